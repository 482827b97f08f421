"""What the repositories share: ids, dates, rows that may be damaged, pages in order, preconditions, a cache."""

import re
import secrets
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path
from threading import Lock
from typing import Any, Generic, NamedTuple, TypeVar

from sqlalchemy import ColumnElement, Select, select
from sqlalchemy.orm import Session

from touchline.core.errors import BadInput, NotFound, Stale
from touchline.core.statements import say
from touchline.store.database import Database
from touchline.store.files import PictureQuota
from touchline.store.integrity import is_intact, json_text, mark_damaged, update_checksum
from touchline.store.quarantine import Damage, DamagedFile, Quarantine

Key = TypeVar("Key", bound=Hashable)
Value = TypeVar("Value")

T = TypeVar("T")
MAX_PAGE = 200
LOOK_AGAIN = say("stale.look-again", "Check the current version, then repeat your change.")


class LruCache(Generic[Key, Value]):
    """Values by key, of max_size together; the newest stays even if it is larger. Thread-safe."""

    def __init__(self, max_size: int, size_of: Callable[[Value], int] = lambda _value: 1) -> None:
        self._max_size, self._size_of, self._size = max_size, size_of, 0
        self._values: OrderedDict[Key, Value] = OrderedDict()
        self._lock = Lock()

    def get(self, key: Key) -> Value | None:
        """Return the value and mark it as used; None if it is not there."""
        with self._lock:
            if key in self._values:
                self._values.move_to_end(key)
            return self._values.get(key)

    def put(self, key: Key, value: Value) -> Value:
        """Add a value, drop the oldest ones that have no room beside it, and return it."""
        with self._lock:
            if key in self._values:
                self._size -= self._size_of(self._values.pop(key))
            self._values[key] = value
            self._size += self._size_of(value)
            while len(self._values) > 1 and self._size > self._max_size:
                self._size -= self._size_of(self._values.popitem(last=False)[1])
        return value

    def get_or_make(self, key: Key, make: Callable[[], Value]) -> Value:
        """Return the value, made where it is missing. Two threads may make the same one, which only costs time."""
        value = self.get(key)
        return self.put(key, make()) if value is None else value

    @property
    def size(self) -> int:
        """Return the size of all values together."""
        return self._size


Clock = Callable[[], datetime]


def utc_now() -> datetime:
    return datetime.now(UTC)


def timestamp(clock: Clock) -> str:
    """Return the time as records have it: ISO 8601, UTC, milliseconds. For people; order never rests on it."""
    return clock().astimezone(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def new_id() -> str:
    return secrets.token_hex(8)


def is_id(id: str) -> bool:
    """Check that it could be one of new_id's; PostgreSQL would trip over a few others."""
    return re.fullmatch(r"[0-9a-f]{16}", id) is not None


def column_text(text: str | None) -> str | None:
    """Return a text as any database can hold it: without NUL and half surrogates, which only the JSON body keeps."""
    return None if text is None else text.replace("\0", "").encode("utf-8", "replace").decode()


class Page(NamedTuple, Generic[T]):
    """Some of the items, newest first; next_cursor asks for the ones after them, None at the end."""

    items: tuple[T, ...]
    next_cursor: str | None


@dataclass(frozen=True)
class StoreContext:
    """What a repository works with. folder: of all data; what takes room there asks the quota first."""

    folder: Path
    database: Database
    quarantine: Quarantine
    clock: Clock
    quota: PictureQuota


class Repository:
    """The checksummed rows of one table. Thread-safe.

    table: the ORM class. noun, listing: how errors call one item and say where they are listed.
    """

    table: Any
    noun: str
    listing: str

    def __init__(self, store: StoreContext) -> None:
        self._database, self._quarantine, self._clock = (
            store.database,
            store.quarantine,
            store.clock,
        )

    def _unknown(self, id: str) -> NotFound:
        return NotFound(
            say(f"{self.noun}.unknown", f"There is no {self.noun} {{id!r}}.", id=id),
            self.listing,
            reason=f"unknown-{self.noun}",
        )

    def _checked(self, row: Any) -> Any:
        """Return the row if it is intact; raise DamagedFile otherwise, also when it is read again."""
        if row.damaged is not None:
            raise DamagedFile(Damage(row.__tablename__, row.damaged))
        if is_intact(row):
            return row
        raise mark_damaged(self._database, self._quarantine, type(row), row)

    def _row(self, id: str, *where: ColumnElement[bool]) -> Any:
        if not is_id(id):
            raise self._unknown(id)
        with self._database.reading() as rows:
            row = rows.scalar(select(self.table).where(self.table.id == id, *where))
        if row is None:
            raise self._unknown(id)
        return self._checked(row)

    @contextmanager
    def _changing(
        self, what: str, id: str, *where: ColumnElement[bool]
    ) -> Iterator[tuple[Session, Any]]:
        """Let the block change the intact row with that id, and save it with its new checksum."""
        self._row(id, *where)
        with self._database.writing(what) as rows:
            row = rows.scalar(select(self.table).where(self.table.id == id, *where))
            if row is None:
                raise self._unknown(id)  # deleted a moment ago
            yield rows, row
            update_checksum(row)  # of one that the block has deleted, to no effect

    def _find(self, query: Select[Any]) -> list[Any]:
        with self._database.reading() as rows:
            return list(rows.scalars(query))

    def _intact(self, rows: Iterable[Any], read: Callable[[Any], T]) -> tuple[T, ...]:
        """Read every row but the damaged ones, which do not hide the others; Store.damaged names them."""
        items = []
        for row in rows:
            with suppress(DamagedFile):
                items.append(read(row))
        return tuple(items)

    def _page(
        self, limit: int, cursor: str | None, read: Callable[[Any], T], *where: ColumnElement[bool]
    ) -> Page[T]:
        """Return a page, newest first. Nothing is shown twice or missed while others come and go."""
        if not 1 <= limit <= MAX_PAGE:
            raise BadInput(
                f"A page cannot have {limit} entries.",
                f"Request 1 to {MAX_PAGE} entries.",
                reason="bad-limit",
            )
        if cursor is not None and not (
            isinstance(cursor, str) and re.fullmatch(r"[0-9]{1,12}", cursor)
        ):
            raise BadInput(
                "The cursor is not valid.",
                "Send the next_cursor of the previous page, or none.",
                reason="bad-cursor",
            )
        query = select(self.table).where(self.table.damaged.is_(None), *where)
        if cursor is not None:
            query = query.where(self.table.sequence < int(cursor))
        found = self._find(query.order_by(self.table.sequence.desc()).limit(limit + 1))
        items = self._intact(found[:limit], lambda row: read(self._checked(row)))
        return Page(items, str(found[limit - 1].sequence) if len(found) > limit else None)


def content_etag(content: Any) -> str:
    """Return the ETag of plain JSON that has no counter of its own."""
    return sha256(json_text(content, "This").encode()).hexdigest()[:16]


def check_etag(
    given: str | None, etag: str, what: str, reason: str, current: Any, fix: str = LOOK_AGAIN
) -> None:
    """Raise Stale, with the current state and its ETag, unless the given one is that or none. what: has happened."""
    if given is not None and given != etag:
        raise Stale(what, fix, reason=reason, current=current, etag=etag)
