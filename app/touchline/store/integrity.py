"""Check that a database is what was written: its structure by SQLite's own check, its rows by their checksums.

The database's own check sees a broken page, not a bit that was flipped within a text or a number. `sequence` alone is
left out, since the database gives it; and `damaged`, which is written when the checksum is wrong.
"""

import json
import sqlite3
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, suppress
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeVar

from sqlalchemy import inspect, select, update
from sqlalchemy.orm import Session

from touchline.core.errors import BadInput, TouchlineError
from touchline.installation import __version__
from touchline.store.database import Database, count_missing_rows
from touchline.store.quarantine import MISSING, DamagedFile, Quarantine, open_as
from touchline.store.tables import CHECKSUMMED_TABLES, Checksummed, LedgerRow

Row = TypeVar("Row", bound=Checksummed)
NOT_COVERED = ("sequence", "damaged", "sha256", "body")

ROWS_AT_ONCE = 500
MAX_REASON = 300  # characters


def checksummed(table: type[Row], record: Mapping[str, Any], what: str, **columns: Any) -> Row:
    """Make a row with that content and its checksum. what: how an error calls it, such as "The draft"."""
    row = table(
        **{name: None for name in covered_columns(table)} | columns,
        body=json_text(record, what),
        damaged=None,
    )
    update_checksum(row)
    return row


def update_checksum(row: Checksummed) -> None:
    """Give the row the checksum of its content."""
    row.sha256 = checksum([getattr(row, name) for name in covered_columns(type(row))], row.body)


def is_intact(row: Any, table: type[Checksummed] | None = None) -> bool:
    """Check that a row is what was written. table: needed for a row that is only a tuple of columns."""
    kind: type[Checksummed] = table or type(row)
    return bool(
        checksum([getattr(row, name) for name in covered_columns(kind)], row.body) == row.sha256
    )


def content(row: Checksummed) -> dict[str, Any]:
    """Return the record of an intact row."""
    record: dict[str, Any] = json.loads(row.body)
    return record


def json_text(record: Any, what: str) -> str:
    """Return plain JSON as ASCII; BadInput where a number is not finite."""
    try:
        return json.dumps(record, allow_nan=False, separators=(",", ":"))
    except ValueError:
        raise BadInput(
            f"{what} contains a number that is not finite.",
            "Remove or correct that number.",
            reason="non-finite-number",
        ) from None


def checksum(columns: Sequence[Any], body: Any) -> str:
    # repr and not JSON: whatever a damaged database answers, bytes too, has one.
    return sha256(f"{list(columns)!r}\n{body}".encode("utf-8", "surrogatepass")).hexdigest()


@cache
def covered_columns(table: type[Checksummed]) -> tuple[str, ...]:
    """Return the columns that the checksum covers besides the body, in a fixed order."""
    return tuple(
        sorted(column.key for column in inspect(table).columns if column.key not in NOT_COVERED)
    )


# by table: each raises for a row that it does not understand
Readers = Mapping[str, Callable[[Any], object]]


def find_damage(path: Path, min_changes: int = 0) -> str | None:
    """Return what is wrong with a SQLite file as a whole, with its log if there is one; None where it is sound.

    min_changes: how many changes it must have at least, the newest backup's number.
    """
    try:
        if not path.exists():
            return "it is missing"
        if path.stat().st_size == 0:
            return "it is empty"  # SQLite itself would call it sound
        # Read only: a connection that may write would empty the log into a file of which nothing is known yet.
        with closing(open_as(path, "ro")) as connection:
            (answer,) = connection.execute("PRAGMA integrity_check(1)").fetchone()
            if answer != "ok":
                return f"its structure is broken: {answer.splitlines()[-1][:200]}"
            changes = count_changes(connection)
    except sqlite3.Error as error:
        return f"it cannot be read: {error}"
    if changes is None:
        return "it is not a Touchline database"
    if changes < min_changes:
        return f"it is older than its newest backup: change {changes}, not {min_changes}"
    return None


def count_changes(connection: sqlite3.Connection) -> int | None:
    """Return how many changes a database has saved; None where it does not say."""
    row = connection.execute("SELECT changes FROM ledger").fetchone()
    return row[0] if row and isinstance(row[0], int) else None


def find_damaged_rows(rows: Session) -> Iterator[tuple[type[Checksummed], Any]]:
    """Find every row, with its table, whose checksum is wrong and that is not marked as damaged yet."""
    return (found for found in _unmarked_rows(rows) if not is_intact(found[1], found[0]))


def find_unreadable_rows(
    rows: Session, readers: Readers
) -> Iterator[tuple[type[Checksummed], Any, str]]:
    """Find every intact row, with its table and the reason, that its reader does not understand."""
    for table, row in _unmarked_rows(rows):
        if is_intact(row, table) and table.__tablename__ in readers:
            try:
                readers[table.__tablename__](row)
            except (
                TouchlineError,
                ValueError,
                LookupError,
                TypeError,
                AttributeError,
                ArithmeticError,
                RecursionError,
            ) as error:
                yield table, row, " ".join(str(error).split())[:MAX_REASON]


def _unmarked_rows(rows: Session) -> Iterator[tuple[type[Checksummed], Any]]:
    for table in CHECKSUMMED_TABLES:
        columns = list(table.__table__.columns)
        query = (
            select(*columns)
            .where(table.damaged.is_(None))
            .execution_options(yield_per=ROWS_AT_ONCE)
        )
        for row in rows.execute(query):
            yield table, row


def is_whole(rows: Session) -> bool:
    """Check that no row is damaged or missing, whether it is marked or not."""
    if rows.scalar(select(LedgerRow.missing)) is not None or count_missing_rows(rows):
        return False
    marked = (
        select(table.damaged).where(table.damaged.is_not(None)).limit(1)
        for table in CHECKSUMMED_TABLES
    )
    return not any(map(rows.scalar, marked)) and next(find_damaged_rows(rows), None) is None


def mark_missing_rows(database: Database, quarantine: Quarantine) -> None:
    """Note the rows that vanished since the last save, until the quarantine's file of them is removed."""
    with database.reading() as rows:
        missing, noted = count_missing_rows(rows), rows.scalar(select(LedgerRow.missing))
    if missing:
        noted = quarantine.add_missing(missing).name
    elif noted is None or quarantine.has(MISSING, noted):
        return
    else:
        noted = None
    with suppress(TouchlineError), database.writing("The mark of a damaged row") as rows:
        rows.execute(update(LedgerRow).values(missing=noted))


def set_aside_unreadable_rows(database: Database, quarantine: Quarantine, readers: Readers) -> None:
    """Mark the rows that this version cannot read; once for each version, which can read what it writes itself."""
    with database.reading() as rows:
        if not readers or rows.scalar(select(LedgerRow.read_by)) == __version__:
            return
        found = list(find_unreadable_rows(rows, readers))
    for table, row, reason in found:
        note = (
            f"This version of Touchline ({__version__}) cannot read it: {reason}. Create it again."
        )
        mark_damaged(database, quarantine, table, row, note)
    with suppress(TouchlineError), database.writing("The mark of a damaged row") as rows:
        rows.execute(update(LedgerRow).values(read_by=__version__))


def mark_damaged(
    database: Database,
    quarantine: Quarantine,
    table: type[Checksummed],
    row: Any,
    note: str | None = None,
) -> DamagedFile:
    """Write what is left of a damaged row to the quarantine, and mark the row; return the error to raise.

    note: why it is set aside, where its checksum is right.
    """
    (key,) = table.__table__.primary_key
    name = str(getattr(row, "id" if hasattr(row, "id") else key.key)).replace(":", "-")
    damaged = quarantine.add_row(table.__tablename__, name, str(row.body), note)
    with suppress(TouchlineError), database.writing("The mark of a damaged row") as rows:
        rows.execute(
            update(table).where(key == getattr(row, key.key)).values(damaged=damaged.damage.name)
        )
    return damaged
