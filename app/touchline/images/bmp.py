"""BMP's header: uncompressed rows only, and all of them there."""

import struct

from touchline.core.statements import say
from touchline.images.limits import DeclaredImage, ImageLimits, checked_size, damaged, truncated, unsupported

FILE_HEADER_BYTES = 14
HEADER_BYTES = (40, 52, 56, 64, 108, 124)
BITS_PER_PIXEL = {0: (1, 4, 8, 16, 24, 32), 3: (16, 32)}  # by compression: none, bit fields


def screen_bmp(data: bytes, limits: ImageLimits) -> DeclaredImage:
    """Size and format of an uncompressed BMP; a negative height means that its first row is the top one."""
    if len(data) < FILE_HEADER_BYTES + 40:
        raise truncated("BMP")
    pixels_at, header_bytes, width, height, planes, bits, compression = struct.unpack_from("<IIiiHHI", data, 10)
    if header_bytes not in HEADER_BYTES:
        raise unsupported(say("image.bmp-type", "The BMP image has an old or unknown type."))
    if planes != 1 or pixels_at < FILE_HEADER_BYTES + header_bytes:
        raise damaged(say("image-damage.header", "its header is inconsistent"))
    if bits not in BITS_PER_PIXEL.get(compression, ()):
        # Run lengths can declare 50 Mpx in a few bytes, and no camera writes them.
        raise unsupported(say("image.bmp-format", "The BMP image is compressed or has an unusual pixel format."))
    height = abs(height)
    checked_size(width, height, limits)
    row_bytes = (width * bits + 31) // 32 * 4
    if pixels_at + row_bytes * height > len(data):
        raise truncated("BMP")
    return DeclaredImage("bmp", width, height)
