"""Read a picture's header before anything is decoded, and refuse what would be costly, odd or unsafe.

JPEG: a segment is FF, marker, length (2, big-endian, counts itself), body; entropy-coded bytes follow each SOS up
to the next marker that is neither a stuffed FF 00 nor a restart. ITU-T T.81, annex B.

PNG: every chunk is length (4), type (4), body, CRC (4), big-endian. https://www.w3.org/TR/png-3/

WebP: RIFF, length (4, little-endian), WEBP, then chunks: name (4), length (4), body, padded to even.
https://developers.google.com/speed/webp/docs/riff_container

Time and memory are linear in the bytes that came, whatever they claim. The decoders behind it accept dozens
of formats; only those in FORMATS reach them.

The headers are read here, not by Pillow: it stops at a JPEG's first scan and a PNG's first pixels, before most of what
is refused; 30 MB of fill bytes cost it 13 s, and for a WebP it reserves memory by the size that 200 bytes declare.
"""

import re
import struct
from collections.abc import Callable
from zlib import crc32

from touchline.core.errors import BadImage, ImageTooLarge
from touchline.core.statements import Sentence, join, say
from touchline.images.limits import (
    DEFAULT_LIMITS,
    NO_PIXELS,
    NO_SIZE,
    RESAVE,
    DeclaredImage,
    ImageLimits,
    animated,
    checked_size,
    damaged,
    truncated,
    unsupported,
)

FILE_HEADER_BYTES = 14
HEADER_BYTES = (40, 52, 56, 64, 108, 124)
BITS_PER_PIXEL = {0: (1, 4, 8, 16, 24, 32), 3: (16, 32)}  # by compression: none, bit fields

EOI, SOS, HUFFMAN = 0xD9, 0xDA, 0xC4
# Exif or XMP: either may say that viewers are to turn the picture, which the decoders here do not
APP1 = 0xE1
PLAIN = (0xC0, 0xC1, 0xC2)  # baseline, extended, progressive: what cameras write
# lossless, hierarchical, arithmetic
OTHER_KINDS = (0xC3, 0xC5, 0xC6, 0xC7, 0xC9, 0xCA, 0xCB, 0xCD, 0xCE, 0xCF)
SEGMENTS = {HUFFMAN, 0xCC, *range(0xDB, 0xF0), 0xFE}  # tables, application data, comments
MAX_SEGMENTS = 5_000

# At C's speed and with nothing to backtrack: a Python loop over a file full of FF 00 would itself be the attack.
NEXT_MARKER = re.compile(rb"\xff[^\x00\xff\xd0-\xd7]", re.DOTALL)
FILL = re.compile(rb"\xff++")  # any number of fill bytes may precede a marker

SIGNATURE_BYTES = 8
CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}  # by colour type
BIT_DEPTHS = {0: (1, 2, 4, 8, 16), 2: (8, 16), 3: (1, 2, 4, 8), 4: (8, 16), 6: (8, 16)}
ANIMATION = (b"acTL", b"fcTL", b"fdAT")
DEFLATE_MAX_RATIO = 1032  # a deflate stream cannot expand further, so a claim beyond it is a lie
MAX_PNG_CHUNKS = 50_000  # 32 MB in chunks of 8 kB are 4,000
MAX_ANCILLARY_BYTES = 4 * 2**20  # profiles and notes; none of them is wanted

NO_PIXEL_HEADER = say("image-damage.no-pixel-header", "its pixel data has no header")
ANIMATION_FLAG = 0x02
MAX_WEBP_CHUNKS = 1_000

TIFF, JPEG_2000 = (
    say("file-kind.tiff", "a TIFF image"),
    say("file-kind.jpeg-2000", "a JPEG 2000 image"),
)
REFUSED: dict[bytes, Sentence] = {  # so that the refusal can name what came
    b"GIF8": say("file-kind.gif", "a GIF image"),
    b"II*\0": TIFF,
    b"MM\0*": TIFF,
    b"\0\0\0\x0cjP": JPEG_2000,
    b"\xffO\xffQ": JPEG_2000,
    b"#?RADIANCE": say("file-kind.radiance", "a Radiance HDR image"),
    b"v/1\x01": say("file-kind.openexr", "an OpenEXR image"),
    b"%PDF": say("file-kind.pdf", "a PDF document"),
    b"<svg": say("file-kind.svg", "an SVG drawing"),
    b"PK": say("file-kind.zip", "a ZIP archive"),
}


def screen_bmp(data: bytes, limits: ImageLimits) -> DeclaredImage:
    """Size and format of an uncompressed BMP; a negative height means that its first row is the top one."""
    if len(data) < FILE_HEADER_BYTES + 40:
        raise truncated("BMP")
    pixels_at, header_bytes, width, height, planes, bits, compression = struct.unpack_from(
        "<IIiiHHI", data, 10
    )
    if header_bytes not in HEADER_BYTES:
        raise unsupported(say("image.bmp-type", "The BMP image has an old or unknown type."))
    if planes != 1 or pixels_at < FILE_HEADER_BYTES + header_bytes:
        raise damaged(say("image-damage.header", "its header is inconsistent"))
    if bits not in BITS_PER_PIXEL.get(compression, ()):
        # Run lengths can declare 50 Mpx in a few bytes, and no camera writes them.
        raise unsupported(
            say("image.bmp-format", "The BMP image is compressed or has an unusual pixel format.")
        )
    height = abs(height)
    checked_size(width, height, limits)
    row_bytes = (width * bits + 31) // 32 * 4
    if pixels_at + row_bytes * height > len(data):
        raise truncated("BMP")
    return DeclaredImage("bmp", width, height)


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
            raise unsupported(
                say(
                    "image.jpeg-type",
                    "The JPEG image has an unsupported type (lossless, hierarchical or arithmetic).",
                )
            )
        if marker in PLAIN:
            if size:
                raise damaged(say("image-damage.size-twice", "it declares its size twice"))
            size = _size(body)
            checked_size(*size, limits)
        elif marker == SOS:
            scans += 1
            if size is None:
                raise damaged(
                    say("image-damage.pixels-before-size", "its pixels come before its size")
                )
            if scans > limits.max_jpeg_scans:
                raise BadImage(
                    say(
                        "image.too-many-scans",
                        "The image has more than {most} scans.",
                        most=limits.max_jpeg_scans,
                    ),
                    say("image.save-again", "Save it again as a standard JPEG or as PNG."),
                    reason="too-many-scans",
                )
            found = NEXT_MARKER.search(data, position)
            if found is None:
                raise truncated("JPEG")
            position = found.start()
        elif marker not in SEGMENTS:
            raise damaged(
                say(
                    "image-damage.unknown-segment",
                    "it contains an unknown segment ({marker})",
                    marker=f"{marker:02X}",
                )
            )
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
    return marker, memoryview(data)[position + 2 : position + length], position + length


def _size(body: memoryview) -> tuple[int, int]:
    if len(body) < 6:
        raise damaged(NO_SIZE)
    precision, height, width, components = struct.unpack_from(">BHHB", body)
    if precision != 8 or components not in (1, 3, 4):
        raise unsupported(
            say(
                "image.jpeg-components",
                "The JPEG image has {components} colour components of {bits} bits.",
                components=components,
                bits=precision,
            )
        )
    return width, height


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
        if chunks > MAX_PNG_CHUNKS or ancillary > MAX_ANCILLARY_BYTES:
            raise damaged(say("image-damage.metadata", "it contains more metadata than pixels"))
    if raw_bytes > compressed * DEFLATE_MAX_RATIO:
        raise truncated("PNG")
    if raw_bytes > max(limits.png_ratio_free_bytes, compressed * limits.max_png_ratio):
        raise BadImage(
            say(
                "image.decompresses-too-far",
                "The image decompresses to {ratio:.0f} times its size. This "
                "is not plausible for a camera image.",
                ratio=raw_bytes / compressed,
            ),
            say("image.send-original", "Send the original camera image, or save it as JPEG."),
            reason="image-bomb",
        )
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
    body = memoryview(data)[position + 8 : end]
    critical = kind[:1].isupper()
    if critical and crc32(body, crc32(kind)) != struct.unpack_from(">I", data, end)[0]:
        raise damaged(
            say(
                "image-damage.checksum",
                "the checksum of its {chunk} chunk is wrong",
                chunk=kind.decode("latin-1"),
            )
        )
    return kind, body, end + 4


def screen_webp(data: bytes, limits: ImageLimits) -> DeclaredImage:
    """Size and format of a still WebP, lossy or lossless."""
    if len(data) < 20 or data[8:12] != b"WEBP":
        raise (
            damaged(say("image-damage.not-webp", "it is a RIFF file, but not WebP"))
            if len(data) >= 12
            else truncated("WebP")
        )
    end = 8 + struct.unpack_from("<I", data, 4)[0]
    if end > len(data):
        raise truncated("WebP")
    canvas: tuple[int, int] | None = None
    size: tuple[int, int] | None = None
    position = 12
    for _ in range(MAX_WEBP_CHUNKS):
        if position + 8 > end:
            break
        kind, length = struct.unpack_from("<4sI", data, position)
        body = memoryview(data)[position + 8 : position + 8 + length]
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


Screen = Callable[[bytes, ImageLimits], DeclaredImage]

FORMATS: dict[bytes, Screen] = {  # by the bytes that a file begins with
    b"\x89PNG\r\n\x1a\n": screen_png,
    b"\xff\xd8\xff": screen_jpeg,
    b"BM": screen_bmp,
    b"RIFF": screen_webp,
}


def screen(data: bytes, limits: ImageLimits = DEFAULT_LIMITS) -> DeclaredImage:
    """What the picture declares itself to be; BadImage or ImageTooLarge if we would not decode it."""
    if not data:
        raise BadImage(
            say("file.empty", "The file is empty."),
            say("file.choose-image", "Choose an image file."),
            reason="empty-image",
        )
    if len(data) > limits.max_bytes:
        raise ImageTooLarge(
            say("file.too-large", "The file has {mb:.1f} MB.", mb=len(data) / 1e6),
            say(
                "file.size-limit",
                "Send at most {most_mb:g} MB. Save it as JPEG or scale it down.",
                most_mb=limits.max_bytes / 1e6,
            ),
            reason="image-file-too-large",
        )
    for magic, read in FORMATS.items():
        if data.startswith(magic):
            declared = read(data, limits)
            checked_size(declared.width, declared.height, limits)
            return declared
    kind = _kind(data)
    raise BadImage(
        say("file.kind-not-supported", "This file is {kind}, which is not supported.", kind=kind)
        if kind
        else say("file.no-image", "The file is not an image."),
        join(say("file.use-image-format", "Use PNG, JPEG, BMP or WebP."), RESAVE),
        reason="unknown-image-format",
    )


def _kind(data: bytes) -> Sentence | None:
    if data[4:12] in (b"ftypavif", b"ftypavis", b"ftypheic", b"ftypmif1"):
        return say("file-kind.avif-heic", "an AVIF or HEIC image")
    return next((kind for magic, kind in REFUSED.items() if data.startswith(magic)), None)
