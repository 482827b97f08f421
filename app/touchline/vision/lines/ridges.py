"""Ridges: the middle of bright lines on a darker ground, thin or thick, to a fraction of a pixel.

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

from touchline.core.geometry import Points

SIGMAS_PX = (0.9, 1.5, 2.4, 3.8)  # a bar answers most to 0.3 of its width: 1 to 13 px are covered
MARGIN = 3  # px at the picture's end, where the blur has nothing to go on
ABOVE_NOISE = 6.0  # times the answer that bare ground gives at the 60th of a hundred places
MIN_RESPONSE = 1.0
OFF_CENTRE = 0.6  # px: further away, the neighbouring pixel is the ridge's


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
    for sigma in SIGMAS_PX:
        _look(picture, sigma, best, offset, across)
    best[:MARGIN], best[-MARGIN:], best[:, :MARGIN], best[:, -MARGIN:] = 0, 0, 0, 0
    row, column = np.nonzero((best > 0) & (np.abs(offset) <= OFF_CENTRE).all(axis=-1))
    normal = across[row, column].astype(np.float64)
    points = np.stack([column, row], axis=1) + offset[row, column]
    return _one_a_cell(points.astype(np.float64), np.stack([-normal[:, 1], normal[:, 0]], axis=1),
                       best[row, column].astype(np.float64), picture.shape)


def _look(picture: NDArray, sigma: float, best: NDArray, offset: NDArray, across: NDArray) -> None:
    """Write this blur's ridges, in place, wherever they answer more than any before."""
    soft = cv2.GaussianBlur(picture, (0, 0), sigma, borderType=cv2.BORDER_REPLICATE)
    second, first, one = np.array([1, -2, 1], np.float32), np.array([-0.5, 0, 0.5], np.float32), np.ones(1, np.float32)

    def filtered(x: NDArray, y: NDArray) -> NDArray:
        return cv2.sepFilter2D(soft, cv2.CV_32F, x, y, borderType=cv2.BORDER_REPLICATE)
    xx, yy, xy = filtered(second, one), filtered(one, second), filtered(first, first)
    middle, half = cv2.addWeighted(xx, 0.5, yy, 0.5, 0), cv2.addWeighted(xx, 0.5, yy, -0.5, 0)
    spread = cv2.magnitude(half, xy)
    # -low - |high|, where low and high are middle ∓ spread: spread itself for a ridge on a slope, less for a blob.
    answer = cv2.min(cv2.subtract(spread, middle), spread) * np.float32(2 * sigma**1.5)
    answer = np.where(middle < 0, cv2.min(answer, (spread - middle - np.abs(middle + spread)) * np.float32(sigma**1.5)),
                      np.float32(0))
    threshold = ABOVE_NOISE * float(np.percentile(answer[::7, ::5], 60)) + MIN_RESPONSE
    row, column = np.nonzero((answer > threshold) & (answer > best))
    at = row, column
    low = middle[at] - spread[at]
    # The eigenvector of low, from whichever row of the matrix is longer.
    a, b = np.stack([xy[at], low - xx[at]], axis=1), np.stack([low - yy[at], xy[at]], axis=1)
    normal = np.where((np.abs(a).sum(axis=1) >= np.abs(b).sum(axis=1))[:, None], a, b)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True) + 1e-9
    slope_x = (soft[row, np.minimum(column + 1, soft.shape[1] - 1)] - soft[row, np.maximum(column - 1, 0)]) / 2
    slope_y = (soft[np.minimum(row + 1, soft.shape[0] - 1), column] - soft[np.maximum(row - 1, 0), column]) / 2
    top = -(normal[:, 0] * slope_x + normal[:, 1] * slope_y) / (low - 1e-6)
    best[at], offset[at], across[at] = answer[at], normal * top[:, None], normal


def _one_a_cell(points: Points, along: NDArray, strength: NDArray, shape: tuple[int, ...]) -> Ridges:
    """Of points whose tops fall into one pixel, the strongest: two neighbours may both see one ridge between them."""
    cells = np.rint(points[:, ::-1]).astype(np.int64)
    number = cells[:, 0] * shape[1] + cells[:, 1]
    order = np.lexsort((-strength, number))
    first = np.ones(len(order), bool)
    first[1:] = np.diff(number[order]) > 0
    strongest = np.sort(order[first])
    return Ridges(points[strongest], along[strongest], strength[strongest], cells[strongest])
