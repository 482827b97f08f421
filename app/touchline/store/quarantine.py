"""What is damaged or was replaced: moved to the quarantine and named, never read as something else or silently missing.

replaced/CHANGES/touchline.db    the database from before, with its log where that is a part of it
replaced/CHANGES/TABLE/…         what the quarantine had of rows that were damaged in it
"""

import json
import logging
import os
import re
import shutil
import sqlite3
from collections.abc import Mapping
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal
from urllib.parse import quote

from touchline.core.errors import Unavailable
from touchline.core.statements import Sentence, say, stated
from touchline.store.files import (
    TEMPORARY,
    make_folder,
    move_durably,
    remove_temporary_files,
    replace_synced,
    write_atomically,
)

LOG, INDEX, JOURNAL = "-wal", "-shm", "-journal"
# of the side files; SQLite takes them for the database's own, whoever left them
ENDINGS = (LOG, INDEX, JOURNAL)

ROW = ".json"  # in the names of what is left of rows
RESTORE_BACKUP = say(
    "quarantine.restore-backup",
    "Restore the newest good backup of the database, or create again what was damaged.",
)
RESTORE_OR_CREATE = say("quarantine.restore", "Restore it from a backup, or create it again.")
NOTE = ".note"
MISSING = "missing"  # kind of what is not damaged but gone
COMPANIONS = (NOTE, *ENDINGS)  # endings of files that belong to a damaged one

FOLDER = "replaced"
MAX_KEPT = 3
UNFINISHED = ".unfinished.tmp"
log = logging.getLogger("touchline")


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
            # to read is to roll back
            connection.execute("SELECT count(*) FROM sqlite_master").fetchone()


def open_as(path: Path, mode: Literal["ro", "rw"]) -> sqlite3.Connection:
    """Open a database that is there: none is made."""
    address = f"file:{quote(str(path.absolute()))}?mode={mode}"
    return sqlite3.connect(address, uri=True, isolation_level=None, timeout=5)


def _beside(path: Path, ending: str) -> Path:
    return path.with_name(path.name + ending)


@dataclass(frozen=True)
class Damage:
    """Something in the quarantine: its kind (the folder or table that it was in), its file, what became of it."""

    kind: str
    name: str
    note: str | None = None

    @property
    def file(self) -> str:
        """Its path in the data folder."""
        return f"quarantine/{self.kind}/{self.name}"

    @property
    def restorable(self) -> bool:
        """Whether it was a row of the database as it is now, which a backup may have intact."""
        return self.note is None and ROW in self.name

    @property
    def fix(self) -> Sentence:
        return RESTORE_BACKUP if self.restorable else RESTORE_OR_CREATE

    def to_json(self) -> dict[str, Any]:
        return stated(
            {
                "kind": self.kind,
                "file": self.file,
                "note": self.note,
                "fix": self.fix,
                "restorable": self.restorable,
            }
        )


class DamagedFile(Unavailable):
    reason = "damaged-file"

    def __init__(self, damage: Damage) -> None:
        super().__init__(
            say(
                "quarantine.moved",
                "A file of the data folder is damaged and was moved to {place}.",
                place=damage.file,
            ),
            damage.fix,
            file=damage.file,
        )
        self.damage = damage


class Quarantine:
    """The folder of what was damaged, with a folder for each kind."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def sweep(self) -> None:
        """Remove what writers that were killed have left; only while there is no other writer."""
        for folder in self._folder.glob("*/"):
            remove_temporary_files(folder)

    def move(
        self, path: Path, why: str, kind: str | None = None, note: str | None = None
    ) -> DamagedFile:
        """Move a damaged file here; return the error to raise, which says where it is now."""
        kind = kind or path.parent.name
        target = self._free_name(kind, path.name)
        if note is not None:
            write_atomically(target.with_name(target.name + NOTE), note.encode())
        with suppress(FileNotFoundError):  # another thread has moved it
            move_durably(path, target)
        log.error("%s/%s is damaged (%s); it was moved to %s", kind, path.name, why, target)
        return DamagedFile(Damage(kind, target.name, note))

    def add_row(self, kind: str, name: str, body: str, note: str | None = None) -> DamagedFile:
        """Write what is left of a damaged row; return the error to raise, which says where that is."""
        data = body.encode("utf-8", "surrogatepass")
        target = self._free_name(kind, name + ROW, data)
        with suppress(OSError):  # a full disk must not hide the damage
            write_atomically(target, data)
            if note is not None:
                write_atomically(target.with_name(target.name + NOTE), note.encode())
        log.error(
            "%s %s in the database is damaged (%s); what is left of it is %s. %s",
            kind,
            name,
            note or "its checksum is wrong",
            target,
            "" if note else RESTORE_BACKUP,
        )
        return DamagedFile(Damage(kind, target.name, note))

    def add_missing(self, missing: Mapping[str, int]) -> Damage:
        """Write down how many rows of which tables vanished while nobody looked."""
        data = json.dumps(missing).encode()
        target = self._free_name(MISSING, f"rows{ROW}", data)
        with suppress(OSError):  # a full disk must not hide it
            write_atomically(target, data)
        log.error("rows of the database have vanished (%s). %s", missing, RESTORE_BACKUP)
        return Damage(MISSING, target.name)

    def has(self, kind: str, name: str) -> bool:
        """Tell whether it is still here."""
        return (self._folder / kind / name).exists()

    def move_rows(self, folder: Path) -> None:
        """Move what is left of damaged rows beside a copy of the database that had them, which another one replaces."""
        for damage in self.all():
            if damage.restorable:
                source = self._folder / damage.kind / damage.name
                with suppress(OSError):  # it stays, and is told until somebody removes it
                    move_durably(source, make_folder(folder / damage.kind) / damage.name)

    def all(self) -> tuple[Damage, ...]:
        """Return everything that was moved here and is still here."""
        kinds = sorted(path.name for path in self._folder.glob("*") if path.is_dir())
        return tuple(
            Damage(kind, name, self._note(kind, name))
            for kind in kinds
            for name in sorted(path.name for path in (self._folder / kind).glob("*"))
            if not name.endswith((*COMPANIONS, TEMPORARY))
        )

    def _note(self, kind: str, name: str) -> str | None:
        with suppress(OSError):
            return (self._folder / kind / (name + NOTE)).read_text(errors="replace")
        return None

    def _free_name(self, kind: str, name: str, data: bytes | None = None) -> Path:
        """Return a name that is free, or of a file with these bytes: a kill came before that was noted."""
        target = make_folder(self._folder / kind) / name
        count = 0
        while target.exists() and (data is None or target.read_bytes() != data):
            count += 1
            target = target.with_name(f"{name}.{count}")
        return target


class Replaced:
    """The folder of them. folder: the data folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder / FOLDER
        # how many changes the last one had that was replaced since the server was started
        self.newest = -1

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
        for old in self._all()[MAX_KEPT:]:
            shutil.rmtree(old, ignore_errors=True)

    def files(self) -> list[str]:
        """Return the databases, newest first, as paths in the data folder."""
        return [
            str(path.relative_to(self._folder.parent))
            for folder in self._all()
            for path in folder.glob("*.db")
        ]

    def _all(self) -> list[Path]:
        with suppress(FileNotFoundError):
            return sorted(
                (path for path in self._folder.iterdir() if re.fullmatch(r"[0-9]{12}", path.name)),
                reverse=True,
            )
        return []
