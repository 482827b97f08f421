"""Edges as long smooth chains of sub-pixel points: where brightness changes fastest, linked along the edge.

Three samples across the edge give the top of a parabola. Through the gradient itself that top ripples from pixel to
pixel one way, through its logarithm (a parabola, were a blurred step a Gaussian) the other, because a pixel's own area
makes the profile lopsided; through its square root it stays within 0.02 px. The samples are taken along the picture's
own axis that is nearer to the gradient, so nothing is interpolated.

After J. Canny 1986; F. Devernay, "A non-maxima suppression method for edge detection with sub-pixel accuracy", 1995.
"""

import numpy as np
from numpy.typing import NDArray

from touchline.core import opencv
from touchline.core.geometry import Points, root_mean_square
from touchline.vision.lines.edge_joining import (
    Piece,
    chord,
    joined,
    mutual_links,
    nearest_neighbours,
    off_cubic,
    smooth_stretches,
    straight_runs,
    walks,
)

BLUR_PX = 1.2  # sharper follows the noise, softer lets neighbouring edges push each other
MARGIN = 4  # px at the picture's end, three blurs
FAINT = 1.0  # grey levels a px: a weaker gradient is noise
CLEAR = 3.0  # the median along a chain that is kept
REACH = 2  # px to the next point of the same edge
SAME_WAY = np.cos(np.radians(25))  # neighbours on one edge have nearly one gradient
AHEAD = 0.8  # of a step's length that lies along the edge
CORNER_ARM = 6  # points on either side that tell how sharply a chain turns
CORNER = np.cos(np.radians(14))
SMOOTH_PX = 1.0  # off a cubic: further is no smooth curve, and the chain is cut there
RAGGED_PX = 0.4  # rms off a cubic of what may be a straight edge behind a lens
TRIM = 3  # points at either end, where other edges meet this one
SHORTEST_PIECE_PX = 12.0  # worth joining to others
SHORTEST = 0.06  # of the picture's diagonal; a chain's bow grows with the square of its length
BENT = 0.2  # of its chord: no lens of ours bows a line further


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
                np.sum(directions[a] * directions[b], axis=1) > SAME_WAY)

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
