"""Points linked along an edge or a ridge; pieces of one edge joined across the lines of a grid, a post, missing light.

Two pieces belong together where each is the other's nearest to go on with: straight ahead, in the same direction, and
with the same side bright (chains are walked so that the bright side is always on one hand).
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Self

import numpy as np
from numpy.typing import NDArray

from touchline.core.geometry import Points

GAP_PX = 40.0  # ... and no longer than the shorter piece
SAME_WAY = np.cos(np.radians(5))
ASIDE_PX = 0.7  # off the way ahead, and
ASIDE = 0.02  # so much more for each px of the gap: a lens bows the way
TIP = 16  # points that tell which way a piece goes at its end


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
                & (aside < ASIDE_PX + ASIDE * gap) & (outset[near] @ outcome[i] > SAME_WAY))
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
