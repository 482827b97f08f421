"""In a camera's process: objects detected in every frame, only while somebody watches or they are published.

    newest frame ─▶ stages ─▶ DETECTIONS: positions as JSON, and the league's packet where it is published
                       └────▶ stage_renderer: the stages' pictures that are watched

Works on the raw picture; points are corrected through the calibration that is applied. A frame that comes while the
one before it is being processed is left out: the newest wins, nothing waits.
"""

import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from touchline.core.colour_profile import ColourProfile
from touchline.core.errors import BadImage, TouchlineError
from touchline.core.geometry import ImageSize
from touchline.core.json_values import JsonObject
from touchline.core.records import Calibration
from touchline.core.statements import say, stated
from touchline.live import messages
from touchline.live.camera_part import CameraPart, PartContext
from touchline.live.capture import CapturedFrame, FrameCapture
from touchline.live.failures import Failures
from touchline.live.frame_buffer import FrameBuffer
from touchline.live.picture import AppliedCalibration
from touchline.live.rate import MeasuredRate
from touchline.live.ssl_detection import detection_packet
from touchline.live.stage_renderer import StageRenderer
from touchline.live.status_types import DetectorStatus
from touchline.live.stream_spec import StreamSpec
from touchline.processes.framing import encode_body
from touchline.vision.stage_pipeline import FrameResult, StageConfig, StagePipeline
from touchline.workflows.detection import colour_profile_for, pipeline_for
from touchline.workflows.rectified_detection import RectifiedDetector

IDLE_S = 0.5
RETRY_S = 1.0  # after a picture that could not be processed
DIGITS = 4  # in the JSON: a ten-thousandth of a pixel or millimetre
NO_POSITIONS = say("note.no-positions", "This camera has no active calibration. Sizes are estimated from its field, "
                   "and positions are not available.")


@dataclass
class DetectorState:
    """The stages as they are set up now, and for what."""

    key: tuple[Any, ...]
    pipeline: StagePipeline | RectifiedDetector
    calibration: Calibration | None
    notes: tuple[str, ...]


class DetectionPart(CameraPart):
    """Detection in a camera's process, and the last seconds of its picture for clips."""

    def __init__(self, around: PartContext) -> None:
        self._detector = LiveDetector(around.capture, around.send, around.failures)
        self._buffer = FrameBuffer(around.capture, around.failures)
        self.requests = {"clip": lambda asked: self._buffer.clip(asked["seconds"])}
        self.threads = (self._detector.run, self._buffer.run)

    def apply(self, calibration: AppliedCalibration | None, picture: JsonObject | None) -> None:
        self._detector.apply(calibration)

    def follow(self, request: JsonObject) -> None:
        self._detector.follow(request)

    def watch(self, streams: Mapping[int, tuple[StreamSpec, float]]) -> None:
        self._detector.watch(streams)
        self._buffer.keep(bool(streams))

    def status(self) -> JsonObject:
        return {"detector": self._detector.status}


class LiveDetector:
    """The detecting thread. Other threads say what to detect."""

    def __init__(self, capture: FrameCapture, send: Callable[[int, int, bytes], None], failures: Failures) -> None:
        self._capture, self._send, self._failures = capture, send, failures
        self._renderer = StageRenderer(send, failures)
        self._changed = threading.Event()
        self._request: Mapping[str, Any] | None = None
        self._calibration: AppliedCalibration | None = None
        self._streams: dict[int, tuple[StreamSpec, float]] = {}
        self._state: DetectorState | None = None
        self._rate = MeasuredRate()
        self.status: DetectorStatus = {"learned": None}

    def follow(self, request: Mapping[str, Any]) -> None:
        """Detect this from now on, as DetectionFeed.message says it. A mere switching makes no stage forget."""
        self._request = request if request["on"] else None
        self._changed.set()

    def apply(self, calibration: AppliedCalibration | None) -> None:
        self._calibration = calibration

    def watch(self, streams: Mapping[int, tuple[StreamSpec, float]]) -> None:
        """Draw these stages' pictures and no others."""
        self._streams = dict(streams)
        self._changed.set()

    def run(self) -> None:
        """Work until the process ends, on a thread of its own."""
        threading.Thread(target=self._renderer.run, name="stage renderer", daemon=True).start()
        seq = 0
        while True:
            request, streams = self._request, self._streams
            if request is None or not (request["run"] or streams):
                self._rate.clear()
                self._changed.wait(IDLE_S)
                self._changed.clear()
                continue
            taken = self._capture.after(seq, IDLE_S)
            if taken is None:
                continue
            seq = taken.seq
            try:
                self._process(taken, request, streams)
            except OSError:  # the server is gone
                return
            except Exception as error:  # of one picture like no other, or a plan that cannot be: it must not end all
                if isinstance(error, TouchlineError):
                    what = error.what
                else:
                    what = type(error).__name__
                    self._failures.add(say("camera-failure.detection", "Object detection failed"), error)
                self._send_result(taken, request, None, (f"Object detection failed for this image: {what}",))
                if not isinstance(error, BadImage):  # the next one is whole again
                    self._state = None
                    self._changed.wait(RETRY_S)
                    self._changed.clear()

    def _process(self, taken: CapturedFrame, request: Mapping[str, Any],
                 streams: Mapping[int, tuple[StreamSpec, float]]) -> None:
        state = self._state_for(taken, request)
        due = self._renderer.due(streams, taken)
        stages = {spec.stage for spec in due.values() if spec.stage is not None}
        result = state.pipeline.process(taken.frame.pixels, clock=time.thread_time, pictures=stages, frame=taken.seq,
                                 time_s=taken.time)
        self._rate.add(time.monotonic())
        self._send_result(taken, request, result, state.notes)
        if due:
            self._renderer.offer(taken, result, due, state.pipeline.context.view)

    def _state_for(self, taken: CapturedFrame, request: Mapping[str, Any]) -> DetectorState:
        """Return the stages, set up anew where the plan, the colours, the calibration or the picture's size changed."""
        size, applied = taken.frame.size, self._calibration
        calibration = applied.record if applied is not None and applied.record.image_size == size else None
        key = (request["plan"], request["profile"], calibration.id if calibration else None, size, request["extent_mm"])
        if (state := self._state) is None or key != state.key:
            plan, given = StageConfig.from_json(request["plan"]), request["profile"]
            profile = ColourProfile.from_json(given) if given else colour_profile_for(taken.frame.pixels, plan)
            notes = (*profile.notes, *(() if calibration else (NO_POSITIONS,)))
            scale = None if calibration else request["extent_mm"] / (size.width**2 + size.height**2) ** 0.5
            state = self._state = DetectorState(key, pipeline_for(plan, size, profile, calibration, scale), calibration,
                                                notes)
            self._rate.clear()
            self.status = {"learned": None if given else replace(profile, name="found").to_json()}
        return state

    def _send_result(self, taken: CapturedFrame, request: Mapping[str, Any], result: FrameResult | None,
                     notes: tuple[str, ...]) -> None:
        calibration = None if self._state is None else self._state.calibration
        interval_s = self._rate.interval_s
        head = detection_json(result, taken.seq, taken.time, taken.frame.size, calibration, notes,
                              1 / interval_s if interval_s else 0.0)
        packet = b""
        if request["publish"] and result is not None and calibration is not None:
            packet = detection_packet(result.detections, request["camera_number"], time.time())
        self._send(messages.DETECTIONS, 0, encode_body(head, packet))


def detection_json(result: FrameResult | None, seq: int, time_s: float, size: ImageSize,
                   calibration: Calibration | None, notes: tuple[str, ...], fps: float) -> dict[str, Any]:
    """Return what was detected in a frame of a live camera or a clip; result: None where it could not be processed."""
    items = result.detections.items if result else ()
    took = dict(result.took_ms) if result else {}
    return stated({
        "seq": seq, "time_s": round(time_s, 4), "width": size.width, "height": size.height,
        "calibration": calibration.id if calibration else None, "items": [_rounded(i.to_json()) for i in items],
        "stages": [{"name": name, "ms": round(ms, 3)} for name, ms in took.items()],
        "ms": round(sum(took.values()), 3), "notes": [*notes, *(result.notes if result else ())],
        "fps": round(fps, 2)})


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return round(value, DIGITS)
    if isinstance(value, dict):
        return {name: _rounded(one) for name, one in value.items()}
    return [_rounded(one) for one in value] if isinstance(value, (list, tuple)) else value
