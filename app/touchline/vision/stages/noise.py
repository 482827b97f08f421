"""Less grain before colours are told: the median of 3 × 3, a bilateral filter, or the same pixel over time."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar

import cv2
import numpy as np

from touchline.core.options import Option
from touchline.vision.stages import FrameState, Picture, Stage, StageContext


class NoiseReduction(Stage):
    """Over time, a pixel that has changed by less than `still` is a mixture of what it was and what it is."""

    NAME: ClassVar = "noise"
    TITLE: ClassVar = "Noise reduction"
    HELP: ClassVar = "Reduces image noise before colour classification."
    OPTIONS: ClassVar = (
        Option("method", "choice", "none", "Method: none, the median of 3 × 3, bilateral, or over time.",
               choices=("none", "median", "bilateral", "temporal")),
        Option("strength", "float", 0.6, "Over time: weight of the past frames.", (0, 0.95)),
        Option("still", "float", 18.0, "Over time: pixels that change by more are treated as moving and are not "
                                       "filtered.", (1, 255),
               "grey levels"),
    )

    def __init__(self, options: Mapping[str, Any], context: StageContext) -> None:
        super().__init__(options, context)
        self._before: Picture | None = None

    def run(self, state: FrameState) -> FrameState:
        method, pixels = self._options["method"], state.pixels
        if method == "none":
            return state
        if method == "median":
            return replace(state, clean=np.asarray(cv2.medianBlur(pixels, 3), np.uint8))
        if method == "bilateral":
            return replace(state, clean=np.asarray(cv2.bilateralFilter(pixels, 5, 25, 2), np.uint8))
        return replace(state, clean=self._over_time(pixels))

    def _over_time(self, pixels: Picture) -> Picture:
        if self._before is None or self._before.shape != pixels.shape:
            self._before = pixels.copy()
            return self._before
        share = self._options["strength"]
        mixed = np.asarray(cv2.addWeighted(self._before, share, pixels, 1 - share, 0), np.uint8)
        change = cv2.absdiff(pixels, self._before)
        # A pixel moves as a whole: no channel lags behind the others.
        most = cv2.max(cv2.max(change[..., 0], change[..., 1]), change[..., 2])
        moving = cv2.compare(most, self._options["still"], cv2.CMP_GT)
        cv2.copyTo(pixels, moving, mixed)
        self._before = mixed
        return mixed

    def picture(self, state: FrameState) -> Picture:
        return state.clean
