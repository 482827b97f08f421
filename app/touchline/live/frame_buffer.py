"""In a camera's process: the last seconds of its picture, while somebody watches detections; and clips of it.

A camera's own JPEGs are stored as they came, other pictures as JPEG of all their colour (4:4:4): at half of it, as
usual, the small dots of a robot would run.
"""

import threading
import time
from collections import deque
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import BadImage
from touchline.core.geometry import ImageSize
from touchline.core.statements import say
from touchline.live.capture import CapturedFrame, FrameCapture, no_frames
from touchline.live.failures import Failures
from touchline.live.rate import Rate
from touchline.processes.limits import give_way

MAX_S = 30.0
FPS = 10.0  # encoding costs as much as detecting
MAX_BYTES = 120_000_000
QUALITY = 92
IDLE_S = 0.5
SILENT_S = 3.0
NICE = 10  # niceness: the picture and the detections go first


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
        items = [{"seq": one.seq, "time_s": round(one.time_s, 4), "bytes": len(one.jpeg)} for one in frames]
        size = frames[-1].size
        return {"width": size.width, "height": size.height, "frames": items}, b"".join(one.jpeg for one in frames)

    def _collect(self, seconds: float) -> list[BufferedFrame]:
        silent_until = time.monotonic() + SILENT_S
        newest = -1
        while True:
            with self._changed:
                self._changed.wait(IDLE_S)
                frames = list(self._frames)
            if frames and frames[-1].seq != newest:
                newest, silent_until = frames[-1].seq, time.monotonic() + SILENT_S
                clip = [one for one in frames if one.moment >= frames[-1].moment - seconds - 0.5 / FPS]
                full = frames[0].moment <= frames[-1].moment - seconds + 1.5 / FPS
                if full or self._bytes > 0.9 * MAX_BYTES:
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
            if rate.is_due(taken.moment, 1 / FPS):
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
            while self._bytes > MAX_BYTES or frame.moment - self._frames[0].moment > MAX_S:
                self._bytes -= len(self._frames.popleft().jpeg)
            self._changed.notify_all()

    def _clear(self) -> None:
        self._frames.clear()
        self._bytes = 0


def _encoded(pixels: NDArray[np.uint8]) -> bytes:
    done, buffer = cv2.imencode(".jpg", np.ascontiguousarray(pixels), [
        cv2.IMWRITE_JPEG_QUALITY, QUALITY, cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444])
    if not done:
        raise BadImage(say("frame.not-encodable", "A frame could not be encoded."),
                       say("frame.check-picture", "Check the camera's picture."), reason="not-encodable")
    return buffer.tobytes()
