"""What the shelves share: ids, the clock, rows that may be damaged, and pages in the order in which things came."""

import re
import secrets
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime
from typing import Any, Generic, NamedTuple, TypeVar

from sqlalchemy import ColumnElement, inspect, select, update

from app.core.errors import BadInput, NotFound, TouchlineError
from app.store.checksummed import is_whole
from app.store.database import Database
from app.store.quarantine import Damage, DamagedFile, Quarantine

T = TypeVar("T")
MAX_PAGE = 200
Clock = Callable[[], datetime]


def utc_now() -> datetime:
    return datetime.now(UTC)


def stamp(clock: Clock) -> str:
    """The time as records keep it: ISO 8601, UTC, milliseconds. For people; order never rests on it."""
    return clock().astimezone(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def new_id() -> str:
    return secrets.token_hex(8)


def is_id(id: str) -> bool:
    """Whether it could be one of new_id's; PostgreSQL would trip over a few others."""
    return re.fullmatch(r"[0-9a-f]{16}", id) is not None


def column(text: str | None) -> str | None:
    """A text as any database can hold it: without NUL and half surrogates, which only the sealed body keeps."""
    return None if text is None else text.replace("\0", "").encode("utf-8", "replace").decode()


class Page(NamedTuple, Generic[T]):
    """Some of the things, newest first; next_cursor asks for the ones after them, None at the end."""

    items: tuple[T, ...]
    next_cursor: str | None


class Shelf:
    """One kind of rows, of which `table` is the ORM class and `kind` the quarantine's name."""

    table: Any
    kind: str

    def __init__(self, database: Database, quarantine: Quarantine, clock: Clock) -> None:
        self._database = database
        self._quarantine = quarantine
        self._clock = clock

    def checked(self, row: Any, name: str) -> Any:
        """The row, where it is whole; DamagedFile otherwise, now and whenever it is asked for again."""
        if row.damaged is not None:
            raise DamagedFile(Damage(self.kind, row.damaged))
        if is_whole(row):
            return row
        raise self.put_aside(row, name)

    def put_aside(self, row: Any, name: str, kind: str | None = None) -> DamagedFile:
        """Write what is left of a damaged row to the quarantine, and mark the row."""
        told = self._quarantine.keep(kind or self.kind, f"{name}.json", str(row.body), "its checksum is wrong")
        key = inspect(type(row)).primary_key[0]
        with suppress(TouchlineError), self._database.writing("The mark of a damaged row") as rows:
            rows.execute(update(type(row)).where(key == getattr(row, key.key)).values(damaged=told.damage.name))
        return told

    def row(self, id: str, unknown: Callable[[str], NotFound], *where: ColumnElement[bool]) -> Any:
        """The one with that id; NotFound, or DamagedFile."""
        if not is_id(id):
            raise unknown(id)
        with self._database.reading() as rows:
            row = rows.scalar(select(self.table).where(self.table.id == id, *where))
        if row is None:
            raise unknown(id)
        return self.checked(row, id)

    def page(self, limit: int, cursor: str | None, read: Callable[[Any], T], *where: ColumnElement[bool]) -> Page[T]:
        """Newest first. Nothing is shown twice or missed while others come and go; damaged ones are left out."""
        check_page(limit, cursor)
        wanted = select(self.table).where(self.table.damaged.is_(None), *where)
        if cursor is not None:
            wanted = wanted.where(self.table.sequence < int(cursor))
        with self._database.reading() as rows:
            found = list(rows.scalars(wanted.order_by(self.table.sequence.desc()).limit(limit + 1)))
        shown, items = found[:limit], []
        for row in shown:
            with suppress(DamagedFile):  # one that is damaged does not hide the others; Store.damaged names it
                items.append(read(self.checked(row, row.id)))
        return Page(tuple(items), str(shown[-1].sequence) if len(found) > limit else None)


def check_page(limit: int, cursor: str | None) -> None:
    if not 1 <= limit <= MAX_PAGE:
        raise BadInput(f"A page cannot hold {limit}.", f"Ask for 1 to {MAX_PAGE}.", reason="bad-limit")
    if cursor is not None and not (isinstance(cursor, str) and re.fullmatch(r"[0-9]{1,12}", cursor)):
        raise BadInput("This is no cursor of ours.", "Send the next_cursor of the page before, or none.",
                       reason="bad-cursor")
