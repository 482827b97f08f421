"""Finds which painted line a click means: the nearest bar, brighter or darker than both of its sides, roughly.

Around the click the picture is averaged along each of a fan of directions. In such a profile a line is a run of
columns that all stand out from both sides; across its true direction it stands out most and varies least.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

DIRECTIONS = 24  # over half a turn: 3.75° off at most, which blurs a line by half a pixel
ALONG_PX = 8  # how far to both sides a line is averaged
SIDE_PX = 4  # beside a bar, in which its blurred edge must have come down
MIN_CONTRAST = 6.0  # grey levels by which a line must stand out
NEAR = 1 / 3  # of the reach: so much farther a line must be so much (e^½) clearer
GAP = 0.1  # what a bar is worth that looks like its wider surroundings: the gap between two lines
# what a dark line is worth beside a bright one: paint is bright, and what lies between it dark
DARK = 0.5
# a rise that stands out so many times more than any bar is an edge that has no second one
STEP = 4.0


@dataclass(frozen=True)
class LineBar:
    """A line, to about a pixel: level along angle_rad, its middle offset_px from the click along the normal.

    rooms_px: how far the background goes on beside it, before and after, until something else begins.
    """

    angle_rad: float
    offset_px: float
    width_px: float
    rooms_px: tuple[float, float]


@dataclass(frozen=True)
class ProfileFan:
    """For each direction and each pixel of a patch, in which column of the profile it lies."""

    pixels: NDArray[np.int64]
    cells: NDArray[np.int64]  # direction · columns + column
    share: NDArray[np.float64]  # of the pixel in that column; the rest is in the next one
    columns: int


@lru_cache(maxsize=16)
def profile_fan(across: int, half: int) -> ProfileFan:
    """Columns from -across to across px, in a patch of 2 · half + 1."""
    side = np.arange(-half, half + 1)
    y, x = (a.ravel() for a in np.meshgrid(side, side, indexing="ij"))
    angle = (np.pi / DIRECTIONS * np.arange(DIRECTIONS))[:, None]
    along, off = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
    of, pixel = np.nonzero((np.abs(along) <= ALONG_PX) & (np.abs(off) < across))
    column = np.floor(off[of, pixel]).astype(int)
    columns = 2 * across + 1
    return ProfileFan(pixel, of * columns + column + across, 1 - (off[of, pixel] - column), columns)


def find_line_bar(
    patch: NDArray[np.float64],
    away: NDArray[np.float64],
    reach_px: float,
    widths_px: tuple[float, float],
    angle_rad: float | None,
    turn_rad: float,
) -> LineBar | str:
    """Find the bar that a click means, or why there is none: "no-line", or "one-edge" where there is only a step.

    patch: a square of odd side, NaN beyond the picture; away (x, y) px: the click from its middle pixel.
    """
    means, rough = _profiles(patch, reach_px, widths_px)
    columns = means.shape[1]
    place = np.arange(columns) - columns // 2
    angles = np.pi / DIRECTIONS * np.arange(DIRECTIONS)
    click = away[1] * np.cos(angles) - away[0] * np.sin(angles)
    off = place[None] - click[:, None]
    allowed = np.abs(off) <= reach_px
    if angle_rad is not None:
        turned = np.abs((angles - angle_rad + np.pi / 2) % np.pi - np.pi / 2)
        allowed &= (turned <= turn_rad + np.pi / DIRECTIONS / 2)[:, None]
    usual = float(np.nanmedian(patch))
    found, best, best_rise, clearest = None, 0.0, 0.0, 0.0
    for width in _widths(widths_px):
        for sign in (1.0, -1.0):
            rise = _bars(sign * means, width)
            rise = np.where(allowed & (rise > MIN_CONTRAST), rise, 0.0)
            clearest = max(clearest, float(rise.max()))
            steady = rise**2 / (rise**2 + 4 * rough + 1e-9)
            nearness = np.exp(
                -0.5 * (np.maximum(np.abs(off) - width / 4, 0) / (NEAR * reach_px)) ** 2
            )
            like_all = np.abs(means - usual) < 0.5 * rise
            score = (
                rise
                * steady
                * nearness
                * width**0.25
                * np.where(like_all, GAP, 1.0)
                * (1.0 if sign > 0 else DARK)
            )
            at = np.unravel_index(int(np.argmax(score)), score.shape)
            if score[at] > best:
                best, best_rise, found = float(score[at]), float(rise[at]), (at, width, sign)
    difference = np.abs(means[:, 3:] - means[:, :-3])  # of columns three apart
    step = float(
        np.nanmax(
            np.where(allowed[:, 1:-2] & np.isfinite(difference), difference, 0.0), initial=0.0
        )
    )
    if found is None or step > STEP * clearest + MIN_CONTRAST:
        return "one-edge" if step > 2 * MIN_CONTRAST else "no-line"
    (row, column), width, sign = found
    middle = column - (0.0 if width % 2 else 0.5)
    rooms = _rooms(sign * means[row], middle, width, best_rise)
    return LineBar(
        float(angles[row]), float(middle - columns // 2 - click[row]), float(width), rooms
    )


def _profiles(
    patch: NDArray, reach_px: float, widths_px: tuple[float, float]
) -> tuple[NDArray, NDArray]:
    """(directions, columns): mean grey, NaN where the picture has ended, and its variance along the line."""
    half = patch.shape[0] // 2
    across = min(int(np.ceil(reach_px + widths_px[1] / 2)) + SIDE_PX + 2, half)
    spread = profile_fan(across, half)
    grey = patch.ravel()[spread.pixels]
    known = np.isfinite(grey)
    grey = np.where(known, grey, 0.0)
    size = DIRECTIONS * spread.columns

    def summed(values: NDArray) -> NDArray:
        low = np.bincount(spread.cells, values * spread.share, size + 1)
        high = np.bincount(spread.cells + 1, values * (1 - spread.share), size + 1)
        return (low + high)[:size].reshape(DIRECTIONS, spread.columns)

    weight, first, second = summed(known.astype(float)), summed(grey), summed(grey**2)
    with np.errstate(invalid="ignore", divide="ignore"):
        # of the columns' pixels; fewer are a corner of the picture
        enough = weight > 0.4 * (2 * ALONG_PX)
        mean = np.where(enough, first / weight, np.nan)
        return mean, np.where(enough, np.maximum(second / weight - mean**2, 0.0), 0.0)


def _widths(widths_px: tuple[float, float]) -> list[int]:
    """Columns that a bar may have: each up to eight, then in steps of a quarter."""
    widths, width = [], 1
    while width <= widths_px[1]:
        if width >= widths_px[0] - 1:
            widths.append(width)
        width += max(1, width // 4)
    return widths


def _bars(means: NDArray, width: int) -> NDArray:
    """By how much the least of `width` columns about each stands out from both sides."""
    inner = _least(np.where(np.isfinite(means), means, -np.inf), width)
    side = _least(np.where(np.isfinite(means), means, np.inf), SIDE_PX)
    rows, columns = means.shape
    before, after = np.full((2, rows, columns), np.inf)
    first = np.arange(columns) - width // 2  # of the bar's columns
    left, right = first - SIDE_PX, first + width
    level = np.full((rows, columns), -np.inf)
    fits = (left >= 0) & (right + SIDE_PX <= columns)
    level[:, fits] = inner[:, first[fits]]
    before[:, fits], after[:, fits] = side[:, left[fits]], side[:, right[fits]]
    known = np.isfinite(before) & np.isfinite(after) & np.isfinite(level)
    with np.errstate(invalid="ignore"):
        return np.where(known, level - np.maximum(before, after), 0.0)


def _least(values: NDArray, count: int) -> NDArray:
    """The least of `count` columns from each on; shorter by count - 1."""
    return np.lib.stride_tricks.sliding_window_view(values, count, axis=1).min(axis=-1)


def _rooms(profile: NDArray, middle: float, width: float, rise: float) -> tuple[float, float]:
    """How far from the middle the profile goes on without rising again, before and after."""
    rooms = []
    for way, start in (
        (-1, int(np.floor(middle - width / 2))),
        (1, int(np.ceil(middle + width / 2))),
    ):
        at, lowest = start, np.inf
        while 0 <= at < len(profile) and profile[at] <= lowest + 0.25 * rise:  # NaN ends it as well
            lowest = min(lowest, float(profile[at]))
            at += way
        rooms.append(float(abs(at - middle)) - 0.5)
    return rooms[0], rooms[1]
