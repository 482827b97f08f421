"""Backups of the SQLite database: a copy after the saves, in the background, checked before it counts.

    backups/CHANGES.HOUR.db    the database after so many changes, made in that hour (UTC)

Kept are the 50 newest and one for each of the last 168 hours in which something was saved, as long as they fit in
their share of the disk; the newest always. An hour is only a label: which one is newer is told by the changes.
Copying takes a tenth of the time at most, so that a large database is copied less often than it is saved to.
"""

import logging
import os
import re
import sqlite3
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Event, Thread
from time import monotonic

from app.core.records import Warning
from app.store.check import changes_of, trouble_of
from app.store.files import flush_folder, make_folder, sweep
from app.store.repository import Clock, utc_now
from app.store.space import BACKUPS_BYTES, LEAST_FREE_BYTES, free_bytes

log = logging.getLogger("touchline")
NAME = re.compile(r"(?P<changes>[0-9]{12})\.(?P<hour>[0-9-]{10}T[0-9]{2})\.db")
NEWEST = 50
HOURS = 168
SHARE = 9  # pauses nine times as long as the last copy took
LONGEST_FINAL_S = 2.0  # a last copy when the server ends must not keep it from ending


@dataclass(frozen=True, order=True)
class Backup:
    """One copy. changes: how many the database had kept by then."""

    changes: int
    hour: str
    path: Path


class Backups:
    """Thread-safe. source: the database's file; limit_bytes: what all copies together may take."""

    def __init__(self, folder: Path, source: Path, limit_bytes: int = BACKUPS_BYTES,
                 clock: Clock = utc_now) -> None:
        self._folder = make_folder(folder)
        self._source = source
        self._clock = clock
        self.limit_bytes = limit_bytes
        self._wanted, self._ended = Event(), Event()
        self._took_s = 0.0
        self._trouble: str | None = None
        self._thread = Thread(target=self._run, name="backups", daemon=True)
        sweep(folder)

    def all(self) -> list[Backup]:
        """Newest first."""
        matches = ((NAME.fullmatch(path.name), path) for path in self._folder.iterdir())
        found = [Backup(int(match["changes"]), match["hour"], path) for match, path in matches if match]
        return sorted(found, reverse=True)

    def newest_good(self) -> Backup | None:
        """The newest that can be read and is whole."""
        return next((backup for backup in self.all() if trouble_of(backup.path) is None), None)

    def start(self) -> None:
        """Begin to copy whenever wake() was called."""
        self._thread.start()

    def wake(self) -> None:
        """Something was saved."""
        self._wanted.set()

    def close(self) -> None:
        """Make a last copy, if one is due and quick, and stop."""
        self._ended.set()
        self._wanted.set()
        if self._thread.is_alive():
            self._thread.join()

    def warnings(self) -> tuple[Warning, ...]:
        """What an operator should know about the backups."""
        if self._trouble is None:
            return ()
        return (Warning("no-backup", f"The last backup was not made: {self._trouble}.",
                        "Check the data folder's disk; free some space there."),)

    def make(self) -> None:
        """Copy the database now, check the copy, and only then give it its name."""
        unfinished = self._folder / ".unfinished.tmp"
        unfinished.unlink(missing_ok=True)
        size_bytes = self._source.stat().st_size
        if free_bytes(self._folder) < size_bytes + LEAST_FREE_BYTES:
            raise OSError("the disk is nearly full")
        with (closing(sqlite3.connect(self._source, timeout=5)) as source,
              closing(sqlite3.connect(unfinished, isolation_level=None)) as copy):
            source.execute("PRAGMA query_only=ON")
            source.backup(copy)
            copy.execute("PRAGMA journal_mode=DELETE")  # one file, without a log beside it
            changes = changes_of(copy)
        trouble = trouble_of(unfinished)
        if trouble is not None or changes is None:
            raise OSError(f"the copy is damaged: {trouble}")
        with open(unfinished, "rb") as file:
            os.fsync(file.fileno())
        hour = self._clock().strftime("%Y-%m-%dT%H")
        os.replace(unfinished, self._folder / f"{changes:012d}.{hour}.db")
        flush_folder(self._folder)
        self._thin()

    def _run(self) -> None:
        while True:
            self._wanted.wait()
            last = self._ended.is_set()
            if last and (self._took_s > LONGEST_FINAL_S or not self._is_due()):
                return
            self._wanted.clear()
            began = monotonic()
            self._try()
            self._took_s = monotonic() - began
            if last:
                return
            self._ended.wait(SHARE * self._took_s)

    def _is_due(self) -> bool:
        with suppress(sqlite3.Error), closing(sqlite3.connect(self._source, timeout=5)) as source:
            newest = self.all()
            return not newest or newest[0].changes != changes_of(source)
        return False

    def _try(self) -> None:
        """Copy what has changed; a database that was not saved to is not copied over its own good copy."""
        try:
            if self._is_due():
                self.make()
            self._trouble = None
        except (OSError, sqlite3.Error) as error:
            self._trouble = str(error)
            log.warning("a backup was not made: %s", error)

    def _thin(self) -> None:
        """Remove what is neither new nor the last of its hour, then the oldest until the rest fits."""
        backups = self.all()
        last_of_hour: dict[str, Backup] = {}
        for backup in backups:
            last_of_hour.setdefault(backup.hour, backup)
        kept = {*backups[:NEWEST], *list(last_of_hour.values())[:HOURS]}
        room = self.limit_bytes
        for number, backup in enumerate(backups):
            room -= backup.path.stat().st_size if backup in kept else 0
            if backup not in kept or (room < 0 and number > 0):
                backup.path.unlink(missing_ok=True)
