"""One who watches a stream: a slot for the newest message. Nobody queues, and a slow one misses frames."""

import asyncio
from typing import Self

from app.live.rate import Rate


class Viewer:
    """Only for the event loop's own thread.

    max_fps: frames come no more often; None: all.
    """

    def __init__(self, max_fps: float | None = None) -> None:
        self.interval_s = 1 / max_fps if max_fps else 0.0
        self._rate = Rate()
        self._newest: bytes | None = None
        self._came = asyncio.Event()
        self._ended: Exception | None = None
        self.missed = 0
        self.taken = 0

    def offer(self, message: bytes, now: float) -> None:
        """Give it a new message; the one before it is forgotten if it was not taken yet."""
        if not self._rate.is_due(now, self.interval_s):
            return
        if self._newest is not None:
            self.missed += 1
        self._newest = message
        self._came.set()

    def end(self, reason: Exception) -> None:
        """Say that there will be no more; next() raises the reason."""
        self._ended = reason
        self._came.set()

    async def next(self, timeout_s: float | None = None) -> bytes:
        """Return the newest message not taken yet, or the next; TimeoutError when none comes."""
        while self._newest is None:
            if self._ended is not None:
                raise self._ended
            await asyncio.wait_for(self._came.wait(), timeout_s)
        message, self._newest = self._newest, None
        if self._ended is None:
            self._came.clear()
        self.taken += 1
        return message

    def take(self) -> bytes | None:
        """Return the newest message not taken yet, without waiting."""
        message, self._newest = self._newest, None
        if message is not None and self._ended is None:
            self._came.clear()
        return message

    def __aiter__(self) -> Self:
        return self

    async def __anext__(self) -> bytes:
        return await self.next()
