"""Preconditions: a change names the state that it was made from, so that of two operators none wins in silence."""

from hashlib import sha256
from typing import Any

from app.core.errors import Stale
from app.core.statements import say
from app.store.checksummed import json_text

LOOK_AGAIN = say("stale.look-again", "Check the current version, then repeat your change.")


def content_etag(content: Any) -> str:
    """Return the ETag of plain JSON that has no counter of its own."""
    return sha256(json_text(content, "This").encode()).hexdigest()[:16]


def check_etag(given: str | None, etag: str, what: str, reason: str, current: Any, fix: str = LOOK_AGAIN) -> None:
    """Raise Stale, with the current state and its ETag, unless the given one is that or none. what: has happened."""
    if given is not None and given != etag:
        raise Stale(what, fix, reason=reason, current=current, etag=etag)
