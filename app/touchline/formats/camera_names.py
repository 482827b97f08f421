"""What programs call a camera's numbers and its lens: one table of names for all, and a mapping by them.

A name counts without case, dashes, points and underscores.
"""

import re
from collections.abc import Iterable, Iterator
from typing import Any

from touchline.core.errors import BadInput
from touchline.core.geometry import ImageSize
from touchline.core.json_values import JsonObject
from touchline.formats.numbers import checked_size, format_error, numbers

MATRIX = [
    "cameramatrix",
    "cameraintrinsics",
    "k",
    "mtx",
    "m",
    "camk",
    "cammatrix",
    "matrix",
    "intrinsic",
    "intrinsics",
    "intrinsicmatrix",
]
TERMS = [
    "distortioncoefficients",
    "distcoeffs",
    "distcoeff",
    "distortioncoeffs",
    "distortioncoeff",
    "distortioncoefs",
    "d",
    "dist",
    "distortions",
    "distortion",
    "camkc",
    "kc",
    "camdist",
    "coeffs",
    "coeff",
    "distcoef",
    "distort",
    "cameradistortion",
    "cameraextrinsics",  # so PhotonVision called them once
]
WIDTH = ["imagewidth", "width", "camerawidth", "imgwidth", "framewidth"]
HEIGHT = ["imageheight", "height", "cameraheight", "imgheight", "frameheight"]
SIZE = [
    "calibdimension",
    "dim",
    "imagesize",
    "imagedimension",
    "imgsize",
    "resolution",
    "size",
    "imagersize",
    "framesize",
    "imageresolution",
]
LENS = [
    "distortionmodel",
    "cameramodel",
    "modeltype",
    "lensmodel",
    "lenstype",
    "cameratype",
    "distortiontype",
    "projectionmodel",
    "projection",
    "type",
    "model",
]
IS_FISHEYE = ["fisheyemodel", "fisheye", "isfisheye"]
MIN_INHERITED_PX = 64  # less is a board's size, in squares
# what may be a lens's numbers under a name that is not read
UNREAD = re.compile(
    r".*distort.*|dist.?c.*|.*coef.*|radial.*|tangential.*|kc|xi|mirror.*|params?|parameters|alpha|beta|"
    r"skew"
)
ALWAYS_UNREAD = ("xi", "skew", "mirroroffset")  # whatever terms there are
# what a mapping says of the camera in it
INHERITED = (*LENS, *IS_FISHEYE, *TERMS)
# what programs call the two lenses, and those that we have no lens for
LENS_NAMES = {
    "brown-conrady": re.compile(
        r"(lensmodel)?opencv(4|5|8|12)?|plumbbob|radtan|(pinhole)?radialtangential8?|rectilinear|"
        r"rational(polynomial)?|(distortion)?brown(conrady)?|none|lensmodelpinhole|pinholefull"
    ),
    "fisheye": re.compile(
        r"equi(distant)?|(opencv)?fisheye|(distortion)?kannalabrandt(4|8)?|kb(4|8)?"
    ),
}
# of a lens whose coefficients say what it is
PLAIN_LENSES = re.compile(r"(simple)?(pinhole|radial)|perspective")
OTHER_LENSES = re.compile(
    r"(lensmodel|distortion)?"
    r"(omni(directional)?(universal|radtan)?|universalomni|mei|ds|doublesphere|eucm|ucm|fov|"
    r"sphericalfov|(splined)?ste(reo|rio)graphic|cahvore?|scaramuzza|"
    r"ocam|ftheta|thinprismfisheye|division)(radtan|none|equi)?|"
    r"(distortion)?(inverse|modified)brownconrady|radialdivision|poly[0-9]"
)


class Names:
    """A mapping by its names as they count: the first of several that count the same."""

    def __init__(self, mapping: JsonObject) -> None:
        self.keys: dict[str, str] = {}
        for key in mapping:
            self.keys.setdefault(plain(key), key)
        self._mapping = mapping

    def find(self, names: Iterable[str]) -> Iterator[tuple[str, Any]]:
        """Yield the names as written, and their values."""
        for name in names:
            if name in self.keys:
                yield self.keys[name], self._mapping[self.keys[name]]

    def first(self, *names: str) -> tuple[str, Any] | None:
        return next(self.find(names), None)

    def has(self, *names: str) -> bool:
        return any(name in self.keys for name in names)


def plain(key: object) -> str:
    """Return a name as it counts."""
    return re.sub(r"[^a-z0-9]", "", str(key).lower())


def is_matrix(value: Any) -> bool:
    """Whether it has the shape of a camera matrix, or of Kalibr's and mrcal's list of intrinsics."""
    if isinstance(value, dict):
        return "data" in value
    return isinstance(value, list) and len(value) >= 3


def stated_lens(names: Names, at: str) -> str | None:
    stated: dict[str, str] = {}
    for name, value in names.find(LENS):
        if not isinstance(value, str):
            continue
        known = [lens for lens, called in LENS_NAMES.items() if called.fullmatch(plain(value))]
        if known:
            stated[known[0]] = f"{name} {value}"
        elif (
            OTHER_LENSES.fullmatch(plain(value))
            or plain(name) == "distortionmodel"
            or plain(value).startswith("lensmodel")
        ):
            raise other_lens(at + name, value)
    for name, value in names.find(IS_FISHEYE):
        fisheye = plain(value) in ("1", "true", "yes") or value is True
        stated["fisheye" if fisheye else "brown-conrady"] = f"{name} {value}"
    if len(stated) > 1:
        raise format_error(
            f"The file states two lenses: {' and '.join(stated.values())}.", "Correct the file."
        )
    return next(iter(stated), None)


def has_numbers(value: Any) -> bool:
    """Whether a number other than 0 is in it."""
    if isinstance(value, dict):
        return any(map(has_numbers, value.values()))
    if isinstance(value, list):
        return any(map(has_numbers, value))
    try:
        return float(value) != 0
    except (TypeError, ValueError):
        return False


def is_read(value: str) -> bool:
    """Whether a program's name of a lens is one of those that are read."""
    known = (PLAIN_LENSES, *LENS_NAMES.values())
    return any(called.fullmatch(plain(value)) for called in known)


def other_lens(at: str, value: Any) -> BadInput:
    return format_error(
        f"{at} is {str(value)[:40]!r}: there is no such lens here.",
        "Calibrate with plumb_bob (radtan), rational_polynomial or equidistant.",
    )


def size_of(names: Names, at: str) -> ImageSize | None:
    width, height = names.first(*WIDTH), names.first(*HEIGHT)
    if width is not None or height is not None:
        for found, name in ((width, "image_width"), (height, "image_height")):
            if found is None:
                raise format_error(f"{at[:-1] or 'The file'} has no {name}.", f"Add {name}.")
        assert width is not None and height is not None
        return checked_size(width[1], height[1])
    found = names.first(*SIZE)
    if found is None:
        return None
    if isinstance(found[1], dict):
        short = {"w": "width", "h": "height"}
        part = {short.get(str(key), str(key)): side for key, side in found[1].items()}
        return size_of(Names(part), f"{at}{found[0]}.")
    return checked_size(*numbers(found[1], at + found[0], (2,)))


def size_in(value: JsonObject) -> JsonObject:
    """Return what states the image size in a mapping; nothing where it is none, as a board's."""
    try:
        found = size_of(Names(value), "")
    except BadInput:
        return {}
    if found is None or min(found) < MIN_INHERITED_PX:
        return {}
    return {key: part for key, part in value.items() if plain(key) in (*WIDTH, *HEIGHT, *SIZE)}
