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


def remap(pixels: NDArray, map_1: NDArray, map_2: NDArray, *, border: tuple[int, int, int] = (0, 0, 0),
          fine: bool = False) -> NDArray:
    """Sample the picture by float32 maps or fixed-point ones, bilinearly or (fine) bicubically.

    Outside gives the border colour, and so does NaN in a float map with bilinear sampling.
    """
    return cv2.remap(pixels, map_1, map_2, interpolation=cv2.INTER_CUBIC if fine else cv2.INTER_LINEAR,
                     borderMode=cv2.BORDER_CONSTANT, borderValue=border)


def fixed_point_maps(raw_x: NDArray[np.float32], raw_y: NDArray[np.float32]) -> tuple[NDArray, NDArray]:
    """Float maps as OpenCV's quicker pair: int16 places and an index into 32 × 32 weights; NaN becomes outside."""
    outside = np.float32(-30_000)  # fits int16, and no picture begins there
    maps = [np.clip(np.nan_to_num(m, nan=outside), outside, -outside) for m in (raw_x, raw_y)]
    return cv2.convertMaps(*maps, dstmap1type=cv2.CV_16SC2)
