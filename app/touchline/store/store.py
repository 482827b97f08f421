"""One data folder with everything in it, opened by one process at a time."""

import logging
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from threading import RLock
from types import MappingProxyType
from typing import Any, Self, TypeVar

from touchline.core.errors import Conflict, Unavailable
from touchline.core.records import Warning
from touchline.core.statements import say
from touchline.store.archive import archive_pieces, refuse_unfinished
from touchline.store.backups import Backups
from touchline.store.calibrations import CalibrationRepository
from touchline.store.cameras import CameraRepository, IdentityRepository
from touchline.store.documents import (
    ColourProfileRepository,
    DetectionPlanRepository,
    LensRepository,
    RigRepository,
)
from touchline.store.files import (
    BACKUPS_BYTES,
    UPLOADS_BYTES,
    PictureQuota,
    free_bytes,
    make_folder,
    remove_temporary_files,
)
from touchline.store.integrity import Readers
from touchline.store.jobs import JobRepository
from touchline.store.lock import FolderLock, PostgresLock
from touchline.store.opening import (
    FILE,
    Restoration,
    check_rows,
    find_restoration,
    open_postgresql,
    open_sqlite,
    restore_backup,
)
from touchline.store.quarantine import LOG, Damage, Quarantine, Replaced
from touchline.store.repository import Clock, StoreContext, utc_now
from touchline.store.snapshots import DraftRepository, SnapshotRepository


def disk_usage(
    folder: Path, quota: PictureQuota, backups: Backups | None, replaced: Replaced
) -> dict[str, Any]:
    """Measure what is used now; a backup that is removed meanwhile is not counted.

    "replaced": databases from before a restored backup, newest first.
    "database_bytes" and "backups" are None where the database is not a file here. "newest_at": when the newest copy
    was made, ISO 8601, UTC; None before the first.
    """
    database = None if backups is None else sum(_size(folder / (FILE + more)) for more in ("", LOG))
    return {
        "pictures_bytes": quota.used_bytes,
        "pictures_limit_bytes": quota.quota_bytes,
        "free_bytes": free_bytes(folder),
        "database_bytes": database,
        "backups": None if backups is None else _of_backups(backups),
        "replaced": replaced.files(),
    }


def _of_backups(backups: Backups) -> dict[str, Any]:
    found = backups.all()
    newest_at = None
    with suppress(OSError, IndexError):
        newest_at = found[0].made_at
    return {
        "count": len(found),
        "used_bytes": sum(_size(backup.path) for backup in found),
        "limit_bytes": backups.limit_bytes,
        "newest_at": newest_at,
    }


def _size(path: Path) -> int:
    with suppress(OSError):
        return path.stat().st_size
    return 0


log = logging.getLogger("touchline")
Saved = TypeVar("Saved")


class Store:
    """Everything in one data folder; thread-safe. Close it, or use it as a context.

    database: None for SQLite in the folder, or the address of a PostgreSQL database.
    clock: for the dates that people read; no order and no number rests on it.
    uploads_bytes, backups_bytes: what pictures and backups may take of the disk. free: how much of it is left, bytes.
    readers: by table, what raises for a row that cannot be read; such rows are set aside.
    """

    def __init__(
        self,
        folder: Path,
        clock: Clock = utc_now,
        *,
        database: str | None = None,
        uploads_bytes: int = UPLOADS_BYTES,
        backups_bytes: int = BACKUPS_BYTES,
        free: Callable[[Path], int] = free_bytes,
        readers: Readers = MappingProxyType({}),
    ) -> None:
        self.folder = Path(folder).absolute()
        self._clock = clock
        self._readers = readers
        # held while what names another thing is saved, and while what may be named goes
        self.references = RLock()
        # how often a backup has taken the database's place since the store was opened
        self.restored = 0
        self._backups: Backups | None = None
        self._database_lock: PostgresLock | None = None
        with _usable(self.folder), ExitStack() as undo:
            make_folder(self.folder)
            self._lock = FolderLock(self.folder)
            undo.callback(self._lock.close)
            refuse_unfinished(self.folder)
            remove_temporary_files(self.folder)
            self._quarantine = Quarantine(self.folder / "quarantine")
            self._quarantine.sweep()
            self._replaced = Replaced(self.folder)
            self._quota = PictureQuota(self.folder, uploads_bytes, free)
            if database is None:
                self._backups = Backups(
                    self.folder / "backups",
                    self.folder / FILE,
                    backups_bytes,
                    is_damaged=lambda: any(damage.restorable for damage in self.damaged),
                )
                self._database = open_sqlite(self.folder, self._backups, self._quarantine, readers)
            else:
                self._database, self._database_lock = open_postgresql(
                    database, self.folder, self._quarantine, readers
                )
            undo.callback(self._database.close)
            self.failures = self._database.failures
            if self._database_lock is not None:
                undo.callback(self._database_lock.close)
            context = self._context = StoreContext(
                self.folder, self._database, self._quarantine, clock, self._quota
            )
            self._repositories: dict[object, Any] = {}
            self.snapshots = SnapshotRepository(context)
            self._lost = self.snapshots.lost()
            if self._lost:
                log.error(
                    "pictures are missing from %s: %s",
                    self.folder / "pictures",
                    ", ".join(sorted(self._lost)),
                )
            self.drafts = DraftRepository(context, self.snapshots)
            self.calibrations = CalibrationRepository(context)
            self.lenses = LensRepository(context)
            self.cameras = CameraRepository(context)
            self.cameras.encrypt_passwords()
            self.identities = IdentityRepository(context)
            self.rigs = RigRepository(context)
            self.colour_profiles = ColourProfileRepository(context)
            self.detection_plans = DetectionPlanRepository(context)
            self.jobs = JobRepository(context)
            if self._backups is not None:
                self._backups.start()
                undo.callback(self._backups.close)
                self._database.on_commit = self._backups.request
                self._backups.request()
            self._undo = undo.pop_all()

    def close(self) -> None:
        """Close everything, so that another process can open the folder."""
        self._undo.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def repository(self, kind: Callable[[StoreContext], Saved]) -> Saved:
        """Return what a capability saves here: kind(context), made when it is first asked for."""
        saved: Saved | None = self._repositories.get(kind)
        # No lock: the event loop asks too. Of two that are made at once, both callers get the first.
        return (
            saved if saved is not None else self._repositories.setdefault(kind, kind(self._context))
        )

    def archive(self, fields: Path | None = None, *, passwords: bool = False) -> Iterator[bytes]:
        """Yield everything as one zip, piece by piece.

        fields: the folder of the operator's own. passwords: whether it has those of cameras, in clear.
        """
        return archive_pieces(
            self._database,
            self.folder,
            fields,
            self._clock,
            lambda camera: self.cameras.archived(camera, passwords),
        )

    def find_restoration(self) -> Restoration:
        """Return which backup restore_backup would restore, and what would be lost; Conflict where it cannot."""
        return find_restoration(self._database, self._own_backups())

    def restore_backup(self, seen: tuple[int, int] | None = None) -> Restoration:
        """Put the newest good backup in the place of the database, which is kept; nothing may be running.

        seen: as backup_restore.restore_backup takes it.
        """
        backups = self._own_backups()
        done = restore_backup(self._database, backups, self._quarantine, self._replaced, seen)
        check_rows(self._database, self._quarantine, self._readers)
        self.cameras.encrypt_passwords()
        self.restored += 1
        backups.request()
        return done

    def _own_backups(self) -> Backups:
        if self._backups is None:
            raise Conflict(
                say("backup.postgresql", "Touchline makes no backups of a PostgreSQL database."),
                say(
                    "backup.restore-yours",
                    "Restore your own backup of it, for example with pg_restore.",
                ),
                reason="no-own-backups",
            )
        return self._backups

    @property
    def disk_usage(self) -> dict[str, Any]:
        """How much of the disk is used, bytes, and how old the newest backup is; plain JSON."""
        with _usable(self.folder):
            return disk_usage(self.folder, self._quota, self._backups, self._replaced)

    @property
    def warnings(self) -> tuple[Warning, ...]:
        """What an operator should know: what could not be read or saved, a full disk, another server that saves."""
        if not self._lock.is_in(self.folder):
            return (
                Warning(
                    "data-folder-moved",
                    say(
                        "disk.folder-moved",
                        "The data folder {folder} was moved or deleted while Touchline is running.",
                        folder=str(self.folder),
                    ),
                    say("disk.put-back", "Move it back, then restart Touchline."),
                ),
            )
        lost = Warning(
            "images-missing",
            say(
                "disk.images-missing",
                "Images are missing from the folder pictures: {count}.",
                count=len(self._lost),
            ),
            say(
                "disk.put-images-back",
                "Copy them back from a copy of your own or from an archive, then "
                "restart Touchline. Calibrations are not affected.",
            ),
        )
        watched = (self.failures, self._quota, self._backups, self._database_lock, self.cameras)
        return (
            *((lost,) if self._lost else ()),
            *(warning for one in watched if one is not None for warning in one.warnings()),
        )

    @property
    def damaged(self) -> tuple[Damage, ...]:
        """Every damaged file in the quarantine."""
        return self._quarantine.all()


@contextmanager
def _usable(folder: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise Unavailable(
            f"The data folder {folder} cannot be used: {error.strerror or error}.",
            "Choose another folder with --data, or give this user write permission.",
            reason="data-folder",
        ) from None
