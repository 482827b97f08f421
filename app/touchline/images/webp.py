"""WebP's header: one still picture in a RIFF container, its size said alike in every place.

RIFF, length (4, little-endian), WEBP, then chunks: name (4), length (4), body, padded to even.
https://developers.google.com/speed/webp/docs/riff_container
"""

import struct

from touchline.core.statements import say
from touchline.images.limits import NO_PIXELS, NO_SIZE, DeclaredImage, ImageLimits, animated, damaged, truncated

NO_PIXEL_HEADER = say("image-damage.no-pixel-header", "its pixel data has no header")
ANIMATION_FLAG = 0x02
MAX_CHUNKS = 1_000


def screen_webp(data: bytes, limits: ImageLimits) -> DeclaredImage:
    """Size and format of a still WebP, lossy or lossless."""
    if len(data) < 20 or data[8:12] != b"WEBP":
        raise (damaged(say("image-damage.not-webp", "it is a RIFF file, but not WebP")) if len(data) >= 12
               else truncated("WebP"))
    end = 8 + struct.unpack_from("<I", data, 4)[0]
    if end > len(data):
        raise truncated("WebP")
    canvas: tuple[int, int] | None = None
    size: tuple[int, int] | None = None
    position = 12
    for _ in range(MAX_CHUNKS):
        if position + 8 > end:
            break
        kind, length = struct.unpack_from("<4sI", data, position)
        body = memoryview(data)[position + 8:position + 8 + length]
        position += 8 + length + length % 2
        if position - length % 2 > end:
            raise truncated("WebP")
        if kind in (b"ANIM", b"ANMF") or (kind == b"VP8X" and length and body[0] & ANIMATION_FLAG):
            raise animated("WebP")
        if kind == b"VP8X":
            canvas = _canvas(body)
        elif kind in (b"VP8 ", b"VP8L"):
            if size:
                raise damaged(say("image-damage.two-images", "it contains two images"))
            size = _lossy(body) if kind == b"VP8 " else _lossless(body)
    else:
        raise damaged(say("image-damage.too-many-chunks", "it has too many chunks"))
    if size is None:
        raise damaged(NO_PIXELS)
    if canvas not in (None, size):
        raise damaged(say("image-damage.two-sizes", "it declares two different sizes"))
    return DeclaredImage("webp", *size)


def _canvas(body: memoryview) -> tuple[int, int]:
    if len(body) < 10:
        raise damaged(NO_SIZE)
    return 1 + int.from_bytes(body[4:7], "little"), 1 + int.from_bytes(body[7:10], "little")


def _lossy(body: memoryview) -> tuple[int, int]:
    key_frame = len(body) >= 10 and not body[0] & 1
    if not key_frame or bytes(body[3:6]) != b"\x9d\x01\x2a":
        raise damaged(NO_PIXEL_HEADER)
    width, height = struct.unpack_from("<HH", body, 6)
    return width & 0x3FFF, height & 0x3FFF  # the two bits above are a display scale


def _lossless(body: memoryview) -> tuple[int, int]:
    if len(body) < 5 or body[0] != 0x2F:
        raise damaged(NO_PIXEL_HEADER)
    bits = int.from_bytes(body[1:5], "little")
    return 1 + (bits & 0x3FFF), 1 + (bits >> 14 & 0x3FFF)
