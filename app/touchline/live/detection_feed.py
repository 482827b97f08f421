"""In the server: what a camera is to detect, and who listens; its process does the detecting.

Each DETECTIONS message is passed on as it came: the server reads none of it but a packet that goes to the network.
"""

import asyncio
import contextlib
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from touchline.core.colour_profile import ProfileJson
from touchline.core.common_sentences import use_one_of
from touchline.core.errors import Conflict, NotFound, TouchlineError
from touchline.core.statements import say
from touchline.live.status_types import ProcessValues
from touchline.live.stream_spec import DETECTIONS, StreamSpec
from touchline.live.streams import Viewer
from touchline.processes.framing import split_body

OFF: dict[str, Any] = {"on": False, "plan": None, "profile": None, "publish": False, "camera_number": 0,
                       "extent_mm": 1.0}
Publish = Callable[[bytes], TouchlineError | None]


class DetectionFeed:
    """Only for the event loop's own thread.

    changed: called when the process must know message() anew. publish: takes a packet; returns why it did not leave.
    """

    def __init__(self, changed: Callable[[], None], publish: Publish = lambda _packet: None) -> None:
        self._changed, self._publish = changed, publish
        self.request: Mapping[str, Any] = OFF
        self.learned: ProfileJson | None = None
        self.packets = 0
        self.problem: TouchlineError | None = None
        self._viewers: set[Viewer] = set()

    def follow(self, request: Mapping[str, Any]) -> None:
        """Detect this from now on: {"on", "plan", "profile", "publish", "camera_number", "extent_mm"}."""
        if dict(request) == dict(self.request):
            return
        if (request["plan"], request["profile"]) != (self.request["plan"], self.request["profile"]):
            self.learned = None
        self.request, self.problem = dict(request), None
        if not request["on"]:
            self.end(_off())
        self._changed()

    def message(self) -> dict[str, Any]:
        """Return what the process must know."""
        return {**self.request, "run": bool(self._viewers) or self.request["publish"]}

    def require_view(self, view: str) -> None:
        """Raise Conflict or NotFound, with what to do, where that view of the detections cannot be had now."""
        if not self.request["on"]:
            raise _off()
        name = StreamSpec.requested(view).stage
        stages = [stage["stage"] for stage in self.request["plan"]["stages"]]
        if view != DETECTIONS and name not in stages:
            raise NotFound(say("detection.unknown-stage", "This camera's plan has no stage called {stage!r}.",
                               stage=name), use_one_of(stages), reason="unknown-stage")

    @contextlib.contextmanager
    def listening(self, max_fps: float | None = None) -> Iterator[Viewer]:
        """Yield a viewer of every frame's message, as it came."""
        if not self.request["on"]:
            raise _off()
        viewer = Viewer(max_fps)
        self._viewers.add(viewer)
        self._changed()
        try:
            yield viewer
        finally:
            self._viewers.discard(viewer)
            self._changed()

    def receive(self, body: bytes) -> None:
        """Pass on a DETECTIONS message."""
        now = asyncio.get_running_loop().time()
        for viewer in self._viewers:
            viewer.offer(body, now)
        _, packet = split_body(body)
        if len(packet) and self.request["publish"]:
            self.problem = self._publish(bytes(packet))
            self.packets += self.problem is None

    def update_status(self, status: ProcessValues) -> None:
        """Note the colours that the process found in the picture."""
        self.learned = status["detector"]["learned"] if self.request["profile"] is None else None

    def end(self, why: TouchlineError) -> None:
        """End all listening."""
        for viewer in self._viewers:
            viewer.end(why)


def json_text(body: bytes) -> str:
    """Return a message's JSON, not parsed."""
    text, _ = split_body(body)
    return str(text, "ascii")


def _off() -> Conflict:
    return Conflict(say("detection.off", "Object detection is off for this camera."),
                    say("detection.enable", 'Enable it: PUT /api/v1/cameras/{{id}}/seeing with "on": true.'),
                    reason="seeing-off")
