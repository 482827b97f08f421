"""Camera hypotheses from four lines: two detected lines across two others, matched with two pairs of field lines.

Four lines give a homography. It splits into one from the unit square to the seen quadrilateral and a scaling of the
field's rectangle to that square, so its columns, and with them all that tells a possible camera, are known before any
pair of levels is tried: a camera with square pixels and its axis in the picture's middle sees a right angle as one,

    x₁x₂ + y₁y₂ + p z₁z₂ = 0,    p = (focal length / unit)²,

and shows the rectangle's sides in the ratio of the columns' lengths under the same p. Few rectangles have that ratio.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from touchline.core.geometry import Array, Indices, Mask

FOCALS = np.geomspace(0.45, 14.0, 18)  # half diagonals
MAX_COSINE = 0.10  # cosine of what a right angle may come to: lens and centre are known roughly
MAX_RATIO_ERROR = 0.10  # of a side's length, likewise
PARALLEL_REACH = 0.7  # half diagonals: lines that are parallel on the carpet never meet in the picture
MIN_AREA = 0.02  # of the quadrilateral, square half diagonals
MAX_HYPOTHESES = 60_000


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """homographies (n, 3, 3) from field mm to the undistorted plane, depth positive before the camera; focal (n,)."""

    homographies: Array
    focal: Array


def four_line_hypotheses(square_maps: Array, levels_x: Array, levels_y: Array, is_either_way: bool = False,
                         ) -> Hypotheses:
    """Return every camera that four lines and two pairs of levels allow; the same input gives the same order.

    square_maps: as quadrilaterals() has them. is_either_way: of a camera and the same over the field turned by 180°,
    just one.
    """
    pairs_x = np.array([(a, b) for a in levels_x for b in levels_x if a != b and (a < b or not is_either_way)]
                       ).reshape(-1, 2)
    pairs_y = np.array([(a, b) for a in levels_y for b in levels_y if a != b]).reshape(-1, 2)
    if not len(square_maps) or not len(pairs_x) or not len(pairs_y):
        return Hypotheses(np.empty((0, 3, 3)), np.empty(0))
    i, j = (grid.ravel() for grid in np.meshgrid(np.arange(len(pairs_x)), np.arange(len(pairs_y)), indexing="ij"))
    wide, high = np.ptp(pairs_x[i], axis=1), np.ptp(pairs_y[j], axis=1)
    sense = np.sign((pairs_x[i, 1] - pairs_x[i, 0]) * (pairs_y[j, 1] - pairs_y[j, 0]))
    ratios, which = np.unique(np.round(np.log(wide / high), 9), return_inverse=True)
    fits, focal = _possible(square_maps, ratios)
    # From above, the field's y runs against the picture's: a mirrored match is no view of it.
    right_way = -np.sign(np.linalg.det(square_maps))[:, None] == sense[None]
    quad, rectangle = np.nonzero(fits[:, which] & right_way)
    quad, rectangle = thinned(quad, rectangle)
    x, y = pairs_x[i[rectangle]], pairs_y[j[rectangle]]
    square_from_field = np.zeros((len(quad), 3, 3))
    for axis, pair in ((0, x), (1, y)):
        square_from_field[:, axis, axis] = 1 / (pair[:, 1] - pair[:, 0])
        square_from_field[:, axis, 2] = -pair[:, 0] / (pair[:, 1] - pair[:, 0])
    square_from_field[:, 2, 2] = 1
    return Hypotheses(square_maps[quad] @ square_from_field, focal[quad, which[rectangle]])


def thinned(*columns: Indices) -> list[Indices]:
    """Return at most MAX_HYPOTHESES rows of columns (n,), evenly spaced."""
    if len(columns[0]) <= MAX_HYPOTHESES:
        return list(columns)
    chosen = np.linspace(0, len(columns[0]) - 1, MAX_HYPOTHESES).astype(int)
    return [column[chosen] for column in columns]


def parallel_pairs(lines: list[Array]) -> list[tuple[int, int]]:
    """Return indices of each two lines that may be parallel on the carpet."""
    meet = {(a, b): np.cross(lines[a], lines[b]) for a, b in combinations(range(len(lines)), 2)}
    return [pair for pair, at in meet.items() if np.hypot(at[0], at[1]) > PARALLEL_REACH * abs(at[2])]


def quadrilaterals(lines: list[Array]) -> Array:
    """Return (q, 3, 3) from the unit square to each two lines across two others."""
    pairs = parallel_pairs(lines)
    across = np.array([(*a, *b) for a in pairs for b in pairs if not set(a) & set(b)], int).reshape(-1, 4)
    if not len(across):
        return np.empty((0, 3, 3))
    line = np.array(lines)
    corners = [np.cross(line[across[:, a]], line[across[:, b]]) for a, b in ((0, 2), (1, 2), (1, 3), (0, 3))]
    with np.errstate(all="ignore"):
        corner = np.stack([c[:, :2] / c[:, 2:] for c in corners], axis=1)
        maps = square_maps(corner)
        (x0, x1, x2, x3), (y0, y1, y2, y3) = corner[..., 0].T, corner[..., 1].T
        area = np.abs((x0 - x2) * (y1 - y3) - (x1 - x3) * (y0 - y2)) / 2
        g, h = maps[:, 2, 0], maps[:, 2, 1]
        before = np.minimum(np.minimum(1 + g, 1 + h), 1 + g + h) > 0.05
    return maps[before & (area > MIN_AREA) & np.isfinite(maps).all(axis=(1, 2))]


def square_maps(corners: Array) -> Array:
    """Return (q, 3, 3) from the unit square's corners (0, 0), (1, 0), (1, 1), (0, 1) to (q, 4, 2); NaN for none."""
    (x0, x1, x2, x3), (y0, y1, y2, y3) = corners[..., 0].T, corners[..., 1].T
    with np.errstate(all="ignore"):
        dx1, dx2, sx = x1 - x2, x3 - x2, x0 - x1 + x2 - x3
        dy1, dy2, sy = y1 - y2, y3 - y2, y0 - y1 + y2 - y3
        det = dx1 * dy2 - dx2 * dy1
        g, h = (sx * dy2 - dx2 * sy) / det, (dx1 * sy - sx * dy1) / det
        return np.stack([np.stack([x1 - x0 + g * x1, x3 - x0 + h * x3, x0], -1),
                         np.stack([y1 - y0 + g * y1, y3 - y0 + h * y3, y0], -1),
                         np.stack([g, h, np.ones_like(g)], -1)], axis=1)


def _possible(square_maps: Array, log_ratios: Array) -> tuple[Mask, Array]:
    """Return (q, r) whether a camera sees a rectangle of that log ratio so, and the focal length that fits it best."""
    ratio, cosine = sides_by_focal(square_maps)
    off = np.abs(np.log(ratio)[:, :, None] - log_ratios) / MAX_RATIO_ERROR + np.abs(cosine)[:, :, None] / MAX_COSINE
    best = off.argmin(axis=1)
    fits = np.take_along_axis(off, best[:, None], axis=1)[:, 0] < 1.0
    return fits, FOCALS[best]


def sides_by_focal(maps: Array) -> tuple[Array, Array]:
    """Return (q, f) under each of FOCALS: the ratio of the sides of a rectangle that maps show, and their cosine.

    maps: (q, 3, 3) to the undistorted plane from sides of length 1.
    """
    one, two = maps[:, :, 0], maps[:, :, 1]
    p = FOCALS**2
    n1 = np.sqrt((one[:, :2] ** 2).sum(axis=1)[:, None] + p * one[:, 2:] ** 2)
    n2 = np.sqrt((two[:, :2] ** 2).sum(axis=1)[:, None] + p * two[:, 2:] ** 2)
    return n1 / n2, ((one[:, :2] * two[:, :2]).sum(axis=1)[:, None] + p * one[:, 2:] * two[:, 2:]) / (n1 * n2)
