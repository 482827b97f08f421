"""What stays while robots and people move: one clean picture from many frames, and whether the camera stood still.

For each pixel the median of the frames is found, then the mean of all frames that agree with it: the median alone keeps
a fifth more noise. Where too few agree, something stood there most of the time, and the pixel is marked as never seen
free. What stands still throughout cannot be told from the field.

The median comes from a sorting network of minima and maxima over strips of 8-bit pixels, which is many times faster
than sorting each pixel's values. K. E. Batcher, "Sorting networks and their applications", 1968.

Whether the camera stood still is seen by the shift of each quarter of the picture by phase correlation (C. Kuglin, D.
Hines 1975): robots and people move in some of them and each another way, a camera moves all alike, or turns them. What
most quarters share is the camera's.
"""

from functools import cached_property, lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core import opencv
from touchline.core.errors import BadInput

MAX_FRAMES = 25  # frames at most are kept; of more, evenly spread ones
AGREEING = 0.6  # of the frames must agree on a pixel
_NOISES = 3.5  # noises apart from the median, a frame still agrees
_MIN_APART = 3  # grey levels
# bytes of each frame at a time: all frames of a strip fit a processor's cache
_STRIP = 3 * (1 << 14)

WIDTH_PX = 640  # of the picture that is looked at
SURE = 0.15  # response, of 1: less is no shift of the same scene
ALIKE = 0.3  # of the contrast
QUARTERS = 3  # of 4 must be sure


class Background:
    """Add frames of one size, then ask for the picture. shape: (height, width, 3). frames: how many will be added."""

    def __init__(self, shape: tuple[int, ...], frames: int) -> None:
        if len(shape) != 3 or shape[2] != 3 or frames < 1:
            raise BadInput(
                "A background needs at least one colour frame.",
                "Add frames (height, width, 3).",
                reason="bad-background",
            )
        self._shape = shape
        self._chosen = set(
            np.linspace(0, frames - 1, min(frames, MAX_FRAMES)).round().astype(int).tolist()
        )
        self._chosen_frames = np.empty((len(self._chosen), int(np.prod(shape))), np.uint8)
        self._added = self._count = 0

    def add(self, picture: NDArray[np.uint8]) -> None:
        """Take one more frame; what is beyond the announced number is left out."""
        if picture.shape != self._shape:
            raise BadInput(
                "The frames have different sizes.",
                "Start again with frames of one size.",
                reason="bad-background",
            )
        if self._added in self._chosen:
            self._chosen_frames[self._count] = picture.reshape(-1)
            self._count += 1
            self.__dict__.pop("_found", None)
        self._added += 1

    @property
    def picture(self) -> NDArray[np.uint8]:
        """(height, width, 3) BGR."""
        return self._found[0]

    @property
    def unsettled(self) -> NDArray[np.bool_]:
        """(height, width) where most frames disagree: never, or hardly ever, seen free."""
        return self._found[1]

    @cached_property
    def noise(self) -> float:
        """Standard deviation of one frame's noise, grey levels."""
        if self._count < 2:
            return 0.0
        # Neighbouring frames differ by √2 noises; most pixels see no motion, so their median is noise alone.
        take = slice(None, None, max(1, self._chosen_frames.shape[1] // 200_000))
        some = self._chosen_frames[: self._count, take].astype(np.int16)
        return _spread(np.diff(some, axis=0)) / float(np.sqrt(2))

    @cached_property
    def _found(self) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
        if not self._count:
            raise BadInput(
                "A background needs at least one frame.", "Add a frame.", reason="bad-background"
            )
        self.__dict__.pop("noise", None)
        apart = max(_MIN_APART, int(np.ceil(_NOISES * self.noise)))
        size = self._chosen_frames.shape[1]
        picture, agreeing = np.empty(size, np.uint8), np.empty(size // 3, np.uint8)
        for start in range(0, size, _STRIP):
            part = slice(start, min(start + _STRIP, size))
            strip = self._chosen_frames[: self._count, part]
            middle = _median(strip)
            picture[part], agreeing[start // 3 : part.stop // 3] = _mean_of_agreeing(
                strip, middle, apart
            )
        free = agreeing.reshape(self._shape[:2]) >= AGREEING * self._count
        return picture.reshape(self._shape), ~free


def _spread(off: NDArray) -> float:
    """Standard deviation from the 68 % of values that are least off; whole numbers are spread over their width."""
    counts = np.bincount(np.abs(off).ravel().clip(0, 255), minlength=256).astype(float)
    counts[1:] /= 2  # to either side
    inner = np.cumsum(np.concatenate([[counts[0] / 2], counts[1:]])) / (
        counts[0] / 2 + counts[1:].sum()
    )
    edge = np.arange(256) + 0.5
    return float(np.interp(0.6827, np.concatenate([[0.0], inner]), np.concatenate([[0.0], edge])))


def _median(strip: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """(n,) of rows (count, n); the upper one of two."""
    rows = list(strip.copy())
    spare = np.empty_like(rows[0])
    for a, b in _network(len(rows)):
        cv2.min(rows[a], rows[b], dst=spare)
        cv2.max(rows[a], rows[b], dst=rows[b])
        rows[a], spare = spare, rows[a]
    return rows[len(rows) // 2]


@lru_cache(maxsize=32)
def _network(count: int) -> tuple[tuple[int, int], ...]:
    """Which rows to put in order, one pair after the other, until the middle one is the median."""
    pairs, p = [], 1
    while p < count:  # Batcher's merge exchange, for any count
        k = p
        while k >= 1:
            for j in range(k % p, count - k, 2 * k):
                for i in range(min(k, count - j - k)):
                    if (i + j) // (2 * p) == (i + j + k) // (2 * p):
                        pairs.append((i + j, i + j + k))
            k //= 2
        p *= 2
    needed, used = {count // 2}, []
    for a, b in reversed(pairs):  # only what the middle one depends on
        if needed & {a, b}:
            needed |= {a, b}
            used.append((a, b))
    return tuple(reversed(used))


def _mean_of_agreeing(
    strip: NDArray[np.uint8], middle: NDArray[np.uint8], apart: int
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """The mean (n,) of the rows that are near the middle in all three colours of a pixel, and how many are (n / 3,)."""
    total = np.zeros((len(middle) // 3, 1, 3), np.uint16)
    count = np.zeros((len(middle) // 3, 1), np.uint8)
    middle = middle.reshape(total.shape)
    for row in strip:
        row = row.reshape(total.shape)
        near = cv2.inRange(cv2.absdiff(row, middle), (0, 0, 0), (apart, apart, apart))
        cv2.add(
            total, cv2.bitwise_and(row, cv2.merge([near, near, near])), dst=total, dtype=cv2.CV_16U
        )
        count += near > 0
    # The median's own colours may come from different frames: then none agrees, and it stands.
    times = np.maximum(count, 1)[..., None].astype(np.uint16)
    mean = np.where(count[..., None] > 0, (total + times // 2) // times, middle).astype(np.uint8)
    return mean.reshape(-1), count.reshape(-1)


def camera_shift_px(first: NDArray[np.uint8], other: NDArray[np.uint8]) -> float:
    """Return how far most of the picture (h, w[, 3]) has moved, px; 0 where that cannot be told."""
    small = [
        opencv.to_grey(opencv.shrink_to_width(picture, WIDTH_PX)).astype(np.float32)
        for picture in (first, other)
    ]
    height, width = small[0].shape[0] // 2, small[0].shape[1] // 2
    window = cv2.createHanningWindow((width, height), cv2.CV_32F)
    far = []
    for y in (0, height):
        for x in (0, width):
            then, now = (picture[y : y + height, x : x + width] for picture in small)
            if now.std() < ALIKE * then.std():
                continue  # dark, or covered
            (dx, dy), response = cv2.phaseCorrelate(then, now, window)
            if response > SURE:
                far.append(float(np.hypot(dx, dy)))
    return (
        float(np.sort(far)[-QUARTERS]) * first.shape[1] / small[0].shape[1]
        if len(far) >= QUARTERS
        else 0.0
    )
