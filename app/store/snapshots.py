"""Snapshots: pictures that are kept, the original bytes under their own checksum, and a record of each.

    pictures/SHA256.FORMAT     the bytes as they came; the same picture twice is one file
    the table of snapshots     what the picture is; its row is written last, so a row always has its picture
"""

import hashlib
from dataclasses import asdict, dataclass
from pathlib import Path
from threading import RLock
from typing import Any

from sqlalchemy import ColumnElement, delete, func, select
from sqlalchemy.orm import Session

from app.core.errors import NotFound, Unavailable
from app.core.geometry import ImageSize
from app.store.checksummed import content, sealed
from app.store.database import Database
from app.store.files import keeping, make_folder, sweep, write_whole
from app.store.quarantine import Damage, DamagedFile, Quarantine
from app.store.repository import Clock, Page, Shelf, column, new_id, stamp
from app.store.space import Space
from app.store.tables import CalibrationRow, DraftRow, LensRow, SnapshotRow


@dataclass(frozen=True)
class Snapshot:
    """A kept picture. format: "png", "jpeg", "bmp" or "webp", of the bytes as they came.

    purpose: what it was taken for: "picture" of a field, of a "board", of "straight" edges, for a "rig" or "seeing".
    """

    id: str
    width: int
    height: int
    camera: str | None
    taken_at: str  # ISO 8601, UTC
    sha256: str
    format: str
    purpose: str = "picture"

    @property
    def size(self) -> ImageSize:
        return ImageSize(self.width, self.height)

    @property
    def media_type(self) -> str:
        return f"image/{self.format}"

    @property
    def file(self) -> str:
        """Its picture's name in pictures/."""
        return f"{self.sha256}.{self.format}"

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


class Snapshots(Shelf):
    """The shelf of snapshots. Thread-safe. space: how much of the disk the pictures may take."""

    table = SnapshotRow
    kind = "snapshots"

    def __init__(self, database: Database, quarantine: Quarantine, clock: Clock, folder: Path, space: Space) -> None:
        super().__init__(database, quarantine, clock)
        self._pictures = make_folder(folder / "pictures")
        self._space = space
        self._files = RLock()  # a file that is about to get its row must not be removed as one that has none
        sweep(self._pictures)
        space.count(self._pictures)

    def add(self, data: bytes, size: ImageSize, format: str, camera: str | None = None,
            purpose: str = "picture") -> Snapshot:
        """Keep a picture that images.py has decoded; on return it is safe on disk. DiskFull where there is no room."""
        digest = hashlib.sha256(data).hexdigest()
        snapshot = Snapshot(new_id(), size.width, size.height, camera, stamp(self._clock), digest, format, purpose)
        path = self.path(snapshot)
        with self._files:
            if not _holds(path, digest):
                self._make_room(len(data))
                with keeping("The snapshot"):
                    write_whole(path, data)
                self._space.added(len(data))
            with self._database.writing("The snapshot") as rows:
                rows.add(snapshot_row(snapshot))
        return snapshot

    def get(self, id: str) -> Snapshot:
        """One by its id; NotFound, or DamagedFile."""
        return _read(self.row(id, _unknown))

    def path(self, snapshot: Snapshot) -> Path:
        """Where a snapshot's bytes stand."""
        return self._pictures / snapshot.file

    def picture(self, id: str) -> bytes:
        """The bytes as they came, checked against their checksum."""
        snapshot = self.get(id)
        path = self.path(snapshot)
        try:
            data = path.read_bytes()
        except FileNotFoundError:
            raise DamagedFile(Damage("pictures", path.name)) from None
        if hashlib.sha256(data).hexdigest() != snapshot.sha256:
            raise self._quarantine.take(path, "its checksum is wrong")
        return data

    def list(self, limit: int = 50, cursor: str | None = None, purpose: str | None = None) -> Page[Snapshot]:
        """Newest first, of one purpose or of all. Damaged ones are not among them; Store.damaged names those."""
        return self.page(limit, cursor, _read, *([] if purpose is None else [SnapshotRow.purpose == column(purpose)]))

    def _make_room(self, size_bytes: int) -> None:
        """Refuse, or forget the oldest pictures that nothing needs, until so many bytes fit in."""
        self._space.check_free()
        if self._space.over_by(size_bytes) > 0:
            self._remove_files_without_rows()
        while self._space.over_by(size_bytes) > 0:
            with self._database.reading() as rows:
                unneeded = select(SnapshotRow).where(*_unneeded(rows))
                oldest = rows.scalar(unneeded.order_by(SnapshotRow.sequence).limit(1))
            if oldest is None:
                raise self._space.refusal()
            self._forget(oldest)

    def _forget(self, row: SnapshotRow) -> None:
        """The row first: were it the other way round, a kill in between would leave a row without its picture."""
        with self._database.writing("The deletion") as rows:
            rows.execute(delete(DraftRow).where(DraftRow.snapshot == row.id))
            rows.execute(delete(SnapshotRow).where(SnapshotRow.sequence == row.sequence))
            others = rows.scalar(select(func.count()).where(SnapshotRow.picture == row.picture))
        if others == 0:
            self._remove(self._pictures / row.picture)

    def _remove_files_without_rows(self) -> None:
        """What a kill between a file and its row has left. Only for want of room: a restored backup may lack rows."""
        with self._database.reading() as rows:
            known = set(rows.scalars(select(SnapshotRow.picture).distinct()))
        for path in self._pictures.iterdir():
            if path.name not in known:
                self._remove(path)

    def _remove(self, path: Path) -> None:
        size_bytes = path.stat().st_size if path.exists() else 0
        path.unlink(missing_ok=True)
        self._space.added(-size_bytes)


def _unneeded(rows: Session) -> list[ColumnElement[bool]]:
    """Snapshots that no calibration (deleted ones too), begun draft or lens rests on."""
    used = select(CalibrationRow.snapshot).where(CalibrationRow.snapshot.is_not(None))
    begun = select(DraftRow.snapshot).where(DraftRow.is_begun)
    boards: set[str] = set()
    for lens in rows.scalars(select(LensRow).where(LensRow.damaged.is_(None))):
        boards.update(content(lens).get("snapshots") or ())
    return [SnapshotRow.damaged.is_(None), SnapshotRow.id.not_in(used), SnapshotRow.id.not_in(begun),
            SnapshotRow.id.not_in(boards)]


def snapshot_row(snapshot: Snapshot) -> SnapshotRow:
    """A snapshot as the database has it."""
    return sealed(SnapshotRow, snapshot.to_json(), "The snapshot", id=snapshot.id, picture=snapshot.file,
                  purpose=column(snapshot.purpose))


def checked_bytes(name: str, path: str, sha256: str) -> bytes:
    """A kept picture's bytes, read by another process than the one that holds the store. name: for the refusal."""
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise Unavailable(f"{name.capitalize()} cannot be read: {error.strerror}.", "Upload it again.",
                          reason="damaged-file") from None
    if hashlib.sha256(data).hexdigest() != sha256:
        raise Unavailable(f"{name.capitalize()} is damaged.", "Upload it again.", reason="damaged-file")
    return data


def _read(row: SnapshotRow) -> Snapshot:
    return Snapshot(**content(row))


def _holds(path: Path, digest: str) -> bool:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest() == digest
    except FileNotFoundError:
        return False


def _unknown(id: str) -> NotFound:
    return NotFound(f"There is no snapshot {id!r}.", "List them with GET /api/v1/snapshots, or send the picture again.",
                    reason="unknown-snapshot")
