"""The painted lines of a picture: ridges, the middle of bright lines on darker ground, linked and cut where they turn.

Where a line runs, brightness curves down steeply across it and hardly along it: the Hessian of the blurred picture has
one strongly negative eigenvalue, whose eigenvector points across. The blur whose answer, times sigma^1.5, is greatest
fits the line's width; along the eigenvector the top of the parabola is the line's middle.

C. Steger, "An unbiased detector of curvilinear structures", 1998; T. Lindeberg, "Edge detection and ridge detection
with automatic scale selection", 1998.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core import opencv
from touchline.core.geometry import Points
from touchline.vision.edges import chord, nearest_neighbours, smooth_stretches, straight_runs

SIGMAS_PX = (0.9, 1.5, 2.4, 3.8)  # a bar answers most to 0.3 of its width: 1 to 13 px are covered
MARGIN_PX = 3  # at the picture's end, where the blur has nothing to go on
ABOVE_NOISE = 6.0  # times the response of ground without lines, at the 60th of a hundred places
MIN_RESPONSE = 1.0
MAX_OFF_CENTRE_PX = 0.6  # further away, the neighbouring pixel is the ridge's

REACH_PX = 2  # to the next point of the same ridge
MIN_CHAINED_COSINE = np.cos(np.radians(22))
MIN_AHEAD_SHARE = 0.75  # of a step's length that lies along the ridge
MIN_POINTS = 12
MAX_OFF_CUBIC_PX = 1.2  # further, and the chain is cut there
TURN_ARM = 8  # points on either side by which the turn of a chain is measured
MIN_TURN_COSINE = np.cos(np.radians(25))

# of the longer side: in a larger picture, lines are looked for in one of that size
SEARCH_PX = 1400
STRONG_SHARE = 0.8  # of all length is weaker than what counts as strong
MIN_PAINT_SHARE = 0.3  # of that strength, which paint has at least
# grey levels, of half the picture: below, no lines are darker than their ground
MIN_LIGHT_GROUND = 120
# dark lines prevail where they are so much stronger than the bright ones, all together
MIN_DARK_RATIO = 2.0
MIN_LONG_SHARE = 0.05  # of the diagonal: shorter lines do not count in that


@dataclass(frozen=True, eq=False)
class Ridges:
    """points (n, 2) px; along (n, 2) unit vectors; strength (n,); cells (n, 2) row and column, no two alike."""

    points: Points
    along: NDArray[np.float64]
    strength: NDArray[np.float64]
    cells: NDArray[np.int64]


def ridges(gray: NDArray[np.uint8]) -> Ridges:
    """The ridges of a picture (h, w)."""
    picture = gray.astype(np.float32)
    best = np.zeros(picture.shape, np.float32)
    offset = np.zeros((*picture.shape, 2), np.float32)  # from the pixel to the ridge's top
    across = np.zeros((*picture.shape, 2), np.float32)
    for sigma_px in SIGMAS_PX:
        _add_ridges_of(picture, sigma_px, best, offset, across)
    best[:MARGIN_PX], best[-MARGIN_PX:], best[:, :MARGIN_PX], best[:, -MARGIN_PX:] = 0, 0, 0, 0
    row, column = np.nonzero((best > 0) & (np.abs(offset) <= MAX_OFF_CENTRE_PX).all(axis=-1))
    normal = across[row, column].astype(np.float64)
    points = np.stack([column, row], axis=1) + offset[row, column]
    return _one_a_cell(
        points.astype(np.float64),
        np.stack([-normal[:, 1], normal[:, 0]], axis=1),
        best[row, column].astype(np.float64),
        picture.shape,
    )


def _add_ridges_of(
    picture: NDArray, sigma_px: float, best: NDArray, offset: NDArray, across: NDArray
) -> None:
    """Write this blur's ridges, in place, wherever their response is stronger than any before."""
    soft = cv2.GaussianBlur(picture, (0, 0), sigma_px, borderType=cv2.BORDER_REPLICATE)
    xx, yy, xy = _hessian(soft)
    # The Hessian's eigenvalues are mean ∓ spread.
    mean, half_difference = (
        cv2.addWeighted(xx, 0.5, yy, 0.5, 0),
        cv2.addWeighted(xx, 0.5, yy, -0.5, 0),
    )
    spread = cv2.magnitude(half_difference, xy)
    response = _response(mean, spread, sigma_px)
    # Most of a picture is ground: of every seventh row and fifth column, the 60th percentile is its noise.
    threshold = ABOVE_NOISE * float(np.percentile(response[::7, ::5], 60)) + MIN_RESPONSE
    row, column = np.nonzero((response > threshold) & (response > best))
    at = row, column
    low = mean[at] - spread[at]
    # The eigenvector of the low eigenvalue, from whichever row of the matrix is longer: the other may vanish.
    from_first, from_second = (
        np.stack([xy[at], low - xx[at]], axis=1),
        np.stack([low - yy[at], xy[at]], axis=1),
    )
    first_is_longer = np.abs(from_first).sum(axis=1) >= np.abs(from_second).sum(axis=1)
    normal = np.where(first_is_longer[:, None], from_first, from_second)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True) + 1e-9
    # The top of the parabola across the ridge: one Newton step from the pixel, with the slope and the curvature there.
    slope_x = (
        soft[row, np.minimum(column + 1, soft.shape[1] - 1)] - soft[row, np.maximum(column - 1, 0)]
    ) / 2
    slope_y = (
        soft[np.minimum(row + 1, soft.shape[0] - 1), column] - soft[np.maximum(row - 1, 0), column]
    ) / 2
    to_top = -(normal[:, 0] * slope_x + normal[:, 1] * slope_y) / (low - 1e-6)
    best[at], offset[at], across[at] = response[at], normal * to_top[:, None], normal


def _hessian(soft: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Return the second derivatives xx, yy and xy of a picture, (h, w) each, by central differences."""
    second, first, one = (
        np.array([1, -2, 1], np.float32),
        np.array([-0.5, 0, 0.5], np.float32),
        np.ones(1, np.float32),
    )

    def filtered(x: NDArray, y: NDArray) -> NDArray:
        return cv2.sepFilter2D(soft, cv2.CV_32F, x, y, borderType=cv2.BORDER_REPLICATE)

    return filtered(second, one), filtered(one, second), filtered(first, first)


def _response(mean: NDArray, spread: NDArray, sigma_px: float) -> NDArray:
    """Return σ^1.5 (-low - |high|) of the eigenvalues low, high = mean ∓ spread; 0 where it does not curve down.

    A ridge curves along itself hardly, so its high eigenvalue takes little away; a blob's takes most. The power of σ
    makes the blur that fits the width answer most.
    """
    response = cv2.min(cv2.subtract(spread, mean), spread) * np.float32(2 * sigma_px**1.5)
    not_blob = (spread - mean - np.abs(mean + spread)) * np.float32(sigma_px**1.5)
    return np.where(mean < 0, cv2.min(response, not_blob), np.float32(0))


def _one_a_cell(
    points: Points, along: NDArray, strength: NDArray, shape: tuple[int, ...]
) -> Ridges:
    """Of points whose tops fall into one pixel, the strongest: two neighbours may both see one ridge between them."""
    cells = np.rint(points[:, ::-1]).astype(np.int64)
    number = cells[:, 0] * shape[1] + cells[:, 1]
    order = np.lexsort((-strength, number))
    first = np.ones(len(order), bool)
    first[1:] = np.diff(number[order]) > 0
    strongest = np.sort(order[first])
    return Ridges(points[strongest], along[strongest], strength[strongest], cells[strongest])


def ridge_chains(found: Ridges, shape: tuple[int, ...]) -> list[NDArray[np.int64]]:
    """Indices of points along each smooth piece of a ridge, the longest first; shape: of the picture."""
    walks = _walks(*_links(found, shape))
    pieces = [
        piece for walk in walks if len(walk) >= MIN_POINTS for piece in _smooth(walk, found.points)
    ]
    return sorted(pieces, key=len, reverse=True)


def _links(found: Ridges, shape: tuple[int, ...]) -> tuple[NDArray, NDArray]:
    """Each point's neighbour ahead and behind, by its own direction; -1 for none. Both must choose each other."""

    def judge(a: NDArray, b: NDArray, step: Points) -> tuple[NDArray, NDArray]:
        return (
            np.sum(step * found.along[a], axis=1),
            np.abs(np.sum(found.along[a] * found.along[b], axis=1)) > MIN_CHAINED_COSINE,
        )

    neighbour = nearest_neighbours(
        found.points, found.cells, shape, REACH_PX, MIN_AHEAD_SHARE, judge
    )
    count = len(found.points)
    for way in (0, 1):
        mine = neighbour[way]
        answered = (mine >= 0) & (
            (neighbour[0][mine] == np.arange(count)) | (neighbour[1][mine] == np.arange(count))
        )
        neighbour[way] = np.where(answered, mine, -1)
    return neighbour[0], neighbour[1]


def _walks(ahead: NDArray, behind: NDArray) -> list[list[int]]:
    """Along each chain from one of its ends; a ring from anywhere."""
    ends = ((ahead < 0) != (behind < 0)).nonzero()[0].tolist()
    first, second = ahead.tolist(), behind.tolist()
    visited = np.zeros(len(first), bool)
    walks = []
    for start in [*ends, *range(len(first))]:
        if visited[start]:
            continue
        walk, here = [], start
        while here >= 0 and not visited[here]:
            visited[here] = True
            walk.append(here)
            following = first[here]
            if following < 0 or visited[following]:
                following = second[here]
            here = following
        walks.append(walk)
    return walks


def _smooth(walk: list[int], points: Points) -> list[NDArray]:
    """The stretches of a chain that a lens could have made of a line or of a piece of an arc."""
    chain = np.array(walk)
    can_be_tested = len(walk) >= 3 * TURN_ARM
    runs = (
        straight_runs(points[chain], TURN_ARM, MIN_TURN_COSINE, TURN_ARM)
        if can_be_tested
        else [(0, len(walk))]
    )

    def is_long(piece: Points) -> bool:
        return len(piece) >= MIN_POINTS and chord(piece) > 0

    stretches = smooth_stretches(points[chain], runs, is_long, MAX_OFF_CUBIC_PX, MIN_POINTS // 2)
    return [chain[start:end] for start, end in stretches]


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
        long = MIN_LONG_SHARE * float(np.hypot(*small.shape))
        if _weight(dark, dark_chains, long) > MIN_DARK_RATIO * _weight(found, chains, long):
            gray, found, chains = 255 - gray, dark, dark_chains
    return PaintedLines(
        gray,
        tuple((found.points[c] + 0.5) / scale - 0.5 for c in chains),
        tuple(found.along[c] for c in chains),
    )


def with_bright_lines(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a picture (h, w[, 3]) grey, as painted_lines() has it; quick where its ground is dark."""
    gray = opencv.to_grey(pixels)
    return painted_lines(gray).gray if _is_light(gray) else gray


def _is_light(gray: NDArray[np.uint8]) -> bool:
    return bool(np.median(gray[::4, ::4]) > MIN_LIGHT_GROUND)


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
    return [
        chain
        for chain, own in zip(chains, strength, strict=True)
        if own >= MIN_PAINT_SHARE * strong
    ]
