"""In the server: who watches which stream of a camera, and the newest picture of each.

A viewer has a slot for the newest message. Nobody queues, and a slow one misses frames.
"""

import asyncio
import contextlib
from collections.abc import Callable, Iterator
from dataclasses import asdict
from typing import Any, Self

from touchline.core.errors import Unavailable
from touchline.core.statements import say
from touchline.live.messages import Rate, StreamSpec

MAX_STREAMS = 16  # different pictures encoded at once


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
            async with asyncio.timeout(timeout_s):
                await self._came.wait()
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


class Streams:
    """Only for the event loop's own thread. changed: called when the camera's process must know to_json() anew."""

    def __init__(self, changed: Callable[[], None]) -> None:
        self._changed = changed
        self._viewers: dict[StreamSpec, set[Viewer]] = {}
        self._numbers: dict[StreamSpec, int] = {}
        self._last_number = 0
        self._newest: dict[int, bytes] = {}
        self._ended: Exception | None = None

    @property
    def viewer_count(self) -> int:
        return sum(len(viewers) for viewers in self._viewers.values())

    @contextlib.contextmanager
    def watching(self, spec: StreamSpec, max_fps: float | None = None) -> Iterator[Viewer]:
        """Yield a viewer of a stream; it is encoded only while somebody watches."""
        if spec not in self._viewers:
            if len(self._viewers) >= MAX_STREAMS:
                raise Unavailable(
                    say(
                        "stream.too-many",
                        "This camera is streamed at too many sizes and qualities.",
                    ),
                    say("stream.use-common-width", "Use a width that others use, such as 960."),
                    reason="too-many-channels",
                )
            self._last_number += 1
            self._viewers[spec], self._numbers[spec] = set(), self._last_number
        viewer = Viewer(max_fps)
        self._viewers[spec].add(viewer)
        newest = self._newest.get(self._numbers[spec])
        if newest is not None:
            viewer.offer(newest, asyncio.get_running_loop().time())
        if self._ended is not None:
            viewer.end(self._ended)
        self._changed()
        try:
            yield viewer
        finally:
            self._viewers[spec].discard(viewer)
            if not self._viewers[spec]:
                del self._viewers[spec]
                self._newest.pop(self._numbers.pop(spec), None)
            self._changed()

    def publish(self, number: int, body: bytes, now: float) -> None:
        """Hand a new picture to whoever watches that stream."""
        self._newest[number] = body
        for spec, known in self._numbers.items():
            if known == number:
                for viewer in self._viewers[spec]:
                    viewer.offer(body, now)

    def clear(self) -> None:
        """Forget the newest pictures: they are of a process that has ended."""
        self._newest.clear()

    def end(self, reason: Exception) -> None:
        """End all watching, also of those who come later: their request may have been on its way."""
        self._ended = reason
        for viewer in [viewer for viewers in self._viewers.values() for viewer in viewers]:
            viewer.end(reason)

    def to_json(self) -> list[dict[str, Any]]:
        """Return what the process is to encode."""
        return [
            {
                "number": self._numbers[spec],
                "spec": asdict(spec),
                "interval_s": min(viewer.interval_s for viewer in viewers),
            }
            for spec, viewers in self._viewers.items()
        ]
