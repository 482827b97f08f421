"""From frames of a still camera to what rolling things say about its lens: what the doors call.

    rolling = Rolling()
    for seconds, pixels in frames: new = rolling.add(seconds, pixels)       each a straight run that has just ended
    rolling.report(model)           Eq. (9) per roll, zone and lens: raw, and as far as the model leaves it
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.errors import BadInput, FitFailed
from app.evaluate.distortion import STANDARD_LENS_PCT
from app.evaluate.rolls import Rolls, rolls_of
from app.geometry import ImageSize
from app.models import CameraModel
from app.plumb_pipeline import straightness
from app.vision.movers import Movers
from app.vision.straight_runs import Run, straight_runs
from app.vision.tracks import Track, Tracker

MOST_UPSET = 0.1  # of the frames in which nearly all changed: the camera is not still
LEAST_FOR_LENS = 3  # rolls


class Rolling:
    """Follows what moves, cuts its tracks into straight runs, and keeps them. One thread at a time."""

    def __init__(self) -> None:
        self._movers, self._tracker = Movers(), Tracker()
        self._seconds: list[float] = []
        self._size: ImageSize | None = None
        self.runs: list[Run] = []

    def add(self, seconds: float, pixels: NDArray[np.uint8]) -> list[Run]:
        """A frame (h, w, 3) and when it was taken; the runs that have just ended. BadInput for another size."""
        size = ImageSize(pixels.shape[1], pixels.shape[0])
        if self._size is not None and size != self._size:
            raise BadInput("The frames differ in size.", "Use one camera in one mode.", reason="size-mismatch")
        self._size = size
        self._seconds.append(float(seconds))
        return self._cut(self._tracker.add(len(self._seconds) - 1, self._movers.add(pixels)))

    def end(self) -> list[Run]:
        """No more frames: what was still moving has ended too."""
        return self._cut(self._tracker.end())

    @property
    def now(self) -> list[Track]:
        """What is being followed."""
        return self._tracker.now

    def report(self, model: CameraModel | None = None, name: str | None = None) -> dict[str, Any]:
        """Everything so far as plain JSON; `corrected` where a model was given, `lens` where three rolls tell one."""
        if self._size is None:
            raise BadInput("There is no frame.", "Give a film, or wait for the camera.", reason="nothing-given")
        if self._movers.upset > MOST_UPSET * len(self._seconds) + 2:
            raise BadInput("Nearly the whole picture changes again and again: the camera is not still, or its light is "
                           "not.", "Fix the camera, and switch its automatic exposure off.", reason="camera-not-still")
        raw = rolls_of([run.points for run in self.runs], self._durations(), self._size)
        corrected = None
        if model is not None:
            corrected = rolls_of([model.corrected_from_raw(run.points) for run in self.runs], self._durations(),
                                 model.corrected_size)
        return {"frames": len(self._seconds), "seconds": self._seconds[-1] - self._seconds[0],
                "image_size": [self._size.width, self._size.height], "rolls": len(self.runs),
                "raw": raw.to_json(), "corrected": corrected.to_json() if corrected else None, "model": name,
                "runs": [{"from_s": self._seconds[run.frames[0]], "to_s": self._seconds[run.frames[-1]],
                          "points": run.points.round(2).tolist(), "rms_px": run.rms_px,
                          "straight_px": run.straight_px} for run in self.runs],
                "lens": self._lens(raw), "sentence": _sentence(raw, corrected)}

    def _durations(self) -> list[float]:
        return [self._seconds[run.frames[-1]] - self._seconds[run.frames[0]] for run in self.runs]

    def _cut(self, tracks: Sequence[Track]) -> list[Run]:
        new: list[Run] = []
        for track in tracks:
            new += straight_runs(track.frames, track.points, float(np.hypot(self._size.width, self._size.height)))
        self.runs += new
        return new

    def _lens(self, raw: Rolls) -> dict[str, Any] | None:
        """The rolls as plumb lines, fitted as edges are; None where they do not tell a lens."""
        quick = [run for run, roll in zip(self.runs, raw.rolls, strict=True) if roll.used]
        if len(quick) < LEAST_FOR_LENS:
            return None
        try:
            return straightness(lines=[run.points for run in quick], image_size=self._size)
        except FitFailed:
            return None


def _sentence(raw: Rolls, corrected: Rolls | None) -> str:
    told = raw if corrected is None else corrected
    if not told.rolls:
        return ("Nothing rolled straight for long enough: let a ball roll across the field, best near its borders and "
                "quickly.")
    where = "the raw picture" if corrected is None else "the corrected picture"
    left = f"{told.border_pct:+.2f} ± {told.border_sigma_pct:.2f} %"
    if told.border_sigma_pct > STANDARD_LENS_PCT:
        return (f"{_rolls(told)} in {where}: {left}. That is too uncertain to say anything: roll more, quickly, near "
                "the borders.")
    kind = "barrel" if told.border_pct < 0 else "pincushion"
    if abs(told.border_pct) <= 2 * told.border_sigma_pct:
        return f"{_rolls(told)} in {where}: no distortion is seen, {left} along its edge."
    band = "within" if abs(told.border_pct) <= STANDARD_LENS_PCT else "beyond"
    return (f"{_rolls(told)} in {where}: {kind} of {left} along its edge, {band} the ±{STANDARD_LENS_PCT:g} % of a "
            "standard lens.")


def _rolls(told: Rolls) -> str:
    return "One roll" if len(told.rolls) == 1 else f"{len(told.rolls)} rolls"
