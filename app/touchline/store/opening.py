"""Open the database: check it, bring it to the newest schema, restore a damaged one from the newest good backup.

Each step of the schema is one transaction: a kill leaves the old schema or the new one.

    new folder                      → a new database
    sound                           → itself; single damaged rows are marked, and what is left of them is reported
    damaged, empty, gone, outdated  → to the quarantine; the newest backup that is sound takes its place
    damaged, and no such backup     → refused with a message, and nothing is touched

Nobody is ever given an empty database in place of a full one.

Nothing is read of a database that a backup replaces: it may be damaged as a whole. Good is a backup in which every row
is intact and none is missing. It is looked for in copies, and the copy takes the database's place in one step: a power
cut leaves the old database or the new one, and an error leaves the old one in use.

The new one counts on from the old one's number of changes, so that no backup from before is newer than it.
"""

import logging
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

from alembic import command
from alembic.config import Config
from sqlalchemy import Engine, func, inspect, select, text
from sqlalchemy.exc import DBAPIError

from touchline.core.errors import Conflict, TouchlineError, Unavailable
from touchline.core.statements import say
from touchline.store.backups import Backup, Backups
from touchline.store.database import Database, postgresql_url
from touchline.store.files import replace_synced, translate_disk_errors, write_atomically
from touchline.store.integrity import (
    Readers,
    find_damage,
    find_damaged_rows,
    is_whole,
    mark_damaged,
    mark_missing_rows,
    set_aside_unreadable_rows,
)
from touchline.store.lock import PostgresLock
from touchline.store.quarantine import (
    Quarantine,
    Replaced,
    move_side_files,
    remove_database,
    remove_side_files,
    roll_back,
)
from touchline.store.tables import SnapshotRow

HEAD = "0008"
MIGRATIONS = Path(__file__).parent / "migrations"

FILE = "touchline.db"
UNFINISHED = f"{FILE}.unfinished"  # what is to take its place
log = logging.getLogger("touchline")


def schema_of(engine: Engine) -> str | None:
    """Return the step that a database has reached; None for one without our tables."""
    with engine.connect() as connection:
        if not inspect(connection).has_table("alembic_version"):
            return None
        found: str | None = connection.scalar(text("SELECT version_num FROM alembic_version"))
        return found


def check_not_newer(schema: str | None) -> None:
    """Raise Unavailable for what only a newer Touchline understands."""
    if schema is not None and schema > HEAD:  # names of steps are numbers of four digits
        raise Unavailable(
            f"The database was made by a newer Touchline (format {schema}; this version supports "
            f"{HEAD}).",
            "Start the newer version, or restore an archive or backup from before the update to an "
            "empty folder.",
            reason="newer-database",
        )


def upgrade(engine: Engine) -> None:
    """Run every step that the database lacks."""
    config = Config()
    config.set_main_option("script_location", str(MIGRATIONS).replace("%", "%%"))
    config.set_main_option("path_separator", "os")
    with engine.begin() as connection:
        config.attributes["connection"] = connection
        command.upgrade(config, "head")


def open_sqlite(
    folder: Path, backups: Backups, quarantine: Quarantine, readers: Readers
) -> Database:
    """Open the folder's own database, sound and of the newest schema; Unavailable if there is none.

    readers: as integrity.py takes them.
    """
    path = folder / FILE
    remove_database(path.with_name(UNFINISHED))
    roll_back(path)
    known = backups.all()
    if not path.exists() and not known:
        _refuse_orphans(folder)
        create_sqlite(path)
    damage = find_damage(path)
    if damage is None and known:
        damage = _outdated(path, backups)
    if damage is not None:
        _restore(path, damage, backups, quarantine)
    database = Database.on_sqlite(path)
    schema = schema_of(database.engine)
    check_not_newer(schema)
    if schema != HEAD:
        backups.make()  # an update that goes wrong can be taken back
        upgrade(database.engine)
    check_rows(database, quarantine, readers)
    return database


def open_postgresql(
    setting: str, folder: Path, quarantine: Quarantine, readers: Readers
) -> tuple[Database, PostgresLock]:
    """Open the database that the setting names, with the newest schema, locked against other servers."""
    database = Database(postgresql_url(setting), folder)
    with ExitStack() as undo:
        undo.callback(database.close)
        try:
            lock = PostgresLock(database)
            undo.callback(lock.close)
            schema = schema_of(database.engine)
            check_not_newer(schema)
            if schema is None:
                _refuse_orphans(folder)
            if schema != HEAD:
                upgrade(database.engine)
            _refuse_other_folder(database, folder)
            lock.claim()
        except DBAPIError as error:
            place = database.url.set(password=None).render_as_string()
            raise Unavailable(
                f"The database {place} cannot be used: {str(error.orig).strip().splitlines()[0]}.",
                "Check that PostgreSQL is running, and check the setting `database`.",
                reason="database-away",
            ) from None
        undo.pop_all()
    check_rows(database, quarantine, readers)
    return database, lock


def create_sqlite(path: Path) -> None:
    """Create a database under another name and move it: a kill leaves a whole one or none, never an empty file."""
    unfinished = path.with_name(UNFINISHED)
    with closing(Database.on_sqlite(unfinished)) as database:
        upgrade(database.engine)
    replace_synced(unfinished, path)


def _refuse_orphans(folder: Path) -> None:
    """Refuse pictures without a database that knows them: it was lost, or another folder is meant."""
    pictures = folder / "pictures"
    if pictures.is_dir() and any(not path.name.startswith(".") for path in pictures.iterdir()):
        raise Unavailable(
            f"The folder {folder} contains images, but their database is missing.",
            f"Put {FILE} back, enter the correct database in the settings, restore an archive with "
            "touchline restore, or choose an empty folder with --data.",
            reason="database-missing",
        )


def _refuse_other_folder(database: Database, folder: Path) -> None:
    """Refuse a folder without any pictures for a database that knows some: it belongs to another folder."""
    with database.reading() as rows:
        known = rows.scalar(select(func.count()).select_from(SnapshotRow)) or 0
    if known and not (folder / "pictures").exists():
        raise Unavailable(
            f"The database lists {known} images, but the folder {folder} contains none.",
            "Choose the folder of this database with --data, or enter another database in the settings. "
            "If the images are lost, create an empty folder `pictures` there.",
            reason="pictures-missing",
        )


def _outdated(path: Path, backups: Backups) -> str | None:
    """Return what is wrong with a database that has fewer changes than a backup of it: it has lost some."""
    if find_damage(path, backups.all()[0].changes) is None:
        return None
    good = backups.newest_good()
    return None if good is None else find_damage(path, good.changes)


def _restore(path: Path, damage: str, backups: Backups, quarantine: Quarantine) -> None:
    backup = backups.newest_good()
    if backup is None:
        raise Unavailable(
            f"The database {path} is damaged ({damage}), and there is no intact backup.",
            f"Put an intact {FILE} there, restore an archive to an empty folder with touchline restore, "
            "or choose an empty folder with --data.",
            reason="database-damaged",
        )
    for bad in backups.all():
        if bad.changes > backup.changes:
            quarantine.move(bad.path, "it cannot be read", kind="backups")
    restored = path.with_name(UNFINISHED)
    shutil.copyfile(backup.path, restored)
    note = (
        f"The database was damaged ({damage}). The backup of change {backup.changes} was restored. Changes after "
        "it are only in this file, as far as it can be read."
    )
    if not path.exists():
        write_atomically(path, b"")  # so that its loss has a name in the quarantine
    moved = quarantine.move(path, damage, kind="database", note=note).damage
    move_side_files(path, path.parent / moved.file)
    replace_synced(restored, path)
    log.error("%s: %s", path, note)


def check_rows(database: Database, quarantine: Quarantine, readers: Readers) -> None:
    """Mark the rows that were changed behind our back or cannot be read, and note those that vanished."""
    mark_missing_rows(database, quarantine)  # first: every save counts what there is then
    with database.reading() as rows:
        found = list(find_damaged_rows(rows))
    for table, row in found:
        mark_damaged(database, quarantine, table, row)
    set_aside_unreadable_rows(database, quarantine, readers)


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


def restore_backup(
    database: Database,
    backups: Backups,
    quarantine: Quarantine,
    replaced: Replaced,
    seen: tuple[int, int] | None = None,
) -> Restoration:
    """Replace the database under all who use it; Conflict without a good backup.

    seen: the numbers of backup and database that somebody has agreed to. Conflict if there is another backup by now,
    or if somebody was faster. What others have saved since is lost as well, or the one who restores would never win
    against those who save all the time: it is counted in the answer, and in the copy.
    """
    path = backups.source
    with (
        _good_copy(backups, seen) as (backup, copy),
        database.closed() as changes,
        translate_disk_errors("The database"),
    ):
        if seen is not None and (
            backup.changes != seen[0] or not replaced.newest < seen[1] <= changes
        ):
            raise Conflict(
                say("backup.changed-meanwhile", "Something was saved meanwhile."),
                say(
                    "backup.look-again", "Check again what would be lost, then restore the backup."
                ),
                reason="changed-meanwhile",
            )
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
    log.warning(
        "the backup of change %s was restored; the database from before, with %s, is %s",
        done.backup,
        done.newer_changes,
        done.file,
    )
    return done


@contextmanager
def _good_copy(
    backups: Backups, seen: tuple[int, int] | None = None
) -> Iterator[tuple[Backup, Path]]:
    """Hold the backups, and yield the newest good one with a copy of it that has the newest schema.

    seen: as above; newer backups were found to be damaged then.
    """
    copy = backups.source.with_name(UNFINISHED)
    with backups.held:
        try:
            backup = next(
                (
                    one
                    for one in backups.all()
                    if (seen is None or one.changes <= seen[0]) and _is_good(one, copy)
                ),
                None,
            )
            if backup is None:
                raise Conflict(
                    say("backup.none-good", "There is no backup in which all data is intact."),
                    say(
                        "backup.restore-archive",
                        "Restore an archive to an empty folder with touchline "
                        "restore, or create again what is damaged.",
                    ),
                    reason="no-good-backup",
                )
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
