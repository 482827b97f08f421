"""Moving blobs in front of a still background, each with its middle at sub-pixel.

The background is what a pixel mostly shows: each frame moves it by at most one grey level towards what is seen, so it
follows slow light and is not drawn along by what passes. How much a pixel changes by itself, at a sharp edge in a
compressed stream more than on bare carpet, is learned likewise (sigma-delta, A. Manzanera and J. Richefeu, 2007).

Large pictures are looked at reduced: a ball's middle is the mean of so many pixels that little is lost.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

MIN_DIFFERENCE = 12  # grey levels: below, compression and flicker look like movement
NOISES = 4  # times what a pixel's change usually is
WIDTH_PX = 1000  # larger pictures are reduced by a whole number
MIN_AREA_PX = 6
MAX_AREA = 0.02  # of the picture: above, it is a person or the light
MAX_CHANGED = 0.25  # of the picture: light was switched, or the camera was moved; what was known is void
MAX_BLOBS = 200
BESIDE_PX = 3  # around a blob that its middle takes part of
FULL = 0.6  # of a blob's strong difference: from here on a pixel belongs to it wholly


@dataclass(frozen=True)
class MovingBlob:
    """A moving blob. x, y: its middle, px; area_px; contrast: grey levels by which it stands out."""

    x: float
    y: float
    area_px: float
    contrast: float


class MotionDetector:
    """Detects motion in the frames of one still camera, in order. One thread at a time."""

    def __init__(self) -> None:
        self._background: NDArray[np.uint8] | None = None
        self._usual: NDArray[np.uint8] | None = None
        self.upset = 0  # frames in which nearly everything changed

    def add(self, pixels: NDArray[np.uint8]) -> list[MovingBlob]:
        """Return what moves in a frame (h, w[, 3]), px; nothing in the first one, and where nearly all changed."""
        shrink = max(1, round(pixels.shape[1] / WIDTH_PX))
        small = pixels if shrink == 1 else np.asarray(cv2.resize(
            pixels, (pixels.shape[1] // shrink, pixels.shape[0] // shrink), interpolation=cv2.INTER_AREA), np.uint8)
        if self._background is None or self._usual is None or self._background.shape != small.shape:
            return self._anew(small)
        difference = _difference(small, self._background)
        smooth = cv2.blur(difference, (3, 3))
        changed = ((smooth > self._usual) & (smooth > MIN_DIFFERENCE)).view(np.uint8)
        if cv2.countNonZero(changed) > MAX_CHANGED * changed.size:
            self.upset += 1
            return self._anew(small)
        self._background = _towards(self._background, small)
        self._usual = _towards(self._usual, np.asarray(cv2.convertScaleAbs(smooth, alpha=NOISES), np.uint8))
        _, _, stats, _ = cv2.connectedComponentsWithStats(changed, connectivity=8)
        boxes = stats[1:]
        area = boxes[:, cv2.CC_STAT_AREA]
        boxes = boxes[(area >= MIN_AREA_PX) & (area <= MAX_AREA * changed.size)]
        if len(boxes) > MAX_BLOBS:
            boxes = boxes[np.argsort(-boxes[:, cv2.CC_STAT_AREA])[:MAX_BLOBS]]
        scale = np.array([pixels.shape[1] / small.shape[1], pixels.shape[0] / small.shape[0]])
        return [_mover(difference, box, scale) for box in boxes]

    def _anew(self, small: NDArray[np.uint8]) -> list[MovingBlob]:
        self._background = small.copy()
        self._usual = np.full(small.shape[:2], MIN_DIFFERENCE, np.uint8)
        return []


def _towards(known: NDArray[np.uint8], current: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return known + (current > known) - (current < known)


def _difference(pixels: NDArray[np.uint8], background: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """(h, w): of the channel that differs most, as a coloured ball may be as bright as the carpet."""
    first, *others = cv2.split(cv2.absdiff(pixels, background))
    for other in others:
        first = cv2.max(first, other)
    return np.asarray(first, np.uint8)


def _mover(difference: NDArray[np.uint8], box: NDArray[np.int32], scale: NDArray[np.float64]) -> MovingBlob:
    left, top, width, height, area = (int(v) for v in box)
    x0, y0 = max(left - BESIDE_PX, 0), max(top - BESIDE_PX, 0)
    part = difference[y0:top + height + BESIDE_PX, x0:left + width + BESIDE_PX].astype(np.float64)
    strong = float(np.percentile(np.sort(part, axis=None)[-max(area, 4):], 50))
    weight = np.clip(part - MIN_DIFFERENCE / 2, 0, max(FULL * strong, 1.0))
    total = weight.sum()
    x = x0 + float((weight.sum(axis=0) * np.arange(part.shape[1])).sum() / total)
    y = y0 + float((weight.sum(axis=1) * np.arange(part.shape[0])).sum() / total)
    raw = (np.array([x, y]) + 0.5) * scale - 0.5
    return MovingBlob(float(raw[0]), float(raw[1]), area * float(scale.prod()), strong)
