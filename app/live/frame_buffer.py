"""In a camera's process: the last seconds of its picture, kept while somebody looks at what it sees; and clips of them.

Pictures are kept as JPEG of all their colour (4:4:4): at half of it, as usual, the small dots of a robot would run.
"""

import os
import threading
import time
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from app.core.errors import Unavailable
from app.core.geometry import ImageSize
from app.live.capture import CapturedFrame, FrameCapture

MAX_S = 30.0
FPS = 10.0  # encoding costs as much as seeing
MAX_BYTES = 120_000_000
QUALITY = 92
IDLE_S = 0.5
SILENT_S = 3.0
NICE = 10  # niceness: the picture and the seeing go first
EARLY_SHARE = 0.25  # of the interval


@dataclass(frozen=True)
class BufferedFrame:
    seq: int
    time_s: float
    size: ImageSize
    jpeg: bytes


class FrameBuffer:
    """The recording thread. keep() and clip() may be called from any thread."""

    def __init__(self, capture: FrameCapture) -> None:
        self._capture = capture
        self._changed = threading.Condition()
        self._kept: deque[BufferedFrame] = deque()
        self._bytes = 0
        self._watched = False
        self._asked = 0

    def start(self) -> None:
        threading.Thread(target=self._run, name="ring", daemon=True).start()

    def keep(self, watched: bool) -> None:
        """Whether somebody looks from now on."""
        with self._changed:
            self._watched = watched
            self._changed.notify_all()

    def clip(self, seconds: float) -> tuple[dict[str, Any], bytes]:
        """The last seconds as far as they are kept, else from then on until there are so many."""
        with self._changed:
            if not self._watched and not self._asked:
                self._clear()  # of long ago
            self._asked += 1
            self._changed.notify_all()
        try:
            frames = self._frames(seconds)
        finally:
            with self._changed:
                self._asked -= 1
        told = [{"seq": kept.seq, "time_s": round(kept.time_s, 4), "bytes": len(kept.jpeg)} for kept in frames]
        size = frames[-1].size
        return {"width": size.width, "height": size.height, "frames": told}, b"".join(kept.jpeg for kept in frames)

    def _frames(self, seconds: float) -> list[BufferedFrame]:
        silent_until = time.monotonic() + SILENT_S
        newest = -1
        while True:
            with self._changed:
                self._changed.wait(IDLE_S)
                kept = list(self._kept)
            if kept and kept[-1].seq != newest:
                newest, silent_until = kept[-1].seq, time.monotonic() + SILENT_S
                wanted = [one for one in kept if one.time_s >= kept[-1].time_s - seconds - 0.5 / FPS]
                full = kept[0].time_s <= kept[-1].time_s - seconds + 1.5 / FPS
                if full or self._bytes > 0.9 * MAX_BYTES:
                    return wanted
            elif time.monotonic() > silent_until:
                raise Unavailable("The camera gives no frames now.", "Look at its state, then try again.",
                                  reason="camera-silent")

    def _run(self) -> None:
        with suppress(OSError, AttributeError):  # of this thread alone, on Linux
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), NICE)
        seq, due = 0, 0.0
        while True:
            with self._changed:
                if not (self._watched or self._asked):
                    if self._kept:
                        self._clear()
                    self._changed.wait(IDLE_S)
                    continue
            taken = self._capture.after(seq, IDLE_S)
            if taken is None:
                continue
            seq = taken.seq
            if taken.moment >= due - EARLY_SHARE / FPS:
                due = max(due, taken.moment - 1 / FPS) + 1 / FPS
                self._keep(taken)

    def _keep(self, taken: CapturedFrame) -> None:
        done, buffer = cv2.imencode(".jpg", np.ascontiguousarray(taken.frame.pixels), [
            cv2.IMWRITE_JPEG_QUALITY, QUALITY,
            cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444])
        if not done:
            return
        kept = BufferedFrame(taken.seq, taken.time, taken.frame.size, buffer.tobytes())
        with self._changed:
            if self._kept and self._kept[-1].size != kept.size:
                self._clear()  # a clip is of one size
            self._kept.append(kept)
            self._bytes += len(kept.jpeg)
            while self._bytes > MAX_BYTES or kept.time_s - self._kept[0].time_s > MAX_S:
                self._bytes -= len(self._kept.popleft().jpeg)
            self._changed.notify_all()

    def _clear(self) -> None:
        self._kept.clear()
        self._bytes = 0
