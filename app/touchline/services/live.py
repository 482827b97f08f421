"""Live cameras of the server: each is started when it is calibrated or first asked for; and frames taken from one."""

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from typing import Any, TypeVar

from touchline.core.errors import TouchlineError, Unavailable
from touchline.core.geometry import ImageSize
from touchline.core.records import Calibration
from touchline.core.sentences import TRY_AGAIN
from touchline.core.statements import say, sentence_in
from touchline.live.camera import SEEN, LiveCamera, MakeFeed, Trust
from touchline.live.messages import CameraStatus
from touchline.services.cameras import CameraService
from touchline.sources import Identity
from touchline.store.snapshots import Snapshot
from touchline.store.store import Store

SpecOf = Callable[[str], dict[str, Any]]
CalibrationOf = Callable[[str], tuple[Calibration | None, Identity | None]]
PictureOf = Callable[[Calibration], dict[str, Any] | None]

T = TypeVar("T")
FIRST_FRAME_S = 5.0  # a camera that was asleep gets so long to show its first frame
# the background of many frames of a slow camera, or several cameras that wake up at once
SNAPSHOT_S = 20.0
log = logging.getLogger("touchline")


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
            # versions may have been made for a camera that is not here
            with suppress(TouchlineError):
                self.get(id)

    def _show(self, camera: LiveCamera) -> None:
        calibration, confirmed = self.calibration(camera.id)
        camera.show(
            calibration, confirmed, None if calibration is None else self.picture(calibration)
        )
        camera.refresh()

    async def forget(self, id: str) -> None:
        """End its process, since it was changed or removed; get() starts it anew with what is known then."""
        if camera := self._live.pop(id, None):
            await camera.stop()

    async def aclose(self) -> None:
        live, self._live = self._live, {}
        await asyncio.gather(*(camera.stop() for camera in live.values()))


@dataclass(frozen=True)
class TakenFrame:
    """One exact frame of a live camera. head: what its process says of it: seq, time, width, height."""

    camera: LiveCamera
    head: dict[str, Any]
    png: bytes

    def save(self, store: Store, purpose: str) -> Snapshot:
        """Keep it with the evidence of which device took it, so that no other gets its calibration."""
        size = ImageSize(self.head["width"], self.head["height"])
        snapshot = store.snapshots.add(self.png, size, "png", self.camera.id, purpose)
        if self.camera.identity is not None:
            store.identities.confirm(snapshot.id, asdict(self.camera.identity))
        return snapshot


async def take_frame(
    camera: LiveCamera, timeout_s: float = SNAPSHOT_S, frames: int = 1, over_s: float = 0.0
) -> TakenFrame:
    """Take a frame, or the background of several spread over over_s; Unavailable says what is wrong."""
    head, png = await when_awake(
        camera, lambda left_s: camera.still(frames, left_s, over_s), timeout_s
    )
    return TakenFrame(camera, head, png)


async def when_awake(
    camera: LiveCamera,
    take: Callable[[float], Awaitable[T]],
    timeout_s: float = FIRST_FRAME_S,
    *,
    must_be_live: bool = False,
) -> T:
    """Call take with the seconds left, on a camera that may have been asleep; Unavailable says what is wrong.

    must_be_live: the last frame of a camera that delivers none any more is not wanted.
    """
    end = time.monotonic() + timeout_s

    def is_awake() -> bool:
        status = camera.status()
        return status["state"] in SEEN if must_be_live else status["seq"] not in (None, 0)

    while not is_awake() and time.monotonic() < end:
        if camera.status()["state"] == "offline":  # it says itself what is wrong
            raise _silent(camera)
        await asyncio.sleep(0.05)
    if must_be_live and not is_awake():
        raise _silent(camera)
    try:
        return await take(max(1.0, end - time.monotonic()))
    except (TimeoutError, Unavailable):
        raise _silent(camera) from None


def _silent(camera: LiveCamera) -> Unavailable:
    problem = camera.status()["problem"] or {
        "what": say("camera.no-frame-yet", "This camera has not delivered a frame yet."),
        "fix": TRY_AGAIN,
        "reason": "camera-silent",
    }
    return Unavailable(
        sentence_in(problem, "what"), sentence_in(problem, "fix"), reason=problem["reason"]
    )


def start_live_cameras(
    cameras: CameraService, feeds: Mapping[int, MakeFeed], wake: bool = True
) -> LiveCameras:
    """Make the live cameras. wake: those with an active calibration at once, not only when they are asked for."""
    tasks: set[asyncio.Task[None]] = set()

    async def save_identity(calibration: Calibration, identity: Identity) -> None:
        try:
            await asyncio.to_thread(cameras.confirm, calibration, identity)
        except Exception:
            log.exception(
                "the camera's identity could not be saved; it is asked for again after a restart"
            )

    def trust(calibration: Calibration, identity: Identity) -> None:
        task = asyncio.create_task(save_identity(calibration, identity))
        tasks.add(task)
        task.add_done_callback(tasks.discard)

    live = LiveCameras(
        cameras.process_spec, cameras.active_calibration, trust, cameras.calibration_picture, feeds
    )
    for camera in cameras.all() if wake else ():
        live.refresh(camera.id)
    return live
