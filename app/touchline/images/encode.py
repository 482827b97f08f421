"""Pixels → bytes, in this process: these are our own pictures."""

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import BadInput
from touchline.core.statements import say

ENCODED_MEDIA_TYPES = {"png": "image/png", "jpg": "image/jpeg"}
PNG_COMPRESSION = 3  # of 9; a third slower files for a fifth of the bytes gained beyond it


def encode(pixels: NDArray[np.uint8], format: str = "png", quality: int = 90) -> bytes:
    """(height, width, 3) BGR or (height, width) grey uint8 as a PNG or JPEG file; quality 1–100 is JPEG's."""
    if format not in ENCODED_MEDIA_TYPES:
        raise BadInput(f"Images cannot be written as {format!r}.",
                       f"Use one of: {', '.join(ENCODED_MEDIA_TYPES)}.", reason="unknown-image-format")
    if not 1 <= quality <= 100:
        raise BadInput(f"A JPEG quality of {quality} does not exist.", "Use 1 to 100.", reason="bad-quality")
    options = {"png": [cv2.IMWRITE_PNG_COMPRESSION, PNG_COMPRESSION], "jpg": [cv2.IMWRITE_JPEG_QUALITY, quality]}
    done, buffer = cv2.imencode(f".{format}", np.ascontiguousarray(pixels), options[format])
    if not done:
        raise BadInput(say("image.not-encodable", "The image cannot be encoded."),
                       say("image.use-png", "Use PNG, or a smaller image."), reason="not-encodable")
    return buffer.tobytes()
