"""Bytes → Frame in this very process: only for a process that may die, such as a camera's own."""

from hashlib import sha256

import cv2
import numpy as np

from app.core.records import Frame
from app.images.jpeg_frame import JpegFrame
from app.images.limits import DEFAULT_LIMITS, DeclaredImage, ImageLimits
from app.images.screen import screen


def decode_in_process(data: bytes, limits: ImageLimits = DEFAULT_LIMITS) -> Frame:
    """Screened like any picture, then decoded here, without a process or a time limit of its own.

    BadImage or ImageTooLarge say why not; sha256 is of the bytes.
    """
    declared = screen(data, limits)
    return _decoded(data, declared)


def read_in_process(data: bytes, limits: ImageLimits = DEFAULT_LIMITS) -> Frame:
    """The same, but of a JPEG, whose pixels are decoded when they are wanted: BadImage may come as late as that."""
    declared = screen(data, limits)
    return JpegFrame(data, declared) if declared.format == "jpeg" else _decoded(data, declared)


def _decoded(data: bytes, declared: DeclaredImage) -> Frame:
    try:
        pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    except cv2.error:
        pixels = None
    if pixels is None:
        raise declared.undecodable()
    if pixels.shape != (declared.height, declared.width, 3):
        raise declared.other_size(pixels.shape[1], pixels.shape[0])
    pixels.setflags(write=False)
    return Frame(np.asarray(pixels, np.uint8), sha256(data).hexdigest())
