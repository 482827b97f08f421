"""Live cameras of the server, and frames taken from one that may have been asleep."""

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, TypeVar

from touchline.core.errors import Unavailable
from touchline.core.geometry import ImageSize
from touchline.core.records import Calibration
from touchline.core.sentences import TRY_AGAIN
from touchline.core.statements import say, sentence_in
from touchline.live.camera import SEEN, LiveCamera, MakeFeed
from touchline.live.cameras import LiveCameras
from touchline.services.cameras import CameraService
from touchline.sources import Identity
from touchline.store.snapshots import Snapshot
from touchline.store.store import Store

T = TypeVar("T")
FIRST_FRAME_S = 5.0  # a camera that was asleep gets so long to show its first frame
SNAPSHOT_S = 20.0  # the background of many frames of a slow camera, or several cameras that wake up at once
log = logging.getLogger("touchline")


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


async def take_frame(camera: LiveCamera, timeout_s: float = SNAPSHOT_S, frames: int = 1,
                     over_s: float = 0.0) -> TakenFrame:
    """Take a frame, or the background of several spread over over_s; Unavailable says what is wrong."""
    head, png = await when_awake(camera, lambda left_s: camera.still(frames, left_s, over_s), timeout_s)
    return TakenFrame(camera, head, png)


async def when_awake(camera: LiveCamera, take: Callable[[float], Awaitable[T]], timeout_s: float = FIRST_FRAME_S, *,
                     must_be_live: bool = False) -> T:
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
        "what": say("camera.no-frame-yet", "This camera has not delivered a frame yet."), "fix": TRY_AGAIN,
        "reason": "camera-silent"}
    return Unavailable(sentence_in(problem, "what"), sentence_in(problem, "fix"), reason=problem["reason"])


def start_live_cameras(cameras: CameraService, feeds: Mapping[int, MakeFeed], wake: bool = True) -> LiveCameras:
    """Make the live cameras. wake: those with an active calibration at once, not only when they are asked for."""
    tasks: set[asyncio.Task[None]] = set()

    async def save_identity(calibration: Calibration, identity: Identity) -> None:
        try:
            await asyncio.to_thread(cameras.confirm, calibration, identity)
        except Exception:
            log.exception("the camera's identity could not be saved; it is asked for again after a restart")

    def trust(calibration: Calibration, identity: Identity) -> None:
        task = asyncio.create_task(save_identity(calibration, identity))
        tasks.add(task)
        task.add_done_callback(tasks.discard)

    live = LiveCameras(cameras.process_spec, cameras.active_calibration, trust, cameras.calibration_picture, feeds)
    for camera in cameras.all() if wake else ():
        live.refresh(camera.id)
    return live
