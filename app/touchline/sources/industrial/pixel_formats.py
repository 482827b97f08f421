"""What the bytes of an industrial camera's picture mean: eight-bit formats of the GenICam pixel format list → BGR.

A camera says the format of each picture as a number of that list (GenICam Pixel Format Naming Convention, PFNC 2.4).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import Unavailable
from touchline.core.statements import say

Pixels = NDArray[np.uint8]  # (height, width, 3) BGR
SIDE_PX = (4, 32767)  # below, there is nothing to take colours from; above, OpenCV refuses


@dataclass(frozen=True)
class PixelFormat:
    """One format. code: its number in the list; bytes_per_pixel: of one row, without padding."""

    name: str
    code: int
    bytes_per_pixel: int
    bgr: Callable[[Any], Any]  # (height, width, bytes_per_pixel) → (height, width, 3)


def _by(code: int) -> Callable[[Any], Any]:
    return lambda raw: cv2.cvtColor(raw, code)


def _from_422(code: int, luma: int) -> Callable[[Any], Any]:
    """Two pixels share their colour. These formats use all of 0 to 255, where OpenCV's code expects television's range.

    luma: which of a pixel's two bytes is its brightness.
    """
    full = np.arange(256)
    narrow = np.empty((1, 256, 2), np.uint8)
    narrow[0, :, luma] = np.rint(16 + full * 219 / 255)
    narrow[0, :, 1 - luma] = np.rint(128 + (full - 128) * 224 / 255)

    def bgr(raw: Any) -> Any:
        even = np.ascontiguousarray(raw[:, :raw.shape[1] // 2 * 2])  # an odd last column has only half a colour
        return cv2.cvtColor(cv2.LUT(even, narrow), code)
    return bgr


# In the order in which we would rather have them: colour in few bytes first, since a network is soon full.
PIXEL_FORMATS = {one.name: one for one in (
    PixelFormat("BayerRG8", 0x01080009, 1, _by(cv2.COLOR_BayerRGGB2BGR)),
    PixelFormat("BayerGB8", 0x0108000A, 1, _by(cv2.COLOR_BayerGBRG2BGR)),
    PixelFormat("BayerGR8", 0x01080008, 1, _by(cv2.COLOR_BayerGRBG2BGR)),
    PixelFormat("BayerBG8", 0x0108000B, 1, _by(cv2.COLOR_BayerBGGR2BGR)),
    PixelFormat("YUV422_8", 0x02100032, 2, _from_422(cv2.COLOR_YUV2BGR_YUY2, 0)),
    PixelFormat("YUV422_8_UYVY", 0x0210001F, 2, _from_422(cv2.COLOR_YUV2BGR_UYVY, 1)),
    PixelFormat("YCbCr422_8", 0x0210003B, 2, _from_422(cv2.COLOR_YUV2BGR_YUY2, 0)),
    PixelFormat("YCbCr422_8_CbYCrY", 0x02100043, 2, _from_422(cv2.COLOR_YUV2BGR_UYVY, 1)),
    PixelFormat("BGR8", 0x02180015, 3, lambda raw: raw.copy()),
    PixelFormat("RGB8", 0x02180014, 3, _by(cv2.COLOR_RGB2BGR)),
    PixelFormat("BGRa8", 0x02200017, 4, _by(cv2.COLOR_BGRA2BGR)),
    PixelFormat("RGBa8", 0x02200016, 4, _by(cv2.COLOR_RGBA2BGR)),
    PixelFormat("Mono8", 0x01080001, 1, _by(cv2.COLOR_GRAY2BGR)),
)}
_BY_CODE = {one.code: one for one in PIXEL_FORMATS.values()}
# What cameras made before the list call the same numbers.
OLD_NAMES = {"YUV422Packed": "YUV422_8_UYVY", "YUV422_YUYV_Packed": "YUV422_8", "BGR8Packed": "BGR8",
             "RGB8Packed": "RGB8", "BGRA8Packed": "BGRa8", "RGBA8Packed": "RGBa8"}


def canonical_name(name: str) -> str | None:
    """Our name of a camera's format; None for one that we cannot read."""
    name = OLD_NAMES.get(name, name)
    return name if name in PIXEL_FORMATS else None


def best_format(offered: Sequence[str]) -> str | None:
    """Of the formats that a camera offers the one that we would rather have, as the camera calls it."""
    ours = [name for name in offered if canonical_name(name)]
    order = list(PIXEL_FORMATS)
    return min(ours, key=lambda name: order.index(canonical_name(name) or ""), default=None)


def bgr_from_raw(data: Any, width: int, height: int, code: int, padding: int = 0) -> Pixels | None:
    """One picture's bytes as BGR, a copy that is read-only; None where they are fewer than the picture needs.

    data: anything with a buffer, longer if it likes. padding: bytes after each row. Unavailable for a format that we
    do not read.
    """
    form = _BY_CODE.get(code)
    if form is None:
        raise Unavailable(say("industrial.unknown-format", "The camera sends an unsupported pixel format (number "
                              "{number:#010x}).", number=code),
                          say("industrial.set-format", "Set it to one of: {formats}.", formats=list(PIXEL_FORMATS)),
                          reason="pixel-format")
    least, most = SIDE_PX
    if not (least <= width <= most and least <= height <= most and padding >= 0):
        return None
    row = width * form.bytes_per_pixel
    flat = np.frombuffer(data, np.uint8)
    stride = row + padding
    if len(flat) < stride * height - padding:  # the last row may lack its padding
        return None
    rows = np.lib.stride_tricks.as_strided(flat, (height, row), (stride, 1), writeable=False)
    pixels = form.bgr(np.ascontiguousarray(rows).reshape(height, width, form.bytes_per_pixel))
    pixels.setflags(write=False)
    return pixels
