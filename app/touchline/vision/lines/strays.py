"""Measured points that do not follow their own line: a robot's edge, a shoe, a reflection.

A line may be painted beside its place, and the camera that said where to look may be a little wrong: along one line,
both make a smooth course. It is a parabola by least absolute deviations, which a few strays do not move (by
reweighting: E. Schlossmacher 1973).
"""

import numpy as np
from numpy.typing import NDArray

STRAY_SPREADS, STRAY_PX = 4.5, 0.6
SLOPE_FROM, BEND_FROM = 6, 10  # points of a line: fewer do not tell its slope, or its bend
ROUNDS, EXACT_PX = 8, 0.05


def strays(middle_px: NDArray, found: NDArray[np.bool_], line: NDArray) -> NDArray[np.bool_]:
    """Return which of the found points (n,) are off the course of their line.

    middle_px: across the line from the expected place; line: which one it is, its points in order along it.
    """
    aside = np.zeros(len(middle_px))
    for name in np.unique(line[found]):
        of = np.flatnonzero(line == name)
        aside[of] = middle_px[of] - _course(np.where(found[of], middle_px[of], np.nan))
    spread = 1.4826 * float(np.median(np.abs(aside[found]))) if found.any() else 0.0
    return found & ~(np.abs(aside) < max(STRAY_SPREADS * spread, STRAY_PX))


def _course(values: NDArray) -> NDArray:
    """Return the course of evenly spaced values (n,), of which some are NaN."""
    known = np.isfinite(values)
    terms = 1 + (known.sum() >= SLOPE_FROM) + (known.sum() >= BEND_FROM)
    powers = np.vander(np.linspace(-1, 1, len(values)), terms)
    goal, weight = values[known], np.ones(known.sum())
    course = np.zeros(terms)
    for _ in range(ROUNDS):
        course = np.linalg.lstsq(powers[known] * weight[:, None], goal * weight, rcond=None)[0]
        weight = np.maximum(np.abs(goal - powers[known] @ course), EXACT_PX) ** -0.5
    return powers @ course
