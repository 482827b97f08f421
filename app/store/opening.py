"""Opening the database: checked before it is used, restored where it is damaged, refused where nothing can be restored.

    new folder                      → a new database
    sound                           → itself; single damaged rows are taken from a backup, or put aside and named
    damaged, empty, gone, outdated  → moved aside; the newest good backup, and every whole row that was newer than it
    damaged, and no good backup     → refused with a message, and nothing is touched

Nobody is ever given an empty database in place of a full one.
"""

import logging
import os
import shutil
from pathlib import Path

from sqlalchemy.exc import DBAPIError

from app.core.errors import Unavailable
from app.store.backups import Backups
from app.store.check import damaged_rows, trouble_of
from app.store.database import Database, PostgresLock, postgresql_url
from app.store.files import flush_folder, write_whole
from app.store.quarantine import Quarantine
from app.store.recovery import heal, salvage
from app.store.schema import HEAD, check_not_newer, schema_of, upgrade

log = logging.getLogger("touchline")
FILE = "touchline.db"
BESIDE = ("-wal", "-shm")


def open_sqlite(folder: Path, backups: Backups, quarantine: Quarantine) -> Database:
    """The folder's own database, sound and of the newest form; Unavailable where that cannot be had."""
    path = folder / FILE
    known = backups.all()
    if not path.exists() and not known:
        _refuse_orphans(folder)
        create_sqlite(path)
    trouble = trouble_of(path)
    if trouble is None and known:
        trouble = _outdated(path, backups)
    if trouble is not None:
        _restore(path, trouble, backups, quarantine)
    database = Database.on_sqlite(path)
    schema = schema_of(database.engine)
    check_not_newer(schema)
    if schema != HEAD:
        backups.make()  # an update that goes wrong can be taken back
        upgrade(database.engine)
    _check_rows(database, backups, quarantine)
    return database


def open_postgresql(setting: str, folder: Path, quarantine: Quarantine) -> tuple[Database, PostgresLock]:
    """The database that the setting names, of the newest form, held so that no other server uses it."""
    database = Database(postgresql_url(setting), folder)
    try:
        lock = PostgresLock(database)
        try:
            schema = schema_of(database.engine)
            check_not_newer(schema)
            if schema is None:
                _refuse_orphans(folder)
            if schema != HEAD:
                upgrade(database.engine)
        except BaseException:
            lock.release()
            raise
    except DBAPIError as error:
        database.close()
        place = database.url.set(password=None).render_as_string()
        raise Unavailable(f"The database {place} cannot be used: {str(error.orig).strip().splitlines()[0]}.",
                          "Check that PostgreSQL runs, and the setting `database`.", reason="database-away") from None
    except BaseException:
        database.close()
        raise
    _check_rows(database, None, quarantine)
    return database, lock


def create_sqlite(path: Path) -> None:
    """A new database, made under another name and moved: a kill leaves a whole one or none, never an empty file."""
    unfinished = path.with_name(f"{FILE}.unfinished")
    for old in (unfinished, *(unfinished.with_name(unfinished.name + more) for more in BESIDE)):
        old.unlink(missing_ok=True)
    database = Database.on_sqlite(unfinished)
    try:
        upgrade(database.engine)
    finally:
        database.close()
    with open(unfinished, "rb") as file:
        os.fsync(file.fileno())
    os.replace(unfinished, path)
    flush_folder(path.parent)


def _refuse_orphans(folder: Path) -> None:
    """Pictures without a database that knows them mean that it was lost, or that another one is meant."""
    pictures = folder / "pictures"
    former = (folder / "snapshots").is_dir()  # the former form: files, which are taken over
    if not former and pictures.is_dir() and any(not path.name.startswith(".") for path in pictures.iterdir()):
        raise Unavailable(f"The folder {folder} holds pictures, and the database that knows them is missing.",
                          f"Put {FILE} back (or name the right database in the settings), restore an archive with "
                          "touchline restore, or name an empty folder with --data.", reason="database-missing")


def _outdated(path: Path, backups: Backups) -> str | None:
    """A database with fewer changes than a backup of it has lost some."""
    if trouble_of(path, backups.all()[0].changes) is None:
        return None
    good = backups.newest_good()
    return None if good is None else trouble_of(path, good.changes)


def _restore(path: Path, trouble: str, backups: Backups, quarantine: Quarantine) -> None:
    backup = backups.newest_good()
    if backup is None:
        raise Unavailable(f"The database {path} is damaged ({trouble}), and there is no backup of it that is whole.",
                          f"Put a good {FILE} there, restore an archive into an empty folder with touchline restore, "
                          "or name an empty folder with --data.", reason="database-damaged")
    for bad in backups.all():
        if bad.changes > backup.changes:
            quarantine.take(bad.path, "it cannot be read", kind="backups")
    restored = path.with_name(f"{FILE}.unfinished")
    shutil.copyfile(backup.path, restored)
    with open(restored, "rb") as file:
        os.fsync(file.fileno())
    note = f"It was damaged ({trouble}). The backup of change {backup.changes} was restored in its place."
    aside = _move_aside(path, quarantine, trouble, note)
    for more in BESIDE:
        path.with_name(FILE + more).unlink(missing_ok=True)
    os.replace(restored, path)
    flush_folder(path.parent)
    if aside is not None and "older than its newest backup" not in trouble:
        database = Database.on_sqlite(path)
        try:
            if schema_of(database.engine) != HEAD:  # a backup from before an update: newer rows need newer tables
                upgrade(database.engine)
            saved, lost = salvage(aside, database)
        finally:
            database.close()
        if saved:
            note += f" {saved} newer rows that were whole were taken from the damaged one."
        if lost:
            note += " Some of it could not be read: look whether your newest work is there."
        write_whole(aside.with_name(aside.name + ".note"), note.encode())
    log.error("%s: %s", path, note)


def _move_aside(path: Path, quarantine: Quarantine, trouble: str, note: str) -> Path | None:
    """The damaged database with its log, in the quarantine; None where there was none at all."""
    if not path.exists():
        write_whole(path, b"")  # so that its loss has a name in the quarantine
    place = quarantine.take(path, trouble, kind="database", note=note).damage
    aside = path.parent / "quarantine" / place.kind / place.name
    log_file = path.with_name(f"{FILE}-wal")
    if log_file.exists():
        os.replace(log_file, aside.with_name(f"{aside.name}-wal"))
    return aside


def _check_rows(database: Database, backups: Backups | None, quarantine: Quarantine) -> None:
    """Find rows whose content was changed behind our back; each is healed from a backup or marked, and named."""
    with database.reading() as rows:
        damaged = list(damaged_rows(rows))
    for table, row in damaged:
        keys = [column.key for column in table.__table__.primary_key]  # type: ignore[attr-defined]
        name = str(getattr(row, "id" if hasattr(row, "id") else keys[0]))
        kind = table.__tablename__  # type: ignore[attr-defined]
        told = quarantine.keep(kind, f"{name}.json", str(row.body), "its checksum is wrong")
        note = heal(database, backups, table, row, told.damage.name)
        if note is not None:
            quarantine.note(told.damage, note)
