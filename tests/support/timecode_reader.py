"""Read the time that the simulated camera paints into a picture, as touchline/sources/sim/timecode.py specifies it."""

from math import ceil, floor

import numpy as np
from numpy.typing import NDArray

from touchline.sources.sim.timecode import BITS, CELLS_ACROSS, COUNT, END, START, crc

MIN_CONTRAST = 60.0  # grey levels; JPEG at quality 60 leaves more than 200
MIN_WIDTH = 2 * CELLS_ACROSS  # a cell of two pixels still has a middle


def read_timecode(picture: NDArray[np.uint8]) -> int | None:
    """Return the time in a picture (height, width) or (height, width, 3), ms; None where none can be read."""
    height, width = picture.shape[:2]
    cell = width / CELLS_ACROSS
    if width < MIN_WIDTH or height < 2 * cell:
        return None
    rows = slice(floor(1.25 * cell), ceil(1.75 * cell))
    grey = picture[rows].reshape(rows.stop - rows.start, width, -1).mean(axis=(0, 2))
    level = np.array(
        [grey[floor((1.25 + i) * cell) : ceil((1.75 + i) * cell)].mean() for i in range(COUNT)]
    )
    marks, seen = np.array(START + END, bool), level[[0, 1, 2, 3, -4, -3, -2, -1]]
    white, black = seen[marks].mean(), seen[~marks].mean()
    if white - black < MIN_CONTRAST:
        return None
    bits = level > (white + black) / 2
    value = _number(bits[4 : 4 + BITS])
    right = (bits[[0, 1, 2, 3, -4, -3, -2, -1]] == marks).all() and _number(
        bits[4 + BITS : -4]
    ) == crc(value)
    return value if right else None


def _number(bits: NDArray) -> int:
    return int("".join("1" if bit else "0" for bit in bits), 2)
