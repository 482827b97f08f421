"""Reads a picture's header before anything is decoded, and refuses what would be costly, odd or unsafe.

Time and memory are linear in the bytes that came, whatever they claim. The decoders behind it accept dozens
of formats; only those in FORMATS reach them.

The headers are read here, not by Pillow: it stops at a JPEG's first scan and a PNG's first pixels, before most of what
is refused; 30 MB of fill bytes cost it 13 s, and for a WebP it reserves memory by the size that 200 bytes declare.
"""

from collections.abc import Callable

from touchline.core.errors import BadImage, ImageTooLarge
from touchline.core.statements import Sentence, join, say
from touchline.images.bmp import screen_bmp
from touchline.images.jpeg import screen_jpeg
from touchline.images.limits import DEFAULT_LIMITS, RESAVE, DeclaredImage, ImageLimits, checked_size
from touchline.images.png import screen_png
from touchline.images.webp import screen_webp

Screen = Callable[[bytes, ImageLimits], DeclaredImage]

FORMATS: dict[bytes, Screen] = {  # by the bytes that a file begins with
    b"\x89PNG\r\n\x1a\n": screen_png,
    b"\xff\xd8\xff": screen_jpeg,
    b"BM": screen_bmp,
    b"RIFF": screen_webp,
}

TIFF, JPEG_2000 = say("file-kind.tiff", "a TIFF image"), say("file-kind.jpeg-2000", "a JPEG 2000 image")
REFUSED: dict[bytes, Sentence] = {  # so that the refusal can name what came
    b"GIF8": say("file-kind.gif", "a GIF image"), b"II*\0": TIFF, b"MM\0*": TIFF,
    b"\0\0\0\x0cjP": JPEG_2000, b"\xffO\xffQ": JPEG_2000,
    b"#?RADIANCE": say("file-kind.radiance", "a Radiance HDR image"),
    b"v/1\x01": say("file-kind.openexr", "an OpenEXR image"), b"%PDF": say("file-kind.pdf", "a PDF document"),
    b"<svg": say("file-kind.svg", "an SVG drawing"), b"PK": say("file-kind.zip", "a ZIP archive"),
}


def screen(data: bytes, limits: ImageLimits = DEFAULT_LIMITS) -> DeclaredImage:
    """What the picture declares itself to be; BadImage or ImageTooLarge if we would not decode it."""
    if not data:
        raise BadImage(say("file.empty", "The file is empty."), say("file.choose-image", "Choose an image file."),
                       reason="empty-image")
    if len(data) > limits.max_bytes:
        raise ImageTooLarge(say("file.too-large", "The file has {mb:.1f} MB.", mb=len(data) / 1e6),
                            say("file.size-limit", "Send at most {most_mb:g} MB. Save it as JPEG or scale it down.",
                                most_mb=limits.max_bytes / 1e6), reason="image-file-too-large")
    for magic, read in FORMATS.items():
        if data.startswith(magic):
            declared = read(data, limits)
            checked_size(declared.width, declared.height, limits)
            return declared
    kind = _kind(data)
    raise BadImage(say("file.kind-not-supported", "This file is {kind}, which is not supported.", kind=kind) if kind
                   else say("file.no-image", "The file is not an image."),
                   join(say("file.use-image-format", "Use PNG, JPEG, BMP or WebP."), RESAVE),
                   reason="unknown-image-format")


def _kind(data: bytes) -> Sentence | None:
    if data[4:12] in (b"ftypavif", b"ftypavis", b"ftypheic", b"ftypmif1"):
        return say("file-kind.avif-heic", "an AVIF or HEIC image")
    return next((kind for magic, kind in REFUSED.items() if data.startswith(magic)), None)
