"""How much of the disk everything takes, and how old the newest backup is: for whoever looks after the server."""

from contextlib import suppress
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from app.store.backups import Backups
from app.store.opening import FILE
from app.store.space import Space, free_bytes


@dataclass(frozen=True)
class BackupRoom:
    """newest_at: when the newest copy was made, ISO 8601, UTC; None before the first."""

    count: int
    used_bytes: int
    limit_bytes: int
    newest_at: str | None


@dataclass(frozen=True)
class Room:
    """Bytes. database_bytes: None where the database is not a file here; backups: None where it has its own."""

    pictures_bytes: int
    pictures_limit_bytes: int
    free_bytes: int
    database_bytes: int | None
    backups: BackupRoom | None

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


def room_of(folder: Path, space: Space, backups: Backups | None) -> Room:
    """As it is now. A backup that is removed meanwhile is not counted."""
    database = None
    if backups is not None:
        database = sum(_size(folder / (FILE + more)) for more in ("", "-wal"))
    return Room(space.used_bytes, space.quota_bytes, free_bytes(folder), database,
                None if backups is None else _of_backups(backups))


def _of_backups(backups: Backups) -> BackupRoom:
    found = backups.all()
    newest = None
    if found:
        with suppress(OSError):
            newest = datetime.fromtimestamp(found[0].path.stat().st_mtime, UTC).isoformat(timespec="seconds")
    return BackupRoom(len(found), sum(_size(backup.path) for backup in found), backups.limit_bytes, newest)


def _size(path: Path) -> int:
    with suppress(OSError):
        return path.stat().st_size
    return 0
