"""Make a data folder of an archive, only in an empty folder; one whose restore was cut short is never opened."""

import shutil
from contextlib import closing
from pathlib import Path

from touchline.core.errors import Conflict, NotFound, TouchlineError, Unavailable
from touchline.store.archive import restore_archive
from touchline.store.database import Database
from touchline.store.files import make_folder, sync_folder
from touchline.store.lock import FolderLock
from touchline.store.opening import FILE, create_sqlite, open_postgresql
from touchline.store.quarantine import Quarantine

UNFINISHED = "restore-unfinished"  # while it is there, the folder is not opened


def restore_into(file: Path, folder: Path, database: str | None) -> dict[str, int]:
    """Restore the archive and count the rows of each table; Conflict if the folder or the database is not empty."""
    if not file.is_file():
        raise NotFound(f"The file {file} does not exist.", "Choose a zip file from archive or GET /archive.",
                       reason="no-archive")
    if folder.is_dir() and any(folder.iterdir()):
        raise Conflict(f"The folder {folder} is not empty.", "Choose an empty or a new folder. Existing data is never "
                       "overwritten.", reason="folder-not-empty")
    is_new = not folder.is_dir()
    make_folder(folder)
    with closing(FolderLock(folder)):
        (folder / UNFINISHED).touch()
        sync_folder(folder)
        try:
            counts = _fill(file, folder, database)
        except TouchlineError:
            _remove_all(folder, is_new)
            raise
        make_folder(folder / "pictures")
        (folder / UNFINISHED).unlink()
        sync_folder(folder)
        return counts


def _remove_all(folder: Path, itself: bool) -> None:
    """Leave it as it was found, empty or missing; what says that it is not whole goes last."""
    for path in sorted(folder.iterdir(), key=lambda path: path.name == UNFINISHED):
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    if itself:
        folder.rmdir()


def refuse_unfinished(folder: Path) -> None:
    """Raise Unavailable for a folder in which a restore was cut short."""
    if (folder / UNFINISHED).exists():
        raise Unavailable(f"The folder {folder} is from an incomplete restore.",
                          "Delete that folder and restore the archive again.", reason="restore-unfinished")


def _fill(file: Path, folder: Path, setting: str | None) -> dict[str, int]:
    if setting is None:
        path = folder / FILE
        create_sqlite(path)
        with closing(Database.on_sqlite(path)) as database:
            return restore_archive(file, database, folder)
    database, lock = open_postgresql(setting, folder, Quarantine(folder / "quarantine"), {})
    with closing(database), closing(lock):
        if database.changes() != 0:
            raise Conflict("The database is not empty.", "Enter a new database in the settings. Existing data is "
                           "never overwritten.", reason="database-not-empty")
        return restore_archive(file, database, folder)
