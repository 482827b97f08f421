"""In a camera's process: from a frame to the picture of each watched stream, corrected at its size, encoded once.

A camera's own JPEG is passed on where it serves the stream as it is.
"""

import json
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core import opencv
from touchline.core.errors import Conflict, TouchlineError
from touchline.core.field import Field, Region
from touchline.core.geometry import ImageSize
from touchline.core.records import Calibration, Frame
from touchline.core.sentences import ACTIVATE_OR_RAW, NOT_CALIBRATED
from touchline.images import encode
from touchline.images.in_process import JpegFrame
from touchline.imaging.correction import CorrectedView, CorrectionMap, correction_map
from touchline.live import messages
from touchline.live.capture import CapturedFrame, FrameCapture
from touchline.live.failures import Failures
from touchline.live.messages import Rate, StreamSpec
from touchline.models import CameraModel, Restored
from touchline.processes.framing import encode_body
from touchline.workflows.calibration import overlay

# of the corrected frame's width is shown around the field, so that its borders are in view
MARGIN = 0.06
GAP_PX = 4  # between the two halves of a picture that stands side by side
PASSED_BYTES_PX = 0.5  # of a JPEG that is passed on at quality 80; twice as many for each ten more
OVERLAY_PX = 0.25  # a drawn line may be off by so much where points are left out of it
IDLE_S = 0.5


@dataclass(frozen=True, eq=False)
class AppliedCalibration:
    """The calibration that is applied: its maps are made when a size is first watched."""

    record: Calibration
    model: CameraModel
    field: Field
    region: Region
    maps: dict[int, CorrectionMap]
    overlays: dict[tuple[str, int, int], bytes]

    @classmethod
    def of(cls, calibration: Calibration) -> "AppliedCalibration":
        return cls(calibration, *Restored.of(calibration), {}, {})

    def view(self, width: int) -> CorrectedView:
        """Return how the corrected frame is drawn at a width; 0: one pixel per corrected pixel."""
        return CorrectedView(round(MARGIN * self.model.corrected_size.width), width or None)

    def corrected(self, pixels: NDArray[np.uint8], width: int) -> NDArray[np.uint8]:
        if width not in self.maps:
            self.maps[width] = correction_map(self.model, self.view(width))
        return self.maps[width].apply(pixels)

    def overlay(self, view: str, width: int, raw: ImageSize, drawn: ImageSize) -> bytes:
        """Return JSON text of "overlays": the field's lines in pixels of the drawn picture."""
        key = (view, *drawn)
        if key not in self.overlays:
            if view == "raw":
                features, scale = (
                    overlay(self.model, self.field, self.region, "raw"),
                    drawn.width / raw.width,
                )
            else:
                features, scale = (
                    overlay(self.model, self.field, self.region, "corrected", self.view(width)),
                    1.0,
                )
            lines = [
                {"feature": feature["feature"], "kind": feature["kind"], "points": points}
                for feature in features
                for points in _runs(feature["points"], scale, drawn)
            ]
            text = json.dumps({"field": lines}, allow_nan=False, separators=(",", ":"))
            self.overlays[key] = b'"overlays":' + text.encode("ascii")
        return self.overlays[key]


def _runs(
    points: Sequence[Sequence[float] | None], scale: float, drawn: ImageSize
) -> Iterator[list[list[float]]]:
    """Yield the stretches of a polyline in or near the drawn picture, without points that a straight one needs not."""
    run: list[list[float]] = []
    for point in [*points, None]:
        if point is not None:
            x, y = ((c + 0.5) * scale - 0.5 for c in point)
            if -drawn.width <= x <= 2 * drawn.width and -drawn.height <= y <= 2 * drawn.height:
                run.append([x, y])
                continue
        if run:
            thinned = cv2.approxPolyDP(np.array(run, np.float32), OVERLAY_PX, closed=False).reshape(
                -1, 2
            )
            yield [[round(float(x), 1), round(float(y), 1)] for x, y in thinned]
        run = []


def scaled_down(pixels: NDArray[np.uint8], width: int) -> NDArray[np.uint8]:
    """Return the picture no wider than that, 0: as it is; never enlarged, which a browser does as well."""
    return opencv.shrink_to_width(pixels, width) if width else pixels


def side_by_side(
    left: NDArray[np.uint8], right: NDArray[np.uint8]
) -> tuple[NDArray[np.uint8], list[dict[str, int]]]:
    """Return two pictures of one width as one, the lower in the middle of its half; and where each stands, px."""
    height = max(left.shape[0], right.shape[0])
    width = left.shape[1]
    both = np.zeros((height, 2 * width + GAP_PX, 3), np.uint8)
    places = []
    for pixels, x in ((left, 0), (right, width + GAP_PX)):
        y = (height - pixels.shape[0]) // 2
        both[y : y + pixels.shape[0], x : x + pixels.shape[1]] = pixels
        places.append({"x": x, "y": y, "width": pixels.shape[1], "height": pixels.shape[0]})
    return both, places


def passed_on(frame: Frame, spec: StreamSpec) -> bytes:
    """Return the camera's own JPEG where it serves the stream as it is; empty where one has to be made.

    It serves where it is no wider than what is asked for, and not much larger than a JPEG of that quality.
    """
    if spec.view != "raw" or not isinstance(frame, JpegFrame) or 0 < spec.width < frame.size.width:
        return b""
    allowed = (
        PASSED_BYTES_PX * 2 ** ((spec.quality - 80) / 10) * frame.size.width * frame.size.height
    )
    return frame.jpeg if len(frame.jpeg) <= allowed and frame.is_plain else b""


def render(
    frame: Frame, spec: StreamSpec, applied: AppliedCalibration | None
) -> tuple[NDArray[np.uint8], dict[str, Any], bytes]:
    """Return a stream's picture, members of its JSON, and its overlays; needs a calibration unless it is raw."""
    raw = frame.size
    if spec.view == "raw":
        picture = scaled_down(frame.reduced(spec.width or raw.width), spec.width)
    elif applied is None:
        raise Conflict(NOT_CALIBRATED, ACTIVATE_OR_RAW, reason="not-calibrated")
    elif spec.view == "side":
        half = max(16, ((spec.width or 2 * raw.width) - GAP_PX) // 2)
        left, right = scaled_down(frame.pixels, half), applied.corrected(frame.pixels, half)
        if left.shape[1] < half:
            height = max(1, round(left.shape[0] * half / left.shape[1]))
            left = np.asarray(cv2.resize(left, (half, height)), np.uint8)
        both, (raw_half, corrected_half) = side_by_side(left, right)
        return (
            both,
            {
                "calibration": applied.record.id,
                "halves": {
                    "raw": raw_half,
                    "corrected": corrected_half,
                    "margin_px": applied.view(half).margin_px,
                },
            },
            b"",
        )
    else:
        picture = applied.corrected(frame.pixels, spec.width)
    size = ImageSize(picture.shape[1], picture.shape[0])
    return picture, *described(spec, applied, raw, size)


def described(
    spec: StreamSpec, applied: AppliedCalibration | None, raw: ImageSize, drawn: ImageSize
) -> tuple[dict[str, Any], bytes]:
    """Return what a stream's JSON says of the calibration, and its overlays."""
    if applied is None:
        return {"calibration": None}, b""
    return {"calibration": applied.record.id}, applied.overlay(spec.view, spec.width, raw, drawn)


class Encoder:
    """The drawing thread. Other threads say what to draw."""

    def __init__(
        self, capture: FrameCapture, send: Callable[[int, int, bytes], None], failures: Failures
    ) -> None:
        self._capture = capture
        self._send = send
        self._failures = failures
        # number → stream, interval s (0: every frame)
        self._watched: dict[int, tuple[StreamSpec, float]] = {}
        self._rates: dict[int, Rate] = {}
        self.calibration: AppliedCalibration | None = None
        self._changed = threading.Event()
        self.encoded = 0

    def watch(self, streams: Mapping[int, tuple[StreamSpec, float]]) -> None:
        """Encode these and no others; a new one is sent the newest frame at once."""
        self._watched = dict(streams)
        self._changed.set()

    def apply(self, calibration: AppliedCalibration | None) -> None:
        self.calibration = calibration
        self._changed.set()

    def run(self) -> None:
        """Work until the process ends, on a thread of its own."""
        seq, done = 0, set[int]()
        while True:
            watched = self._watched
            if not watched:
                self._changed.wait(IDLE_S)
                self._changed.clear()
                done.clear()
                continue
            fresh = bool(set(watched) - done)
            # watch() said how often
            taken = self._capture.after(seq - 1 if fresh else seq, IDLE_S, in_passing=True)
            if taken is None:
                continue
            self._rates = {number: self._rates.get(number) or Rate() for number in watched}
            for number, (spec, interval_s) in watched.items():
                # A new stream is sent the newest frame at once; the others have had it.
                if number not in done or (
                    taken.seq > seq and self._rates[number].is_due(taken.moment, interval_s)
                ):
                    with self._failures.surviving("A picture could not be encoded"):
                        self._encode(number, spec, taken)
            seq, done = taken.seq, set(watched)

    def _encode(self, number: int, spec: StreamSpec, taken: CapturedFrame) -> None:
        begin = time.monotonic()
        head: dict[str, Any] = {"seq": taken.seq, "time": taken.time, "view": spec.view}
        calibration = self.calibration
        if calibration is not None and calibration.record.image_size != taken.frame.size:
            calibration = None
        raw = drawn = taken.frame.size
        try:
            if jpeg := passed_on(taken.frame, spec):
                more, overlays = described(spec, calibration, raw, drawn)
            else:
                pixels, more, overlays = render(taken.frame, spec, calibration)
                drawn = ImageSize(pixels.shape[1], pixels.shape[0])
                jpeg = encode(pixels, "jpg", spec.quality)
        except TouchlineError:
            # no calibration, or one that cannot be drawn at this size: the server says why; a
            # damaged picture
            return
        self.encoded += 1
        head |= more | {
            "width": drawn.width,
            "height": drawn.height,
            "raw_width": raw.width,
            "raw_height": raw.height,
            "spent_ms": round(1e3 * (time.monotonic() - begin), 2),
        }
        self._send(messages.PICTURE, number, encode_body(head, jpeg, overlays))
