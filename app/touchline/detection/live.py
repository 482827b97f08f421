"""In a camera's process: objects detected in every frame, only while somebody watches or they are published.

    newest frame ─▶ stages ─▶ positions as JSON, and the league's packet where it is published
         │             └────▶ StageRenderer: the stages' pictures that are watched
         └─▶ FrameBuffer: the last seconds, for clips

Works on the raw picture; points are corrected through the calibration that is applied. A frame that comes while the
one before it is being processed is left out: the newest wins, nothing waits.

A camera's own JPEGs are stored as they came, other pictures as JPEG of all their colour (4:4:4): at half of it, as
usual, the small dots of a robot would run.
"""

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import BadImage, TouchlineError
from touchline.core.geometry import ImageSize
from touchline.core.json_values import JsonObject
from touchline.core.records import Calibration
from touchline.core.statements import say
from touchline.detection.detect import (
    RectifiedDetector,
    colour_profile_for,
    detection_json,
    detections_image,
    pipeline_for,
)
from touchline.detection.profile import ColourProfile, ProfileJson
from touchline.detection.records import FieldLocator, detection_packet
from touchline.detection.stages import FrameResult, StageConfig, StagePipeline, stage_of
from touchline.images import encode
from touchline.live.camera_part import CameraPart, PartContext
from touchline.live.capture import CapturedFrame, FrameCapture, no_frames
from touchline.live.failures import Failures
from touchline.live.messages import MeasuredRate, Rate, StreamSpec
from touchline.live.picture import AppliedCalibration, scaled_down
from touchline.processes.framing import encode_body
from touchline.processes.limits import give_way

IDLE_S = 0.5
RETRY_S = 1.0  # after a picture that could not be processed
MIN_DRAWING_S = 1 / 15  # between two pictures of a stream: drawing costs as much as detecting
MAX_CLIP_S = 30.0
CLIP_FPS = 10.0  # encoding costs as much as detecting
MAX_CLIP_BYTES = 120_000_000
CLIP_QUALITY = 92
SILENT_S = 3.0
NICE = 10  # niceness: the picture and the detections go first
NO_POSITIONS = say(
    "note.no-positions",
    "This camera has no active calibration. Sizes are estimated from its field, "
    "and positions are not available.",
)


@dataclass
class DetectorState:
    """The stages as they are set up now, and for what."""

    key: tuple[Any, ...]
    pipeline: StagePipeline | RectifiedDetector
    calibration: Calibration | None
    notes: tuple[str, ...]
    team_z_mm: Mapping[str, float]


class DetectionPart(CameraPart):
    """Detection in a camera's process, and the last seconds of its picture for clips."""

    def __init__(self, around: PartContext) -> None:
        self._detector = LiveDetector(around)
        self._buffer = FrameBuffer(around.capture, around.failures)
        self.requests = {"clip": lambda asked: self._buffer.clip(asked["seconds"])}
        self.threads = (self._detector.run, self._buffer.run)

    def apply(self, calibration: AppliedCalibration | None, picture: JsonObject | None) -> None:
        self._detector.apply(calibration)

    def follow(self, settings: JsonObject) -> None:
        self._detector.follow(settings)

    def watch(self, streams: Mapping[int, tuple[StreamSpec, float]]) -> None:
        self._detector.watch(streams)
        self._buffer.keep(bool(streams))

    def status(self) -> JsonObject:
        return {"detector": {"learned": self._detector.learned}}


class LiveDetector:
    """The detecting thread. Other threads say what to detect."""

    def __init__(self, around: PartContext) -> None:
        self._capture, self._send, self._failures = around.capture, around.send, around.failures
        self._renderer = StageRenderer(around.send_picture, around.failures)
        self._changed = threading.Event()
        self._request: Mapping[str, Any] | None = None
        self._calibration: AppliedCalibration | None = None
        self._streams: dict[int, tuple[StreamSpec, float]] = {}
        self._state: DetectorState | None = None
        self._rate = MeasuredRate()
        self.learned: ProfileJson | None = None  # the colours that were found in the picture

    def follow(self, request: Mapping[str, Any]) -> None:
        """Detect this from now on, as DetectionFeed.settings() says it. A mere switching makes no stage forget."""
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
            # of one picture like no other, or a plan that cannot be: it must not end all
            except Exception as error:
                if isinstance(error, TouchlineError):
                    what = error.what
                else:
                    what = type(error).__name__
                    self._failures.add(
                        say("camera-failure.detection", "Object detection failed"), error
                    )
                self._send_result(
                    taken, request, None, (f"Object detection failed for this image: {what}",)
                )
                if not isinstance(error, BadImage):  # the next one is whole again
                    self._state = None
                    self._changed.wait(RETRY_S)
                    self._changed.clear()

    def _process(
        self,
        taken: CapturedFrame,
        request: Mapping[str, Any],
        streams: Mapping[int, tuple[StreamSpec, float]],
    ) -> None:
        state = self._state_for(taken, request)
        due = self._renderer.due(streams, taken)
        stages = {stage for spec in due.values() if (stage := stage_of(spec.view)) is not None}
        result = state.pipeline.process(
            taken.frame.pixels,
            clock=time.thread_time,
            pictures=stages,
            frame=taken.seq,
            time_s=taken.time,
        )
        self._rate.add(time.monotonic())
        self._send_result(taken, request, result, state.notes)
        if due:
            self._renderer.offer(taken, result, due, state.pipeline.context.view)

    def _state_for(self, taken: CapturedFrame, request: Mapping[str, Any]) -> DetectorState:
        """Return the stages, set up anew where the plan, the colours, the calibration or the picture's size changed."""
        size, applied = taken.frame.size, self._calibration
        calibration = (
            applied.record if applied is not None and applied.record.image_size == size else None
        )
        key = (
            request["plan"],
            request["profile"],
            calibration.id if calibration else None,
            size,
            request["extent_mm"],
        )
        heights = request["team_z_mm"]
        if (state := self._state) is None or (key, heights) != (state.key, state.team_z_mm):
            plan, given = StageConfig.from_json(request["plan"]), request["profile"]
            if given:
                profile = ColourProfile.from_json(given)
            elif state is not None and key == state.key:  # other teams do not change the colours
                profile = state.pipeline.context.profile
            else:
                profile = colour_profile_for(taken.frame.pixels, plan)
            notes = (*profile.notes, *(() if calibration else (NO_POSITIONS,)))
            scale = (
                None
                if calibration
                else request["extent_mm"] / (size.width**2 + size.height**2) ** 0.5
            )
            pipeline = pipeline_for(plan, size, profile, calibration, scale, team_z_mm=heights)
            state = self._state = DetectorState(key, pipeline, calibration, notes, heights)
            self._rate.clear()
            self.learned = None if given else replace(profile, name="found").to_json()
        return state

    def _send_result(
        self,
        taken: CapturedFrame,
        request: Mapping[str, Any],
        result: FrameResult | None,
        notes: tuple[str, ...],
    ) -> None:
        calibration = None if self._state is None else self._state.calibration
        interval_s = self._rate.interval_s
        head = detection_json(
            result,
            taken.seq,
            taken.time,
            taken.frame.size,
            calibration,
            notes,
            1 / interval_s if interval_s else 0.0,
        )
        packet = b""
        if request["publish"] and result is not None and calibration is not None:
            packet = detection_packet(result.detections, request["camera_number"], time.time())
        self._send(encode_body(head, packet))


class StageRenderer:
    """The drawing thread: one frame at a time, and none is kept waiting for it."""

    def __init__(self, send_picture: Callable[[int, bytes], None], failures: Failures) -> None:
        self._send_picture, self._failures = send_picture, failures
        self._rates: dict[int, Rate] = {}
        self._came = threading.Event()
        self._work: (
            tuple[CapturedFrame, FrameResult, Mapping[int, StreamSpec], FieldLocator] | None
        ) = None

    def due(
        self, streams: Mapping[int, tuple[StreamSpec, float]], taken: CapturedFrame
    ) -> dict[int, StreamSpec]:
        """Return which of these a frame is to be drawn for; none while another is being drawn."""
        self._rates = {number: self._rates.get(number) or Rate() for number in streams}
        if self._work is not None:
            return {}
        return {
            number: spec
            for number, (spec, interval_s) in streams.items()
            if self._rates[number].is_due(taken.moment, max(interval_s, MIN_DRAWING_S))
        }

    def offer(
        self,
        taken: CapturedFrame,
        result: FrameResult,
        streams: Mapping[int, StreamSpec],
        view: FieldLocator,
    ) -> None:
        self._work = (taken, result, streams, view)
        self._came.set()

    def run(self) -> None:
        """Work until the process ends, on a thread of its own."""
        while True:
            self._came.wait()
            self._came.clear()
            if self._work is not None:
                with self._failures.surviving(
                    say("camera-failure.drawing", "Detections are not drawn")
                ):
                    self._render(*self._work)
                self._work = None

    def _render(
        self,
        taken: CapturedFrame,
        result: FrameResult,
        streams: Mapping[int, StreamSpec],
        view: FieldLocator,
    ) -> None:
        marked = None
        for number, spec in streams.items():
            begin = time.monotonic()
            if (stage := stage_of(spec.view)) is not None:
                picture = result.pictures.get(stage)  # None: the plan has no such stage now
            else:
                marked = (
                    detections_image(taken.frame.pixels, result.detections, view)
                    if marked is None
                    else marked
                )
                picture = marked
            if picture is None:
                continue
            try:
                pixels = scaled_down(picture, spec.width)
                jpeg = encode(pixels, "jpg", spec.quality)
            except TouchlineError:
                continue
            raw = taken.frame.size
            head = {
                "seq": taken.seq,
                "time": taken.time,
                "view": spec.view,
                "width": pixels.shape[1],
                "height": pixels.shape[0],
                "raw_width": raw.width,
                "raw_height": raw.height,
                "spent_ms": round(1e3 * (time.monotonic() - begin), 2),
            }
            self._send_picture(number, encode_body(head, jpeg))


@dataclass(frozen=True)
class BufferedFrame:
    """One frame, encoded. time_s: unix; moment: on the steady clock, by which frames are kept, s."""

    seq: int
    time_s: float
    moment: float
    size: ImageSize
    jpeg: bytes


class FrameBuffer:
    """The recording thread. keep() and clip() may be called from any thread."""

    def __init__(self, capture: FrameCapture, failures: Failures) -> None:
        self._capture = capture
        self._failures = failures
        self._changed = threading.Condition()
        self._frames: deque[BufferedFrame] = deque()
        self._bytes = 0
        self._watched = False
        self._requests = 0

    def keep(self, watched: bool) -> None:
        """Say whether somebody watches from now on."""
        with self._changed:
            self._watched = watched
            self._changed.notify_all()

    def clip(self, seconds: float) -> tuple[dict[str, Any], bytes]:
        """Return the last seconds as far as they are buffered, else from now on until there are so many."""
        with self._changed:
            if not self._watched and not self._requests:
                self._clear()  # of long ago
            self._requests += 1
            self._changed.notify_all()
        try:
            frames = self._collect(seconds)
        finally:
            with self._changed:
                self._requests -= 1
        items = [
            {"seq": one.seq, "time_s": round(one.time_s, 4), "bytes": len(one.jpeg)}
            for one in frames
        ]
        size = frames[-1].size
        return {"width": size.width, "height": size.height, "frames": items}, b"".join(
            one.jpeg for one in frames
        )

    def _collect(self, seconds: float) -> list[BufferedFrame]:
        silent_until = time.monotonic() + SILENT_S
        newest = -1
        while True:
            with self._changed:
                self._changed.wait(IDLE_S)
                frames = list(self._frames)
            if frames and frames[-1].seq != newest:
                newest, silent_until = frames[-1].seq, time.monotonic() + SILENT_S
                clip = [
                    one
                    for one in frames
                    if one.moment >= frames[-1].moment - seconds - 0.5 / CLIP_FPS
                ]
                full = frames[0].moment <= frames[-1].moment - seconds + 1.5 / CLIP_FPS
                if full or self._bytes > 0.9 * MAX_CLIP_BYTES:
                    return clip
            elif time.monotonic() > silent_until:
                raise no_frames()

    def run(self) -> None:
        """Work until the process ends, on a thread of its own."""
        give_way(NICE)
        seq, rate = 0, Rate()
        while True:
            with self._changed:
                if not (self._watched or self._requests):
                    if self._frames:
                        self._clear()
                    self._changed.wait(IDLE_S)
                    continue
            taken = self._capture.after(seq, IDLE_S)
            if taken is None:
                continue
            seq = taken.seq
            if rate.is_due(taken.moment, 1 / CLIP_FPS):
                with self._failures.surviving("A frame could not be recorded"):
                    self._keep(taken)

    def _keep(self, taken: CapturedFrame) -> None:
        jpeg = taken.frame.jpeg or _encoded(taken.frame.pixels)
        frame = BufferedFrame(taken.seq, taken.time, taken.moment, taken.frame.size, jpeg)
        with self._changed:
            if self._frames and self._frames[-1].size != frame.size:
                self._clear()  # a clip is of one size
            self._frames.append(frame)
            self._bytes += len(frame.jpeg)
            while (
                self._bytes > MAX_CLIP_BYTES or frame.moment - self._frames[0].moment > MAX_CLIP_S
            ):
                self._bytes -= len(self._frames.popleft().jpeg)
            self._changed.notify_all()

    def _clear(self) -> None:
        self._frames.clear()
        self._bytes = 0


def _encoded(pixels: NDArray[np.uint8]) -> bytes:
    done, buffer = cv2.imencode(
        ".jpg",
        np.ascontiguousarray(pixels),
        [
            cv2.IMWRITE_JPEG_QUALITY,
            CLIP_QUALITY,
            cv2.IMWRITE_JPEG_SAMPLING_FACTOR,
            cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444,
        ],
    )
    if not done:
        raise BadImage(
            say("frame.not-encodable", "A frame could not be encoded."),
            say("frame.check-picture", "Check the camera's picture."),
            reason="not-encodable",
        )
    return buffer.tobytes()
