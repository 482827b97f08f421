"""All cameras of a server: each is woken when it is first asked for, and stays awake until the server ends."""

import asyncio
from collections.abc import Callable
from typing import Any

from app.core.records import Calibration
from app.live.camera import LiveCamera, Trust
from app.live.detection_feed import OFF, Publish
from app.sources import Identity

Spec = Callable[[str], dict[str, Any]]
Kept = Callable[[str], tuple[Calibration | None, Identity | None]]
Picture = Callable[[Calibration], dict[str, Any] | None]
Seen = Callable[[str], dict[str, Any]]


class LiveCameras:
    """Only for the event loop's own thread.

    spec: what a camera's process must know, by the camera's id; NotFound for an unknown one. kept: its active
    calibration, and the evidence of which camera that was made for. trust: see LiveCamera. picture: where the picture
    stands that a calibration came from, {"name", "path", "sha256"}; None where it is not kept. seen: what a camera is
    to see, by its id. publish: takes the packets of what was seen.
    """

    def __init__(self, spec: Spec, kept: Kept, trust: Trust, picture: Picture = lambda _calibration: None,
                 seen: Seen = lambda _id: OFF, publish: Publish = lambda _packet: None) -> None:
        self._spec = spec
        self._kept = kept
        self._trust = trust
        self._picture = picture
        self._seen = seen
        self._publish = publish
        self._live: dict[str, LiveCamera] = {}

    def get(self, id: str) -> LiveCamera:
        """One camera, woken; NotFound."""
        if id not in self._live:
            camera = LiveCamera(id, self._spec(id), self._trust, self._publish)
            self._show(camera)
            camera.start()
            self._live[id] = camera
        return self._live[id]

    def get_running(self, id: str) -> LiveCamera | None:
        """The same, without waking it."""
        return self._live.get(id)

    def refresh(self, id: str) -> None:
        """Its active calibration, its evidence or what it is to see has changed."""
        if camera := self._live.get(id):
            self._show(camera)

    def _show(self, camera: LiveCamera) -> None:
        calibration, confirmed = self._kept(camera.id)
        camera.show(calibration, confirmed, calibration and self._picture(calibration))
        camera.detections.follow(self._seen(camera.id))

    async def forget(self, id: str) -> None:
        """It was changed or removed: end its process; get() starts it anew with what is known then."""
        if camera := self._live.pop(id, None):
            await camera.stop()

    async def aclose(self) -> None:
        live, self._live = self._live, {}
        await asyncio.gather(*(camera.stop() for camera in live.values()))
