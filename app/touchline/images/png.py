"""PNG's header: its chunks are walked, their checksums checked, and the deflate ratio kept sane.

Every chunk is length (4), type (4), body, CRC (4), big-endian. https://www.w3.org/TR/png-3/
"""

import struct
from zlib import crc32

from touchline.core.errors import BadImage
from touchline.core.statements import say
from touchline.images.limits import DeclaredImage, ImageLimits, animated, checked_size, damaged, truncated

SIGNATURE_BYTES = 8
CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}  # by colour type
BIT_DEPTHS = {0: (1, 2, 4, 8, 16), 2: (8, 16), 3: (1, 2, 4, 8), 4: (8, 16), 6: (8, 16)}
ANIMATION = (b"acTL", b"fcTL", b"fdAT")
DEFLATE_MAX_RATIO = 1032  # a deflate stream cannot expand further, so a claim beyond it is a lie
MAX_CHUNKS = 50_000  # 32 MB in chunks of 8 kB are 4,000
MAX_ANCILLARY_BYTES = 4 * 2**20  # profiles and notes; none of them is wanted


def screen_png(data: bytes, limits: ImageLimits) -> DeclaredImage:
    """Size and format of a still PNG whose critical chunks are whole."""
    width, height, raw_bytes = _header(data)
    checked_size(width, height, limits)
    compressed = ancillary = chunks = 0
    position = SIGNATURE_BYTES
    while True:
        chunks += 1
        kind, body, position = _chunk(data, position)
        if kind in ANIMATION:
            raise animated("PNG")
        if kind == b"IEND":
            break
        if kind == b"IDAT":
            compressed += len(body)
        elif kind not in (b"IHDR", b"PLTE"):
            ancillary += len(body)
        if chunks > MAX_CHUNKS or ancillary > MAX_ANCILLARY_BYTES:
            raise damaged(say("image-damage.metadata", "it contains more metadata than pixels"))
    if raw_bytes > compressed * DEFLATE_MAX_RATIO:
        raise truncated("PNG")
    if raw_bytes > max(limits.png_ratio_free_bytes, compressed * limits.max_png_ratio):
        raise BadImage(say("image.decompresses-too-far", "The image decompresses to {ratio:.0f} times its size. This "
                           "is not plausible for a camera image.", ratio=raw_bytes / compressed),
                       say("image.send-original", "Send the original camera image, or save it as JPEG."),
                       reason="image-bomb")
    return DeclaredImage("png", width, height)


def _header(data: bytes) -> tuple[int, int, int]:
    """Width, height and the bytes that the pixels unpack to."""
    kind, body, _ = _chunk(data, SIGNATURE_BYTES)
    if kind != b"IHDR" or len(body) != 13:
        raise damaged(say("image-damage.size-not-first", "its size is not at the beginning"))
    width, height, depth, colour, _, _, interlace = struct.unpack(">IIBBBBB", body)
    if depth not in BIT_DEPTHS.get(colour, ()) or interlace > 1:
        raise damaged(say("image-damage.pixel-format", "its pixel format is invalid"))
    return width, height, height * (1 + (width * depth * CHANNELS[colour] + 7) // 8)


def _chunk(data: bytes, position: int) -> tuple[bytes, memoryview, int]:
    """Type and body of the chunk at a position, and where the next begins."""
    if position + 12 > len(data):
        raise truncated("PNG")
    length, kind = struct.unpack_from(">I4s", data, position)
    end = position + 8 + length
    if end + 4 > len(data):
        raise truncated("PNG")
    body = memoryview(data)[position + 8:end]
    critical = kind[:1].isupper()
    if critical and crc32(body, crc32(kind)) != struct.unpack_from(">I", data, end)[0]:
        raise damaged(say("image-damage.checksum", "the checksum of its {chunk} chunk is wrong",
                          chunk=kind.decode("latin-1")))
    return kind, body, end + 4
