"""Rows that carry their own checksum: over the content as text and over every column that repeats a part of it.

The database's own check sees a broken page, not a bit that was flipped within a text or a number. `sequence` alone is
left out, since the database gives it; and `damaged`, which is written when the checksum is wrong.
"""

import json
from collections.abc import Mapping, Sequence
from functools import cache
from hashlib import sha256
from typing import Any, TypeVar

from sqlalchemy import inspect

from touchline.core.errors import BadInput
from touchline.store.tables import Checksummed

Row = TypeVar("Row", bound=Checksummed)
NOT_COVERED = ("sequence", "damaged", "sha256", "body")


def checksummed(table: type[Row], record: Mapping[str, Any], what: str, **columns: Any) -> Row:
    """Make a row with that content and its checksum. what: how an error calls it, such as "The draft"."""
    row = table(**{name: None for name in covered_columns(table)} | columns, body=json_text(record, what), damaged=None)
    update_checksum(row)
    return row


def update_checksum(row: Checksummed) -> None:
    """Give the row the checksum of its content."""
    row.sha256 = checksum([getattr(row, name) for name in covered_columns(type(row))], row.body)


def is_intact(row: Any, table: type[Checksummed] | None = None) -> bool:
    """Check that a row is what was written. table: needed for a row that is only a tuple of columns."""
    kind: type[Checksummed] = table or type(row)
    return bool(checksum([getattr(row, name) for name in covered_columns(kind)], row.body) == row.sha256)


def content(row: Checksummed) -> dict[str, Any]:
    """Return the record of an intact row."""
    record: dict[str, Any] = json.loads(row.body)
    return record


def json_text(record: Any, what: str) -> str:
    """Return plain JSON as ASCII; BadInput where a number is not finite."""
    try:
        return json.dumps(record, allow_nan=False, separators=(",", ":"))
    except ValueError:
        raise BadInput(f"{what} contains a number that is not finite.", "Remove or correct that number.",
                       reason="non-finite-number") from None


def checksum(columns: Sequence[Any], body: Any) -> str:
    # repr and not JSON: whatever a damaged database answers, bytes too, has one.
    return sha256(f"{list(columns)!r}\n{body}".encode("utf-8", "surrogatepass")).hexdigest()


@cache
def covered_columns(table: type[Checksummed]) -> tuple[str, ...]:
    """Return the columns that the checksum covers besides the body, in a fixed order."""
    return tuple(sorted(column.key for column in inspect(table).columns if column.key not in NOT_COVERED))
