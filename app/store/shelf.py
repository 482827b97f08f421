"""What the shelves share: ids, the clock, and pages of things in the order in which they came."""

import re
import secrets
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from datetime import UTC, datetime
from typing import Generic, NamedTuple, TypeVar

from app.errors import BadInput, NotFound
from app.store.quarantine import DamagedFile

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


class Page(NamedTuple, Generic[T]):
    """Some of the things, newest first; next_cursor asks for the ones after them, None at the end."""

    items: tuple[T, ...]
    next_cursor: str | None


def readable(get: Callable[[str], T], ids: Iterable[str]) -> Iterator[T]:
    """Those that can be read: one damaged file does not hide the others, nor one that was deleted just now."""
    for id in ids:
        with suppress(DamagedFile, NotFound):
            yield get(id)


def page(sequences: Iterable[int], limit: int, cursor: str | None) -> tuple[list[int], str | None]:
    """Which sequence numbers a page shows. Nothing is shown twice or missed while others come and go."""
    if not 1 <= limit <= MAX_PAGE:
        raise BadInput(f"A page cannot hold {limit}.", f"Ask for 1 to {MAX_PAGE}.", reason="bad-limit")
    if cursor is not None and not (isinstance(cursor, str) and re.fullmatch(r"[0-9]{1,12}", cursor)):
        raise BadInput("This is no cursor of ours.", "Send the next_cursor of the page before, or none.",
                       reason="bad-cursor")
    below = sorted((s for s in sequences if cursor is None or s < int(cursor)), reverse=True)
    shown = below[:limit]
    return shown, str(shown[-1]) if len(below) > limit else None
