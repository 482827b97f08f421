"""Pictures that tests make: honest ones in every format, and hostile ones byte by byte."""

import struct
from collections.abc import Callable
from zlib import Z_FINISH, Z_FULL_FLUSH, compress, compressobj, crc32

import cv2
import numpy as np

from touchline.imaging.correction import BORDER_BGR, CorrectionMap

LOSSLESS_WEBP = 101  # OpenCV's quality above 100


def gradient(width: int = 64, height: int = 48) -> np.ndarray:
    """A smooth picture that no two rows or columns of are alike, BGR uint8; smooth, so that JPEG keeps it."""
    x, y = np.meshgrid(np.linspace(0, 255, width), np.linspace(0, 255, height))
    return np.stack([x, y, (x + y) / 2], axis=-1).astype(np.uint8)


def remapped_exactly(table: CorrectionMap, pixels: np.ndarray) -> np.ndarray:
    """The corrected picture, bilinear at the exact places, where the map itself rounds them to 1/32 px."""
    return cv2.remap(
        pixels,
        table.raw_x,
        table.raw_y,
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=BORDER_BGR,
    )


def encoded(suffix: str, pixels: np.ndarray | None = None, *options: int) -> bytes:
    """The picture as a file; WebP without loss."""
    if suffix == "webp" and not options:
        options = (cv2.IMWRITE_WEBP_QUALITY, LOSSLESS_WEBP)
    return cv2.imencode(f".{suffix}", gradient() if pixels is None else pixels, list(options))[
        1
    ].tobytes()


def chunk(kind: bytes, body: bytes = b"") -> bytes:
    """One chunk of a PNG, with its checksum."""
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", crc32(kind + body))


def png(width: int, height: int, *chunks: bytes, depth: int = 8, colour: int = 2) -> bytes:
    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + header + b"".join(chunks) + chunk(b"IEND")


def png_bomb(width: int, height: int) -> bytes:
    """All black, RGBA with 16 bits: 8 bytes of memory for each of the pixels, 1 in 1,000 of them in the file."""
    return png(
        width,
        height,
        chunk(b"IDAT", compressed_zeros(height * (1 + 8 * width))),
        depth=16,
        colour=6,
    )


def compressed_zeros(count: int) -> bytes:
    """Gigabytes of zeros as zlib writes them, at once: one block, byte-aligned by a flush, again and again."""
    blocks, rest = divmod(count, 1 << 20)
    maker = compressobj(9)
    head = maker.compress(b"") + maker.flush(Z_FULL_FLUSH)
    block = maker.compress(bytes(1 << 20)) + maker.flush(Z_FULL_FLUSH)
    tail = (maker.compress(bytes(rest)) + maker.flush(Z_FINISH))[:-4]
    # RFC 1950, section 8.2: of zeros, the first sum stays 1, the second counts them
    adler = (count % 65521) << 16 | 1
    return head + block * blocks + tail + struct.pack(">I", adler)


def apng() -> bytes:
    return png(
        8, 8, chunk(b"acTL", struct.pack(">II", 2**31, 0)), chunk(b"IDAT", compress(bytes(8 * 25)))
    )


def jpeg_with_size(width: int, height: int, data: bytes | None = None) -> bytes:
    """An honest JPEG whose size was overwritten."""
    changed = bytearray(data or encoded("jpg"))
    at = next(
        changed.index(bytes([0xFF, kind]))
        for kind in (0xC0, 0xC2)
        if bytes([0xFF, kind]) in changed
    )
    changed[at + 5 : at + 9] = struct.pack(">HH", height, width)
    return bytes(changed)


def jpeg_segment(marker: int, body: bytes) -> bytes:
    return struct.pack(">BBH", 0xFF, marker, 2 + len(body)) + body


# Exif with one tag: whoever shows the picture is to turn it by 90°.
EXIF = b"MM\0*" + struct.pack(">IHHHIHHI", 8, 1, 0x0112, 3, 1, 6, 0, 0)
TURN = jpeg_segment(0xE1, b"Exif\0\0" + EXIF)
# what looks like a table in them is none
COMMENTS = jpeg_segment(0xFE, b"\xff\xc4" + bytes(65_531)) * 2
TURNED = {  # what stands between a JPEG's first marker and its second
    "Exif": TURN,
    "Exif behind comments": COMMENTS + TURN,
    "Exif behind fill bytes": b"\xff" * 9 + TURN,
    "Exif behind another": jpeg_segment(0xE1, b"http://ns.adobe.com/xap/1.0/\0") + TURN,
    "Exif behind large tables": jpeg_segment(0xE2, b"ICC_PROFILE\0" + bytes(65_000)) * 3 + TURN,
}


def turned_jpeg(name: str, data: bytes) -> bytes:
    """A JPEG that viewers turn: with what TURNED calls so."""
    return data[:2] + TURNED[name] + data[2:]


def turned_png() -> bytes:
    data = encoded("png")
    return data[:33] + chunk(b"eXIf", EXIF) + data[33:]  # behind its header


def turned_webp() -> bytes:
    has_exif = struct.pack("<I", 0x08)
    canvas = (
        b"VP8X"
        + struct.pack("<I", 10)
        + has_exif
        + struct.pack("<I", 64 - 1)[:3]
        + struct.pack("<I", 48 - 1)[:3]
    )
    body = b"WEBP" + canvas + encoded("webp")[12:] + b"EXIF" + struct.pack("<I", len(EXIF)) + EXIF
    return b"RIFF" + struct.pack("<I", len(body)) + body


def jpeg_of_many_scans(count: int, width: int = 2000, height: int = 2000) -> bytes:
    """A progressive JPEG that repeats one of its later scans, each of which costs a pass over all pixels."""
    data = encoded("jpg", np.zeros((height, width, 3), np.uint8), cv2.IMWRITE_JPEG_PROGRESSIVE, 1)
    last = data.rindex(b"\xff\xda")
    return data[:last] + data[last:-2] * count + data[-2:]


def bmp_with_size(width: int, height: int) -> bytes:
    data = bytearray(encoded("bmp"))
    data[18:26] = struct.pack("<ii", width, height)
    return bytes(data)


def lossless_webp(width: int, height: int, data: bytes | None = None) -> bytes:
    """An honest lossless WebP whose size was overwritten."""
    changed = bytearray(data or encoded("webp"))
    at = changed.index(b"VP8L") + 9
    rest = int.from_bytes(changed[at : at + 4], "little") >> 28 << 28
    changed[at : at + 4] = (rest | width - 1 | height - 1 << 14).to_bytes(4, "little")
    return bytes(changed)


def animated_webp() -> bytes:
    body = (
        b"VP8X"
        + struct.pack("<IB", 10, 0x02)
        + bytes(9)
        + b"ANIM"
        + struct.pack("<I", 6)
        + bytes(6)
    )
    return b"RIFF" + struct.pack("<I", 4 + len(body)) + b"WEBP" + body


def gif(width: int = 60_000, height: int = 60_000) -> bytes:
    """35 bytes that a GIF decoder gives gigabytes to."""
    return (
        b"GIF89a"
        + struct.pack("<HH", width, height)
        + b"\x80\0\0\0\0\0\xff\xff\xff,"
        + struct.pack("<HHHHB", 0, 0, width, height, 0)
        + b"\2\2D\1\0;"
    )


# what it is: (its bytes, the reason it is refused for)
HOSTILE: dict[str, tuple[Callable[[], bytes], str]] = {
    "nothing": (lambda: b"", "empty-image"),
    "one byte": (lambda: b"\x89", "unknown-image-format"),
    "text": (lambda: b"Not a picture.\n" * 10, "unknown-image-format"),
    "zeros": (lambda: bytes(100_000), "unknown-image-format"),
    "a GIF that asks for gigabytes": (gif, "unknown-image-format"),
    "a TIFF": (lambda: b"II*\0" + bytes(100), "unknown-image-format"),
    "a PNM": (lambda: b"P6 99999 99999 255\n", "unknown-image-format"),
    "an AVIF": (lambda: b"\0\0\0\x1cftypavif" + bytes(40), "unknown-image-format"),
    "a PNG bomb": (lambda: png_bomb(3000, 3000), "image-bomb"),
    "a PNG of 2^31 px a side": (
        lambda: png(2**31 - 1, 2**31 - 1, chunk(b"IDAT", compress(b""))),
        "image-too-large",
    ),
    "a PNG of 51 Mpx": (
        lambda: png(10_000, 5_100, chunk(b"IDAT", compress(b""))),
        "image-too-large",
    ),
    "a PNG too wide": (lambda: png(16_385, 1, chunk(b"IDAT", compress(b""))), "image-too-large"),
    "a PNG of one pixel": (lambda: encoded("png", gradient(1, 1)), "image-too-small"),
    "a PNG of one row": (lambda: encoded("png", gradient(4000, 1)), "image-too-small"),
    "a PNG without rows": (lambda: png(8, 0, chunk(b"IDAT", compress(b""))), "damaged-image"),
    "a PNG without pixels": (lambda: png(8, 8), "truncated-image"),
    "a PNG whose data cannot hold its size": (
        lambda: png(4000, 4000, chunk(b"IDAT", compress(bytes(99)))),
        "truncated-image",
    ),
    "a PNG with fewer rows than it says": (
        lambda: png(8, 8, chunk(b"IDAT", compress(bytes(7 * 25)))),
        "undecodable-image",
    ),
    "a PNG of no known pixel format": (
        lambda: png(8, 8, chunk(b"IDAT", compress(bytes(200))), depth=3),
        "damaged-image",
    ),
    "a PNG cut short": (lambda: encoded("png")[:-30], "truncated-image"),
    "a PNG with a flipped bit": (
        lambda: encoded("png")[:60] + b"\x55" + encoded("png")[61:],
        "damaged-image",
    ),
    "a PNG full of notes": (lambda: png(8, 8, chunk(b"tEXt", bytes(2**20)) * 5), "damaged-image"),
    "an animated PNG": (apng, "animated-image"),
    "a JPEG cut short": (lambda: encoded("jpg")[:-40], "truncated-image"),
    "a JPEG of its first bytes": (lambda: b"\xff\xd8\xff", "truncated-image"),
    "a JPEG of 20,000 px a side": (lambda: jpeg_with_size(20_000, 20_000), "image-too-large"),
    "a JPEG without size": (lambda: jpeg_with_size(0, 0), "damaged-image"),
    "a JPEG with 20,000 scans": (lambda: jpeg_of_many_scans(20_000), "too-many-scans"),
    "a JPEG of nothing but fill bytes": (
        lambda: b"\xff\xd8" + b"\xff" * 30_000_000,
        "truncated-image",
    ),
    "a JPEG of nothing but stuffed bytes": (
        lambda: encoded("jpg")[:-2] + b"\xff\0" * 15_000_000,
        "truncated-image",
    ),
    "a JPEG with a long run of fill bytes": (
        lambda: encoded("jpg")[:-2] + b"\xff" * 30_000_000 + b"\0",
        "truncated-image",
    ),
    "a JPEG part without length": (
        lambda: b"\xff\xd8\xff\xfe\0\0" + encoded("jpg")[2:],
        "damaged-image",
    ),
    "a lossless JPEG": (
        lambda: encoded("jpg").replace(b"\xff\xc0", b"\xff\xc3"),
        "unsupported-image-kind",
    ),
    "a BMP cut short": (lambda: encoded("bmp")[:-100], "truncated-image"),
    "a BMP of 30,000 px a side": (lambda: bmp_with_size(30_000, 30_000), "image-too-large"),
    "a BMP of the lowest height": (lambda: bmp_with_size(8, -(2**31)), "image-too-large"),
    "a BMP of run lengths": (
        lambda: encoded("bmp")[:30] + b"\1" + encoded("bmp")[31:],
        "unsupported-image-kind",
    ),
    "a WebP cut short": (lambda: encoded("webp")[:-20], "truncated-image"),
    "a WebP of 16,384 px a side": (lambda: lossless_webp(16_384, 16_384), "image-too-large"),
    "an animated WebP": (animated_webp, "animated-image"),
    "a sound file": (lambda: b"RIFF\x24\0\0\0WAVEfmt " + bytes(40), "damaged-image"),
    "more bytes than are read": (
        lambda: encoded("png") + bytes(33 * 2**20),
        "image-file-too-large",
    ),
}


def hostile(name: str) -> tuple[bytes, str]:
    """A hostile picture, made when it is asked for: some take 30 MB; and the reason it is refused for."""
    make, reason = HOSTILE[name]
    return make(), reason
