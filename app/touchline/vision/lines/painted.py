"""The painted lines of a picture: bright ones on darker ground, or on a light ground dark ones where these prevail."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from touchline.core import opencv
from touchline.core.geometry import Points
from touchline.vision.lines.ridge_chains import ridge_chains
from touchline.vision.lines.ridges import Ridges, ridges

SEARCH_PX = 1400  # of the longer side: in a larger picture, lines are looked for in one of that size
STRONG_SHARE, WEAK = 0.8, 0.3  # of all length is weaker than what is strong; of that strength, what paint has at least
LIGHT_GROUND = 120  # grey levels, of half the picture: below, no lines are darker than their ground
PREVAIL = 2.0  # times as strong as the bright ones, all together
LONG = 0.05  # of the diagonal: shorter ones tell nothing of that


@dataclass(frozen=True, eq=False)
class PaintedLines:
    """gray (h, w): the picture with its lines bright. chains: points (n, 2) px along each, the longest first; along:
    unit vectors there."""

    gray: NDArray[np.uint8]
    chains: tuple[Points, ...]
    along: tuple[NDArray[np.float64], ...]


def painted_lines(gray: NDArray[np.uint8]) -> PaintedLines:
    """Return the lines of a picture (h, w)."""
    small, scale = opencv.fit_within(gray, SEARCH_PX)
    found, chains = _bright(small)
    if _is_light(gray):
        dark, dark_chains = _bright(255 - small)
        long = LONG * float(np.hypot(*small.shape))
        if _weight(dark, dark_chains, long) > PREVAIL * _weight(found, chains, long):
            gray, found, chains = 255 - gray, dark, dark_chains
    return PaintedLines(gray, tuple((found.points[c] + 0.5) / scale - 0.5 for c in chains),
                        tuple(found.along[c] for c in chains))


def with_bright_lines(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a picture (h, w[, 3]) grey, as painted_lines() has it; quick where its ground is dark."""
    gray = opencv.to_grey(pixels)
    return painted_lines(gray).gray if _is_light(gray) else gray


def _is_light(gray: NDArray[np.uint8]) -> bool:
    return bool(np.median(gray[::4, ::4]) > LIGHT_GROUND)


def _bright(gray: NDArray[np.uint8]) -> tuple[Ridges, list[NDArray[np.int64]]]:
    found = ridges(gray)
    return found, _like_paint(ridge_chains(found, gray.shape), found)


def _weight(found: Ridges, chains: list[NDArray[np.int64]], long: float) -> float:
    """Return how strong the chains of more points than that are together."""
    return float(sum(found.strength[chain].sum() for chain in chains if len(chain) > long))


def _like_paint(chains: list[NDArray[np.int64]], found: Ridges) -> list[NDArray[np.int64]]:
    """Return those that are not far weaker than what most of the length is: a floor's seams and texture go."""
    if not chains:
        return chains
    strength = np.array([np.median(found.strength[chain]) for chain in chains])
    length = np.array([len(chain) for chain in chains])
    order = np.argsort(strength)
    run = np.cumsum(length[order])
    strong = strength[order][np.searchsorted(run, STRONG_SHARE * run[-1])]
    return [chain for chain, own in zip(chains, strength, strict=True) if own >= WEAK * strong]
