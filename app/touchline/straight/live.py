"""In a camera's process: what rolls before it, followed frame by frame, only while somebody polls.

    poll → followed → a roll has ended → returned by the next poll → no poll for KEEP_S → rests

Rolls are numbered within one watch; `watch` is another word whenever the following began anew: then numbers do too.
"""

import secrets
import threading
import time
from collections import deque

import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import BadImage
from touchline.core.json_values import JsonObject
from touchline.core.sentences import SECURE_CAMERA
from touchline.core.statements import join, say, stated
from touchline.live.camera_part import CameraPart, PartContext
from touchline.live.capture import CapturedFrame, FrameCapture, no_frames
from touchline.processes.limits import give_way
from touchline.straight.rolling import RollRecorder

KEEP_S = 3.0  # without a poll: then nobody watches any more
WAIT_S = 2.0  # for the next frame
MAX_ROLLS = 100  # rolls that somebody may still ask for
NICE = 5  # niceness: the picture goes first, and yet frames should not be missed
MAX_DRAWN_FRAMES = 240  # newest points of a track that are drawn, as
MAX_DRAWN_POINTS = 40
MIN_MOVED_SHARE = 0.02  # of the picture's width: what has come less far stands
PICTURE_CHANGES = say("rolls.picture-changes", "Nearly the whole picture changes repeatedly.")


class RollPart(CameraPart):
    """Rolls before the camera, in its process."""

    def __init__(self, around: PartContext) -> None:
        monitor = RollMonitor(around.capture)
        self.requests = {
            "rolls": lambda asked: (monitor.poll(asked["watch"], asked["after"], asked["seq"]), b"")
        }


class RollMonitor:
    """Follows while it is polled. poll() may be called from any thread."""

    def __init__(self, capture: FrameCapture) -> None:
        self._capture = capture
        self._lock = threading.Condition()
        self._follow_until = 0.0
        self._thread: threading.Thread | None = None
        self._newest: JsonObject | None = None
        self._rolls: deque[JsonObject] = deque(maxlen=MAX_ROLLS)

    def poll(self, watch: str, after: int, seq: int) -> JsonObject:
        """Return what moves in a frame after that one, and the rolls after that number; of another watch all."""
        with self._lock:
            self._follow_until = time.monotonic() + KEEP_S
            if self._thread is None:
                self._newest = None
                self._thread = threading.Thread(target=self._follow, name="rolls", daemon=True)
                self._thread.start()
            self._lock.wait_for(
                lambda: (
                    self._newest is not None
                    and (self._newest["seq"] != seq or self._newest["watch"] != watch)
                ),
                WAIT_S,
            )
            if self._newest is None or self._newest["seq"] == seq:
                raise no_frames()
            after = after if self._newest["watch"] == watch else 0
            return {
                **self._newest,
                "rolls": [roll for roll in self._rolls if roll["number"] > after],
            }

    def _follow(self) -> None:
        give_way(NICE)
        watch, seq = _Watch(), 0
        self._rolls.clear()
        while True:
            taken = self._capture.after(seq, WAIT_S)
            with self._lock:
                if time.monotonic() > self._follow_until:
                    self._thread = None
                    return
            if taken is None:
                continue
            seq, size = taken.seq, taken.frame.size
            try:
                pixels = taken.frame.pixels
            except BadImage:  # the next one is whole again
                continue
            if watch.recorder.frames and watch.recorder.size != size:
                watch = _Watch()
            new = watch.add(taken, pixels)
            with self._lock:
                if watch.count == len(new):  # those that are there are of the watch before
                    self._rolls.clear()
                self._rolls.extend(new)
                self._newest = stated(
                    {
                        "watch": watch.id,
                        "seq": seq,
                        "time": taken.time,
                        "width": size.width,
                        "height": size.height,
                        "tracks": _drawn_tracks(watch.recorder, size.width),
                        "hint": ""
                        if watch.recorder.is_still
                        else join(PICTURE_CHANGES, SECURE_CAMERA),
                    }
                )
                self._lock.notify_all()


class _Watch:
    """The following of frames of one size, from one beginning. count: its rolls so far."""

    def __init__(self) -> None:
        self.id, self.recorder, self.count = secrets.token_hex(6), RollRecorder(live=True), 0

    def add(self, taken: CapturedFrame, pixels: NDArray[np.uint8]) -> list[JsonObject]:
        """Follow into the next frame; return the rolls that have ended, as poll() does."""
        ended = self.recorder.add(taken.moment, pixels, taken.seq)
        self.recorder.rolls.clear()  # they go to whoever polls, and are stored there
        new = []
        for roll in ended:
            self.count += 1
            # Watch and four digits of a roll's number are its id.
            new.append(
                {
                    "number": self.count,
                    "id": f"{self.id}{self.count % 65536:04x}",
                    "at": round(taken.time - (taken.moment - roll.to_s), 3),
                    "seconds": roll.seconds,
                    "points": roll.points.round(2).tolist(),
                    "times": [] if roll.times_s is None else roll.times_s.round(6).tolist(),
                    "rms_px": roll.rms_px,
                    "straight_px": roll.straight_px,
                }
            )
        return new


def _drawn_tracks(recorder: RollRecorder, width_px: int) -> list[list[list[float]]]:
    """Return where things came from in the last seconds, px; what stands is not drawn."""
    tracks = []
    for track in recorder.open_tracks:
        recent = track.points[-MAX_DRAWN_FRAMES:]
        if np.ptp(recent, axis=0).max() < MIN_MOVED_SHARE * width_px:
            continue
        drawn = np.unique(np.linspace(0, len(recent) - 1, MAX_DRAWN_POINTS).round().astype(int))
        tracks.append(recent[drawn].round(1).tolist())
    return tracks
