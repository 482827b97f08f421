"""Whether a database is what was written: its structure by SQLite's own check, its rows by their checksums."""

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any
from urllib.parse import quote

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.store.checksummed import is_whole
from app.store.tables import SEALED, Sealed

FETCH = 500  # rows at a time


def trouble_of(path: Path, least_changes: int = 0) -> str | None:
    """What is wrong with a SQLite file as a whole; None where it is sound. Its log, if there is one, is read as well.

    least_changes: what it must have kept at least, the newest backup's number.
    """
    try:
        if not path.exists():
            return "it is missing"
        if path.stat().st_size == 0:
            return "it is empty"  # SQLite itself would call it sound
        # Read only: a connection that may write would empty the log into a file of which nothing is known yet.
        address = f"file:{quote(str(path.absolute()))}?mode=ro"
        with closing(sqlite3.connect(address, uri=True, isolation_level=None, timeout=5)) as connection:
            (answer,) = connection.execute("PRAGMA integrity_check(1)").fetchone()
            if answer != "ok":
                return f"its structure is broken: {answer.splitlines()[-1][:200]}"
            changes = changes_of(connection)
    except sqlite3.Error as error:
        return f"it cannot be read: {error}"
    if changes is None:
        return "it is no database of Touchline"
    if changes < least_changes:
        return f"it is older than its newest backup: change {changes}, not {least_changes}"
    return None


def changes_of(connection: sqlite3.Connection) -> int | None:
    """How many changes a database has kept; None where it does not say."""
    row = connection.execute("SELECT changes FROM ledger").fetchone()
    return row[0] if row and isinstance(row[0], int) else None


def damaged_rows(rows: Session) -> Iterator[tuple[type[Sealed], Any]]:
    """Every row, with its table, whose checksum is wrong and that nobody has noticed yet."""
    for table in SEALED:
        columns = list(table.__table__.columns)  # type: ignore[attr-defined]
        wanted = select(*columns).where(table.damaged.is_(None)).execution_options(yield_per=FETCH)
        for row in rows.execute(wanted):
            if not is_whole(row, table):
                yield table, row
