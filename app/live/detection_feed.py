"""In the server: what a camera is to see, who listens, and what it saw last; its process does the seeing.

Each SEEN message is passed on as it came: the server reads none of it but a packet that goes to the network.
"""

import asyncio
import contextlib
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from app.core.errors import Conflict, NotFound, TouchlineError, Unavailable
from app.live import messages
from app.live.stream_spec import DETECTIONS, StreamSpec
from app.live.viewer import Viewer

OFF: dict[str, Any] = {"on": False, "plan": None, "profile": None, "publish": False, "camera_number": 0,
                       "extent_mm": 1.0}
Publish = Callable[[bytes], TouchlineError | None]


class DetectionFeed:
    """Only for the event loop's own thread.

    tell: called when the process must know message() anew. publish: takes a packet; why it did not leave, or None.
    """

    def __init__(self, tell: Callable[[], None], publish: Publish = lambda _packet: None) -> None:
        self._tell, self._publish = tell, publish
        self.wanted: Mapping[str, Any] = OFF
        self.learned: dict[str, Any] | None = None
        self.packets = 0
        self.problem: TouchlineError | None = None
        self._viewers: set[Viewer] = set()

    def follow(self, wanted: Mapping[str, Any]) -> None:
        """See this from now on: {"on", "plan", "profile", "publish", "camera_number", "extent_mm"}."""
        if dict(wanted) == dict(self.wanted):
            return
        if (wanted["plan"], wanted["profile"]) != (self.wanted["plan"], self.wanted["profile"]):
            self.learned = None
        self.wanted, self.problem = dict(wanted), None
        if not wanted["on"]:
            self._end_viewers(_off())
        self._tell()

    def message(self) -> dict[str, Any]:
        """What the process must know."""
        return {**self.wanted, "run": bool(self._viewers) or self.wanted["publish"]}

    def require_view(self, channel_view: str) -> None:
        """Conflict or NotFound, with what to do, where that view of what is seen cannot be had now."""
        if not self.wanted["on"]:
            raise _off()
        name = StreamSpec.requested(channel_view).stage
        stages = [stage["stage"] for stage in self.wanted["plan"]["stages"]]
        if channel_view != DETECTIONS and name not in stages:
            raise NotFound(f"This camera's plan has no stage called {name!r}.", f"Use one of: {', '.join(stages)}.",
                           reason="unknown-stage")

    @contextlib.contextmanager
    def listening(self, most_fps: float | None = None) -> Iterator[Viewer]:
        """Every frame's message as it came, as long as the context lasts."""
        if not self.wanted["on"]:
            raise _off()
        viewer = Viewer(most_fps)
        self._viewers.add(viewer)
        self._tell()
        try:
            yield viewer
        finally:
            self._viewers.discard(viewer)
            self._tell()

    def heard(self, body: bytes) -> None:
        """A SEEN message came."""
        now = asyncio.get_running_loop().time()
        for viewer in self._viewers:
            viewer.offer(body, now)
        packet = messages.payload(body)
        if len(packet) and self.wanted["publish"]:
            self.problem = self._publish(bytes(packet))
            self.packets += self.problem is None

    def told(self, status: Mapping[str, Any]) -> None:
        """The process says how its seeing is: the colours that it found in the picture."""
        self.learned = (status.get("seeing") or {}).get("learned") if self.wanted["profile"] is None else None

    def end(self) -> None:
        """The camera was changed or removed."""
        self._end_viewers(Unavailable("This camera was changed or removed.", "Open it again.", reason="camera-gone"))

    def _end_viewers(self, why: TouchlineError) -> None:
        for viewer in self._viewers:
            viewer.end(why)


def json_text(body: bytes) -> str:
    """A message's JSON, unread."""
    (length,) = messages.LENGTH.unpack_from(body)
    return body[messages.LENGTH.size:messages.LENGTH.size + length].decode("ascii")


def _off() -> Conflict:
    return Conflict("Seeing is switched off for this camera.", "Switch it on: PUT /api/v1/cameras/{id}/seeing with "
                    '"on": true.', reason="seeing-off")
