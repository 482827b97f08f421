"""The lens from lines that are not identified: the division term under which most of them are straight.

Points are in half diagonals about the picture's centre, so that r_u = r_d / (1 + bend r_d²) has a bend of about -1 to 1
for every camera. Arcs do not disturb: no lens makes them straight.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from touchline.core.geometry import Array, ImageSize, Points

BENDS = np.linspace(-1.1, 0.5, 65)  # from a fisheye's to a pincushion's
FINER = np.linspace(-0.025, 0.025, 21)
SAMPLES = 25  # of each chain
STRAIGHT_PX = 0.7
MAX_CHAINS = 60
MIN_LENGTH = 0.08  # of the diagonal: shorter chains bow too little to measure
CAUTION = 0.02  # of the score, for each unit of bend: a prior for none


@dataclass(frozen=True)
class UndistortedPlane:
    """The undistorted picture: from raw px to half diagonals about the centre, and back."""

    bend: float
    centre: tuple[float, float]
    unit_px: float

    @classmethod
    def of(cls, size: ImageSize, bend: float = 0.0) -> Self:
        return cls(bend, size.centre, float(np.hypot(size.width, size.height)) / 2)

    def undistorted_from_raw(self, points: Points) -> Points:
        """Map raw pixels (..., 2) to the plane; NaN beyond the bend's horizon."""
        about = (points - np.array(self.centre)) / self.unit_px
        below = 1 + self.bend * np.sum(about * about, axis=-1, keepdims=True)
        with np.errstate(all="ignore"):
            return about / np.where(below > 0.05, below, np.nan)

    def raw_from_undistorted(self, points: Points) -> Points:
        """Map the plane (..., 2) to raw pixels; NaN where the picture would fold."""
        rr = np.sum(points * points, axis=-1, keepdims=True)
        with np.errstate(all="ignore"):
            scale = 2 * self.unit_px / (1 + np.sqrt(1 - 4 * self.bend * rr))
        return points * scale + np.array(self.centre, points.dtype)


def estimate_bend(chains: Sequence[Points], size: ImageSize) -> float:
    """Estimate the bend under which most of the chains' length is straight; 0 where none is long enough."""
    plane = UndistortedPlane.of(size)
    long = [c for c in chains if np.linalg.norm(c[-1] - c[0]) > 2 * MIN_LENGTH * plane.unit_px][:MAX_CHAINS]
    if not long:
        return 0.0
    picked = np.stack([c[np.linspace(0, len(c) - 1, SAMPLES).round().astype(int)] for c in long])
    about = plane.undistorted_from_raw(picked)
    length = np.linalg.norm(about[:, -1] - about[:, 0], axis=1)
    coarse = BENDS[np.argmax(_straightness(about, length, BENDS, plane.unit_px, 2.0))]
    near = coarse + FINER
    return float(near[np.argmax(_straightness(about, length, near, plane.unit_px, 1.0))])


def _straightness(about: Array, length: Array, bends: Array, unit_px: float, tolerance: float) -> Array:
    """Return how much length each bend makes straight (m,). about (c, n, 2), length (c,)."""
    below = 1 + bends[:, None, None] * np.sum(about * about, axis=-1)
    straight = about / np.maximum(below, 0.05)[..., None]
    off = straight - straight.mean(axis=2, keepdims=True)
    xx, yy, xy = (off[..., i] * off[..., j] for i, j in ((0, 0), (1, 1), (0, 1)))
    xx, yy, xy = xx.mean(axis=2), yy.mean(axis=2), xy.mean(axis=2)
    root = np.sqrt((xx - yy) ** 2 / 4 + xy**2)
    low, high = np.maximum((xx + yy) / 2 - root, 0), (xx + yy) / 2 + root
    # As a share of the chain's own length, so that a bend gains nothing by shrinking the picture.
    rms_px = np.sqrt(low / np.maximum(high, 1e-12) / 12) * length * unit_px
    score = (length * np.exp(-((rms_px / (tolerance * STRAIGHT_PX)) ** 2))).sum(axis=1)
    return score - CAUTION * length.sum() * np.abs(bends)
