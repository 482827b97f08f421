"""In a camera's process: draws and encodes each watched stream once, from the newest frame, and sends it.

A camera's own JPEG is passed on where it serves the stream as it is.
"""

import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

from touchline.core.errors import TouchlineError
from touchline.core.geometry import ImageSize
from touchline.images import encode
from touchline.live import messages
from touchline.live.capture import CapturedFrame, FrameCapture
from touchline.live.failures import Failures
from touchline.live.picture import AppliedCalibration, described, passed_on, render
from touchline.live.rate import Rate
from touchline.live.stream_spec import StreamSpec
from touchline.processes.framing import encode_body

IDLE_S = 0.5


class Encoder:
    """The drawing thread. Other threads say what to draw."""

    def __init__(self, capture: FrameCapture, send: Callable[[int, int, bytes], None], failures: Failures) -> None:
        self._capture = capture
        self._send = send
        self._failures = failures
        self._watched: dict[int, tuple[StreamSpec, float]] = {}  # number → stream, interval s (0: every frame)
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
            taken = self._capture.after(seq - 1 if fresh else seq, IDLE_S, in_passing=True)  # watch() said how often
            if taken is None:
                continue
            self._rates = {number: self._rates.get(number) or Rate() for number in watched}
            for number, (spec, interval_s) in watched.items():
                # A new stream is sent the newest frame at once; the others have had it.
                if number not in done or (taken.seq > seq and self._rates[number].is_due(taken.moment, interval_s)):
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
            return  # no calibration, or one that cannot be drawn at this size: the server says why; a damaged picture
        self.encoded += 1
        head |= more | {"width": drawn.width, "height": drawn.height, "raw_width": raw.width,
                        "raw_height": raw.height, "spent_ms": round(1e3 * (time.monotonic() - begin), 2)}
        self._send(messages.PICTURE, number, encode_body(head, jpeg, overlays))
