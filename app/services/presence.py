"""Who has a picture open, and which state of its draft is the newest: so that pages can tell each other at once.

Only of this server, and only as long as it runs: presence is no record.
"""

import asyncio
import itertools
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Any

LOOK_S = 0.2  # how often a page's line looks whether there is something to tell


class Presence:
    """Thread-safe."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._numbers = itertools.count(1)
        self._here: dict[str, dict[int, str]] = {}
        self._saved: dict[str, tuple[str, str]] = {}

    @contextmanager
    def at(self, snapshot: str, name: str) -> Iterator[int]:
        """Somebody is at a picture as long as the context lasts; the number tells them apart."""
        with self._lock:
            number = next(self._numbers)
            self._here.setdefault(snapshot, {})[number] = name
        try:
            yield number
        finally:
            with self._lock:
                del self._here[snapshot][number]
                if not self._here[snapshot]:
                    del self._here[snapshot]
                    self._saved.pop(snapshot, None)  # nobody is left to be told

    def saved(self, snapshot: str, etag: str, by: str) -> None:
        """A draft was saved."""
        with self._lock:
            if snapshot in self._here:
                self._saved[snapshot] = (etag, by)

    def seen_by(self, snapshot: str, number: int) -> dict[str, Any]:
        """Who else is there, in the order in which they came, and the draft that was saved last meanwhile."""
        with self._lock:
            others = [name for other, name in self._here.get(snapshot, {}).items() if other != number]
            etag, by = self._saved.get(snapshot, (None, None))
        return {"others": others, "etag": etag, "by": by}

    async def told(self, snapshot: str, name: str) -> AsyncIterator[dict[str, Any]]:
        """What there is to see, now and after every change."""
        with self.at(snapshot, name) as number:
            before = None
            while True:
                now = self.seen_by(snapshot, number)
                if now != before:
                    yield now
                    before = now
                await asyncio.sleep(LOOK_S)
