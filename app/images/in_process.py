"""Bytes → Frame in this very process: only for a process that may die, such as a camera's own."""

from hashlib import sha256

import cv2
import numpy as np

from app.core.errors import BadImage
from app.core.records import Frame
from app.images.limits import DEFAULT_LIMITS, RESAVE, SEND_AGAIN, ImageLimits
from app.images.screen import screen


def decode_in_process(data: bytes, limits: ImageLimits = DEFAULT_LIMITS) -> Frame:
    """Screened like any picture, then decoded here, without a process or a time limit of its own.

    BadImage or ImageTooLarge say why not; sha256 is of the bytes.
    """
    declared = screen(data, limits)
    try:
        pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    except cv2.error:
        pixels = None
    if pixels is None:
        raise BadImage(f"The {declared.format.upper()} picture cannot be decoded.", SEND_AGAIN,
                       reason="undecodable-image")
    if pixels.shape != (declared.height, declared.width, 3):
        raise BadImage(f"The picture declares {declared.width} × {declared.height} px, "
                       f"but holds {pixels.shape[1]} × {pixels.shape[0]} px.", RESAVE, reason="image-size-mismatch")
    pixels.setflags(write=False)
    return Frame(pixels, sha256(data).hexdigest())
