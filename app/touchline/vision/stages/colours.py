"""Each pixel's colour from a lookup table, which follows the light.

Only colours that are looked for everywhere go into the labels; the others are read where a robot is.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar

import cv2
import numpy as np

from touchline.core.colour_profile import NAMES, Bgr
from touchline.core.options import Option
from touchline.vision.colour.learning import mean_light
from touchline.vision.colour.table import as_bgr, in_light, table_of
from touchline.vision.stages import FrameState, Picture, Stage, StageContext

_EVERY = 5  # frames; lamps and clouds are slower
_NEW = 0.25  # of a fresh measure of the light, in what is believed
_STEP = 1.04  # a table is made anew when the light has changed by that
_MAX_GAIN, _MIN_GAIN = 2.5, 0.4  # beyond that, the picture shows something else


class Colours(Stage):
    NAME: ClassVar = "colours"
    TITLE: ClassVar = "Colours"
    HELP: ClassVar = "Classifies the colour of each pixel with a lookup table, learned from a few samples."
    OPTIONS: ClassVar = (
        Option("everywhere", "names", ("orange", "yellow", "blue"), "Colours that are searched for in the whole image.",
               choices=tuple(NAMES)),
        Option("follow", "bool", True, "Follow slow changes of the light."),
    )

    def __init__(self, options: Mapping[str, Any], context: StageContext) -> None:
        super().__init__(options, context)
        self._learned_in = context.profile.light
        self._table, self._names = table_of(context.profile)
        wanted = np.array([False] + [name in options["everywhere"] for name in self._names])
        self._wanted = np.where(wanted[self._table], self._table, 0).astype(np.uint8)
        self._gain: np.ndarray = np.ones(3)
        self._gain_of_table = np.ones(3)
        self._now = self._wanted
        self._frames = 0

    @property
    def light(self) -> Bgr:
        """How much brighter it is than when the colours were learned, in blue, green and red."""
        return as_bgr(self._gain)

    def run(self, state: FrameState) -> FrameState:
        if self._options["follow"] and self._learned_in is not None:
            self._measure(state.pixels)
        codes = _codes(state.clean)
        labels = np.empty(codes.shape, np.uint8)
        np.take(self._now, codes, out=labels, mode="clip")
        if self._context.within is not None:
            cv2.bitwise_and(labels, self._context.within, labels)
        return replace(state, labels=labels, colours=self._names, light=self.light)

    def _measure(self, pixels: Picture) -> None:
        first = self._frames == 0
        self._frames += 1
        if not first and self._frames % _EVERY:
            return
        light = np.array(mean_light(pixels)) + 1
        fresh = np.clip(light / (np.array(self._learned_in) + 1), _MIN_GAIN, _MAX_GAIN)
        self._gain = fresh if first else self._gain * (fresh / self._gain) ** _NEW
        change = self._gain / self._gain_of_table
        if max(change.max(), 1 / change.min()) > _STEP:
            self._gain_of_table = self._gain.copy()
            self._now = in_light(self._wanted, self.light)

    def picture(self, state: FrameState) -> Picture:
        """All colours of the table, those too that are not looked for everywhere, on a dim picture."""
        named = in_light(self._table, as_bgr(self._gain_of_table))[_codes(state.clean)]
        paint = np.array([(0, 0, 0)] + [NAMES[name] for name in self._names], np.uint8)
        return np.where(named[..., None] > 0, paint[named], state.clean // 3)


def _codes(pixels: Picture) -> np.ndarray:
    """(height, width) uint16: where each pixel stands in the table."""
    return cv2.cvtColor(pixels, cv2.COLOR_BGR2BGR565).view(np.uint16).reshape(pixels.shape[:2])
