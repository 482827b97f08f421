"""Points linked along an edge or a ridge; pieces of one edge joined across the lines of a grid, a post, missing light.

Two pieces belong together where each is the other's nearest to go on with: straight ahead, in the same direction, and
with the same side bright (chains are walked so that the bright side is always on one hand).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Self

import numpy as np
from numpy.typing import NDArray

from app.core.geometry import Points

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
            for walk in _walks(follows, leads)]


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


def _walks(follows: NDArray, leads: NDArray) -> list[list[int]]:
    walks = []
    for start in range(len(follows)):
        before = leads[start]
        if before >= 0 and follows[before] == start:
            continue
        walk = [start]
        while (after := int(follows[walk[-1]])) >= 0 and leads[after] == walk[-1]:
            walk.append(after)
        walks.append(walk)
    return walks
