"""A time painted into the picture, to measure how long a picture takes from the camera to whoever looks at it.

The code is a row of 64 cells, white for 1 and black for 0. With c = width of the picture / 96 (5 px at 480, 20 px at
1920), cell i covers x from (1 + i) c to (2 + i) c and y from c to 2 c, counted from the picture's top-left corner,
before any correction. From left to right:

    4 cells    1 0 1 0      start; how bright white and black came out
    48 cells   milliseconds since 1970-01-01 UTC, whole, most significant bit first
    8 cells    CRC-8 of those 48 bits as six bytes: polynomial 0x07, starting from 0, nothing reflected or inverted
    4 cells    0 1 0 1      end

To read it at any size of the picture: take the mean brightness of the middle half of each cell (from a quarter to three
quarters of c, both ways). The threshold is the middle between the mean of the four marker cells that are 1 and the mean
of the four that are 0; they must lie at least 60 grey levels apart. A wrong marker or a wrong CRC means that there is
no code to be read. Six bytes fit a JavaScript number; shift by multiplying by 2.
"""

from math import floor

import numpy as np
from numpy.typing import NDArray

CELLS_ACROSS = 96  # cells that would fill the picture's width
START, END = (1, 0, 1, 0), (0, 1, 0, 1)
BITS, CRC_BITS, POLYNOMIAL = 48, 8, 0x07
COUNT = len(START) + BITS + CRC_BITS + len(END)


def paint(picture: NDArray[np.uint8], time_ms: int) -> None:
    """Write a time into a picture (height, width, 3), in place."""
    cell = picture.shape[1] / CELLS_ACROSS
    top, bottom = _whole(cell), _whole(2 * cell)
    for i, bit in enumerate(_cells(time_ms)):
        picture[top:bottom, _whole((1 + i) * cell) : _whole((2 + i) * cell)] = 255 * bit


def _cells(time_ms: int) -> list[int]:
    if not 0 <= time_ms < 1 << BITS:
        raise ValueError(f"{time_ms} ms is not a time in {BITS} bits")
    return [*START, *_bits(time_ms, BITS), *_bits(crc(time_ms), CRC_BITS), *END]


def _bits(value: int, count: int) -> list[int]:
    return [value >> i & 1 for i in reversed(range(count))]


def crc(value: int) -> int:
    crc = 0
    for byte in value.to_bytes(BITS // 8, "big"):
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ (POLYNOMIAL if crc & 0x80 else 0)) & 0xFF
    return crc


def _whole(px: float) -> int:
    return floor(px + 0.5)
