"""Whose picture it is: pictures as some thousand numbers that tell cameras over the same kind of field apart.

Field lines tell nothing: on a symmetric rig they lie alike in every picture. A print keeps what is left without light:
the carpet's texture and seams, the floor and walls about it, as fine as SMOOTH cells, and clipped so that a line or a
robot counts no more than a stain. Prints are compared as they are in the picture, so no calibration is needed.

    likeness(a, b)            correlation of two prints: near 1 for one camera, whatever moved, however it is sent
    nearer(now, one, other)   correlation of now − (one + other) / 2 with (one − other) / 2: what both have in common,
                              lines above all, is gone; near 1 for one's picture, near −1 for the other's
"""

import base64
from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core import opencv
from touchline.core.geometry import Pixels

COLUMNS, ROWS = 64, 48
SMOOTH = 2.0  # cells: wider brightness is light, which changes
CLIPPED = 2.0  # spreads
STEPS = 63  # of a number on either side of 0
TINY_LEVELS = 0.15  # grey levels: a spread below is a picture of nothing, or of noise


@dataclass(frozen=True, eq=False)
class PicturePrint:
    """values (ROWS, COLUMNS): brightness without light, in STEPS of CLIPPED spreads."""

    values: NDArray[np.int8]

    @classmethod
    def of(cls, picture: Pixels) -> Self | None:
        """picture (h, w[, 3]); None where nothing is in it, as in the dark."""
        # whole levels would be coarser than a carpet's texture
        grey = opencv.to_grey(picture).astype(np.float32)
        cells = np.asarray(
            cv2.resize(grey, (COLUMNS, ROWS), interpolation=cv2.INTER_AREA), np.float32
        )
        levels = cells - cv2.GaussianBlur(cells, (0, 0), SMOOTH)
        spread = _spread(levels)
        if spread < TINY_LEVELS:
            return None
        return cls(np.rint(STEPS * np.clip(levels / (CLIPPED * spread), -1, 1)).astype(np.int8))

    def to_text(self) -> str:
        return base64.b64encode(self.values.tobytes()).decode("ascii")

    @classmethod
    def from_text(cls, text: str) -> Self | None:
        """Return what to_text() gave; None for anything else."""
        try:
            values = np.frombuffer(base64.b64decode(text, validate=True), np.int8)
        except ValueError:
            return None
        return cls(values.reshape(ROWS, COLUMNS)) if values.size == ROWS * COLUMNS else None


def likeness(one: PicturePrint, other: PicturePrint) -> float:
    return _correlation(one.values.astype(np.float64), other.values.astype(np.float64))


def nearer(now: PicturePrint, one: PicturePrint, other: PicturePrint) -> float:
    a, b = one.values.astype(np.float64), other.values.astype(np.float64)
    return _correlation(now.values - (a + b) / 2, (a - b) / 2)


def _correlation(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """Return 0 where one of them is nothing."""
    size = float(np.sqrt(np.sum(one**2) * np.sum(other**2)))
    return float(np.sum(one * other)) / size if size else 0.0


def _spread(levels: NDArray[np.float32]) -> float:
    return 1.4826 * float(np.median(np.abs(levels)))
