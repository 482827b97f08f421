"""In a camera's process: pictures of what the stages of seeing made of a frame, drawn and encoded beside the seeing."""

import threading
import time
from collections.abc import Callable, Mapping

from app.core.errors import TouchlineError
from app.images import encode
from app.live import messages
from app.live.capture import CapturedFrame
from app.live.picture import scaled_down
from app.live.stream_spec import StreamSpec
from app.vision.stage_pipeline import FrameResult
from app.vision.stages.localisation import FieldLocator
from app.workflows.detection import detections_image

MIN_INTERVAL_S = 1 / 15  # between two pictures of a channel: drawing costs as much as seeing
EARLY_SHARE = 0.25  # of that: a frame so much too early is still taken


class StageRenderer:
    """The drawing thread: one frame at a time, and none is kept waiting for it."""

    def __init__(self, send: Callable[[int, int, bytes], None]) -> None:
        self._send = send
        self._due: dict[int, float] = {}
        self._came = threading.Event()
        self._work: tuple[CapturedFrame, FrameResult, Mapping[int, StreamSpec], FieldLocator] | None = None

    def start(self) -> None:
        threading.Thread(target=self._run, name="painter", daemon=True).start()

    def due(self, channels: Mapping[int, tuple[StreamSpec, float]], taken: CapturedFrame) -> dict[int, StreamSpec]:
        """Which of these a frame is to be drawn for; none while another is being drawn."""
        self._due = {number: at for number, at in self._due.items() if number in channels}
        if self._work is not None:
            return {}
        wanted = {}
        for number, (channel, interval_s) in channels.items():
            interval_s = max(interval_s, MIN_INTERVAL_S)
            at = self._due.get(number, 0.0)
            if taken.moment >= at - EARLY_SHARE * interval_s:
                self._due[number] = max(at, taken.moment - interval_s) + interval_s
                wanted[number] = channel
        return wanted

    def offer(self, taken: CapturedFrame, seen: FrameResult, channels: Mapping[int, StreamSpec],
              view: FieldLocator) -> None:
        self._work = (taken, seen, channels, view)
        self._came.set()

    def _run(self) -> None:
        while True:
            self._came.wait()
            self._came.clear()
            if self._work is not None:
                try:
                    self._paint(*self._work)
                finally:
                    self._work = None

    def _paint(self, taken: CapturedFrame, seen: FrameResult, channels: Mapping[int, StreamSpec],
               view: FieldLocator) -> None:
        marked = None
        for number, channel in channels.items():
            begin = time.monotonic()
            if channel.stage is not None:
                picture = seen.pictures.get(channel.stage)  # None: the plan has no such stage now
            else:
                marked = detections_image(taken.frame.pixels, seen.detections, view) if marked is None else marked
                picture = marked
            if picture is None:
                continue
            try:
                pixels = scaled_down(picture, channel.width)
                jpeg = encode(pixels, "jpg", channel.quality)
            except TouchlineError:
                continue
            raw = taken.frame.size
            head = {"seq": taken.seq, "time": taken.time, "view": channel.view, "width": pixels.shape[1],
                    "height": pixels.shape[0], "raw_width": raw.width, "raw_height": raw.height,
                    "spent_ms": round(1e3 * (time.monotonic() - begin), 2)}
            self._send(messages.PICTURE, number, messages.message(head, jpeg))
