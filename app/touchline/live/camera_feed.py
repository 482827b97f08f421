"""In the server: what a capability has of one live camera, the other half of its part in the camera's process."""

import asyncio
import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, ClassVar

from touchline.core.errors import TouchlineError
from touchline.core.json_values import JsonObject
from touchline.live.streams import Viewer


class CameraFeed:
    """The settings that its part follows, and what the part sends, for whoever listens.

    Only for the event loop's own thread. A feed overrides what it needs. NAME: by which a camera's feeds are known.
    views: of the camera's streams, those that its part draws.
    """

    NAME: ClassVar[str]
    views: Sequence[str] = ()

    def __init__(self, services: Any, camera: str, changed: Callable[[], None]) -> None:
        """services: the running server's Services. changed: called when the part must know settings() anew."""
        self.services, self.camera, self.changed = services, camera, changed
        self.viewers: set[Viewer] = set()

    def refresh(self) -> None:
        """Note that what is saved of the camera may have changed: its settings, its calibration."""

    def settings(self) -> JsonObject:
        """Return what the part is to follow."""
        return {}

    def require_view(self, view: str) -> None:
        """Raise Conflict or NotFound, with what to do, where one of its views cannot be had now."""

    def require_listening(self) -> None:
        """Raise Conflict, with what to do, where there is nothing to listen to now."""

    @contextlib.contextmanager
    def listening(self, max_fps: float | None = None) -> Iterator[Viewer]:
        """Yield a viewer of every message of the part, as it came."""
        self.require_listening()
        viewer = Viewer(max_fps)
        self.viewers.add(viewer)
        self.changed()
        try:
            yield viewer
        finally:
            self.viewers.discard(viewer)
            self.changed()

    def receive(self, body: bytes) -> None:
        """Pass on a message of the part."""
        now = asyncio.get_running_loop().time()
        for viewer in self.viewers:
            viewer.offer(body, now)

    def update_status(self, status: Mapping[str, Any]) -> None:
        """Note the newest report of the camera's process."""

    def end(self, why: TouchlineError) -> None:
        """End all listening."""
        for viewer in self.viewers:
            viewer.end(why)
