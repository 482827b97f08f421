"""Whether a camera stood still between two frames, whatever moved before it.

The shift of each quarter of the picture by phase correlation (C. Kuglin, D. Hines 1975): robots and people move in some
of them and each another way, a camera moves all alike, or turns them. What most quarters share is the camera's.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core import opencv

WIDTH_PX = 640  # of the picture that is looked at
SURE = 0.15  # response, of 1: less is no shift of the same scene
ALIKE = 0.3  # of the contrast
QUARTERS = 3  # of 4 must be sure


def camera_shift_px(first: NDArray[np.uint8], other: NDArray[np.uint8]) -> float:
    """Return how far most of the picture (h, w[, 3]) has moved, px; 0 where that cannot be told."""
    small = [opencv.to_grey(opencv.shrink_to_width(picture, WIDTH_PX)).astype(np.float32) for picture in (first, other)]
    height, width = small[0].shape[0] // 2, small[0].shape[1] // 2
    window = cv2.createHanningWindow((width, height), cv2.CV_32F)
    far = []
    for y in (0, height):
        for x in (0, width):
            then, now = (picture[y:y + height, x:x + width] for picture in small)
            if now.std() < ALIKE * then.std():
                continue  # dark, or covered
            (dx, dy), response = cv2.phaseCorrelate(then, now, window)
            if response > SURE:
                far.append(float(np.hypot(dx, dy)))
    return float(np.sort(far)[-QUARTERS]) * first.shape[1] / small[0].shape[1] if len(far) >= QUARTERS else 0.0
