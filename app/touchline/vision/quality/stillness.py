"""For how long a picture, and how much of it, has stayed the same bit by bit.

A sensor's noise changes each part of a picture from frame to frame. What comes as whole pictures, raw or as JPEG, shows
that; what is coded from frame to frame (H.264) leaves it out, often up to the next key frame. Black and white are
clipped, and have no noise: they are not counted.
"""

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray
from typing_extensions import TypedDict

from touchline.core import opencv

COLUMNS, ROWS = 16, 12
DARKEST, BRIGHTEST = 16, 240  # grey levels, on average: what is counted
MIN_CELLS = 24  # that must be counted
LARGE = 0.9  # of the cells: all but a clock, a caption or a cursor
LIVELY_S, ENOUGH_S = 5.0, 20.0  # LARGE changes within LIVELY_S, for ENOUGH_S together: it has noise
LONG_S = 20.0  # longer than from key frame to key frame


class Still(TypedDict):
    """all_s, most_s: for how long all of it, and LARGE of what is counted, has been the same; None where that is dark
    or white. share: of what is counted that has been the same for LONG_S. had_noise: whether noise was ever seen."""

    all_s: float
    most_s: float | None
    share: float
    had_noise: bool


@dataclass
class Stillness:
    """Of pictures one after the other, all of one size; another size begins anew."""

    _before: NDArray[np.uint8] | None = None
    _since: NDArray[np.float64] = field(default_factory=lambda: np.zeros((ROWS, COLUMNS)))
    _moment: float = 0.0
    _lively_s: float = 0.0

    def add(self, picture: NDArray[np.uint8], moment: float) -> Still:
        """picture (h, w[, 3]), moment: s, on any clock that is steady."""
        before, self._before = self._before, picture
        if before is None or before.shape != picture.shape:
            self._since[:], self._moment, self._lively_s = moment, moment, 0.0
        else:
            self._since[_changed(before, picture)] = moment
        passed_s, self._moment = moment - self._moment, moment
        still_s = moment - self._since
        levels = cv2.resize(opencv.to_grey(picture), (COLUMNS, ROWS), interpolation=cv2.INTER_AREA)
        counted = still_s[(levels > DARKEST) & (levels < BRIGHTEST)]
        if counted.size < MIN_CELLS:
            return Still(all_s=float(still_s.min()), most_s=None, share=0.0, had_noise=False)
        if np.quantile(counted, LARGE) < LIVELY_S:
            self._lively_s += min(passed_s, LIVELY_S)
        return Still(all_s=float(still_s.min()), most_s=float(np.quantile(counted, 1 - LARGE)),
                     share=float(np.mean(counted >= LONG_S)), had_noise=self._lively_s >= ENOUGH_S)


def _changed(one: NDArray[np.uint8], other: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Return which cells (ROWS, COLUMNS) differ in any pixel."""
    differs = (one != other).reshape(*one.shape[:2], -1).any(axis=2)
    rows, columns = (np.arange(count) * length // count for count, length in zip((ROWS, COLUMNS), differs.shape,
                                                                                 strict=True))
    return np.logical_or.reduceat(np.logical_or.reduceat(differs, rows, axis=0), columns, axis=1)
