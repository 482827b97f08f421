"""What is kept: snapshots, drafts, calibrations, cameras, rigs, jobs, … in a database; pictures as files beside it.

What a Store answers is a contract; that it is SQLite or PostgreSQL is not. Every row and every picture carries its
checksum and is checked whenever it is read; a damaged one is put into quarantine/ and named in `damaged`. What a call
has returned survives a killed process and a power cut. One process at a time holds a data folder.

    with Store(folder) as store:
        snapshot = store.add_snapshot(data, frame.size, declared.format, camera="north")
        draft = store.save_draft(snapshot.id, body, etag=store.draft(snapshot.id).etag)
        calibration = store.save(calibration)
        store.activate(calibration.id)

    opening.py     check, restore or refuse; schema.py and migrations/ bring the tables to their newest form
    database.py    one writer and many readers, on SQLite or PostgreSQL; tables.py is what they hold, sealed.py its seal
    a shelf each   snapshots, drafts, calibrations, lenses, cameras, rigs, rolls, presets, jobs; on shelf.py
    backups.py     copies of the database; healing.py takes rows back from them
    space.py       how much of the disk pictures may take; room.py says how much everything takes
    archive.py     everything as one zip, and back; restoring.py fills an empty folder with it
    former.py      data folders from before there was a database
    files.py, quarantine.py, lock.py    files that are whole or not there, what is damaged, one server a folder

Fields stand apart (field_shelf.py): they are YAML files, written by people too.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any, Self

from app.core.errors import NotFound, Unavailable
from app.core.geometry import ImageSize
from app.core.records import Calibration, Warning
from app.store.archive import archive
from app.store.backups import Backups
from app.store.calibrations import Calibrations
from app.store.cameras import Cameras, Identities, KeptCamera
from app.store.clips import Clips
from app.store.disk_usage import Room, room_of
from app.store.drafts import EMPTY, Draft, Drafts
from app.store.files import make_folder
from app.store.former import take_over
from app.store.jobs import JobRows, KeptJob
from app.store.lenses import Lenses
from app.store.lock import FolderLock
from app.store.opening import FILE, open_postgresql, open_sqlite
from app.store.presets import Preset, Presets
from app.store.quarantine import Damage, DamagedFile, Quarantine
from app.store.repository import Clock, Page, utc_now
from app.store.restoring import refuse_unfinished
from app.store.rigs import KeptRig, Rigs
from app.store.rolls import Rolls
from app.store.snapshots import Snapshot, Snapshots
from app.store.space import BACKUPS_BYTES, UPLOADS_BYTES, Space, free_bytes

__all__ = ["EMPTY", "Damage", "DamagedFile", "Draft", "KeptCamera", "KeptJob", "KeptRig", "Page", "Preset", "Room",
           "Snapshot", "Store"]


class Store:
    """Everything in one data folder; thread-safe. Close it, or use it as a context.

    database: None for SQLite in the folder, or the address of a PostgreSQL database.
    clock: for the dates that people read; no order and no number rests on it.
    uploads_bytes, backups_bytes: what pictures and backups may take of the disk. free: how much of it is left, bytes.
    """

    def __init__(self, folder: Path, clock: Clock = utc_now, *, database: str | None = None,
                 uploads_bytes: int = UPLOADS_BYTES, backups_bytes: int = BACKUPS_BYTES,
                 free: Callable[[Path], int] = free_bytes) -> None:
        self.folder = Path(folder).absolute()
        self._clock = clock
        self._backups: Backups | None = None
        with _usable(self.folder), ExitStack() as undo:
            make_folder(self.folder)
            lock = FolderLock(self.folder)
            undo.callback(lock.release)
            refuse_unfinished(self.folder)
            self._quarantine = Quarantine(self.folder / "quarantine")
            self._space = Space(self.folder, uploads_bytes, free)
            if database is None:
                self._backups = Backups(self.folder / "backups", self.folder / FILE, backups_bytes)
                self._database = open_sqlite(self.folder, self._backups, self._quarantine)
            else:
                self._database, held = open_postgresql(database, self.folder, self._quarantine)
                undo.callback(held.release)
            undo.callback(self._database.close)
            take_over(self.folder, self._database, self._quarantine)
            shared = (self._database, self._quarantine, clock)
            self._snapshots = Snapshots(*shared, self.folder, self._space)
            self._drafts = Drafts(*shared)
            self._calibrations = Calibrations(*shared)
            self._lenses = Lenses(*shared)
            self._cameras = Cameras(*shared)
            self._identities = Identities(*shared)
            self._rigs = Rigs(*shared)
            self.rolls = Rolls(*shared)
            self.presets = Presets(*shared)
            self.clips = Clips(self.folder, self._space, clock)
            self.jobs = JobRows(self._database, clock)
            if self._backups is not None:
                self._backups.start()
                undo.callback(self._backups.close)
                self._database.saved = self._backups.wake
                self._backups.wake()
            self._undo = undo.pop_all()

    def close(self) -> None:
        """Let another process have the folder."""
        self._undo.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # Snapshots

    def add_snapshot(self, data: bytes, size: ImageSize, format: str, camera: str | None = None,
                     purpose: str = "picture") -> Snapshot:
        """Keep the bytes of a picture that was decoded. format: "png", "jpeg", "bmp" or "webp"."""
        return self._snapshots.add(data, size, format, camera, purpose)

    def snapshot(self, id: str) -> Snapshot:
        """What a snapshot is; NotFound."""
        return self._snapshots.get(id)

    def picture(self, id: str) -> bytes:
        """A snapshot's bytes as they came: still a stranger's, so only images.py decodes them."""
        return self._snapshots.picture(id)

    def picture_path(self, id: str) -> Path:
        """Where those bytes stand, for another process that reads them and checks the snapshot's sha256 itself."""
        return self._snapshots.path(self.snapshot(id))

    def snapshots(self, limit: int = 50, cursor: str | None = None, purpose: str | None = None) -> Page[Snapshot]:
        """Newest first; those of one purpose, or all."""
        return self._snapshots.list(limit, cursor, purpose)

    # Drafts

    def draft(self, snapshot: str) -> Draft:
        """The work in progress on a snapshot, EMPTY before the first save; NotFound for an unknown snapshot."""
        return self._drafts.get(self.snapshot(snapshot).id)

    def save_draft(self, snapshot: str, body: Mapping[str, Any], etag: str, by: str = "") -> Draft:
        """Save over the draft with that ETag; Stale, with `current` and `etag` in its details, if that is old."""
        return self._drafts.save(self.snapshot(snapshot).id, body, etag, by)

    # Calibrations

    def save(self, calibration: Calibration, by: str = "") -> Calibration:
        """Keep it as a new version of its camera's; id, version, created_at and made_by are given here."""
        return self._calibrations.add(calibration, by)

    def calibration(self, id: str) -> Calibration:
        """One version, as it was saved; NotFound."""
        return self._calibrations.get(id)

    def calibrations(self, camera: str | None = None, limit: int = 50, cursor: str | None = None) -> Page[Calibration]:
        """Newest first; of all cameras where none is named."""
        return self._calibrations.list(camera, limit, cursor)

    def calibration_texts(self, camera: str | None = None, limit: int = 50, cursor: str | None = None) -> Page[str]:
        """The same page, each version as JSON: for those who only pass it on."""
        return self._calibrations.texts(camera, limit, cursor)

    def delete_calibration(self, id: str) -> None:
        """Forget a version, never to use its number again; Conflict while it is active."""
        self._calibrations.delete(id)

    def restore_calibration(self, id: str) -> Calibration:
        """Take a deletion back; the version has its number still."""
        return self._calibrations.restore(id)

    def annotate(self, id: str, note: str) -> Calibration:
        """Change the remark beside a version, all that ever changes of one."""
        return self._calibrations.annotate(id, note)

    def activate(self, id: str, by: str = "") -> Calibration:
        """Make it its camera's; the former one stays."""
        return self._calibrations.activate(id, by)

    def activations(self, camera: str | None, limit: int = 50) -> tuple[dict[str, Any], ...]:
        """What was active before, newest first: {"calibration", "at", "by"}."""
        return self._calibrations.history(camera, limit)

    def active(self, camera: str | None) -> Calibration | None:
        """A camera's active version, if there is one."""
        return self._calibrations.active(camera)

    # Lenses from boards

    def add_lens(self, lens: Mapping[str, Any]) -> dict[str, Any]:
        """Keep what a board calibration answered, plain JSON; id and created_at are given here."""
        return self._lenses.add(lens)

    def lens(self, id: str) -> dict[str, Any]:
        """One lens, as it was kept; NotFound."""
        return self._lenses.get(id)

    def lenses(self, limit: int = 50, cursor: str | None = None) -> Page[dict[str, Any]]:
        """Newest first."""
        return self._lenses.list(limit, cursor)

    def delete_lens(self, id: str) -> None:
        """Forget a lens; calibrations that held it keep their copy."""
        self._lenses.delete(id)

    def held_lens(self, id: str) -> dict[str, Any]:
        """A lens for a fit's option, by the id of the calibration or the lens from a board that has it."""
        with suppress(NotFound):
            calibration = self.calibration(id)
            return {"id": id, **calibration.lens_option()}
        with suppress(NotFound):
            lens = self.lens(id)
            return {"id": id, "name": lens["model"], "lens": lens["lens"]}
        raise NotFound(f"There is no calibration or lens {id!r} whose lens could be held.",
                       "List them with GET /api/v1/calibrations and GET /api/v1/lenses.", reason="unknown-lens")

    # Cameras that were added in the browser

    def cameras(self) -> tuple[KeptCamera, ...]:
        """In the order in which they were added."""
        return self._cameras.all()

    def camera(self, id: str) -> KeptCamera:
        """One; NotFound."""
        return self._cameras.get(id)

    def add_camera(self, id: str, body: Mapping[str, Any], by: str = "") -> KeptCamera:
        """Keep a new one, plain JSON; Conflict where the id is taken."""
        return self._cameras.add(id, body, by)

    def save_camera(self, id: str, body: Mapping[str, Any], etag: str, by: str = "") -> KeptCamera:
        """Save over the one with that ETag; Stale, with `current` and `etag` in its details, if that is old."""
        return self._cameras.save(id, body, etag, by)

    def remove_camera(self, id: str, etag: str | None = None) -> None:
        """Forget it; its calibrations stay."""
        self._cameras.remove(id, etag)

    def camera_identity(self, id: str) -> dict[str, Any] | None:
        """The evidence of which physical camera an id was last confirmed to be, of any camera; None before that."""
        return self._identities.get(id)

    def confirm_identity(self, id: str, evidence: Mapping[str, Any], by: str = "") -> None:
        """From now on the id means the camera with that evidence. by: who says so; nobody where it was seen first."""
        self._identities.confirm(id, evidence, by)

    # Cameras that share a field

    def rigs(self) -> tuple[KeptRig, ...]:
        """In the order in which they were made."""
        return self._rigs.all()

    def rig(self, name: str) -> KeptRig:
        """One; NotFound."""
        return self._rigs.get(name)

    def add_rig(self, name: str, body: Mapping[str, Any], by: str = "") -> KeptRig:
        """Keep a new one, plain JSON; Conflict where the name is taken."""
        return self._rigs.add(name, body, by)

    def save_rig(self, name: str, body: Mapping[str, Any], etag: str, by: str = "") -> KeptRig:
        """Save over the one with that ETag; Stale, with `current` and `etag` in its details, if that is old."""
        return self._rigs.save(name, body, etag, by)

    def remove_rig(self, name: str, etag: str | None = None) -> None:
        """Forget it; its cameras and their calibrations stay."""
        self._rigs.remove(name, etag)

    # All of it

    def archive(self, fields: Path | None = None) -> Iterator[bytes]:
        """Everything as one zip, piece by piece. fields: the folder of the operator's own."""
        return archive(self._database, self.folder, fields, self._clock)

    # Health

    @property
    def room(self) -> Room:
        """What of the disk is taken, and how old the newest backup is."""
        return room_of(self.folder, self._space, self._backups)

    @property
    def warnings(self) -> tuple[Warning, ...]:
        """What an operator should know: a disk that is nearly full, backups that fail."""
        return (*self._space.warnings(), *(self._backups.warnings() if self._backups else ()))

    @property
    def damaged(self) -> tuple[Damage, ...]:
        """Every damaged file that was moved aside and has not been removed by somebody since."""
        return self._quarantine.all()


@contextmanager
def _usable(folder: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise Unavailable(f"The data folder {folder} cannot be used: {error.strerror or error}.",
                          "Name another with --data, or let this user write there.", reason="data-folder") from None
