"""Reads a picture's header before anything is decoded, and refuses what would be costly, odd or unsafe.

Time and memory are linear in the bytes that came, whatever they claim. The decoders behind it accept dozens
of formats; only those in FORMATS reach them.
"""

from collections.abc import Callable

from app.core.errors import BadImage, ImageTooLarge
from app.images.bmp import screen_bmp
from app.images.jpeg import screen_jpeg
from app.images.limits import DEFAULT_LIMITS, RESAVE, DeclaredImage, ImageLimits, checked_size
from app.images.png import screen_png
from app.images.webp import screen_webp

Screen = Callable[[bytes, ImageLimits], DeclaredImage]

FORMATS: dict[bytes, Screen] = {  # by the bytes that a file begins with
    b"\x89PNG\r\n\x1a\n": screen_png,
    b"\xff\xd8\xff": screen_jpeg,
    b"BM": screen_bmp,
    b"RIFF": screen_webp,
}

REFUSED: dict[bytes, str] = {  # so that the refusal can name what came
    b"GIF8": "a GIF image", b"II*\0": "a TIFF image", b"MM\0*": "a TIFF image",
    b"\0\0\0\x0cjP": "a JPEG 2000 image", b"\xffO\xffQ": "a JPEG 2000 image",
    b"#?RADIANCE": "a Radiance HDR image", b"v/1\x01": "an OpenEXR image", b"%PDF": "a PDF document",
    b"<svg": "an SVG drawing", b"PK": "a ZIP archive",
}


def screen(data: bytes, limits: ImageLimits = DEFAULT_LIMITS) -> DeclaredImage:
    """What the picture declares itself to be; BadImage or ImageTooLarge if we would not decode it."""
    if not data:
        raise BadImage("The file is empty.", "Choose an image file.", reason="empty-image")
    if len(data) > limits.max_bytes:
        raise ImageTooLarge(f"The file has {len(data) / 1e6:.1f} MB.",
                            f"Send at most {limits.max_bytes / 1e6:g} MB. Save it as JPEG or scale it down.",
                            reason="image-file-too-large")
    for magic, read in FORMATS.items():
        if data.startswith(magic):
            declared = read(data, limits)
            checked_size(declared.width, declared.height, limits)
            return declared
    kind = _kind(data)
    raise BadImage(f"This file is {kind}, which is not supported." if kind else "The file is not an image.",
                   f"Use PNG, JPEG, BMP or WebP. {RESAVE}", reason="unknown-image-format")


def _kind(data: bytes) -> str | None:
    if data[4:12] in (b"ftypavif", b"ftypavis", b"ftypheic", b"ftypmif1"):
        return "an AVIF or HEIC image"
    return next((kind for magic, kind in REFUSED.items() if data.startswith(magic)), None)
