"""Backups of the SQLite database: a copy after the saves, in the background, checked before it counts.

    backups/CHANGES.HOUR.db    the database after so many changes, made in that hour (UTC)

They thin out with age: the newest stay, and the last of some hours, days and weeks, as many as fit in six times the
newest's size (or 100 MB, or the share of the disk that the settings give); the newest always. An hour is only a label:
the number of changes says which one is newer.
Copying takes a tenth of the time at most, so that a large database is copied less often than it is saved to.
"""

import logging
import re
import sqlite3
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import accumulate, compress, zip_longest
from pathlib import Path
from threading import Event, Lock, Thread
from time import monotonic

from touchline.core.records import Warning
from touchline.core.statements import Sentence, say
from touchline.store.files import (
    BACKUPS_BYTES,
    MB,
    MIN_FREE_BYTES,
    free_bytes,
    make_folder,
    remove_temporary_files,
    replace_synced,
)
from touchline.store.integrity import count_changes, find_damage
from touchline.store.quarantine import remove_database
from touchline.store.repository import Clock, utc_now

log = logging.getLogger("touchline")
UNFINISHED = ".unfinished.tmp"
NAME = re.compile(r"(?P<changes>[0-9]{12})\.(?P<hour>[0-9-]{10}T[0-9]{2})\.db")
MAX_KEPT = {"copy": 12, "hour": 24, "day": 14, "week": 8}  # at most, of each the newest
MAX_COPIES = 6  # of a large database together, by the newest's size
SMALL_BYTES = 100 * MB  # for all of a small one
PAUSE_FACTOR = 9  # pauses nine times as long as the last copy took
MAX_FINAL_S = 2.0  # a last copy when the server ends must not keep it from ending


@dataclass(frozen=True, order=True)
class Backup:
    """One copy. changes: how many the database had saved by then."""

    changes: int
    hour: str
    path: Path

    @property
    def made_at(self) -> str:
        """Return when it was made, ISO 8601, UTC."""
        return datetime.fromtimestamp(self.path.stat().st_mtime, UTC).isoformat(timespec="seconds")


class Backups:
    """Thread-safe. source: the database's file; limit_bytes: what all copies together may take.

    is_damaged: whether rows of the database are damaged; while they are, older copies stay as long as they fit.
    held: locked while a copy is made, and by who replaces the database.
    """

    def __init__(
        self,
        folder: Path,
        source: Path,
        limit_bytes: int = BACKUPS_BYTES,
        clock: Clock = utc_now,
        is_damaged: Callable[[], bool] = lambda: False,
    ) -> None:
        self._folder = make_folder(folder)
        self.source = source
        self._clock = clock
        self.limit_bytes = limit_bytes
        self.held = Lock()
        self._is_damaged = is_damaged
        self._spared: list[Backup] = []
        self._requested, self._ended = Event(), Event()
        self._took_s = 0.0
        self._failure: str | None = None
        self._thread = Thread(target=self._run, name="backups", daemon=True)
        remove_database(folder / UNFINISHED)
        remove_temporary_files(folder)

    def all(self) -> list[Backup]:
        """Return all, newest first."""
        matches = ((NAME.fullmatch(path.name), path) for path in self._folder.iterdir())
        found = [
            Backup(int(match["changes"]), match["hour"], path) for match, path in matches if match
        ]
        return sorted(found, reverse=True)

    def newest_good(self) -> Backup | None:
        """Return the newest that is sound as a file."""
        return next((backup for backup in self.all() if find_damage(backup.path) is None), None)

    def start(self) -> None:
        """Start the thread that copies after each request()."""
        self._thread.start()

    def request(self) -> None:
        """Ask for a copy, since something was saved."""
        self._requested.set()

    def close(self) -> None:
        """Make a last copy, if one is due and quick, and stop."""
        self._ended.set()
        self._requested.set()
        if self._thread.is_alive():
            self._thread.join()

    def warnings(self) -> tuple[Warning, ...]:
        """Return what an operator should know about the backups."""
        if self._failure is None:
            return ()
        return (
            Warning(
                "no-backup",
                say("backup.failed", "The last backup failed: {error}.", error=self._failure),
                say("backup.check-disk", "Check the disk of the data folder, and free some space."),
            ),
        )

    def make(self) -> None:
        """Copy the database now, check the copy, and only then give it its name."""
        unfinished = self._folder / UNFINISHED
        remove_database(unfinished)
        size_bytes = self.source.stat().st_size
        if free_bytes(self._folder) < size_bytes + MIN_FREE_BYTES:
            raise OSError(say("backup.disk-nearly-full", "the disk is nearly full"))
        with (
            closing(sqlite3.connect(self.source, timeout=5)) as source,
            closing(sqlite3.connect(unfinished, isolation_level=None)) as copy,
        ):
            source.execute("PRAGMA query_only=ON")
            source.backup(copy)
            copy.execute("PRAGMA journal_mode=DELETE")  # one file, without a log beside it
            changes = count_changes(copy)
        damage = find_damage(unfinished)
        if damage is not None or changes is None:
            raise OSError(
                say("backup.copy-damaged", "the copy is damaged: {damage}", damage=str(damage))
            )
        hour = self._clock().strftime("%Y-%m-%dT%H")
        replace_synced(unfinished, self._folder / f"{changes:012d}.{hour}.db")
        self._thin()

    def _run(self) -> None:
        while True:
            self._requested.wait()
            last = self._ended.is_set()
            if last and (self._took_s > MAX_FINAL_S or not self._is_due()):
                return
            self._requested.clear()
            began = monotonic()
            self._try()
            self._took_s = monotonic() - began
            if last:
                return
            self._ended.wait(PAUSE_FACTOR * self._took_s)

    def _is_due(self) -> bool:
        with suppress(sqlite3.Error), closing(sqlite3.connect(self.source, timeout=5)) as source:
            newest = self.all()
            return not newest or newest[0].changes != count_changes(source)
        return False

    def _try(self) -> None:
        """Copy what has changed; a database without new changes is not copied over its own good copy."""
        try:
            with self.held:
                if self._is_due():
                    self.make()
            self._failure = None
        except (OSError, sqlite3.Error) as error:
            self._failure = error.args[0] if isinstance(error.args[0], Sentence) else str(error)
            log.warning("a backup was not made: %s", error)

    def _thin(self) -> None:
        """Remove what is not worth its space."""
        backups = self.all()
        self._spared = [] if not self._is_damaged() else self._spared or backups[1:]
        spared = [backup for backup in self._spared if backup in backups]
        ranked = list(dict.fromkeys([backups[0], *spared, *_by_worth(backups)]))
        sizes_bytes = [backup.path.stat().st_size for backup in ranked]
        space_bytes = min(self.limit_bytes, max(SMALL_BYTES, MAX_COPIES * sizes_bytes[0]))
        fit = [total <= space_bytes for total in accumulate(sizes_bytes)]
        kept = {ranked[0], *compress(ranked, fit)}
        for backup in backups:
            if backup not in kept:
                backup.path.unlink(missing_ok=True)


def _by_worth(backups: Sequence[Backup]) -> Iterator[Backup]:
    """Yield the newest copy, the last of the newest hour, day and week, then the second of each, and so on.

    So few copies reach far back, and what is to be the last of its day was the last of its hour before.
    """
    newest: dict[str, dict[object, Backup]] = {kind: {} for kind in MAX_KEPT}
    for backup in backups:
        began = datetime.strptime(backup.hour, "%Y-%m-%dT%H")
        for kind, label in zip(
            MAX_KEPT, (backup, began, began.date(), began.isocalendar()[:2]), strict=True
        ):
            newest[kind].setdefault(label, backup)
    columns = [list(newest[kind].values())[:count] for kind, count in MAX_KEPT.items()]
    for row in zip_longest(*columns):
        yield from (backup for backup in row if backup is not None)
