"""In a camera's process: pictures of what each detection stage made of a frame, encoded beside the detecting."""

import threading
import time
from collections.abc import Callable, Mapping

from touchline.core.errors import TouchlineError
from touchline.core.statements import say
from touchline.images import encode
from touchline.live import messages
from touchline.live.capture import CapturedFrame
from touchline.live.failures import Failures
from touchline.live.picture import scaled_down
from touchline.live.rate import Rate
from touchline.live.stream_spec import StreamSpec
from touchline.processes.framing import encode_body
from touchline.vision.stage_pipeline import FrameResult
from touchline.vision.stages.localisation import FieldLocator
from touchline.workflows.detection import detections_image

MIN_INTERVAL_S = 1 / 15  # between two pictures of a stream: drawing costs as much as detecting


class StageRenderer:
    """The drawing thread: one frame at a time, and none is kept waiting for it."""

    def __init__(self, send: Callable[[int, int, bytes], None], failures: Failures) -> None:
        self._send, self._failures = send, failures
        self._rates: dict[int, Rate] = {}
        self._came = threading.Event()
        self._work: tuple[CapturedFrame, FrameResult, Mapping[int, StreamSpec], FieldLocator] | None = None

    def due(self, streams: Mapping[int, tuple[StreamSpec, float]], taken: CapturedFrame) -> dict[int, StreamSpec]:
        """Return which of these a frame is to be drawn for; none while another is being drawn."""
        self._rates = {number: self._rates.get(number) or Rate() for number in streams}
        if self._work is not None:
            return {}
        return {number: spec for number, (spec, interval_s) in streams.items()
                if self._rates[number].is_due(taken.moment, max(interval_s, MIN_INTERVAL_S))}

    def offer(self, taken: CapturedFrame, result: FrameResult, streams: Mapping[int, StreamSpec],
              view: FieldLocator) -> None:
        self._work = (taken, result, streams, view)
        self._came.set()

    def run(self) -> None:
        """Work until the process ends, on a thread of its own."""
        while True:
            self._came.wait()
            self._came.clear()
            if self._work is not None:
                with self._failures.surviving(say("camera-failure.drawing", "Detections are not drawn")):
                    self._render(*self._work)
                self._work = None

    def _render(self, taken: CapturedFrame, result: FrameResult, streams: Mapping[int, StreamSpec],
                view: FieldLocator) -> None:
        marked = None
        for number, spec in streams.items():
            begin = time.monotonic()
            if spec.stage is not None:
                picture = result.pictures.get(spec.stage)  # None: the plan has no such stage now
            else:
                marked = detections_image(taken.frame.pixels, result.detections, view) if marked is None else marked
                picture = marked
            if picture is None:
                continue
            try:
                pixels = scaled_down(picture, spec.width)
                jpeg = encode(pixels, "jpg", spec.quality)
            except TouchlineError:
                continue
            raw = taken.frame.size
            head = {"seq": taken.seq, "time": taken.time, "view": spec.view, "width": pixels.shape[1],
                    "height": pixels.shape[0], "raw_width": raw.width, "raw_height": raw.height,
                    "spent_ms": round(1e3 * (time.monotonic() - begin), 2)}
            self._send(messages.PICTURE, number, encode_body(head, jpeg))
