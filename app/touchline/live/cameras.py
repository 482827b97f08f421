"""All cameras of a server: each is started when it is calibrated or first asked for, and runs until the server ends."""

import asyncio
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from touchline.core.errors import TouchlineError
from touchline.core.records import Calibration
from touchline.live.camera import LiveCamera, MakeFeed, Trust
from touchline.live.status_types import CameraStatus
from touchline.sources import Identity

SpecOf = Callable[[str], dict[str, Any]]
CalibrationOf = Callable[[str], tuple[Calibration | None, Identity | None]]
PictureOf = Callable[[Calibration], dict[str, Any] | None]


@dataclass
class LiveCameras:
    """Only for the event loop's own thread.

    spec: what a camera's process must know, by the camera's id; NotFound for an unknown one. calibration: its active
    calibration, and the evidence of which camera that was made for. trust: see LiveCamera. picture: where the picture
    is stored that a calibration came from, {"name", "path", "sha256"}; None where it is not. feeds: see LiveCamera.
    """

    spec: SpecOf
    calibration: CalibrationOf
    trust: Trust
    picture: PictureOf = lambda _calibration: None
    feeds: Mapping[int, MakeFeed] = field(default_factory=dict)
    _live: dict[str, LiveCamera] = field(default_factory=dict, init=False)

    def get(self, id: str) -> LiveCamera:
        """Return one camera, started if it was not; NotFound."""
        if id not in self._live:
            camera = LiveCamera(id, self.spec(id), self.trust, self.feeds)
            self._show(camera)
            camera.start()
            self._live[id] = camera
        return self._live[id]

    def get_running(self, id: str) -> LiveCamera | None:
        """Return the same; None where it was not started."""
        return self._live.get(id)

    @property
    def running(self) -> tuple[str, ...]:
        """The ids of those that were started."""
        return tuple(self._live)

    def status(self, id: str) -> CameraStatus:
        """Return one camera's status now, without starting it: its state is "idle" where it was not started."""
        return (self._live.get(id) or LiveCamera(id, {})).status()

    def refresh(self, id: str) -> None:
        """Note that its active calibration, its evidence or other settings of it have changed.

        One that has a calibration is started: whether it still stands as it did is watched though nobody looks.
        """
        if camera := self._live.get(id):
            self._show(camera)
        elif self.calibration(id)[0] is not None:
            with suppress(TouchlineError):  # versions may have been made for a camera that is not here
                self.get(id)

    def _show(self, camera: LiveCamera) -> None:
        calibration, confirmed = self.calibration(camera.id)
        camera.show(calibration, confirmed, None if calibration is None else self.picture(calibration))
        camera.refresh()

    async def forget(self, id: str) -> None:
        """End its process, since it was changed or removed; get() starts it anew with what is known then."""
        if camera := self._live.pop(id, None):
            await camera.stop()

    async def aclose(self) -> None:
        live, self._live = self._live, {}
        await asyncio.gather(*(camera.stop() for camera in live.values()))
