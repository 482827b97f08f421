"""A SQLite database on disk: its file, and what SQLite keeps beside it until that is a part of the file."""

import os
import shutil
import sqlite3
from contextlib import closing, suppress
from pathlib import Path
from typing import Literal
from urllib.parse import quote

LOG, INDEX, JOURNAL = "-wal", "-shm", "-journal"
ENDINGS = (LOG, INDEX, JOURNAL)  # of the side files; SQLite takes them for the database's own, whoever left them


def remove_database(path: Path) -> None:
    """Remove a database with its side files, as far as they are there; the file itself goes last."""
    remove_side_files(path)
    path.unlink(missing_ok=True)


def remove_side_files(path: Path) -> None:
    """Remove what another database of the same name has left, before a new one takes its place."""
    for ending in ENDINGS:
        _beside(path, ending).unlink(missing_ok=True)


def move_side_files(path: Path, target: Path) -> None:
    """Move what holds a part of a database beside the file that it has become."""
    for ending in (LOG, JOURNAL):
        with suppress(FileNotFoundError):
            os.replace(_beside(path, ending), _beside(target, ending))
    remove_side_files(path)


def copy_side_files(path: Path, target: Path) -> None:
    """Copy what holds a part of a database beside the copy that is made of it."""
    for ending in (LOG, JOURNAL):
        if (side := _beside(path, ending)).exists() and side.stat().st_size:
            shutil.copyfile(side, _beside(target, ending))


def roll_back(path: Path) -> None:
    """Let SQLite undo the change that a kill has cut short; a file that it cannot read stays as it is.

    Beside a log a journal is nobody's, and who may write would empty the log into a file of which nothing is known yet.
    """
    if _beside(path, JOURNAL).exists() and not _beside(path, LOG).exists():
        with suppress(sqlite3.Error), closing(open_as(path, "rw")) as connection:
            connection.execute("SELECT count(*) FROM sqlite_master").fetchone()  # to read is to roll back


def open_as(path: Path, mode: Literal["ro", "rw"]) -> sqlite3.Connection:
    """Open a database that is there: none is made."""
    address = f"file:{quote(str(path.absolute()))}?mode={mode}"
    return sqlite3.connect(address, uri=True, isolation_level=None, timeout=5)


def _beside(path: Path, ending: str) -> Path:
    return path.with_name(path.name + ending)
