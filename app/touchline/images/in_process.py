"""Bytes → Frame in this very process, for one that may die, such as a camera's own; and our own pictures → bytes.

A camera's picture stays as the camera compressed it until its pixels are wanted: most frames are looked at by nobody,
or passed on as they came.
"""

import threading
from hashlib import sha256

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import BadInput
from touchline.core.geometry import ImageSize
from touchline.core.records import Frame
from touchline.core.statements import say
from touchline.images.limits import DEFAULT_LIMITS, DeclaredImage, ImageLimits
from touchline.images.screen import screen

# libjpeg leaves out what a smaller picture does not show: an eighth costs a third of the whole
REDUCED = (
    (8, cv2.IMREAD_REDUCED_COLOR_8),
    (4, cv2.IMREAD_REDUCED_COLOR_4),
    (2, cv2.IMREAD_REDUCED_COLOR_2),
)

ENCODED_MEDIA_TYPES = {"png": "image/png", "jpg": "image/jpeg"}
PNG_COMPRESSION = 3  # of 9; a third slower files for a fifth of the bytes gained beyond it


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
        pixels = cv2.imdecode(
            np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
        )
    except cv2.error:
        pixels = None
    if pixels is None:
        raise declared.undecodable()
    if pixels.shape != (declared.height, declared.width, 3):
        raise declared.other_size(pixels.shape[1], pixels.shape[0])
    pixels.setflags(write=False)
    return Frame(np.asarray(pixels, np.uint8), sha256(data).hexdigest())


class JpegFrame(Frame):
    """A screened JPEG. pixels and reduced() raise BadImage where it cannot be decoded; any thread may ask."""

    _declared: DeclaredImage
    _lock: threading.Lock
    _decoded: NDArray[np.uint8] | None

    def __init__(self, jpeg: bytes, declared: DeclaredImage) -> None:
        self.__dict__.update(
            jpeg=jpeg[: declared.length], _declared=declared, _lock=threading.Lock(), _decoded=None
        )

    @property
    def size(self) -> ImageSize:
        return ImageSize(self._declared.width, self._declared.height)

    @property
    def pixels(self) -> NDArray[np.uint8]:
        with self._lock:  # two who want them at once decode once
            if (pixels := self._decoded) is None:
                pixels = self.__dict__["_decoded"] = self._decode(cv2.IMREAD_COLOR, *self.size)
        return pixels

    @property
    def is_plain(self) -> bool:
        """Whether any viewer shows it as we do."""
        return self._declared.is_plain

    def reduced(self, width: int, height: int = 1) -> NDArray[np.uint8]:
        if self._decoded is None:
            for by, flag in REDUCED:
                if self.size.width // by >= width and self.size.height // by >= height:
                    return self._decode(flag, -(-self.size.width // by), -(-self.size.height // by))
        return self.pixels

    def _decode(self, flag: int, width: int, height: int) -> NDArray[np.uint8]:
        try:
            pixels = cv2.imdecode(
                np.frombuffer(self.jpeg, np.uint8), flag | cv2.IMREAD_IGNORE_ORIENTATION
            )
        except cv2.error:
            pixels = None
        if pixels is None:
            raise self._declared.undecodable()
        if pixels.shape != (height, width, 3):
            raise self._declared.other_size(pixels.shape[1], pixels.shape[0])
        pixels.setflags(write=False)
        return np.asarray(pixels, np.uint8)


def encode(pixels: NDArray[np.uint8], format: str = "png", quality: int = 90) -> bytes:
    """(height, width, 3) BGR or (height, width) grey uint8 as a PNG or JPEG file; quality 1–100 is JPEG's."""
    if format not in ENCODED_MEDIA_TYPES:
        raise BadInput(
            f"Images cannot be written as {format!r}.",
            f"Use one of: {', '.join(ENCODED_MEDIA_TYPES)}.",
            reason="unknown-image-format",
        )
    if not 1 <= quality <= 100:
        raise BadInput(
            f"A JPEG quality of {quality} does not exist.", "Use 1 to 100.", reason="bad-quality"
        )
    options = {
        "png": [cv2.IMWRITE_PNG_COMPRESSION, PNG_COMPRESSION],
        "jpg": [cv2.IMWRITE_JPEG_QUALITY, quality],
    }
    done, buffer = cv2.imencode(f".{format}", np.ascontiguousarray(pixels), options[format])
    if not done:
        raise BadInput(
            say("image.not-encodable", "The image cannot be encoded."),
            say("image.use-png", "Use PNG, or a smaller image."),
            reason="not-encodable",
        )
    return buffer.tobytes()
