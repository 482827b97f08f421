"""In a camera's process: read its source without a pause, keep only the newest frame, and take exact snapshots.

A source that says it is off is opened anew after 0.5 s, then after twice as long each time, up to 5 s, for ever. One
that hangs is not noticed here: the server sees that no frame comes, and kills the whole process.

A source that makes its pictures itself makes no more of them than somebody needs: as many as who watches the most of
them asks for, and while nobody does one a second, to be looked at for light and focus. A real camera gives all it has:
what it would not be asked for piles up, and the next picture would be an old one.
"""

import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import ProblemJson, TouchlineError, Unavailable
from touchline.core.records import Frame
from touchline.core.sentences import (
    CHECK_STATE_TRY_AGAIN,
    REPEAT,
    SENDS_NO_FRAMES,
    SERIES_MOVED,
    SERIES_MOVED_FIX,
)
from touchline.core.statements import say
from touchline.images import encode
from touchline.live.messages import CaptureStatus, MeasuredRate, SourceState
from touchline.processes.framing import problem_json
from touchline.processes.limits import return_memory
from touchline.sources import Control, IdentityJson, Source, SourceContext, source_from_url
from touchline.vision.background import Background, camera_shift_px

RETRY_S, MAX_RETRY_S = 0.5, 5.0
ENDED = "source-ended"
REST_S = 1.0  # between two frames that nobody needs
RESTS_AFTER_S = 10.0  # not all needed for so long: whoever comes back soon finds it awake

MAX_FRAMES = 60
STILL_PX = 1.0  # a camera that stands seems to move by a third of it


@dataclass(frozen=True, eq=False)
class CapturedFrame:
    """One frame as it was taken. time: unix, s; moment: on this process' own steady clock, s."""

    frame: Frame
    seq: int
    time: float
    moment: float


class FrameCapture:
    """The reading thread. Everything public may be called from other threads."""

    def __init__(self, url: str, around: SourceContext) -> None:
        self._url = url
        self._around = around
        self._changed = threading.Condition()
        self._newest: CapturedFrame | None = None
        self._seq = 0
        self._rate = MeasuredRate()
        self._state: SourceState = "connecting"
        self._problem: ProblemJson | None = None
        self._since = time.monotonic()
        self._identity: IdentityJson | None = None
        self._reopened = 0
        self._watched_s = REST_S
        self._can_rest = False
        self._awake_until = 0.0
        self._actions: deque[tuple[Callable[[Source], Any], Future[Any]]] = deque()

    def status(self) -> CaptureStatus:
        """Return what the server needs to judge it by; ages in s on this process' clock."""
        now = time.monotonic()
        with self._changed:
            newest = self._newest
            return {
                "state": self._state,
                "problem": self._problem,
                "since_s": now - self._since,
                "seq": self._seq,
                "interval_s": max(self._rate.interval_s, self._pace_s),
                "identity": self._identity,
                "reopened": self._reopened,
                "age_s": now - newest.moment if newest else None,
                "size": list(newest.frame.size) if newest else None,
            }

    @property
    def resting(self) -> bool:
        """Whether fewer frames are made than there could be, because nobody needs more."""
        return self._pace_s > 0

    @property
    def _pace_s(self) -> float:
        """The time from frame to frame that is enough for all, s; 0: all frames are needed."""
        return self._watched_s if self._can_rest and time.monotonic() >= self._awake_until else 0.0

    def watch(self, interval_s: float) -> None:
        """Give a frame at least so often from now on, 0: every one; where nobody watches, REST_S."""
        interval_s = min(interval_s, REST_S)
        with self._changed:
            if 0 in (interval_s, self._watched_s):
                self._wake()
            elif self.resting and interval_s < self._watched_s:
                self._forget_rate()
            self._watched_s = interval_s

    def _wake(self) -> None:
        if self.resting:
            self._forget_rate()
        self._awake_until = time.monotonic() + RESTS_AFTER_S

    def _forget_rate(self) -> None:
        """Begin a faster one at once: the rate while it rested is not the camera's."""
        self._rate.clear()
        self._changed.notify_all()

    def after(self, seq: int, timeout_s: float, in_passing: bool = False) -> CapturedFrame | None:
        """Return the newest frame if it is newer than seq, or the next one; None when none comes in time.

        in_passing: no frame is made for this alone.
        """
        with self._changed:
            if not in_passing:
                self._wake()
            self._changed.wait_for(lambda: self._newest is not None and self._seq > seq, timeout_s)
            return self._newest if self._newest is not None and self._seq > seq else None

    def next(self, seq: int, timeout_s: float) -> CapturedFrame:
        """Return the same; Unavailable where none comes in time."""
        if (taken := self.after(seq, timeout_s)) is None:
            raise no_frames()
        return taken

    def controls(self, timeout_s: float = 3.0) -> tuple[Control, ...]:
        """Return what can be set, read back between two frames."""
        return self._between_frames(lambda source: source.controls(), timeout_s)

    def set_control(self, name: str, value: Any, timeout_s: float = 3.0) -> Control:
        return self._between_frames(lambda source: source.set_control(name, value), timeout_s)

    def _between_frames(self, action: Callable[[Source], Any], timeout_s: float) -> Any:
        answer: Future[Any] = Future()
        with self._changed:
            self._actions.append((action, answer))
            self._wake()
        try:
            return answer.result(timeout_s)
        except TimeoutError:
            answer.cancel()  # it may not be done any more: nobody would know
            raise Unavailable(
                say(
                    "camera.settings-locked",
                    "The camera sends no frames, so its settings cannot be changed.",
                ),
                say("advice.wait-until-live", "Wait until it is live again, then try again."),
                reason="camera-silent",
            ) from None

    def run(self) -> None:
        """Work until the process ends, on a thread of its own."""
        wait_s = RETRY_S
        while True:
            try:
                source = source_from_url(self._url, self._around)
            except Exception as error:
                self._fail(_explained(error))
            else:
                if self._read(source):
                    wait_s = RETRY_S
            if self._problem is not None and self._problem["reason"] == ENDED:
                # a film that is not to be shown again: its last picture stays, called offline
                return
            time.sleep(wait_s)
            wait_s = min(2 * wait_s, MAX_RETRY_S)

    def _read(self, source: Source) -> bool:
        """Read until it fails; return whether a frame came at all."""
        came = False
        try:
            with self._changed:
                self._identity, self._reopened = source.identity().to_json(), self._reopened + 1
                self._can_rest = source.CAN_REST
                self._wake()
            while True:
                begun = time.monotonic()
                self._keep(source.read())
                if not came:
                    # opening may have taken much more than what is kept: a field is painted
                    return_memory()
                came = True
                while self._actions:
                    _answer(source, *self._actions.popleft())
                self._rest(source, begun)
        except Exception as error:
            self._fail(_explained(error))
        finally:
            source.close()
        return came

    def _rest(self, source: Source, begun: float) -> None:
        """Wait until another frame is needed, and let the time since the last was begun go by in the source, too."""
        rested_s = 0.0
        with self._changed:
            while (left_s := begun + self._pace_s - time.monotonic()) > 0:
                self._changed.wait(left_s)
                rested_s = time.monotonic() - begun
        if rested_s:
            source.pass_over(rested_s)

    def _keep(self, frame: Frame) -> None:
        now = time.monotonic()
        with self._changed:
            self._rate.add(now)
            self._seq += 1
            self._newest = CapturedFrame(frame, self._seq, time.time(), now)
            if self._state != "live":
                self._state, self._problem, self._since = "live", None, now
            self._changed.notify_all()

    def _fail(self, error: TouchlineError) -> None:
        with self._changed:
            if self._state != "offline":
                self._since = time.monotonic()
            self._rate.clear()
            self._state = "offline"
            self._problem = problem_json(error)


def no_frames() -> Unavailable:
    """Return the error for a camera from which nothing comes."""
    return Unavailable(SENDS_NO_FRAMES, CHECK_STATE_TRY_AGAIN, reason="camera-silent")


def _answer(source: Source, action: Callable[[Source], Any], answer: Future[Any]) -> None:
    if answer.set_running_or_notify_cancel():
        try:
            answer.set_result(action(source))
        except Exception as error:
            answer.set_exception(_explained(error))


def _explained(error: Exception) -> TouchlineError:
    if isinstance(error, TouchlineError):
        return error
    return Unavailable(
        say("source.failed", "The source failed: {error}.", error=type(error).__name__),
        say("advice.check-camera-and-address", "Check the camera and its address."),
        reason="source-failed",
    )


def take_still(
    capture: FrameCapture, frames: int, over_s: float, timeout_s: float
) -> tuple[dict[str, Any], bytes]:
    """Return the next frame, or what most of so many agree on that are spread over so long; a PNG.

    The JSON says how many frames went in, when the first and last were taken, and which share of the pixels was never
    seen free of moving things. Unavailable where frames do not come, and where the camera moved meanwhile.
    """
    deadline = time.monotonic() + timeout_s
    first = last = capture.next(capture.status()["seq"], timeout_s)
    if frames <= 1:
        return _description(first, last, 1, None), encode(first.frame.pixels, "png")
    background = Background(first.frame.pixels.shape, min(frames, MAX_FRAMES))
    background.add(first.frame.pixels)
    count, begun, frames = 1, first.moment, min(frames, MAX_FRAMES)
    while count < frames:
        # Who walks by needs some seconds to leave: frames that follow each other would all show them.
        time.sleep(max(0.0, begun + over_s * count / (frames - 1) - time.monotonic()))
        taken = capture.next(last.seq, max(0.0, deadline - time.monotonic()))
        if taken.frame.pixels.shape != first.frame.pixels.shape:
            raise Unavailable(
                say("image.size-changed", "The image size changed while the image was taken."),
                REPEAT,
                reason="size-changed",
            )
        if camera_shift_px(first.frame.pixels, taken.frame.pixels) > STILL_PX:
            raise Unavailable(SERIES_MOVED, SERIES_MOVED_FIX, reason="series-moved")
        last = taken
        background.add(taken.frame.pixels)
        count += 1
    return _description(first, last, count, background.unsettled), encode(background.picture, "png")


def _description(
    first: CapturedFrame, last: CapturedFrame, count: int, unsettled: NDArray[np.bool_] | None
) -> dict[str, Any]:
    size = first.frame.size
    return {
        "frames": count,
        "seq": last.seq,
        "time": first.time,
        "until": last.time,
        "width": size.width,
        "height": size.height,
        "hidden_share": None if unsettled is None else float(np.mean(unsettled)),
    }
