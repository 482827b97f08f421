"""A chessboard corner to a few hundredths of a pixel, in a window as large as its squares allow.

Where four squares meet, the gradient at every pixel stands perpendicular to the line from the corner to that pixel;
least squares over a window find the corner (W. Förstner 1987, as cornerSubPix does). A window that reaches the next
corner is drawn to it; one that is too small averages little noise. So each corner gets its own.
"""

import numpy as np
from numpy.typing import NDArray

from touchline.core.geometry import Points
from touchline.core.opencv import refine_corners

REACH = 0.35  # of a square's side: inside the four squares even when they are seen from aside
HALF_WINDOW = (2, 16)  # px; below two there are too few pixels, beyond sixteen nothing more is gained


def refine_corners_by_square(gray: NDArray[np.uint8], corners: Points, places: NDArray[np.float64], reach: float =
                             REACH) -> Points:
    """The corners (n, 2), each refined in its own window; one that would leave its window stays where it was.

    places (n, 2): where they are on the board, in squares. reach: how far the four squares are empty, in squares.
    """
    if len(corners) < 2:
        return corners
    halves = np.clip((reach * _square_px(corners, places)).astype(int), *HALF_WINDOW)
    found = corners.copy()
    for half in np.unique(halves):
        mine = halves == half
        found[mine] = refine_corners(gray, corners[mine], int(half))
    ran = np.abs(found - corners).max(axis=1) > halves
    return np.where(ran[:, None], corners, found)


def _square_px(corners: Points, places: NDArray[np.float64]) -> NDArray[np.float64]:
    """How long the shortest side of a square looks at each corner; the board's usual where no neighbour was seen."""
    steps = np.rint(places - places.min(axis=0)).astype(int) + 1
    number = np.full(steps.max(axis=0) + 2, -1)  # which corner stands where, with an empty rim
    number[steps[:, 0], steps[:, 1]] = np.arange(len(corners))
    sides = np.full(len(corners), np.inf)
    for across, down in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        neighbour = number[steps[:, 0] + across, steps[:, 1] + down]
        apart = np.linalg.norm(corners - corners[neighbour], axis=1)
        sides = np.where(neighbour >= 0, np.minimum(sides, apart), sides)
    known = np.isfinite(sides)
    return np.where(known, sides, np.median(sides[known]) if known.any() else 0.0)
