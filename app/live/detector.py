"""In a camera's process: what plays before it, seen in every frame, only while somebody watches or it is published.

    newest frame ─▶ stages ─▶ SEEN: places as JSON, and the league's packet where it is published
                       └────▶ painter: the stages' pictures that are watched

Works on the raw picture; points are corrected through the calibration that is shown. A frame that comes while the one
before it is being looked at is left out: the newest wins, nothing waits.
"""

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from app.core.colour_profile import ColourProfile
from app.core.errors import TouchlineError
from app.core.geometry import ImageSize
from app.core.records import Calibration
from app.live import messages
from app.live.capture import CapturedFrame, FrameCapture
from app.live.picture import AppliedCalibration
from app.live.ssl_detection import detection_packet
from app.live.stage_renderer import StageRenderer
from app.live.stream_spec import StreamSpec
from app.vision.stage_pipeline import FrameResult, StageConfig, StagePipeline
from app.workflows.detection import colour_profile_for, pipeline_for

IDLE_S = 0.5
RETRY_S = 1.0  # after a picture that could not be looked at
RATE_FRAMES = 30  # frames from which the rate is told
DIGITS = 4  # of what is told: a ten-thousandth of a pixel or millimetre
NO_POSITIONS = "This camera has no calibration in use: sizes are guessed from its field, and there are no places."


@dataclass(frozen=True, eq=False)
class DetectionRequest:
    """What the server asked for. run: see without pause; extent_mm: how much field about crosses the picture.

    sighted_as: plan and profile as they came; as long as they stay the same, the stages remember.
    """

    plan: StageConfig
    profile: ColourProfile | None
    run: bool
    publish: bool
    camera_number: int
    extent_mm: float
    sighted_as: str

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> "DetectionRequest":
        profile = value["profile"]
        return cls(StageConfig.from_json(value["plan"]), None if profile is None else ColourProfile.from_json(profile),
                   value["run"], value["publish"], value["camera_number"], value["extent_mm"],
                   repr((value["plan"], profile)))


@dataclass
class DetectorState:
    """The stages as they are set up now, and for what. learned: colours that were found in the picture."""

    key: tuple[Any, ...] = ()
    sight: StagePipeline | None = None
    learned: ColourProfile | None = None
    calibration: Calibration | None = None
    notes: tuple[str, ...] = field(default=())


class LiveDetector:
    """The seeing thread. What to see is told by other threads."""

    def __init__(self, capture: FrameCapture, send: Callable[[int, int, bytes], None]) -> None:
        self._capture, self._send = capture, send
        self._painter = StageRenderer(send)
        self._asked = threading.Event()
        self._wanted: DetectionRequest | None = None
        self._shown: AppliedCalibration | None = None
        self._channels: dict[int, tuple[StreamSpec, float]] = {}
        self._eyes = DetectorState()
        self._moments: deque[float] = deque(maxlen=RATE_FRAMES + 1)
        self.told: dict[str, Any] = {"learned": None}

    def start(self) -> None:
        self._painter.start()
        threading.Thread(target=self._run, name="seeing", daemon=True).start()

    def follow(self, wanted: Mapping[str, Any]) -> None:
        """From now on this. What only switches it on or off does not make the stages forget."""
        self._wanted = DetectionRequest.from_json(wanted) if wanted["on"] else None
        self._asked.set()

    def show(self, shown: AppliedCalibration | None) -> None:
        self._shown = shown

    def watch(self, channels: Mapping[int, tuple[StreamSpec, float]]) -> None:
        """From now on, these stages' pictures and no others."""
        self._channels = dict(channels)
        self._asked.set()

    def _run(self) -> None:
        seq = 0
        while True:
            wanted, channels = self._wanted, self._channels
            if wanted is None or not (wanted.run or channels):
                self._moments.clear()
                self._asked.wait(IDLE_S)
                self._asked.clear()
                continue
            taken = self._capture.after(seq, IDLE_S)
            if taken is None:
                continue
            seq = taken.seq
            try:
                self._look(taken, wanted, channels)
            except OSError:  # the server is gone
                return
            except Exception as error:  # of one picture like no other, or a plan that cannot be: it must not end all
                what = error.what if isinstance(error, TouchlineError) else type(error).__name__
                self._tell(taken, wanted, None, (f"This picture could not be looked at: {what}",))
                self._eyes = DetectorState()
                self._asked.wait(RETRY_S)
                self._asked.clear()

    def _look(self, taken: CapturedFrame, wanted: DetectionRequest,
              channels: Mapping[int, tuple[StreamSpec, float]]) -> None:
        eyes = self._eyes_for(taken, wanted)
        due = self._painter.due(channels, taken)
        stages = {channel.stage for channel in due.values() if channel.stage is not None}
        seen = eyes.sight.process(taken.frame.pixels, clock=time.thread_time, pictures=stages, frame=taken.seq,
                                  time_s=taken.time)
        self._moments.append(time.monotonic())
        self._tell(taken, wanted, seen, eyes.notes)
        if due:
            self._painter.offer(taken, seen, due, eyes.sight.context.view)

    def _eyes_for(self, taken: CapturedFrame, wanted: DetectionRequest) -> DetectorState:
        """Set up anew where the plan, the colours, the calibration or the picture's size is another."""
        size, shown = taken.frame.size, self._shown
        calibration = shown.calibration if shown is not None and shown.calibration.image_size == size else None
        key = (wanted.sighted_as, calibration.id if calibration else None, size, wanted.extent_mm)
        if key != self._eyes.key:
            profile = wanted.profile or colour_profile_for(taken.frame.pixels, wanted.plan)
            notes = (*profile.notes, *(() if calibration else (NO_POSITIONS,)))
            scale = None if calibration else _mm_per_px(wanted, size)
            self._eyes = DetectorState(key, pipeline_for(wanted.plan, size, profile, calibration, scale),
                               None if wanted.profile else profile, calibration, notes)
            self._moments.clear()
            self.told = {"learned": None if wanted.profile else replace(profile, name="found").to_json()}
        return self._eyes

    def _tell(self, taken: CapturedFrame, wanted: DetectionRequest, seen: FrameResult | None,
              notes: tuple[str, ...]) -> None:
        calibration = self._eyes.calibration
        head = detection_json(seen, taken.seq, taken.time, taken.frame.size, calibration, notes, self._fps())
        packet = b""
        if wanted.publish and seen is not None and calibration is not None:
            packet = detection_packet(seen.detections, wanted.camera_number, time.time())
        self._send(messages.DETECTIONS, 0, messages.message(head, packet))

    def _fps(self) -> float:
        count = len(self._moments) - 1
        return count / max(self._moments[-1] - self._moments[0], 1e-6) if count > 0 else 0.0


def detection_json(seen: FrameResult | None, seq: int, time_s: float, size: ImageSize, calibration: Calibration | None,
            notes: tuple[str, ...], fps: float) -> dict[str, Any]:
    """What a frame showed, plain JSON: of a live camera, or of a clip. seen: None where it could not be looked at."""
    items = seen.detections.items if seen else ()
    took = dict(seen.took_ms) if seen else {}
    return {"seq": seq, "time_s": round(time_s, 4), "width": size.width, "height": size.height,
            "calibration": calibration.id if calibration else None, "items": [_rounded(i.to_json()) for i in items],
            "stages": [{"name": name, "ms": round(ms, 3)} for name, ms in took.items()],
            "ms": round(sum(took.values()), 3), "notes": [*notes, *(seen.notes if seen else ())],
            "fps": round(fps, 2)}


def _mm_per_px(wanted: DetectionRequest, size: ImageSize) -> float:
    return wanted.extent_mm / (size.width**2 + size.height**2) ** 0.5


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return round(value, DIGITS)
    if isinstance(value, dict):
        return {name: _rounded(one) for name, one in value.items()}
    return [_rounded(one) for one in value] if isinstance(value, (list, tuple)) else value
