"""The one seam to OpenCV: point shapes normalised, so that 4.x and 5.x answer alike.

OpenCV 5 returns (N, 2) where OpenCV 4 returned (N, 1, 2); fisheye functions take only (1, N, 2).
Whoever passes points to cv2 or takes points from it comes through here.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from app.geometry import Points


def points_from_cv(array: NDArray | None) -> Points:
    """Any of OpenCV's point shapes, or None, as float64 (N, 2)."""
    if array is None:
        return np.empty((0, 2))
    return np.asarray(array, dtype=np.float64).reshape(-1, 2)


def remap(pixels: NDArray, raw_x: NDArray[np.float32], raw_y: NDArray[np.float32], *,
          border: tuple[int, int, int] = (0, 0, 0)) -> NDArray:
    """Sample the picture bilinearly at float32 raw positions; NaN and outside give the border colour."""
    return cv2.remap(pixels, raw_x, raw_y, interpolation=cv2.INTER_LINEAR,
                     borderMode=cv2.BORDER_CONSTANT, borderValue=border)
