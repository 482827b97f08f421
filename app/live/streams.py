"""In the server: who watches which stream of a camera, and the newest picture of each."""

import asyncio
import contextlib
from collections.abc import Callable, Iterator
from dataclasses import asdict
from typing import Any

from app.core.errors import Unavailable
from app.core.statements import say
from app.live.stream_spec import StreamSpec
from app.live.viewer import Viewer

MAX_STREAMS = 16  # different pictures encoded at once


class Streams:
    """Only for the event loop's own thread. changed: called when the camera's process must know to_json() anew."""

    def __init__(self, changed: Callable[[], None]) -> None:
        self._changed = changed
        self._viewers: dict[StreamSpec, set[Viewer]] = {}
        self._numbers: dict[StreamSpec, int] = {}
        self._last_number = 0
        self._newest: dict[int, bytes] = {}

    @property
    def viewer_count(self) -> int:
        return sum(len(viewers) for viewers in self._viewers.values())

    @contextlib.contextmanager
    def watching(self, spec: StreamSpec, max_fps: float | None = None) -> Iterator[Viewer]:
        """Yield a viewer of a stream; it is encoded only while somebody watches."""
        if spec not in self._viewers:
            if len(self._viewers) >= MAX_STREAMS:
                raise Unavailable(say("stream.too-many", "This camera is streamed at too many sizes and qualities."),
                                  say("stream.use-common-width", "Use a width that others use, such as 960."),
                                  reason="too-many-channels")
            self._last_number += 1
            self._viewers[spec], self._numbers[spec] = set(), self._last_number
        viewer = Viewer(max_fps)
        self._viewers[spec].add(viewer)
        newest = self._newest.get(self._numbers[spec])
        if newest is not None:
            viewer.offer(newest, asyncio.get_running_loop().time())
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
        for viewer in [viewer for viewers in self._viewers.values() for viewer in viewers]:
            viewer.end(reason)

    def to_json(self) -> list[dict[str, Any]]:
        """Return what the process is to encode."""
        return [{"number": self._numbers[spec], "spec": asdict(spec),
                 "interval_s": min(viewer.interval_s for viewer in viewers)}
                for spec, viewers in self._viewers.items()]
