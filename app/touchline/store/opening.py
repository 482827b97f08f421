"""Open the database: check it, restore a damaged one, refuse one that cannot be restored.

    new folder                      → a new database
    sound                           → itself; single damaged rows are marked, and what is left of them is reported
    damaged, empty, gone, outdated  → to the quarantine; the newest backup that is sound takes its place
    damaged, and no such backup     → refused with a message, and nothing is touched

Nobody is ever given an empty database in place of a full one.
"""

import logging
import shutil
from contextlib import ExitStack, closing
from pathlib import Path

from sqlalchemy import func, select
from sqlalchemy.exc import DBAPIError

from touchline.core.errors import Unavailable
from touchline.store.backups import Backups
from touchline.store.database import Database, postgresql_url
from touchline.store.files import replace_synced, write_atomically
from touchline.store.integrity import (
    Readers,
    find_damage,
    find_damaged_rows,
    mark_damaged,
    mark_missing_rows,
    set_aside_unreadable_rows,
)
from touchline.store.lock import PostgresLock
from touchline.store.quarantine import Quarantine
from touchline.store.schema import HEAD, check_not_newer, schema_of, upgrade
from touchline.store.sqlite_files import move_side_files, remove_database, roll_back
from touchline.store.tables import SnapshotRow

log = logging.getLogger("touchline")
FILE = "touchline.db"
UNFINISHED = f"{FILE}.unfinished"  # what is to take its place


def open_sqlite(folder: Path, backups: Backups, quarantine: Quarantine, readers: Readers) -> Database:
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


def open_postgresql(setting: str, folder: Path, quarantine: Quarantine,
                    readers: Readers) -> tuple[Database, PostgresLock]:
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
            raise Unavailable(f"The database {place} cannot be used: {str(error.orig).strip().splitlines()[0]}.",
                              "Check that PostgreSQL is running, and check the setting `database`.",
                              reason="database-away") from None
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
        raise Unavailable(f"The folder {folder} contains images, but their database is missing.",
                          f"Put {FILE} back, enter the correct database in the settings, restore an archive with "
                          "touchline restore, or choose an empty folder with --data.", reason="database-missing")


def _refuse_other_folder(database: Database, folder: Path) -> None:
    """Refuse a folder without any pictures for a database that knows some: it belongs to another folder."""
    with database.reading() as rows:
        known = rows.scalar(select(func.count()).select_from(SnapshotRow)) or 0
    if known and not (folder / "pictures").exists():
        raise Unavailable(f"The database lists {known} images, but the folder {folder} contains none.",
                          "Choose the folder of this database with --data, or enter another database in the settings. "
                          "If the images are lost, create an empty folder `pictures` there.",
                          reason="pictures-missing")


def _outdated(path: Path, backups: Backups) -> str | None:
    """Return what is wrong with a database that has fewer changes than a backup of it: it has lost some."""
    if find_damage(path, backups.all()[0].changes) is None:
        return None
    good = backups.newest_good()
    return None if good is None else find_damage(path, good.changes)


def _restore(path: Path, damage: str, backups: Backups, quarantine: Quarantine) -> None:
    backup = backups.newest_good()
    if backup is None:
        raise Unavailable(f"The database {path} is damaged ({damage}), and there is no intact backup.",
                          f"Put an intact {FILE} there, restore an archive to an empty folder with touchline restore, "
                          "or choose an empty folder with --data.", reason="database-damaged")
    for bad in backups.all():
        if bad.changes > backup.changes:
            quarantine.move(bad.path, "it cannot be read", kind="backups")
    restored = path.with_name(UNFINISHED)
    shutil.copyfile(backup.path, restored)
    note = (f"The database was damaged ({damage}). The backup of change {backup.changes} was restored. Changes after "
            "it are only in this file, as far as it can be read.")
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
