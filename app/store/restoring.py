"""A data folder made of an archive: only ever in an empty folder, and a restore that was cut short is never opened."""

from pathlib import Path

from app.core.errors import Conflict, NotFound, Unavailable
from app.store.archive import restore
from app.store.database import Database
from app.store.files import flush_folder, make_folder
from app.store.lock import FolderLock
from app.store.opening import FILE, create_sqlite, open_postgresql
from app.store.quarantine import Quarantine

MARK = "restore-unfinished"  # while it is there, the folder is not opened


def restore_into(file: Path, folder: Path, database: str | None) -> dict[str, int]:
    """How many rows of each table there are now. Conflict where the folder or the database is not empty."""
    if not file.is_file():
        raise NotFound(f"There is no file {file}.", "Name a zip that archive or GET /archive has written.",
                       reason="no-archive")
    if folder.is_dir() and any(folder.iterdir()):
        raise Conflict(f"The folder {folder} is not empty.", "Name an empty or a new folder: nothing is ever restored "
                       "over something else.", reason="folder-not-empty")
    make_folder(folder)
    lock = FolderLock(folder)
    try:
        (folder / MARK).touch()
        flush_folder(folder)
        counts = _fill(file, folder, database)
        make_folder(folder / "pictures")
        (folder / MARK).unlink()
        flush_folder(folder)
        return counts
    finally:
        lock.release()


def refuse_unfinished(folder: Path) -> None:
    """Unavailable for a folder in which a restore was cut short."""
    if (folder / MARK).exists():
        raise Unavailable(f"The folder {folder} comes from a restore that did not end.",
                          "Delete that folder and restore the archive again.", reason="restore-unfinished")


def _fill(file: Path, folder: Path, setting: str | None) -> dict[str, int]:
    if setting is None:
        path = folder / FILE
        create_sqlite(path)
        database = Database.on_sqlite(path)
        try:
            return restore(file, database, folder)
        finally:
            database.close()
    database, held = open_postgresql(setting, folder, Quarantine(folder / "quarantine"))
    try:
        _refuse_filled(database)
        return restore(file, database, folder)
    finally:
        held.release()
        database.close()


def _refuse_filled(database: Database) -> None:
    if database.changes() != 0:
        raise Conflict("The database is not empty.", "Name a new database in the settings: nothing is ever restored "
                       "over something else.", reason="database-not-empty")
