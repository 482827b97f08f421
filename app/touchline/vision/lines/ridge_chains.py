"""Ridge points linked along their ridge, cut where it turns: pieces of the field's lines and arcs."""

import numpy as np
from numpy.typing import NDArray

from touchline.core.geometry import Points
from touchline.vision.lines.edge_joining import chord, nearest_neighbours, smooth_stretches, straight_runs
from touchline.vision.lines.ridges import Ridges

REACH = 2  # px to the next point of the same ridge
SAME_WAY = np.cos(np.radians(22))
AHEAD = 0.75  # of a step's length that lies along the ridge
MIN_POINTS = 12
SMOOTH_PX = 1.2  # off a cubic: further, and the chain is cut there
KNEE = 8  # points on either side that tell how sharply a chain turns
KNEE_TURN = np.cos(np.radians(25))


def ridge_chains(found: Ridges, shape: tuple[int, ...]) -> list[NDArray[np.int64]]:
    """Indices of points along each smooth piece of a ridge, the longest first; shape: of the picture."""
    walks = _walks(*_links(found, shape))
    pieces = [piece for walk in walks if len(walk) >= MIN_POINTS for piece in _smooth(walk, found.points)]
    return sorted(pieces, key=len, reverse=True)


def _links(found: Ridges, shape: tuple[int, ...]) -> tuple[NDArray, NDArray]:
    """Each point's neighbour ahead and behind, by its own direction; -1 for none. Both must choose each other."""
    def judge(a: NDArray, b: NDArray, step: Points) -> tuple[NDArray, NDArray]:
        return (np.sum(step * found.along[a], axis=1),
                np.abs(np.sum(found.along[a] * found.along[b], axis=1)) > SAME_WAY)

    neighbour, count = nearest_neighbours(found.points, found.cells, shape, REACH, AHEAD, judge), len(found.points)
    for way in (0, 1):
        mine = neighbour[way]
        answered = (mine >= 0) & ((neighbour[0][mine] == np.arange(count)) | (neighbour[1][mine] == np.arange(count)))
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
    runs = straight_runs(points[chain], KNEE, KNEE_TURN, KNEE) if len(walk) >= 3 * KNEE else [(0, len(walk))]
    return [chain[start:end] for start, end in smooth_stretches(
        points[chain], runs, lambda piece: len(piece) >= MIN_POINTS and chord(piece) > 0, SMOOTH_PX, MIN_POINTS // 2)]
