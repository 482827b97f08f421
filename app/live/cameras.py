"""All cameras of a server: each is woken when it is first asked for, and stays awake until the server ends."""

import asyncio
from collections.abc import Callable
from typing import Any

from app.live.camera import LiveCamera, Trust
from app.records import Calibration
from app.sources import Identity

Spec = Callable[[str], dict[str, Any]]
Kept = Callable[[str], tuple[Calibration | None, Identity | None]]


class LiveCameras:
    """Only for the event loop's own thread.

    spec: what a camera's process must know, by the camera's id; NotFound for an unknown one. kept: its active
    calibration, and the evidence of which camera that was made for. trust: see LiveCamera.
    """

    def __init__(self, spec: Spec, kept: Kept, trust: Trust) -> None:
        self._spec = spec
        self._kept = kept
        self._trust = trust
        self._live: dict[str, LiveCamera] = {}

    def get(self, id: str) -> LiveCamera:
        """One camera, woken; NotFound."""
        if id not in self._live:
            camera = LiveCamera(id, self._spec(id), self._trust)
            camera.show(*self._kept(id))
            camera.start()
            self._live[id] = camera
        return self._live[id]

    def awake(self, id: str) -> LiveCamera | None:
        """The same, without waking it."""
        return self._live.get(id)

    def refresh(self, id: str) -> None:
        """Its active calibration or its evidence has changed."""
        if camera := self._live.get(id):
            camera.show(*self._kept(id))

    async def forget(self, id: str) -> None:
        """It was changed or removed: end its process; get() starts it anew with what is known then."""
        if camera := self._live.pop(id, None):
            await camera.stop()

    async def aclose(self) -> None:
        live, self._live = self._live, {}
        await asyncio.gather(*(camera.stop() for camera in live.values()))
