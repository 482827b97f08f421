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

# between two pieces of one edge, which is no longer than the shorter piece either
MAX_GAP_PX = 40.0
MIN_JOINED_COSINE = np.cos(np.radians(5))
MAX_OFF_AXIS_PX = 0.7  # across the way ahead, and
OFF_AXIS_A_PX = 0.02  # so much more for each px of the gap: a lens bows the way
TIP_POINTS = 16  # that give the direction of a piece at its end

BLUR_PX = 1.2  # sharper follows the noise, softer lets neighbouring edges push each other
MARGIN_PX = 4  # at the picture's end, three blurs
MIN_GRADIENT = 1.0  # grey levels a px: a weaker one is noise
MIN_MEDIAN_GRADIENT = 3.0  # along a chain
REACH_PX = 2  # to the next point of the same edge
MIN_LINKED_COSINE = np.cos(np.radians(25))  # neighbours on one edge have nearly one gradient
MIN_AHEAD_SHARE = 0.8  # of a step's length that lies along the edge
CORNER_ARM = 6  # points on either side by which the turn of a chain is measured
MIN_CORNER_COSINE = np.cos(np.radians(14))
MAX_OFF_CUBIC_PX = 1.0  # further is no smooth curve, and the chain is cut there
MAX_RMS_OFF_CUBIC_PX = 0.4  # of what may be a straight edge behind a lens
TRIMMED_POINTS = 3  # at either end, where other edges meet this one
MIN_PIECE_PX = 12.0  # worth joining to others
# of the picture's diagonal; a chain's bow grows with the square of its length
MIN_CHAIN_SHARE = 0.06
MAX_BOW_SHARE = 0.2  # of its chord: no lens of ours bows a line further


@dataclass(frozen=True, eq=False)
class Piece:
    """Points (n, 2) px along an edge and the gradient at each (n,)."""

    points: Points
    strength: NDArray

    def part(self, start: int, end: int | None) -> Self:
        return type(self)(self.points[start:end], self.strength[start:end])


def nearest_neighbours(
    points: Points,
    cells: NDArray,
    shape: tuple[int, ...],
    reach: int,
    ahead_share: float,
    judge: Callable[[NDArray, NDArray, NDArray], tuple[NDArray, NDArray]],
) -> NDArray:
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


def straight_runs(
    points: Points, arm: int, least_cosine: float, clear: int
) -> list[tuple[int, int]]:
    """The stretches [start, end) of a chain between its sharp turns, which are seen by `arm` points on either side.

    clear: points that are left out after a turn; before one, arm - 1 are.
    """
    if len(points) < 2 * arm + 1:
        return []
    way = points[arm:] - points[:-arm]
    way = way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
    straight = np.sum(way[arm:] * way[:-arm], axis=1) > least_cosine
    turns = np.flatnonzero(np.diff(np.concatenate([[False], straight, [False]]).astype(int)))
    # A turn is seen `arm` points before and after it; blur bends an edge nearly as far.
    return [
        (int(start and start + clear), int(end + (2 * arm if end == len(straight) else arm + 1)))
        for start, end in zip(turns[::2], turns[1::2], strict=True)
    ]


def smooth_stretches(
    points: Points,
    waiting: list[tuple[int, int]],
    is_long: Callable[[Points], bool],
    off_px: float,
    margin: int,
) -> Iterator[tuple[int, int]]:
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
    """Longer pieces of the same points: each is followed by the nearest one that goes on with it, where that agrees."""
    if not pieces:
        return []
    ends = _Ends.of(pieces)
    follows, leads = np.full(len(pieces), -1), np.full(len(pieces), -1)
    follow_gap, lead_gap = np.full(len(pieces), np.inf), np.full(len(pieces), np.inf)
    for i, candidates in enumerate(_starts_near_ends(ends)):
        for j, gap in zip(*ends.continuations(i, candidates), strict=True):
            if gap < follow_gap[i]:
                follow_gap[i], follows[i] = gap, j
            if gap < lead_gap[j]:
                lead_gap[j], leads[j] = gap, i
    return [
        Piece(
            np.concatenate([pieces[i].points for i in walk]),
            np.concatenate([pieces[i].strength for i in walk]),
        )
        for walk in walks(mutual_links(follows, leads))
    ]


@dataclass(frozen=True, eq=False)
class _Ends:
    """Of each piece: where it starts and ends (n, 2), its unit direction there (n, 2), and its chord (n,), px."""

    start: Points
    end: Points
    start_direction: NDArray
    end_direction: NDArray
    length: NDArray

    @classmethod
    def of(cls, pieces: Sequence[Piece]) -> Self:
        return cls(
            np.array([p.points[0] for p in pieces]),
            np.array([p.points[-1] for p in pieces]),
            _directions([p.points[:TIP_POINTS] for p in pieces]),
            _directions([p.points[-TIP_POINTS:] for p in pieces]),
            np.array([chord(p.points) for p in pieces]),
        )

    def continuations(self, i: int, candidates: NDArray) -> tuple[NDArray, NDArray]:
        """Return those of the candidates that go straight on where piece i ends, and the gaps to them, px."""
        step = self.start[candidates] - self.end[i]
        # The gap is bridged along the mean of both directions, since a lens bends the edge within it.
        bridge = self.end_direction[i] + self.start_direction[candidates]
        bridge = bridge / np.maximum(np.linalg.norm(bridge, axis=1, keepdims=True), 1e-9)
        gap = np.sum(step * bridge, axis=1)
        off_axis = np.abs(step[:, 0] * bridge[:, 1] - step[:, 1] * bridge[:, 0])
        is_near = (gap > 0) & (
            gap < np.minimum(MAX_GAP_PX, np.minimum(self.length[candidates], self.length[i]))
        )
        is_straight_on = (off_axis < MAX_OFF_AXIS_PX + OFF_AXIS_A_PX * gap) & (
            self.start_direction[candidates] @ self.end_direction[i] > MIN_JOINED_COSINE
        )
        fits = is_near & is_straight_on
        return candidates[fits], gap[fits]


def _starts_near_ends(ends: _Ends) -> Iterator[NDArray]:
    """Yield for each piece which others start in the cells of MAX_GAP_PX about its end: any further gap is too long."""
    cells: dict[tuple[int, int], list[int]] = {}
    for i, (x, y) in enumerate(np.floor(ends.start / MAX_GAP_PX).astype(int)):
        cells.setdefault((x, y), []).append(i)
    for i, (x, y) in enumerate(np.floor(ends.end / MAX_GAP_PX).astype(int)):
        near = np.array(
            [j for dx in (-1, 0, 1) for dy in (-1, 0, 1) for j in cells.get((x + dx, y + dy), ())],
            int,
        )
        yield near[near != i]


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


def _directions(tips: list[Points]) -> NDArray:
    """Unit directions (n, 2): from the mean of a tip's first half to that of its second."""
    ways = np.array(
        [tip[len(tip) // 2 :].mean(axis=0) - tip[: len(tip) // 2].mean(axis=0) for tip in tips]
    )
    return ways / np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-9)


def edge_chains(pixels: NDArray[np.uint8]) -> list[Points]:
    """Chains (n, 2) px of a picture (h, w) or (h, w, 3), each along one edge, the longest first."""
    gradient_x, gradient_y = opencv.blurred_gradients(opencv.to_grey(pixels), BLUR_PX)
    points, directions, strength, cells = _tops(gradient_x, gradient_y)
    height, width = gradient_x.shape
    least_px = max(MIN_CHAIN_SHARE * float(np.hypot(width, height)), MIN_PIECE_PX)
    pieces = [
        piece
        for links in walks(_links(points, directions, cells, (height, width)))
        if len(links) > 1
        for piece in _smooth(Piece(points[links], strength[links]), MIN_PIECE_PX)
    ]
    # Once more, as a joint may be a corner, and where pieces meet their ends are no better than those of a chain.
    found = [chain.points for line in joined(pieces) for chain in _smooth(line, least_px)]
    return sorted(found, key=lambda chain: (-chord(chain), *chain[0]))


def _tops(gx: NDArray, gy: NDArray) -> tuple[Points, NDArray, NDArray, NDArray]:
    """Sub-pixel points, unit gradients, strengths and cells (row, column) where the gradient is at its top."""
    strength = np.hypot(gx, gy)
    inner = strength[1:-1, 1:-1]
    sideways = np.abs(gx[1:-1, 1:-1]) >= np.abs(gy[1:-1, 1:-1])
    before = np.where(sideways, strength[1:-1, :-2], strength[:-2, 1:-1])
    after = np.where(sideways, strength[1:-1, 2:], strength[2:, 1:-1])
    tops = (inner > MIN_GRADIENT) & (inner >= before) & (inner > after)
    # Beyond the picture's end its last row goes on, in the blur, and turns a slanted edge.
    tops[:MARGIN_PX], tops[-MARGIN_PX:], tops[:, :MARGIN_PX], tops[:, -MARGIN_PX:] = (
        False,
        False,
        False,
        False,
    )
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
        return (
            np.sum(step * (tangent[a] + tangent[b]), axis=1) / 2,
            np.sum(directions[a] * directions[b], axis=1) > MIN_LINKED_COSINE,
        )

    return mutual_links(*nearest_neighbours(points, cells, shape, REACH_PX, MIN_AHEAD_SHARE, judge))


def _smooth(line: Piece, least_px: float) -> list[Piece]:
    """The stretches of a chain, at least so long, that may be a straight edge behind a lens; without its ends."""
    line = line.part(TRIMMED_POINTS, -TRIMMED_POINTS)
    runs = straight_runs(line.points, CORNER_ARM, MIN_CORNER_COSINE, CORNER_ARM - 1)

    def is_long(points: Points) -> bool:
        return len(points) >= 2 * TRIMMED_POINTS + 6 and chord(points) >= least_px

    stretches = smooth_stretches(line.points, runs, is_long, MAX_OFF_CUBIC_PX, 2 * TRIMMED_POINTS)
    return [
        piece
        for piece in (line.part(*ends) for ends in stretches)
        if np.median(piece.strength) >= MIN_MEDIAN_GRADIENT and _is_smooth(piece.points)
    ]


def _is_smooth(points: Points) -> bool:
    off, bow = off_cubic(points)
    return root_mean_square(off) < MAX_RMS_OFF_CUBIC_PX and bow < MAX_BOW_SHARE * chord(points)
