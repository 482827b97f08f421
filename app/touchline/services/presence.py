"""Which operators have a picture open, and which state of its draft is the newest; only while the server runs."""

import asyncio
import itertools
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Any

POLL_S = 0.2


class Presence:
    """Thread-safe."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._numbers = itertools.count(1)
        self._here: dict[str, dict[int, str]] = {}
        self._saved: dict[str, tuple[str, str]] = {}

    @contextmanager
    def at(self, snapshot: str, name: str) -> Iterator[int]:
        """Note that somebody has a picture open while the context lasts; yield their number."""
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
                    self._saved.pop(snapshot, None)

    def saved(self, snapshot: str, etag: str, by: str) -> None:
        """Note that a draft was saved."""
        with self._lock:
            if snapshot in self._here:
                self._saved[snapshot] = (etag, by)

    def state_for(self, snapshot: str, number: int) -> dict[str, Any]:
        """Return who else is there, in order of arrival, and the draft that was saved last meanwhile."""
        with self._lock:
            others = [name for other, name in self._here.get(snapshot, {}).items() if other != number]
            etag, by = self._saved.get(snapshot, (None, None))
        return {"others": others, "etag": etag, "by": by}

    async def changes(self, snapshot: str, name: str) -> AsyncIterator[dict[str, Any]]:
        """Yield the state for somebody who has a picture open, now and after every change."""
        with self.at(snapshot, name) as number:
            before = None
            while True:
                now = self.state_for(snapshot, number)
                if now != before:
                    yield now
                    before = now
                await asyncio.sleep(POLL_S)
