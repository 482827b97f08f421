"""JPEG's header: every segment of the file is walked, so that scans are counted before one is decoded.

A segment is FF, marker, length (2, big-endian, counts itself), body; entropy-coded bytes follow each SOS up
to the next marker that is neither a stuffed FF 00 nor a restart. ITU-T T.81, annex B.
"""

import re
import struct

from touchline.core.errors import BadImage
from touchline.core.statements import say
from touchline.images.limits import (
    NO_PIXELS,
    NO_SIZE,
    DeclaredImage,
    ImageLimits,
    checked_size,
    damaged,
    truncated,
    unsupported,
)

EOI, SOS, HUFFMAN = 0xD9, 0xDA, 0xC4
APP1 = 0xE1  # Exif or XMP: either may say that viewers are to turn the picture, which the decoders here do not
PLAIN = (0xC0, 0xC1, 0xC2)  # baseline, extended, progressive: what cameras write
OTHER_KINDS = (0xC3, 0xC5, 0xC6, 0xC7, 0xC9, 0xCA, 0xCB, 0xCD, 0xCE, 0xCF)  # lossless, hierarchical, arithmetic
SEGMENTS = {HUFFMAN, 0xCC, *range(0xDB, 0xF0), 0xFE}  # tables, application data, comments
MAX_SEGMENTS = 5_000

# At C's speed and with nothing to backtrack: a Python loop over a file full of FF 00 would itself be the attack.
NEXT_MARKER = re.compile(rb"\xff[^\x00\xff\xd0-\xd7]", re.DOTALL)
FILL = re.compile(rb"\xff++")  # any number of fill bytes may precede a marker


def screen_jpeg(data: bytes, limits: ImageLimits) -> DeclaredImage:
    """Size and format of a JPEG with few scans, whole to its end mark."""
    size: tuple[int, int] | None = None
    has_tables, is_turned = False, False
    scans, position = 0, 2
    for _ in range(MAX_SEGMENTS):
        marker, body, position = _segment(data, position)
        if marker == EOI:
            break
        if marker in OTHER_KINDS:
            raise unsupported(say("image.jpeg-type",
                                  "The JPEG image has an unsupported type (lossless, hierarchical or arithmetic)."))
        if marker in PLAIN:
            if size:
                raise damaged(say("image-damage.size-twice", "it declares its size twice"))
            size = _size(body)
            checked_size(*size, limits)
        elif marker == SOS:
            scans += 1
            if size is None:
                raise damaged(say("image-damage.pixels-before-size", "its pixels come before its size"))
            if scans > limits.max_jpeg_scans:
                raise BadImage(say("image.too-many-scans", "The image has more than {most} scans.",
                                   most=limits.max_jpeg_scans),
                               say("image.save-again", "Save it again as a standard JPEG or as PNG."),
                               reason="too-many-scans")
            found = NEXT_MARKER.search(data, position)
            if found is None:
                raise truncated("JPEG")
            position = found.start()
        elif marker not in SEGMENTS:
            raise damaged(say("image-damage.unknown-segment", "it contains an unknown segment ({marker})",
                              marker=f"{marker:02X}"))
        has_tables |= marker == HUFFMAN and scans == 0
        is_turned |= marker == APP1
    else:
        raise damaged(say("image-damage.too-many-segments", "it has too many segments"))
    if size is None or scans == 0:
        raise damaged(NO_PIXELS)
    return DeclaredImage("jpeg", *size, position, has_tables and not is_turned)


def _segment(data: bytes, position: int) -> tuple[int, memoryview, int]:
    """Marker and body of the segment at a position, and where the next begins."""
    fill = FILL.match(data, position)
    if fill is None and position < len(data):
        raise damaged(say("image-damage.wrong-byte", "a segment begins with the wrong byte"))
    if fill is None or fill.end() == len(data):
        raise truncated("JPEG")
    marker, position = data[fill.end()], fill.end() + 1
    if marker == EOI:
        return marker, memoryview(b""), position
    if position + 2 > len(data):
        raise truncated("JPEG")
    length = struct.unpack_from(">H", data, position)[0]
    if position + length > len(data):
        raise truncated("JPEG")
    return marker, memoryview(data)[position + 2:position + length], position + length


def _size(body: memoryview) -> tuple[int, int]:
    if len(body) < 6:
        raise damaged(NO_SIZE)
    precision, height, width, components = struct.unpack_from(">BHHB", body)
    if precision != 8 or components not in (1, 3, 4):
        raise unsupported(say("image.jpeg-components",
                              "The JPEG image has {components} colour components of {bits} bits.",
                              components=components, bits=precision))
    return width, height
