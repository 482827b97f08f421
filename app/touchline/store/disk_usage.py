"""How much of the disk everything takes, and how old the newest backup is."""

from contextlib import suppress
from pathlib import Path
from typing import Any

from touchline.store.backups import Backups
from touchline.store.opening import FILE
from touchline.store.quota import PictureQuota, free_bytes
from touchline.store.replaced import Replaced
from touchline.store.sqlite_files import LOG


def disk_usage(folder: Path, quota: PictureQuota, backups: Backups | None, replaced: Replaced) -> dict[str, Any]:
    """Measure what is used now; a backup that is removed meanwhile is not counted.

    "replaced": databases from before a restored backup, newest first.
    "database_bytes" and "backups" are None where the database is not a file here. "newest_at": when the newest copy
    was made, ISO 8601, UTC; None before the first.
    """
    database = None if backups is None else sum(_size(folder / (FILE + more)) for more in ("", LOG))
    return {"pictures_bytes": quota.used_bytes, "pictures_limit_bytes": quota.quota_bytes,
            "free_bytes": free_bytes(folder), "database_bytes": database,
            "backups": None if backups is None else _of_backups(backups), "replaced": replaced.files()}


def _of_backups(backups: Backups) -> dict[str, Any]:
    found = backups.all()
    newest_at = None
    with suppress(OSError, IndexError):
        newest_at = found[0].made_at
    return {"count": len(found), "used_bytes": sum(_size(backup.path) for backup in found),
            "limit_bytes": backups.limit_bytes, "newest_at": newest_at}


def _size(path: Path) -> int:
    with suppress(OSError):
        return path.stat().st_size
    return 0
