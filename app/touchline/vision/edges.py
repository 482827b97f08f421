"""Edges as long smooth chains of sub-pixel points, and the joining of points along an edge or a ridge.

Three samples across the edge give the top of a parabola. Through the gradient itself that top ripples from pixel to
pixel one way, through its logarithm (a parabola, were a blurred step a Gaussian) the other, because a pixel's own area
makes the profile lopsided; through its square root it stays within 0.02 px. The samples are taken along the picture's
own axis that is nearer to the gradient, so nothing is interpolated.

Two pieces belong together where each is the other's nearest to go on with: straight ahead, in the same direction, and
with the same side bright (chains are walked so that the bright side is always on one hand).

After J. Canny 1986; F. Devernay, "A non-maxima suppression method for edge detection with sub-pixel accuracy", 1995.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Self

import numpy as np
from numpy.typing import NDArray

from touchline.core import opencv
from touchline.core.geometry import Points, root_mean_square

GAP_PX = 40.0  # ... and no longer than the shorter piece
MIN_JOINED_COSINE = np.cos(np.radians(5))
ASIDE_PX = 0.7  # off the way ahead, and
ASIDE = 0.02  # so much more for each px of the gap: a lens bows the way
TIP = 16  # points that tell which way a piece goes at its end

BLUR_PX = 1.2  # sharper follows the noise, softer lets neighbouring edges push each other
MARGIN = 4  # px at the picture's end, three blurs
FAINT = 1.0  # grey levels a px: a weaker gradient is noise
CLEAR = 3.0  # the median along a chain that is kept
REACH = 2  # px to the next point of the same edge
MIN_LINKED_COSINE = np.cos(np.radians(25))  # neighbours on one edge have nearly one gradient
AHEAD = 0.8  # of a step's length that lies along the edge
CORNER_ARM = 6  # points on either side that tell how sharply a chain turns
CORNER = np.cos(np.radians(14))
SMOOTH_PX = 1.0  # off a cubic: further is no smooth curve, and the chain is cut there
RAGGED_PX = 0.4  # rms off a cubic of what may be a straight edge behind a lens
TRIM = 3  # points at either end, where other edges meet this one
SHORTEST_PIECE_PX = 12.0  # worth joining to others
SHORTEST = 0.06  # of the picture's diagonal; a chain's bow grows with the square of its length
BENT = 0.2  # of its chord: no lens of ours bows a line further


@dataclass(frozen=True, eq=False)
class Piece:
    """Points (n, 2) px along an edge and the gradient at each (n,)."""

    points: Points
    strength: NDArray

    def part(self, start: int, end: int | None) -> Self:
        return type(self)(self.points[start:end], self.strength[start:end])


def nearest_neighbours(points: Points, cells: NDArray, shape: tuple[int, ...], reach: int, ahead_share: float,
                       judge: Callable[[NDArray, NDArray, NDArray], tuple[NDArray, NDArray]]) -> NDArray:
    """(2, n) for each point the nearest one ahead and the nearest behind, in cells (n, 2) at most `reach` apart; or -1.

    judge(a, b, step): how far ahead of points a their neighbours b lie, px, and which pairs are alike. ahead_share: of
    a step's length, what must lie ahead.
    """
    count = len(points)
    index = np.full((shape[0] + 2 * reach, shape[1] + 2 * reach), -1)
    index[cells[:, 0] + reach, cells[:, 1] + reach] = np.arange(count)
    nearest, neighbour = np.full((2, count), np.inf), np.full((2, count), -1)
    for down, right in product(range(-reach, reach + 1), repeat=2):
        other = index[cells[:, 0] + reach + down, cells[:, 1] + reach + right]
        a = np.flatnonzero((other >= 0) & (other != np.arange(count)))
        b = other[a]
        step = points[b] - points[a]
        length = np.linalg.norm(step, axis=1)
        ahead, alike = judge(a, b, step)
        alike &= np.abs(ahead) > ahead_share * length
        for way, sign in ((0, 1), (1, -1)):
            better = alike & (sign * ahead > 0) & (length < nearest[way, a])
            nearest[way, a[better]], neighbour[way, a[better]] = length[better], b[better]
    return neighbour


def mutual_links(follows: NDArray, leads: NDArray) -> NDArray:
    """For each the one that follows, where that has chosen it as the one that leads; -1 for none."""
    return np.where((follows >= 0) & (leads[follows] == np.arange(len(follows))), follows, -1)


def walks(follows: NDArray) -> Iterator[list[int]]:
    """Indices along each chain of mutual links; a ring, which has no first one, is left out."""
    following = follows.tolist()
    for start in np.setdiff1d(np.arange(len(follows)), follows).tolist():
        walk = [start]
        while (start := following[start]) >= 0:
            walk.append(start)
        yield walk


def straight_runs(points: Points, arm: int, least_cosine: float, clear: int) -> list[tuple[int, int]]:
    """The stretches [start, end) of a chain between its sharp turns, told by `arm` points on either side.

    clear: of a turn, points that are left out after it.
    """
    if len(points) < 2 * arm + 1:
        return []
    way = points[arm:] - points[:-arm]
    way = way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
    straight = np.sum(way[arm:] * way[:-arm], axis=1) > least_cosine
    turns = np.flatnonzero(np.diff(np.concatenate([[False], straight, [False]]).astype(int)))
    # A turn is seen `arm` points before and after it; blur bends an edge nearly as far.
    return [(int(start and start + clear), int(end + (2 * arm if end == len(straight) else arm + 1)))
            for start, end in zip(turns[::2], turns[1::2], strict=True)]


def smooth_stretches(points: Points, waiting: list[tuple[int, int]], is_long: Callable[[Points], bool], off_px: float,
                     margin: int) -> Iterator[tuple[int, int]]:
    """Yield [start, end) of what a lens could have made of a line or of a piece of an arc, out of what is waiting.

    off_px: further off a cubic a stretch is cut in two, at least `margin` points from its ends.
    """
    while waiting:
        start, end = waiting.pop()
        if not is_long(points[start:end]):
            continue
        off = np.abs(off_cubic(points[start:end])[0])
        worst = int(np.argmax(off))
        if off[worst] > off_px:
            cut = start + min(max(worst, margin), len(off) - margin)
            waiting += [(start, cut), (cut, end)]
        else:
            yield start, end


def joined(pieces: Sequence[Piece]) -> list[Piece]:
    """Longer pieces of the same points."""
    if not pieces:
        return []
    first, last = (np.array([p.points[i] for p in pieces]) for i in (0, -1))
    outset, outcome = _way([p.points[:TIP] for p in pieces]), _way([p.points[-TIP:] for p in pieces])
    length = np.array([chord(p.points) for p in pieces])
    cells: dict[tuple[int, int], list[int]] = {}
    for i, (x, y) in enumerate(np.floor(first / GAP_PX).astype(int)):
        cells.setdefault((x, y), []).append(i)
    follows, leads = np.full(len(pieces), -1), np.full(len(pieces), -1)
    follow_gap, lead_gap = np.full(len(pieces), np.inf), np.full(len(pieces), np.inf)
    for i, (x, y) in enumerate(np.floor(last / GAP_PX).astype(int)):
        near = np.array([j for dx in (-1, 0, 1) for dy in (-1, 0, 1) for j in cells.get((x + dx, y + dy), ())], int)
        near = near[near != i]
        step = first[near] - last[i]
        middle = outcome[i] + outset[near]
        middle = middle / np.maximum(np.linalg.norm(middle, axis=1, keepdims=True), 1e-9)
        gap = np.sum(step * middle, axis=1)
        aside = np.abs(step[:, 0] * middle[:, 1] - step[:, 1] * middle[:, 0])
        fits = ((gap > 0) & (gap < np.minimum(GAP_PX, np.minimum(length[near], length[i])))
                & (aside < ASIDE_PX + ASIDE * gap) & (outset[near] @ outcome[i] > MIN_JOINED_COSINE))
        for j, g in zip(near[fits], gap[fits], strict=True):
            if g < follow_gap[i]:
                follow_gap[i], follows[i] = g, j
            if g < lead_gap[j]:
                lead_gap[j], leads[j] = g, i
    return [Piece(np.concatenate([pieces[i].points for i in walk]), np.concatenate([pieces[i].strength for i in walk]))
            for walk in walks(mutual_links(follows, leads))]


def off_cubic(points: Points) -> tuple[NDArray, float]:
    """How far each point is off the best cubic over the chord, px, and how far that cubic bows."""
    way = points[-1] - points[0]
    way = way / np.linalg.norm(way)
    about = points - points.mean(axis=0)
    along, side = about @ way, about @ np.array([-way[1], way[0]])
    powers = (along / np.abs(along).max())[:, None] ** np.arange(4)
    curve = powers @ np.linalg.lstsq(powers, side, rcond=None)[0]
    return side - curve, float(np.ptp(curve - np.interp(along, along[[0, -1]], curve[[0, -1]])))


def chord(points: Points) -> float:
    """From end to end, px."""
    return float(np.linalg.norm(points[-1] - points[0])) if len(points) > 1 else 0.0


def _way(tips: list[Points]) -> NDArray:
    """Unit directions (n, 2): from the mean of a tip's first half to that of its second."""
    ways = np.array([tip[len(tip) // 2:].mean(axis=0) - tip[:len(tip) // 2].mean(axis=0) for tip in tips])
    return ways / np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-9)


def edge_chains(pixels: NDArray[np.uint8]) -> list[Points]:
    """Chains (n, 2) px of a picture (h, w) or (h, w, 3), each along one edge, the longest first."""
    gradient_x, gradient_y = opencv.blurred_gradients(opencv.to_grey(pixels), BLUR_PX)
    points, directions, strength, cells = _tops(gradient_x, gradient_y)
    height, width = gradient_x.shape
    least = max(SHORTEST * float(np.hypot(width, height)), SHORTEST_PIECE_PX)
    pieces = [piece for links in walks(_links(points, directions, cells, (height, width))) if len(links) > 1
              for piece in _smooth(Piece(points[links], strength[links]), SHORTEST_PIECE_PX)]
    found = [chain.points for line in joined(pieces) for chain in _smooth(line, least)]
    return sorted(found, key=lambda chain: (-chord(chain), *chain[0]))


def _tops(gx: NDArray, gy: NDArray) -> tuple[Points, NDArray, NDArray, NDArray]:
    """Sub-pixel points, unit gradients, strengths and cells (row, column) where the gradient is at its top."""
    strength = np.hypot(gx, gy)
    inner = strength[1:-1, 1:-1]
    sideways = np.abs(gx[1:-1, 1:-1]) >= np.abs(gy[1:-1, 1:-1])
    before = np.where(sideways, strength[1:-1, :-2], strength[:-2, 1:-1])
    after = np.where(sideways, strength[1:-1, 2:], strength[2:, 1:-1])
    tops = (inner > FAINT) & (inner >= before) & (inner > after)
    # Beyond the picture's end its last row goes on, in the blur, and turns a slanted edge.
    tops[:MARGIN], tops[-MARGIN:], tops[:, :MARGIN], tops[:, -MARGIN:] = False, False, False, False
    row, column = np.nonzero(tops)
    low, top, high = (np.sqrt(s[row, column]).astype(float) for s in (before, inner, after))
    with np.errstate(all="ignore"):
        offset = np.clip(np.nan_to_num((high - low) / (2 * (2 * top - low - high))), -0.5, 0.5)
    across = sideways[row, column]
    cells = np.stack([row + 1, column + 1], axis=1)
    points = cells[:, ::-1] + np.where(across[:, None], [1.0, 0.0], [0.0, 1.0]) * offset[:, None]
    at = tuple(cells.T)
    directions = np.stack([gx[at], gy[at]], axis=1).astype(float) / strength[at][:, None]
    return points, directions, strength[at].astype(float), cells


def _links(points: Points, directions: NDArray, cells: NDArray, shape: tuple[int, int]) -> NDArray:
    """For each point the one that follows, with the bright side kept right; -1 for none.

    Two points are linked where each is the other's nearest.
    """
    tangent = np.stack([-directions[:, 1], directions[:, 0]], axis=1)

    def judge(a: NDArray, b: NDArray, step: Points) -> tuple[NDArray, NDArray]:
        return (np.sum(step * (tangent[a] + tangent[b]), axis=1) / 2,
                np.sum(directions[a] * directions[b], axis=1) > MIN_LINKED_COSINE)

    return mutual_links(*nearest_neighbours(points, cells, shape, REACH, AHEAD, judge))


def _smooth(line: Piece, least_px: float) -> list[Piece]:
    """The stretches of a chain, at least so long, that may be a straight edge behind a lens; without its ends."""
    line = line.part(TRIM, -TRIM)
    runs = straight_runs(line.points, CORNER_ARM, CORNER, CORNER_ARM - 1)

    def is_long(points: Points) -> bool:
        return len(points) >= 2 * TRIM + 6 and chord(points) >= least_px

    pieces = (line.part(*ends) for ends in smooth_stretches(line.points, runs, is_long, SMOOTH_PX, 2 * TRIM))
    return [piece for piece in pieces if np.median(piece.strength) >= CLEAR and _is_calm(piece.points)]


def _is_calm(points: Points) -> bool:
    off, bow = off_cubic(points)
    return root_mean_square(off) < RAGGED_PX and bow < BENT * chord(points)
