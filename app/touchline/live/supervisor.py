"""In the server: a camera's process kept alive, started anew when no frame comes; and how the camera is by it."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Self

from touchline.core.drift_status import CameraDrift
from touchline.core.errors import ProblemJson, TouchlineError, Unavailable
from touchline.core.geometry import ImageSize
from touchline.core.sentences import CHECK_STATE_TRY_AGAIN, FREE_MEMORY, SET_RESOLUTION, TRY_AGAIN
from touchline.core.statements import Sentence, say, stated
from touchline.live import messages
from touchline.live.messages import ProcessValues
from touchline.processes.async_process import AsyncProcess
from touchline.processes.framing import Message, decode_body
from touchline.processes.start import Program
from touchline.sources import Identity
from touchline.vision.zones import LONG_S, Still

STALL_S = 1.5  # without a frame; a slow camera gets four of its own intervals
KILL_AFTER_S = 0.5  # more, and its process is ended and started anew
OPEN_S = 15.0  # an industrial camera may take some seconds to be found
FROZEN_S = 3.0  # a sensor's noise never stays the same so long, where each picture comes whole
INTERVALS = 4
UNKNOWN_S = 6.0  # a camera of which one picture came may send one every second or two
STATIC_SOURCES = ("picture", "folder", "video", "sim")  # sources whose pictures may stay the same
CODED_SOURCES = (
    "rtsp",
    "rtp",
    "udp",
)  # sources whose pictures may stay the same up to the next key frame:
FROZEN_CODED_S = 60.0
# of a picture: coded anew from a frozen one, a quarter to all of it stays the same
SHARE_IN_DOUBT = 0.2
NO_NOISE_FIX = say(
    "camera.no-noise.fix",
    "If the camera still delivers new images, set it to less compression and to "
    "key frames every few seconds; otherwise restart it.",
)

MEMORY_BYTES = 6 << 30  # of addresses; FFmpeg and camera libraries reserve much more than they use
RETRY_S, MAX_RETRY_S = 0.5, 5.0
POLL_S = 0.1
LATE_S = 0.5  # the event loop itself was held up: what the camera sent meanwhile lies unread


@dataclass(frozen=True)
class ProcessStatus:
    """The last status that a camera's process sent, and when it came on the server's clock."""

    values: ProcessValues
    received_s: float

    @classmethod
    def initial(cls, now: float) -> Self:
        """Return the status of a process that has sent none yet."""
        return cls(
            {
                "state": "connecting",
                "problem": None,
                "since_s": 0.0,
                "seq": 0,
                "interval_s": 0.0,
                "identity": None,
                "reopened": 0,
                "age_s": None,
                "size": None,
                "encoded": 0,
                "quality": None,
                "drift": None,
                "failures": {"count": 0, "newest": None},
            },
            now,
        )

    def updated(self, values: Any, now: float) -> "ProcessStatus":
        """Return what it is by the newest report, as JSON."""
        return ProcessStatus({**self.values, **values}, now)

    def frame_age_s(self, now: float) -> float | None:
        age_s = self.values["age_s"]
        return None if age_s is None else age_s + (now - self.received_s)

    @property
    def stall_s(self) -> float:
        interval_s = self.values["interval_s"]
        return max(STALL_S, INTERVALS * interval_s) if interval_s else UNKNOWN_S

    @property
    def size(self) -> ImageSize | None:
        return ImageSize(*self.values["size"]) if self.values["size"] else None

    @property
    def identity(self) -> Identity | None:
        return Identity(**self.values["identity"]) if self.values["identity"] else None


def stall_reason(status: ProcessStatus, now: float, grace_s: float = 0.0) -> Sentence | None:
    """Say why it counts as stalled; None while it does not. grace_s: so much longer than usual."""
    state, silent_s, age_s = (
        status.values["state"],
        now - status.received_s,
        status.frame_age_s(now),
    )
    # A camera maker's library may hold up the whole process while it looks for its cameras.
    if silent_s > (STALL_S if state == "live" else UNKNOWN_S) + grace_s:
        return say("camera.process-silent", "The camera process is not responding.")
    if state == "live" and age_s is not None and age_s > status.stall_s + grace_s:
        return say("camera.no-frame", "No frame received for {seconds:.1f} s.", seconds=age_s)
    if state == "connecting" and status.values["since_s"] + silent_s > OPEN_S + grace_s:
        return say(
            "camera.no-response", "The camera has not responded for {seconds:g} s.", seconds=OPEN_S
        )
    return None


def frozen_reason(status: ProcessStatus, scheme: str) -> Sentence | None:
    """Say why it counts as showing an old picture again and again; None where it does not."""
    still = _still(status, scheme)
    if still is None:
        return None
    if still["all_s"] >= (FROZEN_CODED_S if scheme in CODED_SOURCES else FROZEN_S):
        return say(
            "camera.picture-frozen",
            "The picture has not changed for {seconds:.0f} s.",
            seconds=still["all_s"],
        )
    if scheme not in CODED_SOURCES and still["had_noise"] and (still["most_s"] or 0.0) >= LONG_S:
        return say(
            "camera.picture-frozen-but",
            "The picture has not changed for {seconds:.0f} s, except in a small part.",
            seconds=still["most_s"],
        )
    return None


def frozen_doubt(status: ProcessStatus, scheme: str) -> Sentence | None:
    """Say why nobody can know whether its picture is frozen; None where it is seen to change."""
    still = _still(status, scheme)
    if still is None or still["share"] < SHARE_IN_DOUBT:
        return None
    return say(
        "camera.no-noise",
        "{share:.0f} % of the picture has not changed for {seconds:.0f} s: a frozen picture "
        "looks the same. Movement of the camera cannot be detected.",
        share=100 * still["share"],
        seconds=LONG_S,
    )


def unmonitored(drift: CameraDrift, why: Sentence) -> CameraDrift:
    """Return what is known of a camera's drift where nobody can know whether its picture is frozen; alarms stay."""
    if drift["alarm"]:
        return {**drift, "monitored": False}
    return stated(
        CameraDrift(
            **{
                **drift,
                "state": "unfollowed",
                "monitored": False,
                "px": None,
                "mm": None,
                "sigma_px": None,
                "sigma_mm": None,
                "sentence": why,
                "fix": NO_NOISE_FIX,
            }
        )
    )


def _still(status: ProcessStatus, scheme: str) -> Still | None:
    quality = status.values["quality"]
    return None if quality is None or scheme in STATIC_SOURCES else quality["still"]


def calibration_mismatch(
    status: ProcessStatus, confirmed: Identity | None, image_size: ImageSize | None
) -> ProblemJson | None:
    """Return the problem where the calibration belongs to another camera or another size; None where it fits."""
    size, identity = status.size, status.identity
    if size is not None and image_size is not None and size != image_size:
        return camera_problem(
            "other-size",
            say(
                "camera.other-size",
                "The camera sends {size}; its calibration is for {wanted}.",
                size=size,
                wanted=image_size,
            ),
            SET_RESOLUTION,
        )
    if image_size is None or confirmed is None or identity is None:
        return None
    difference = identity.differs_from(confirmed)
    return (
        None
        if difference is None
        else camera_problem(
            "other-camera",
            say(
                "camera.other-camera",
                "This may not be the camera that was calibrated: {difference}.",
                difference=difference,
            ),
            say(
                "camera.confirm-or-calibrate",
                "Check the picture. Confirm it if it is the same camera in the same "
                "position, or calibrate it again.",
            ),
        )
    )


def camera_problem(reason: str, what: str, fix: str) -> ProblemJson:
    return stated(ProblemJson(reason=reason, what=what, fix=fix))


class CameraProcess(AsyncProcess):
    """What a camera sends is a stranger's, and may make this process die, never the server."""

    PROGRAM = Program("touchline.live.worker_main:main", MEMORY_BYTES)
    START_S = 30.0  # importing OpenCV takes 0.3 s, on a busy small machine some seconds
    CANNOT_START = (
        say("camera.process-cannot-start", "The camera process cannot be started."),
        say("camera.free-memory", "Free some memory."),
        "camera-process",
    )
    NOT_READY = (
        say("camera.process-not-ready", "The camera process does not start."),
        FREE_MEMORY,
        "camera-process",
    )
    SILENT = (
        say("camera.silent", "The camera is not responding."),
        CHECK_STATE_TRY_AGAIN,
        "camera-silent",
    )
    ENDED = say("camera.process-ended", "The camera process has ended."), TRY_AGAIN, "camera-silent"


class CameraSupervisor:
    """Only for the event loop's own thread.

    spec: the process' arguments. on_start: called when a process was started, to send it what it must know. on_message:
    called with each message.
    """

    def __init__(
        self,
        name: str,
        spec: dict[str, Any],
        on_start: Callable[[], None],
        on_message: Callable[[Message], None],
    ) -> None:
        self._name, self._spec, self._on_start, self._on_message = name, spec, on_start, on_message
        self.restarts = 0
        self.status: ProcessStatus | None = None  # None until the first process has started
        self.problem: ProblemJson | None = None  # why no process could be started last
        self._process: CameraProcess | None = None
        self._task: asyncio.Task[None] | None = None

    @property
    def started(self) -> bool:
        return self._task is not None

    def start(self) -> None:
        if self._task is None:
            self._task = asyncio.create_task(self._keep_alive(), name=self._name)

    async def stop(self) -> None:
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait([self._task])
            if not self._task.cancelled():
                self._task.result()

    def send(self, kind: int, head: dict[str, Any]) -> None:
        """Send a message if there is a process; one that is started later learns it from on_start."""
        if self._process is not None:
            self._process.send(kind, head)

    async def request(self, head: dict[str, Any], timeout_s: float) -> tuple[dict[str, Any], bytes]:
        """Return the process' answer; what it refuses is raised."""
        if self._process is None:
            what, fix = (
                (self.problem["what"], self.problem["fix"])
                if self.problem
                else (say("camera.starting", "The camera is still starting."), TRY_AGAIN)
            )
            raise Unavailable(what, fix, reason="camera-silent")
        return await self._process.request(messages.REQUEST, head, timeout_s)

    async def _keep_alive(self) -> None:
        wait_s = RETRY_S
        while True:
            try:
                process = await CameraProcess.start(self._spec)
            except TouchlineError as error:
                self.problem = error.to_json()
            else:
                if await self._follow(process):
                    wait_s = RETRY_S
                self.restarts += 1
            await asyncio.sleep(wait_s)
            wait_s = min(2 * wait_s, MAX_RETRY_S)

    async def _follow(self, process: CameraProcess) -> bool:
        """Receive until the process dies, sends no JSON or has to be killed; return whether a frame came from it."""
        self._process = process
        self.status = ProcessStatus.initial(asyncio.get_running_loop().time())
        watchdog = asyncio.create_task(self._kill_when_stalled(process))
        try:
            self._on_start()
            while True:
                message = await process.receive()
                if message.kind == messages.STATUS:
                    self.status = self.status.updated(
                        decode_body(message.body)[0], asyncio.get_running_loop().time()
                    )
                self._on_message(message)
        except (asyncio.IncompleteReadError, OSError):
            return self.status.values["seq"] > 0
        finally:
            watchdog.cancel()
            self._process = None
            await asyncio.shield(process.end())
            self.status = ProcessStatus(
                self.status.values | {"state": "connecting", "problem": None},
                self.status.received_s,
            )

    async def _kill_when_stalled(self, process: CameraProcess) -> None:
        loop = asyncio.get_running_loop()
        looked, grace_s = loop.time(), 0.0
        while True:
            await asyncio.sleep(POLL_S)
            now = loop.time()
            if now - looked > POLL_S + LATE_S:  # we slept, not the camera
                grace_s = now - looked
            elif grace_s > 0:
                grace_s = max(0.0, grace_s - POLL_S)
            looked = now
            if self.status is not None and stall_reason(self.status, now, KILL_AFTER_S + grace_s):
                process.kill()
                return
