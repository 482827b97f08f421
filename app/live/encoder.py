"""In a camera's process: draws and encodes each watched channel once, from the newest frame, and hands it over."""

import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

from app.core.errors import TouchlineError
from app.images import encode
from app.live import messages
from app.live.capture import CapturedFrame, FrameCapture
from app.live.picture import AppliedCalibration, render
from app.live.stream_spec import StreamSpec

IDLE_S = 0.5
EARLY_SHARE = 0.25  # of a channel's interval: a frame so much too early is still taken, or every second would be lost


class Encoder:
    """The drawing thread. What to draw is told by other threads."""

    def __init__(self, capture: FrameCapture, send: Callable[[int, int, bytes], None]) -> None:
        self._capture = capture
        self._send = send
        self._watched: dict[int, tuple[StreamSpec, float]] = {}  # number → channel, interval s (0: every frame)
        self._due: dict[int, float] = {}
        self._shown: AppliedCalibration | None = None
        self._told = threading.Event()
        self.encoded = 0

    def start(self) -> None:
        threading.Thread(target=self._run, name="encoder", daemon=True).start()

    def watch(self, channels: Mapping[int, tuple[StreamSpec, float]]) -> None:
        """From now on, these and no others; a new one is sent the newest frame at once."""
        self._watched = dict(channels)
        self._told.set()

    def show(self, shown: AppliedCalibration | None) -> None:
        self._shown = shown
        self._told.set()

    @property
    def shown(self) -> AppliedCalibration | None:
        return self._shown

    def _run(self) -> None:
        seq, done = 0, set()
        while True:
            watched = self._watched
            if not watched:
                self._told.wait(IDLE_S)
                self._told.clear()
                done = set()
                continue
            fresh = bool(set(watched) - done)
            taken = self._capture.after(seq - 1 if fresh else seq, IDLE_S)
            if taken is None:
                continue
            for number, (channel, interval_s) in watched.items():
                # A new channel is shown the newest frame at once; the others have had it.
                if number not in done or (taken.seq > seq and self._is_due(number, taken, interval_s)):
                    self._hand_over(number, channel, taken)
            seq, done = taken.seq, set(watched)

    def _is_due(self, number: int, taken: CapturedFrame, interval_s: float) -> bool:
        due = self._due.get(number, 0.0)
        if taken.moment < due - EARLY_SHARE * interval_s:
            return False
        self._due[number] = max(due, taken.moment - interval_s) + interval_s
        return True

    def _hand_over(self, number: int, channel: StreamSpec, taken: CapturedFrame) -> None:
        begin = time.monotonic()
        head: dict[str, Any] = {"seq": taken.seq, "time": taken.time, "view": channel.view}
        shown = self._shown
        if channel.view != "raw" and shown is None:
            return  # the server tells the viewer why
        if shown is not None and shown.calibration.image_size != taken.frame.size:
            shown = None
            if channel.view != "raw":
                return
        try:
            pixels, more, tail = render(taken.frame.pixels, channel, shown)
            jpeg = encode(pixels, "jpg", channel.quality)
        except TouchlineError:
            return  # a model that cannot be drawn at this size: the still view says why
        self.encoded += 1
        head |= more | {"width": pixels.shape[1], "height": pixels.shape[0],
                        "raw_width": taken.frame.size.width, "raw_height": taken.frame.size.height,
                        "spent_ms": round(1e3 * (time.monotonic() - begin), 2)}
        self._send(messages.PICTURE, number, messages.message(head, jpeg, tail))
