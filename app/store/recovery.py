"""Recover rows from where they are intact: a damaged row from a backup, newer rows from a damaged database."""

import logging
import sqlite3
from collections.abc import Iterator
from contextlib import closing, suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from sqlalchemy import and_, insert, select, update
from sqlalchemy.exc import IntegrityError

from app.core.errors import TouchlineError
from app.store.backups import Backups
from app.store.checksummed import is_intact
from app.store.database import Database
from app.store.tables import ARCHIVED_TABLES, Checksummed

log = logging.getLogger("touchline")
MAX_SEARCHED_BACKUPS = 10  # looked through for a whole copy of a row


def recover_row(database: Database, backups: Backups | None, table: type[Checksummed], row: Any,
                name: str) -> str | None:
    """Replace the damaged row by a backup's copy, or mark it with the quarantine's name of its remains.

    Returns what was done, in words; None where it was only marked.
    """
    keys = _keys(table)
    same = and_(*(column == getattr(row, column.key) for column in keys))
    for backup in (backups.all() if backups else [])[:MAX_SEARCHED_BACKUPS]:
        whole = _copy_in(backup.path, table, row)
        if whole is not None:
            with database.writing("The restored row") as rows:
                rows.execute(update(table).where(same).values({key: value for key, value in whole.items()
                                                               if key not in {column.key for column in keys}}))
            return f"Restored from the backup of change {backup.changes}."
    with database.writing("The mark of a damaged row") as rows:
        rows.execute(update(table).where(same).values(damaged=name))
    return None


def _copy_in(path: Path, table: type[Checksummed], row: Any) -> dict[str, Any] | None:
    keys = _keys(table)
    where = " AND ".join(f'"{column.name}" = ?' for column in keys)
    with suppress(sqlite3.Error), closing(_open(path)) as source:
        found = source.execute(f'SELECT * FROM "{table.__tablename__}" WHERE {where}',
                               [getattr(row, column.key) for column in keys]).fetchone()
        return None if found is None else _values(table, dict(found))
    return None


def salvage_rows(damaged: Path, into: Database) -> tuple[int, bool]:
    """Insert every whole row that the other database lacks, and replace those that it has in an older state.

    Returns how many rows, and whether anything could not be read. Rows are read through the tables, so
    what was deleted stays deleted; each carries its own checksum, so a row that is taken is what was written.
    """
    count, lost = 0, False
    with closing(_open(damaged)) as source:
        for table in ARCHIVED_TABLES:
            if not issubclass(table, Checksummed):
                continue
            for values in _readable(source, table):
                if values is None:
                    lost = True
                    continue
                with suppress(TouchlineError):
                    count += _put(into, table, values)
    return count, lost


def _readable(source: sqlite3.Connection, table: type[Checksummed]) -> Iterator[dict[str, Any] | None]:
    """Read the intact rows of a table; None in place of each that is not, and at the end of what can be read."""
    name = table.__tablename__
    try:
        if source.execute("SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = ?", [name]).fetchone() is None:
            return  # an older schema had no such table
        for found in source.execute(f'SELECT * FROM "{name}"'):
            yield _values(table, dict(found))
    except sqlite3.Error as error:
        log.error("the damaged database ends early: %s", error)
        yield None


def _put(into: Database, table: type[Checksummed], values: dict[str, Any]) -> bool:
    """Insert or replace a row; whether it was not there in that very state."""
    same = and_(*(column == values[column.key] for column in _keys(table)))
    with into.writing("A restored row") as rows:
        there = rows.execute(select(table.sha256).where(same)).first()
        if there is not None and there[0] == values["sha256"]:
            return False
        try:
            with rows.begin_nested():
                if there is None:
                    rows.execute(insert(table).values(values))
                else:
                    rows.execute(update(table).where(same).values(values))
        except IntegrityError:
            return False  # what it refers to could not be read
    return True


def _values(table: type[Checksummed], found: dict[str, Any]) -> dict[str, Any] | None:
    """Return a row's columns by the names of its class, as Python has them; None where its checksum is wrong."""
    columns = table.__table__.columns
    values = {column.key: bool(found[column.name]) if column.type.python_type is bool else found[column.name]
              for column in columns}
    return values if values["damaged"] is not None or is_intact(SimpleNamespace(**values), table) else None


def _keys(table: type[Checksummed]) -> list[Any]:
    return list(table.__mapper__.primary_key)


def _open(path: Path) -> sqlite3.Connection:
    connection = sqlite3.connect(path, isolation_level=None, timeout=5)
    connection.row_factory = sqlite3.Row
    connection.text_factory = lambda raw: raw.decode("utf-8", "surrogateescape")
    connection.execute("PRAGMA query_only=ON")
    return connection
