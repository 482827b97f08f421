"""How much of the disk everything takes, and how old the newest backup is."""

from contextlib import suppress
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from app.store.backups import Backups
from app.store.opening import FILE
from app.store.quota import PictureQuota, free_bytes


@dataclass(frozen=True)
class BackupUsage:
    """newest_at: when the newest copy was made, ISO 8601, UTC; None before the first."""

    count: int
    used_bytes: int
    limit_bytes: int
    newest_at: str | None


@dataclass(frozen=True)
class DiskUsage:
    """Bytes. database_bytes: None where the database is not a file here; backups: None where it has its own."""

    pictures_bytes: int
    pictures_limit_bytes: int
    free_bytes: int
    database_bytes: int | None
    backups: BackupUsage | None

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


def disk_usage(folder: Path, quota: PictureQuota, backups: Backups | None) -> DiskUsage:
    """Measure what is used now; a backup that is removed meanwhile is not counted."""
    database = None
    if backups is not None:
        database = sum(_size(folder / (FILE + more)) for more in ("", "-wal"))
    return DiskUsage(quota.used_bytes, quota.quota_bytes, free_bytes(folder), database,
                None if backups is None else _of_backups(backups))


def _of_backups(backups: Backups) -> BackupUsage:
    found = backups.all()
    newest = None
    if found:
        with suppress(OSError):
            newest = datetime.fromtimestamp(found[0].path.stat().st_mtime, UTC).isoformat(timespec="seconds")
    return BackupUsage(len(found), sum(_size(backup.path) for backup in found), backups.limit_bytes, newest)


def _size(path: Path) -> int:
    with suppress(OSError):
        return path.stat().st_size
    return 0
