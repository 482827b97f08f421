"""Put the newest good backup in the place of a damaged database, of which a copy is kept.

Nothing is read of the database that is replaced: it may be damaged as a whole. Good is a backup in which every row is
intact and none is missing. It is looked for in copies, and the copy takes the database's place in one step: a power cut
leaves the old database or the new one, and an error leaves the old one in use.

The new one counts on from the old one's number of changes, so that no backup from before is newer than it.
"""

import logging
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

from sqlalchemy.exc import DBAPIError

from touchline.core.errors import Conflict, TouchlineError
from touchline.core.statements import say
from touchline.store.backups import Backup, Backups
from touchline.store.database import Database
from touchline.store.files import replace_synced, translate_disk_errors
from touchline.store.integrity import find_damage, is_whole
from touchline.store.opening import UNFINISHED
from touchline.store.quarantine import Quarantine
from touchline.store.replaced import Replaced
from touchline.store.schema import check_not_newer, schema_of, upgrade
from touchline.store.sqlite_files import remove_database, remove_side_files

log = logging.getLogger("touchline")


@dataclass(frozen=True)
class Restoration:
    """A backup in the place of the database. made_at: ISO 8601, UTC.

    backup, database: how many changes each has saved. file: where the database from before is; None before it is done.
    """

    backup: int
    database: int
    made_at: str
    file: str | None = None

    @property
    def lost(self) -> int:
        """How many changes are newer than the backup."""
        return self.database - self.backup

    @property
    def newer_changes(self) -> str:
        return "1 newer change" if self.lost == 1 else f"{self.lost} newer changes"


def find_restoration(database: Database, backups: Backups) -> Restoration:
    """Return what restore_backup would do; Conflict without a good backup."""
    with _good_copy(backups) as (backup, _):
        return Restoration(backup.changes, database.changes(), backup.made_at)


def restore_backup(database: Database, backups: Backups, quarantine: Quarantine, replaced: Replaced,
                   seen: tuple[int, int] | None = None) -> Restoration:
    """Replace the database under all who use it; Conflict without a good backup.

    seen: the numbers of backup and database that somebody has agreed to. Conflict if there is another backup by now,
    or if somebody was faster. What others have saved since is lost as well, or the one who restores would never win
    against those who save all the time: it is counted in the answer, and in the copy.
    """
    path = backups.source
    with (_good_copy(backups, seen) as (backup, copy), database.closed() as changes,
          translate_disk_errors("The database")):
        if seen is not None and (backup.changes != seen[0] or not replaced.newest < seen[1] <= changes):
            raise Conflict(say("backup.changed-meanwhile", "Something was saved meanwhile."),
                           say("backup.look-again", "Check again what would be lost, then restore the backup."),
                           reason="changed-meanwhile")
        with closing(sqlite3.connect(copy, isolation_level=None)) as connection:
            connection.execute("PRAGMA journal_mode=DELETE")  # one file, without a log beside it
            connection.execute("UPDATE ledger SET changes = ?", [changes + 1])
        kept = replaced.add(path, changes)
        remove_side_files(path)
        replace_synced(copy, path)
        replaced.newest = changes
        quarantine.move_rows(kept.parent)
    replaced.thin()
    done = Restoration(backup.changes, changes, backup.made_at, str(kept.relative_to(path.parent)))
    log.warning("the backup of change %s was restored; the database from before, with %s, is %s", done.backup,
                done.newer_changes, done.file)
    return done


@contextmanager
def _good_copy(backups: Backups, seen: tuple[int, int] | None = None) -> Iterator[tuple[Backup, Path]]:
    """Hold the backups, and yield the newest good one with a copy of it that has the newest schema.

    seen: as above; newer backups were found to be damaged then.
    """
    copy = backups.source.with_name(UNFINISHED)
    with backups.held:
        try:
            backup = next((one for one in backups.all()
                           if (seen is None or one.changes <= seen[0]) and _is_good(one, copy)), None)
            if backup is None:
                raise Conflict(say("backup.none-good", "There is no backup in which all data is intact."),
                               say("backup.restore-archive", "Restore an archive to an empty folder with touchline "
                                   "restore, or create again what is damaged."), reason="no-good-backup")
            yield backup, copy
        finally:
            remove_database(copy)


def _is_good(backup: Backup, copy: Path) -> bool:
    remove_database(copy)
    with translate_disk_errors("The database"):
        shutil.copyfile(backup.path, copy)
    if find_damage(copy) is not None:
        return False
    with closing(Database.on_sqlite(copy)) as database:
        try:
            check_not_newer(schema_of(database.engine))
            upgrade(database.engine)
            with database.reading() as rows:
                return is_whole(rows)
        except (DBAPIError, TouchlineError):  # another version's, or not as its schema says
            return False
