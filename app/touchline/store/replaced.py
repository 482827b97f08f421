"""Databases that a backup has replaced, each with what was left of its damaged rows; the three newest stay.

    replaced/CHANGES/touchline.db    the database from before, with its log where that is a part of it
    replaced/CHANGES/TABLE/…         what the quarantine had of rows that were damaged in it
"""

import re
import shutil
from contextlib import suppress
from pathlib import Path

from touchline.store.files import make_folder, replace_synced
from touchline.store.sqlite_files import copy_side_files, remove_side_files

FOLDER = "replaced"
KEPT = 3
UNFINISHED = ".unfinished.tmp"


class Replaced:
    """The folder of them. folder: the data folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder / FOLDER
        self.newest = -1  # how many changes the last one had that was replaced since the server was started

    def add(self, path: Path, changes: int) -> Path:
        """Copy a database that is about to be replaced after so many changes; return the copy, whole on disk."""
        target = make_folder(self._folder / f"{changes:012d}") / path.name
        unfinished = target.with_name(UNFINISHED)
        try:
            remove_side_files(target)
            copy_side_files(path, target)
            shutil.copyfile(path, unfinished)
            replace_synced(unfinished, target)
        finally:
            unfinished.unlink(missing_ok=True)
        return target

    def thin(self) -> None:
        """Remove all but the newest; one that cannot be removed stays."""
        for old in self._all()[KEPT:]:
            shutil.rmtree(old, ignore_errors=True)

    def files(self) -> list[str]:
        """Return the databases, newest first, as paths in the data folder."""
        return [str(path.relative_to(self._folder.parent)) for folder in self._all() for path in folder.glob("*.db")]

    def _all(self) -> list[Path]:
        with suppress(FileNotFoundError):
            return sorted((path for path in self._folder.iterdir() if re.fullmatch(r"[0-9]{12}", path.name)),
                          reverse=True)
        return []
