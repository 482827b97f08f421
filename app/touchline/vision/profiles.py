"""The middle of a bright line where one is expected, from the brightness across it; and points that follow no line.

Across the line, brightness is a slope, perhaps a step (carpet on one side, a wall on the other), and on it a bar with
blurred edges:

    g(u) = a + b u + s S(u - m) + c T(u - m),   T(u) = Φ((w/2 + u)/σ) - Φ((u - w/2)/σ),   S(u) = 2Φ(u/σ) - 1

fitted within a window about the bar by a few Gauss–Newton steps from the best of several starts. Both edges of a wide
line take part, and as T is even, a width that is known badly does not move the middle.

Points that follow no line: a line may be painted beside its place, and the camera that said where to look may be a
little wrong: along one line, both make a smooth course. It is a parabola by least absolute deviations, which a few
strays do not move (by reweighting: E. Schlossmacher 1973).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.geometry import Points

NO_WIDTHS: Mapping[int, float] = MappingProxyType({})
STEP_PX = 0.5
ALONG_PX = (-1.5, -0.5, 0.5, 1.5)  # profiles side by side are averaged
GREY_OF_BGR = (0.114, 0.587, 0.299)
BLUR_PX = 0.9
# least and most; 0.46 to 5.6 times the expected
WIDTHS_PX, WIDTH_RATIO, WIDTH_STEPS = (0.8, 28.0), 1.17, (-5, 12)
GROUND_PX = 3.0  # bare ground on either side of the bar that takes part
FADE_PX = 0.7  # the window's edge is soft, so that nothing jumps as it moves
STEPS = 3
# of the profiles explained: then no other is tried; how much better it must be
ALMOST_ALL, CLEARLY = 0.94, 1.01
# where else to begin, in expected widths; and by how many steps to go on
WIDER, STRIDES = (2.0, 4.0), (2, 1)
WIDTH_PROFILES = 12  # profiles of a marking that tell how wide it is painted
ENOUGH = 16  # profiles of one marking, for a step that they share
MIN_CONTRAST = 4.0  # grey levels
CONTRAST_NOISES = 4.0
CLEAN = 0.8  # of what slope and step leave, the share that the bar explains

STRAY_SPREADS, STRAY_PX = 4.5, 0.6
SLOPE_FROM, BEND_FROM = 6, 10  # points of a line: fewer do not tell its slope, or its bend
ROUNDS, EXACT_PX = 8, 0.05


@dataclass(frozen=True, eq=False)
class Profiles:
    """(n,) each. middle: px from the expected place, along the normal; found: whether a bar is there.

    widths: by group, how wide it is painted, of how wide it was expected.
    """

    middle: NDArray[np.float64]
    contrast: NDArray[np.float64]
    found: NDArray[np.bool_]
    widths: Mapping[int, float]


def across_lines(
    gray: NDArray[np.uint8],
    places: Points,
    normals: Points,
    width_px: NDArray,
    group: NDArray,
    capture_px: float,
    widths: Mapping[int, float] = NO_WIDTHS,
) -> Profiles:
    """places, normals (n, 2) px; width_px (n,) expected; group (n,): whose paint is of one width.

    widths: as Profiles has them, where they have been measured before.
    """
    middle, contrast = np.full(len(places), np.nan), np.zeros(len(places))
    found = np.zeros(len(places), bool)
    painted = {}
    for name in np.unique(group):
        of = np.flatnonzero(group == name)
        nominal = float(np.median(width_px[of]))
        if name in widths:
            width = widths[name] * nominal
        else:
            some = of[np.unique(np.linspace(0, len(of) - 1, WIDTH_PROFILES).round().astype(int))]
            possible = _widths(nominal)
            rows, away = _profiles(gray, places[some], normals[some], possible[-1], capture_px)
            width = _width(rows, away, nominal, possible, capture_px)
        painted[int(name)] = width / nominal
        rows, away = _profiles(gray, places[of], normals[of], width, capture_px)
        middle[of], contrast[of], explained, _ = _bars(rows, away, width, capture_px)
        found[of] = _good(_noise(rows), middle[of], contrast[of], explained, width, capture_px)
    return Profiles(middle, contrast, found, painted)


def _profiles(
    gray: NDArray[np.uint8],
    places: Points,
    normals: Points,
    width: float,
    capture_px: float,
) -> tuple[NDArray, NDArray]:
    """Return grey levels (n, k) across the places, and where: as far as a bar of that width is looked for."""
    reach = _reach(capture_px, width)
    away = np.arange(-reach, reach + STEP_PX / 2, STEP_PX)
    return brightness_across(gray, places, normals, away), away


def _capture(capture_px: float, width: float) -> float:
    """Return how far off the middle may be: the expected place may lie on the edge of a wide line."""
    return max(capture_px, width / 2 + 1)


def _reach(capture_px: float, width: float) -> float:
    """Return as far from the expected place as a bar's window reaches."""
    return _capture(capture_px, width) + width / 2 + GROUND_PX + 2 * BLUR_PX


def _width(
    rows: NDArray, away: NDArray, nominal: float, widths: NDArray, capture_px: float
) -> float:
    """Return the width whose bars explain the profiles best, and need the least of a step for it.

    It is looked for uphill from the expected one; where that does not explain them almost fully, from wider ones too,
    as an edge of wide paint is a narrow line on a step, and where nothing is found, among all.
    """
    noise = _noise(rows)
    worth = lru_cache(lambda number: _worth(rows, away, float(widths[number]), capture_px, noise))
    found = _uphill(worth, int(np.argmin(np.abs(widths - nominal))), len(widths))
    if worth(found) < ALMOST_ALL * len(rows):
        others = (
            {
                _uphill(worth, int(np.argmin(np.abs(widths - factor * nominal))), len(widths))
                for factor in WIDER
            }
            if worth(found)
            else range(len(widths))
        )
        best = max(others, key=worth)
        found = best if worth(best) > CLEARLY * worth(found) else found
    return float(widths[found])


def _uphill(worth: Callable[[int], float], start: int, count: int) -> int:
    for stride in STRIDES:
        while True:
            better = max(
                (start, *(k for k in (start - stride, start + stride) if 0 <= k < count)), key=worth
            )
            if better == start:
                break
            start = better
    return start


def _worth(rows: NDArray, away: NDArray, width: float, capture_px: float, noise: float) -> float:
    near = np.abs(away) <= _reach(capture_px, width)
    middle, contrast, explained, step = _bars(rows[:, near], away[near], width, capture_px)
    good = _good(noise, middle, contrast, explained, width, capture_px)
    return float(np.sum(np.where(good, explained / (1 + step), 0.0)))


def _good(
    noise: float,
    middle: NDArray,
    contrast: NDArray,
    explained: NDArray,
    width: float,
    capture_px: float,
) -> NDArray[np.bool_]:
    least = max(MIN_CONTRAST, CONTRAST_NOISES * noise)
    return (explained > CLEAN) & (contrast > least) & (np.abs(middle) < _capture(capture_px, width))


def _widths(nominal: float) -> NDArray:
    """The expected width and others: paint is not always as the rules want it."""
    least, most = WIDTHS_PX
    nominal = max(nominal, least)
    widths = nominal * WIDTH_RATIO ** np.arange(*WIDTH_STEPS)
    return widths[(widths >= least) & (widths <= max(nominal, most))]


def brightness_across(
    picture: NDArray[np.uint8], places: Points, normals: Points, away: NDArray
) -> NDArray:
    """(n, k) grey levels at so many px (k,) across each place, averaged over a few pixels along it.

    picture: (height, width), or (height, width, 3) BGR, of which nothing else is touched.
    """
    along = np.stack([-normals[:, 1], normals[:, 0]], axis=1)
    total = np.zeros((len(places), len(away), *picture.shape[2:]), np.float32)
    for shift in ALONG_PX if len(places) else ():
        at = ((places + shift * along)[:, None] + away[:, None] * normals[:, None]).astype(
            np.float32
        )
        total += cv2.remap(
            picture, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
    if picture.ndim == 3:
        total = total @ np.array(GREY_OF_BGR, np.float32)
    return total.astype(np.float64) / len(ALONG_PX)


def _noise(rows: NDArray) -> float:
    """Of a profile's sample, grey levels, from how its second differences scatter."""
    second = rows[:, 4:] - 2 * rows[:, 2:-2] + rows[:, :-4]  # a pixel apart
    return float(np.median(np.abs(second)) * 1.4826 / np.sqrt(6)) if second.size else 0.0


def _bars(rows: NDArray, away: NDArray, width: float, capture_px: float) -> tuple[NDArray, ...]:
    """Middle, contrast, explained share and step over contrast (n,) of the best bar of this width in each profile."""
    capture = _capture(capture_px, width)
    starts = np.arange(-capture, capture + 0.4, max(1.0, width / 3))
    about = away - starts[:, None]
    weight = _window(about, width)
    ground, bar, _ = _columns(about, width)
    basis, _ = np.linalg.qr(ground * weight[..., None])
    own = bar * weight
    own = own - (basis @ (basis.transpose(0, 2, 1) @ own[..., None]))[..., 0]
    power = np.sum(own**2, axis=1)
    height = np.maximum(rows @ (weight * own).T / np.maximum(power, 1e-9), 0)
    best = np.argmax(height**2 * power, axis=1)
    middle, contrast = starts[best], height[np.arange(len(rows)), best]
    middle, contrast, step = _refined(rows, away, width, middle, contrast, None)
    beside = _shared(step / np.maximum(contrast, 1.0))
    middle, contrast, _ = _refined(rows, away, width, middle, contrast, beside)
    about = away - middle[:, None]
    ground, bar, _ = _columns(about, width)
    weight = _window(about, width)
    solved, left = _solved(np.concatenate([ground, bar[..., None]], axis=2), rows, weight)
    _, without = _solved(ground, rows, weight)
    return (
        middle,
        solved[:, 3],
        1 - left / np.maximum(without, 1e-9),
        np.abs(solved[:, 2]) / np.maximum(np.abs(solved[:, 3]), 1.0),
    )


def _refined(
    rows: NDArray,
    away: NDArray,
    width: float,
    middle: NDArray,
    contrast: NDArray,
    beside: float | None,
) -> tuple[NDArray, NDArray, NDArray]:
    """Middle, contrast and step (n,) after a few Gauss–Newton steps. beside: the step over the contrast, or free.

    A step of its own costs each profile most of what it knows of the middle; that of the whole marking costs nothing.
    """
    step = np.zeros(len(rows))
    for _ in range(STEPS):
        about = away - middle[:, None]
        ground, bar, slope = _columns(about, width)
        moved = -np.maximum(contrast, 1.0)[:, None, None] * slope[..., None]
        if beside is None:
            full = np.concatenate([ground, bar[..., None], moved], axis=2)
        else:
            full = np.concatenate(
                [ground[..., :2], (bar + beside * ground[..., 2])[..., None], moved], axis=2
            )
        solved, _ = _solved(full, rows, _window(about, width))
        middle = middle + np.clip(solved[:, -1], -0.7, 0.7)
        contrast, step = solved[:, -2], solved[:, 2]
    return middle, contrast, step


def _shared(steps: NDArray) -> float:
    """The step of a whole marking, in parts of its contrast; nought where the profiles do not clearly agree on one."""
    middle = float(np.median(steps))
    spread = 1.4826 * float(np.median(np.abs(steps - middle)))
    return (
        middle
        if len(steps) >= ENOUGH and abs(middle) > max(4 * spread / np.sqrt(len(steps)), 0.02)
        else 0.0
    )


def _solved(design: NDArray, rows: NDArray, weight: NDArray) -> tuple[NDArray, NDArray]:
    """Weighted least squares of each row: coefficients (n, p), and the sum of squares that is left (n,)."""
    heavy = design * weight[..., None]
    normal = heavy.transpose(0, 2, 1) @ heavy + 1e-6 * np.eye(design.shape[2])
    solved = np.linalg.solve(normal, heavy.transpose(0, 2, 1) @ (rows * weight)[..., None])
    rest = (rows - (design @ solved)[..., 0]) * weight
    return solved[..., 0], np.sum(rest**2, axis=1)


def _window(about: NDArray, width: float) -> NDArray:
    return 1 / (
        1 + np.exp(np.clip((np.abs(about) - width / 2 - GROUND_PX) / (FADE_PX / 2), -40, 40))
    )


def _columns(about: NDArray, width: float) -> tuple[NDArray, NDArray, NDArray]:
    """The ground (..., 3): level, slope and step; the bar, and its derivative."""
    # T and its derivative, Φ by a logistic that is within 0.01 of it: the blur's form is not known better.
    low, high = (about + width / 2) / BLUR_PX, (about - width / 2) / BLUR_PX
    a, b = (1 / (1 + np.exp(-1.702 * np.clip(z, -30, 30))) for z in (low, high))
    step = 2 / (1 + np.exp(-1.702 / BLUR_PX * np.clip(about, -30, 30))) - 1
    return (
        np.stack([np.ones_like(about), about, step], axis=-1),
        a - b,
        1.702 / BLUR_PX * (a * (1 - a) - b * (1 - b)),
    )


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
