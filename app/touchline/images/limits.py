"""How much a picture may ask of us, and the refusals that its header earns."""

from dataclasses import dataclass, field

from touchline.core.errors import BadImage, ImageTooLarge
from touchline.core.geometry import MIN_SIDE_PX
from touchline.core.statements import say

RESAVE = say("image.resave", "Open it in an image program and save it again as PNG or JPEG.")
NO_PIXELS = say("image-damage.no-pixels", "it contains no pixels")
NO_SIZE = say("image-damage.no-size", "its size is missing")
SCALE_DOWN = say("image.scale-down", "Scale it down, or save it again as a standard JPEG.")
SEND_AGAIN = say(
    "image.send-again",
    "Copy or export the image again. The file is probably incomplete or damaged.",
)


@dataclass(frozen=True)
class ImageLimits:
    """The largest picture that is decoded, and what decoding may cost."""

    max_bytes: int = 32_000_000
    # 150 MB of BGR; the largest industrial sensors have 50 Mpx or less
    max_pixels: int = 50_000_000
    max_side_px: int = 16_384
    # a progressive picture has about 10; every scan costs a pass over all pixels
    max_jpeg_scans: int = 64
    # decoded to compressed bytes; photographs reach 2, drawn fields some 100
    max_png_ratio: float = 200.0
    png_ratio_free_bytes: int = 32 * 2**20  # below it a high ratio is an empty scene, not a bomb
    memory_bytes: int = 2**30  # address space of the process that decodes
    wall_s: float = 5.0


@dataclass(frozen=True)
class DeclaredImage:
    """What a header says: format "png", "jpeg", "bmp" or "webp", and the size in px.

    length: bytes to the picture's end mark, after which more may have come; None where it was not looked for.
    is_plain: a JPEG that any viewer shows as we decode it: nothing in it asks to be turned, and its Huffman tables are
    its own.
    """

    format: str
    width: int
    height: int
    length: int | None = field(default=None, compare=False)
    is_plain: bool = field(default=False, compare=False)

    def undecodable(self) -> BadImage:
        return BadImage(
            say(
                "image.cannot-decode",
                "The {format} image cannot be decoded.",
                format=self.format.upper(),
            ),
            SEND_AGAIN,
            reason="undecodable-image",
        )

    def other_size(self, width: int, height: int) -> BadImage:
        return BadImage(
            say(
                "image.size-contradicts",
                "The image declares {width} × {height} px, but contains "
                "{found_width} × {found_height} px.",
                width=self.width,
                height=self.height,
                found_width=width,
                found_height=height,
            ),
            RESAVE,
            reason="image-size-mismatch",
        )


DEFAULT_LIMITS = ImageLimits()


def damaged(what: str) -> BadImage:
    """The bytes contradict their own format; what: a clause about it."""
    return BadImage(
        say("image.damaged", "The image is damaged: {cause}.", cause=what),
        SEND_AGAIN,
        reason="damaged-image",
    )


def truncated(kind: str) -> BadImage:
    return BadImage(
        say("image.incomplete", "The {format} image is incomplete.", format=kind),
        SEND_AGAIN,
        reason="truncated-image",
    )


def animated(kind: str) -> BadImage:
    return BadImage(
        say("image.animated", "The {format} image is animated.", format=kind),
        say("image.send-still", "Send a still image."),
        reason="animated-image",
    )


def unsupported(what: str) -> BadImage:
    """A kind of a known format that cameras do not make; what: a sentence."""
    return BadImage(what, RESAVE, reason="unsupported-image-kind")


def checked_size(width: int, height: int, limits: ImageLimits) -> None:
    """Refuse an empty picture, one that no camera delivers, and one with more pixels than we would decode."""
    if width < 1 or height < 1:
        raise damaged(
            say(
                "image-damage.empty",
                "it declares {width} × {height} px",
                width=width,
                height=height,
            )
        )
    if (
        width > limits.max_side_px
        or height > limits.max_side_px
        or width * height > limits.max_pixels
    ):
        raise ImageTooLarge(
            say(
                "image.too-large",
                "The image declares {width} × {height} px.",
                width=width,
                height=height,
            ),
            say(
                "image.size-limit",
                "Send at most {most_megapixels:g} million pixels and {most_px} px "
                "per side. Scale it down or crop it.",
                most_megapixels=limits.max_pixels / 1e6,
                most_px=limits.max_side_px,
            ),
        )
    if min(width, height) < MIN_SIDE_PX:
        raise BadImage(
            say(
                "image.too-small",
                "The image has {width} × {height} px.",
                width=width,
                height=height,
            ),
            say("image.send-full", "Send a full camera image."),
            reason="image-too-small",
        )
