"""From frames of a still camera to straight rolls, and what they tell of its lens.

    rolling = RollRecorder()
    for seconds, pixels in frames: new = rolling.add(seconds, pixels)       each a straight roll that has just ended
    rolling.report(model)           Eq. (9) per roll, zone and lens: raw, and as far as the model leaves it
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.core.common_sentences import SECURE_CAMERA
from touchline.core.errors import BadInput, FitFailed
from touchline.core.geometry import ImageSize
from touchline.core.statements import say
from touchline.evaluate.motion.roll_report import RecordedRoll, roll_report
from touchline.models import CameraModel
from touchline.vision.motion.foreground import MotionDetector
from touchline.vision.motion.straight_runs import StraightRun, straight_runs
from touchline.vision.motion.tracks import Track, Tracker
from touchline.workflows.straight_lines import straightness

MAX_UPSET_SHARE = 0.1  # of the frames in which nearly all changed: the camera is not still
UPSET_ANYWAY = 2  # times that light may be switched
MIN_FOR_LENS = 3  # rolls
LOOK_EVERY = 8  # frames, at what is still being followed
SETTLED = 6  # frames after its end until a roll is reported: until then it may still go on
MAX_OPEN_POINTS = 240  # points of a track that are looked at before it has ended: what stands and shakes has no end
KNOWN_FRAMES = 4096  # whose times are remembered; tracks are shorter


class RollRecorder:
    """Tracks what moves, cuts tracks into straight rolls, and collects them. One thread at a time.

    live: report a roll soon after its end, while its track is still open.
    """

    def __init__(self, live: bool = False) -> None:
        self._movers, self._tracker = MotionDetector(), Tracker()
        self._live = live
        self._times: dict[int, float] = {}
        self._first_s = self._last_s = 0.0
        self._size: ImageSize | None = None
        self.frames = 0
        self.rolls: list[RecordedRoll] = []

    def add(self, seconds: float, pixels: NDArray[np.uint8], number: int | None = None) -> list[RecordedRoll]:
        """Add a frame (h, w, 3), when it was taken, and its number where some were missed; return the rolls just ended.

        BadInput for another size.
        """
        size = ImageSize(pixels.shape[1], pixels.shape[0])
        if self._size is not None and size != self._size:
            raise BadInput(say("rolls.frames-differ", "The frames have different sizes."),
                           say("rolls.one-resolution", "Use one camera at one resolution."), reason="size-mismatch")
        self._size = size
        number = self.frames if number is None else number
        self._first_s = float(seconds) if not self.frames else self._first_s
        self._last_s = self._times[number] = float(seconds)
        if len(self._times) > KNOWN_FRAMES:
            del self._times[next(iter(self._times))]
        self.frames += 1
        ended = self._cut(self._tracker.add(number, self._movers.add(pixels)))
        return ended + (self._settled(number) if self._live and self.frames % LOOK_EVERY == 0 else [])

    def end(self) -> list[RecordedRoll]:
        """End all tracks; return their rolls."""
        return self._cut(self._tracker.end())

    @property
    def now(self) -> list[Track]:
        """The open tracks."""
        return self._tracker.now

    @property
    def is_still(self) -> bool:
        """Whether the camera stands still: not where nearly the whole picture changes again and again."""
        return self._movers.upset <= MAX_UPSET_SHARE * self.frames + UPSET_ANYWAY

    @property
    def size(self) -> ImageSize:
        if self._size is None:
            raise BadInput(say("rolls.no-frames", "There are no frames."),
                           say("rolls.use-video", "Use a video, or wait for the camera."), reason="nothing-given")
        return self._size

    def report(self, model: CameraModel | None = None, name: str | None = None) -> dict[str, Any]:
        """Return all figures as plain JSON; `corrected` where a model was given, `lens` where three rolls give one."""
        figures = roll_report(self.rolls, self.size, model, name)
        if not self.is_still:
            raise BadInput(say("rolls.not-still", "Nearly the whole image changes repeatedly: the camera or its "
                               "light is not steady."), SECURE_CAMERA, reason="camera-not-still")
        return {**figures, "frames": self.frames, "seconds": self._last_s - self._first_s,
                "runs": [roll.to_json() for roll in self.rolls], "lens": lens_or_none(self.rolls, figures, self.size)}

    def _cut(self, tracks: Sequence[Track]) -> list[RecordedRoll]:
        new = [self._rolled(run) for track in tracks for run in self._runs(track)]
        self.rolls += new
        return new

    def _settled(self, now: int) -> list[RecordedRoll]:
        """Return rolls that have ended within open tracks; a ball that is kicked again and again is one track."""
        new: list[RecordedRoll] = []
        for track in self._tracker.now:
            runs = self._runs(track)
            done = [run for run in runs if run.frames[-1] <= now - SETTLED]
            new += [self._rolled(run) for run in done]
            if done:
                self._tracker.forget(track.number, int(done[-1].frames[-1]))
            elif not runs and len(track.points) > MAX_OPEN_POINTS:
                self._tracker.forget(track.number, int(track.frames[MAX_OPEN_POINTS // 2]))
        self.rolls += new
        return new

    def _runs(self, track: Track) -> list[StraightRun]:
        return straight_runs(track.frames, track.points, float(np.hypot(self.size.width, self.size.height)))

    def _rolled(self, run: StraightRun) -> RecordedRoll:
        return RecordedRoll(run.points, self._times[int(run.frames[0])], self._times[int(run.frames[-1])], run.rms_px,
                            run.straight_px)


def lens_or_none(rolls: Sequence[RecordedRoll], figures: dict[str, Any], size: ImageSize) -> dict[str, Any] | None:
    """Fit the rolls as plumb lines, as edges are; None where they give no lens. figures: their report."""
    quick = agreeing_rolls(rolls, figures)
    if len(quick) < MIN_FOR_LENS:
        return None
    try:
        return straightness((), [roll.points for roll in quick], size)
    except FitFailed:
        return None


def agreeing_rolls(rolls: Sequence[RecordedRoll], figures: dict[str, Any]) -> list[RecordedRoll]:
    """Return those that agree with the others, by their report."""
    return [rolls[roll["number"]] for roll in figures["raw"]["rolls"] if roll["used"]]
