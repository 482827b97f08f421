"""A canvas: the still picture in 16 bits, on which moving solids are drawn for a frame, and erased after it.

A grey level is 32 steps, so that what is still stays exact to 0.03 grey levels. Per frame only the windows of moving
solids are touched; then the whole is scaled by the light, given noise and rounded to 8 bits, strip by strip, so that
no strip leaves the processor's cache on the way.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.sources.sim.draw import Scene, draw
from touchline.sources.sim.solids import Colour, Solid

STEPS = 32  # a grey level; 16 bits then reach four times as bright as white
_ROWS = 8  # of a strip
_SHEET = 1 << 22  # random numbers; each strip takes a random piece


def in_steps(picture: NDArray, steps: float | Colour) -> NDArray[np.int16]:
    """Return a picture (height, width, 3) times so many, of each colour, as whole numbers."""
    made = np.multiply(picture, np.asarray(steps, np.float32))
    np.rint(made, out=made)
    return np.clip(made, 0, np.iinfo(np.int16).max, out=made).astype(np.int16)


class Canvas:
    """One still picture (height, width, 3) in steps, ready to be drawn on; untinted, that very array."""

    def __init__(self, still: NDArray[np.int16], scene: Scene, tint: Colour) -> None:
        self._scene, self._tint = scene, tint
        self._picture = still if tint == (1.0, 1.0, 1.0) else in_steps(still, tint)

    @contextmanager
    def drawn(self, solids: list[Solid]) -> Iterator[None]:
        """Have these on it for as long as the context lasts."""
        changed = draw(self._picture, self._scene, solids, STEPS, self._tint)
        try:
            yield
        finally:
            for window, before in reversed(changed):  # they may overlap
                self._picture[window] = before

    def develop(self, gain: NDArray | float, noise: float, seed: int, index: int) -> NDArray[np.uint8]:
        """Return a new frame. gain: (height,) of each row, or one number. noise: standard deviation in grey levels."""
        height = self._picture.shape[0]
        tops = range(0, height, _ROWS)
        gains = np.broadcast_to(gain, (height,))[::_ROWS] if np.ndim(gain) else np.full(len(tops), gain)
        sheet = _noise_sheet(seed, noise) if noise else None
        if sheet is not None:
            spare = sheet.size - self._picture[:_ROWS].size
            starts = np.random.default_rng([seed, 4, index]).integers(spare, size=len(tops))
        frame = np.empty(self._picture.shape, np.uint8)
        for i, top in enumerate(tops):
            strip = self._picture[top:top + _ROWS]
            grain = None if sheet is None else sheet[starts[i]:starts[i] + strip.size].reshape(strip.shape)
            if gains[i] != 1:
                strip = np.asarray(cv2.addWeighted(strip, float(gains[i]), strip if grain is None else grain,
                                                   0.0 if grain is None else 1.0, 0), np.int16)
            elif grain is not None:
                strip = np.asarray(cv2.add(strip, grain), np.int16)
            _, lit = cv2.threshold(strip, 0, 0, cv2.THRESH_TOZERO)  # no grain makes it darker than black
            cv2.convertScaleAbs(lit, frame[top:top + _ROWS], 1 / STEPS)  # rounds, saturates at 255
        return frame


@lru_cache(maxsize=4)
def _noise_sheet(seed: int, sigma: float) -> NDArray[np.int16]:
    """Return a sheet of noise in steps: cutting pieces out of it is much faster than drawing new noise."""
    drawn = np.random.default_rng([seed, 5]).standard_normal(_SHEET, dtype=np.float32)
    return np.clip(np.rint(drawn * np.float32(sigma * STEPS)), -32767, 32767).astype(np.int16)
