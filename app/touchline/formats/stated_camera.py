"""A camera's numbers in another program's mapping: what they are called, and the shapes that they are written in.

One table of names serves all programs; what has a form of its own (mrcal, MATLAB, VINS, COLMAP) is brought into these
names first. A name counts without case, dashes, points and underscores.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from touchline.core.errors import BadInput
from touchline.core.geometry import ImageSize
from touchline.core.json_values import JsonObject
from touchline.formats.numbers import (
    camera_matrix,
    checked_size,
    flat_numbers,
    format_error,
    number,
    numbers,
)
from touchline.models.lenses.brown_conrady import TERMS as BROWN_TERMS
from touchline.models.lenses.kannala_brandt import TERMS as FISHEYE_TERMS

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
    "imagesize",
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
MIN_INHERITED_PX = 64  # less is a board's size, in squares
IS_FISHEYE = ["fisheyemodel", "fisheye", "isfisheye"]
COUNTS = (0, 4, 5, 8, 12, 14)  # of coefficients in a list, as OpenCV has it
# what programs call the two lenses, and those that we have no lens for
LENS_NAMES = {
    "brown-conrady": re.compile(
        r"(lensmodel)?opencv(4|5|8|12)?|plumbbob|radtan|(pinhole)?radialtangential|rectilinear|"
        r"rational(polynomial)?|(distortion)?brown(conrady)?|none|lensmodelpinhole|pinholefull"
    ),
    "fisheye": re.compile(
        r"equi(distant)?|(opencv)?fisheye|(distortion)?kannalabrandt(4|8)?|kb(4|8)?"
    ),
}
OTHER_LENSES = re.compile(
    r"(lensmodel|distortion)?"
    r"(omni(directional)?(universal|radtan)?|universalomni|mei|ds|doublesphere|eucm|ucm|fov|"
    r"sphericalfov|(splined)?ste(reo|rio)graphic|cahvore?|scaramuzza|"
    r"ocam|ftheta|thinprismfisheye|division)(radtan|none|equi)?|"
    r"(distortion)?(inverse|modified)brownconrady|radialdivision|poly[0-9]"
)
WHOLE = ("distortion", "distortionparameters", "distortioncoefficients", "distcoeffs", "d")
# what may be a lens's numbers under a name that is not read
UNREAD = re.compile(
    r".*distort.*|dist.?c.*|.*coef.*|radial.*|tangential.*|kc|xi|mirror.*|params?|parameters|alpha|beta|"
    r"skew"
)
ALWAYS_UNREAD = ("xi", "skew", "mirroroffset")  # whatever terms there are
# what a mapping says of the camera in it
INHERITED = (*LENS, *IS_FISHEYE, *TERMS)
# COLMAP's models: our lens, and what their parameters are called
COLMAP = {
    "SIMPLE_PINHOLE": ("brown-conrady", "f cx cy"),
    "PINHOLE": ("brown-conrady", "fx fy cx cy"),
    "SIMPLE_RADIAL": ("brown-conrady", "f cx cy k1"),
    "RADIAL": ("brown-conrady", "f cx cy k1 k2"),
    "OPENCV": ("brown-conrady", "fx fy cx cy k1 k2 p1 p2"),
    "FULL_OPENCV": ("brown-conrady", "fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6"),
    "OPENCV_FISHEYE": ("fisheye", "fx fy cx cy k1 k2 k3 k4"),
    "SIMPLE_RADIAL_FISHEYE": ("fisheye", "f cx cy k1"),
    "RADIAL_FISHEYE": ("fisheye", "f cx cy k1 k2"),
}
MRCAL_COUNTS = {"OPENCV4": 4, "OPENCV5": 5, "OPENCV8": 8, "OPENCV12": 12}
VINS_FISHEYE = {
    "k2": "k1",
    "k3": "k2",
    "k4": "k3",
    "k5": "k4",
    "mu": "fx",
    "mv": "fy",
    "u0": "cx",
    "v0": "cy",
}
# by what stands in them: programs whose files are read, and the lens that they assume where none is stated
PROGRAMS = {
    "opencv": ("OpenCV", None),
    "ros": ("ROS camera_info", "brown-conrady"),
    "kalibr": ("Kalibr camchain", None),
    "mrcal": ("mrcal camera model", None),
    "photonvision": ("PhotonVision JSON", "brown-conrady"),
    "vins": ("VINS", "brown-conrady"),
    "orb-slam": ("ORB-SLAM", "brown-conrady"),
    "matlab": ("MATLAB", "brown-conrady"),
    "colmap": ("COLMAP", None),
    "anipose": ("Anipose", "brown-conrady"),
}


@dataclass(frozen=True)
class StatedCamera:
    """program: a name in PROGRAMS. lens: a model's name, None where the file does not say. terms: in OpenCV's order.

    extrinsics: mrcal's rotation vector and translation.
    """

    program: str
    lens: str | None
    terms: tuple[float, ...]
    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    size: ImageSize | None
    extrinsics: tuple[float, ...] | None = None
    notes: tuple[str, ...] = ()


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


def program_of(value: JsonObject, syntax: str) -> str | None:
    """Return the program whose camera this mapping is; None where it is no camera."""
    names = Names(value)
    has = names.has
    if has("colmapmodel"):
        return "colmap"
    if has("radialdistortion") and has("intrinsicmatrix", "k", "focallength"):
        return "matlab"
    if has("projectionparameters", "mirrorparameters"):
        return "vins"
    matrices = [found for _, found in names.find(MATRIX) if is_matrix(found)]
    if not matrices:
        return ("orb-slam" if has("orbslam") else "opencv") if has("fx") and has("fy") else None
    if has("lensmodel") and isinstance(matrices[0], list) and not has("cameraintrinsics"):
        return "mrcal"
    if has("cameraintrinsics"):
        return "photonvision"
    if isinstance(matrices[0], list) and len(matrices[0]) != 9 and has("intrinsics"):
        return "kalibr" if not isinstance(matrices[0][0], list) else "opencv"
    if syntax == "oST" or has("distortionmodel", "projectionmatrix", "cameraname", "binningx"):
        return "ros"
    return "anipose" if syntax == "TOML" else "opencv"


def is_matrix(value: Any) -> bool:
    """Whether it has the shape of a camera matrix, or of Kalibr's and mrcal's list of intrinsics."""
    if isinstance(value, dict):
        return "data" in value
    return isinstance(value, list) and len(value) >= 3


def stated_camera(
    value: JsonObject, program: str, at: str, given: str | None = None
) -> StatedCamera:
    """Read a camera's numbers; BadInput names the place of what is wrong.

    at: of the mapping, "" for the file. given: the lens that the caller states, where the file does not.
    """
    notes: list[str] = []
    value, lens, offset_px = _usual(value, program, at)
    names = Names(value)
    lens = lens or _stated_lens(names, at)
    if given is not None and lens is not None and given != lens:
        raise format_error(
            f"The file states its lens: {lens}.", "Choose none. From a program, omit model."
        )
    lens = lens or given
    found = next((it for it in names.find(MATRIX) if is_matrix(it[1])), None)
    if found is None:
        focal, centre, more = _pair(names, at, "fx", "fy"), _pair(names, at, "cx", "cy"), ()
    else:
        focal, centre, more = _intrinsics(found[1], at + found[0], program)
    if program == "mrcal":
        stated = names.first("lensmodel")
        count = MRCAL_COUNTS.get(str(stated and stated[1]).removeprefix("LENSMODEL_"), 0)
        numbers(found and found[1], f"{at}intrinsics", (4 + count,))
    assumed = PROGRAMS[program][1]
    terms = _terms(names, lens or assumed, more, at)
    _refuse_unread(names, at, is_complete=bool(terms) or program in ("matlab", "colmap", "vins"))
    if not terms and not _says_none(names):
        notes.append("The file states no distortion.")
    if lens is None and len(terms) != 4:  # a fisheye has four
        lens = "brown-conrady"
    if lens is None and assumed is not None and any(terms):
        notes.append(f"The file does not state its lens: {PROGRAMS[program][0]} assumes {assumed}.")
    for name, part in names.find(("binningx", "binningy", "roi")):
        if _is_applied(part):
            notes.append(f"{name} was not applied: the lens is that of the whole image.")
    return StatedCamera(
        program,
        lens or assumed,
        terms,
        focal,
        (centre[0] + offset_px, centre[1] + offset_px),
        _size(names, at),
        _extrinsics(names),
        tuple(notes),
    )


def _usual(value: JsonObject, program: str, at: str) -> tuple[JsonObject, str | None, float]:
    """Bring a form of its own into the usual names; return also the lens, and what is added to the centre, px."""
    names = Names(value)
    if program == "colmap":
        model = value["colmap_model"]
        if model not in COLMAP:
            raise _other_lens(f"{at}the model", model)
        lens, called = COLMAP[model]
        wanted = called.split()
        given = numbers(value["parameters"], f"{at}parameters", (len(wanted),))
        usual = dict(zip(wanted, given, strict=True))
        if "f" in usual:
            usual["fx"] = usual["fy"] = usual.pop("f")
        size = {"width": value["width"], "height": value["height"]}
        return {**usual, **size}, lens, -0.5  # its top-left pixel's centre is (0.5, 0.5)
    if program == "matlab":
        return _of_matlab(names, at), "brown-conrady", -1.0  # its pixels are counted from 1
    if program == "vins":
        parts = [
            part
            for _, part in names.find(("projectionparameters", "distortionparameters"))
            if isinstance(part, dict)
        ]
        usual = {key: item for part in parts for key, item in part.items()} | dict(value)
        if "mu" in usual:  # Kannala and Brandt's: r = θ + k2 θ³ + k3 θ⁵ + …
            usual |= {ours: usual[name] for name, ours in VINS_FISHEYE.items() if name in usual}
            usual.pop("k5", None)
        usual.pop("fisheye", None)  # whether a mask is used
        return usual, None, 0.0
    return _without_whole(value, names), None, 0.0


def _without_whole(value: JsonObject, names: Names) -> JsonObject:
    """Return a camera with the coefficients that stand as {type, parameters} or {k1, k2, …} in usual names."""
    whole = next((it for it in names.find(WHOLE) if isinstance(it[1], dict)), None)
    if whole is None or "data" in whole[1]:
        return dict(value)
    usual = {key: part for key, part in value.items() if key != whole[0]}
    inside: JsonObject = whole[1]
    parts = Names(inside)
    parameters = parts.first("parameters", "params")
    if parameters is None:
        return usual | inside
    stated = parts.first("type")
    kind = {} if stated is None else {"distortion_model": stated[1]}
    return usual | kind | {"D": parameters[1]}


def _of_matlab(names: Names, at: str) -> JsonObject:
    """Return cameraParameters in usual names. IntrinsicMatrix is K by columns; ImageSize is rows, columns."""
    usual: JsonObject = {}
    if (given := names.first("intrinsicmatrix", "k")) is not None:
        usual["K"] = given[1]
    else:
        usual |= _paired(names, at, "focallength", ("fx", "fy"))
        usual |= _paired(names, at, "principalpoint", ("cx", "cy"))
    usual |= _paired(names, at, "radialdistortion", ("k1", "k2", "k3"))
    usual |= _paired(names, at, "tangentialdistortion", ("p1", "p2"))
    if (found := names.first("imagesize")) is not None and found[1]:
        height, width = numbers(found[1], at + found[0], (2,))
        usual["image_size"] = [width, height]
    return usual


def _paired(names: Names, at: str, part: str, keys: tuple[str, ...]) -> JsonObject:
    """Return a list's two numbers or all under these keys; nothing where there is no such list."""
    if (found := names.first(part)) is None:
        return {}
    return dict(zip(keys, numbers(found[1], at + found[0], (2, len(keys))), strict=False))


def _intrinsics(
    value: Any, at: str, program: str
) -> tuple[tuple[float, float], tuple[float, float], tuple[Any, ...]]:
    """Return focal lengths, centre, and what follows them in a list fx, fy, cx, cy, …, as Kalibr's and mrcal's."""
    if isinstance(value, dict) and len(flat := value.get("data") or []) == 4:
        program, value = "kalibr", flat
    if program in ("kalibr", "mrcal"):
        fx, fy, cx, cy = numbers(value[:4], at, (4,))
        return (fx, fy), (cx, cy), tuple(value[4:])
    fx, skew, cx, zero, fy, cy, *last = camera_matrix(value, at)
    if abs(skew) > 1e-9 * abs(fx) or zero != 0 or last != [0, 0, 1]:
        raise format_error(
            f"{at} is not a camera matrix without skew.", "Use [fx, 0, cx, 0, fy, cy, 0, 0, 1]."
        )
    return (fx, fy), (cx, cy), ()


def _pair(names: Names, at: str, x: str, y: str) -> tuple[float, float]:
    """Return two numbers by their names; RealSense calls the centre ppx, ppy."""
    first, second = (names.first(name, name.replace("c", "pp", 1)) for name in (x, y))
    if first is None or second is None:
        raise format_error(f"{at or 'The file '}has no {x if first is None else y}.", "Add it.")
    return number(first[1], at + first[0]), number(second[1], at + second[0])


def _stated_lens(names: Names, at: str) -> str | None:
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
            raise _other_lens(at + name, value)
    for name, value in names.find(IS_FISHEYE):
        fisheye = plain(value) in ("1", "true", "yes") or value is True
        stated["fisheye" if fisheye else "brown-conrady"] = f"{name} {value}"
    if len(stated) > 1:
        raise format_error(
            f"The file states two lenses: {' and '.join(stated.values())}.", "Correct the file."
        )
    return next(iter(stated), None)


def _says_none(names: Names) -> bool:
    return any(plain(value) in ("none", "lensmodelpinhole") for _, value in names.find(LENS))


def _refuse_unread(names: Names, at: str, is_complete: bool) -> None:
    """BadInput where a name that is not read may have the lens's numbers. is_complete: it has terms already."""
    for name, key in names.keys.items():
        if name not in ALWAYS_UNREAD and (is_complete or not UNREAD.fullmatch(name)):
            continue
        if _has_numbers(next(names.find((name,)))[1]):
            raise format_error(
                f"{at}{key} is not read, and may belong to the lens.",
                "Call the coefficients distortion_coefficients, in OpenCV's order, or remove it.",
            )


def _has_numbers(value: Any) -> bool:
    """Whether a number other than 0 is in it."""
    if isinstance(value, dict):
        return any(map(_has_numbers, value.values()))
    if isinstance(value, list):
        return any(map(_has_numbers, value))
    try:
        return float(value) != 0
    except (TypeError, ValueError):
        return False


def _other_lens(at: str, value: Any) -> BadInput:
    return format_error(
        f"{at} is {str(value)[:40]!r}: there is no such lens here.",
        "Calibrate with plumb_bob (radtan), rational_polynomial or equidistant.",
    )


def _terms(names: Names, lens: str | None, more: tuple[Any, ...], at: str) -> tuple[float, ...]:
    """Return a fisheye's four terms; else as many as are given, without the zeros beyond eight."""
    found = next((it for it in names.find(TERMS) if isinstance(it[1], (list, dict))), None)
    if more:
        place, flat = f"{at}intrinsics", list(more)
    elif found is not None:
        place, flat = at + found[0], flat_numbers(found[1], at + found[0])
    else:
        return _named_terms(names, lens, at)
    given = numbers(flat, place, COUNTS[1:] if lens == "fisheye" else COUNTS)
    if lens == "fisheye":
        if any(given[4:]):
            raise format_error(f"{place} has {len(given)} numbers.", "A fisheye lens has 4.")
        return given[:4]
    return given if any(given[8:]) else given[:8]


def _named_terms(names: Names, lens: str | None, at: str) -> tuple[float, ...]:
    """Return the terms that are given one by one, as k1 and p1."""
    given = {
        plain(key): number(value, at + key)
        for key, value in names.find(BROWN_TERMS)
        if not isinstance(value, (list, dict))
    }
    if lens == "fisheye" and (given.get("p1") or given.get("p2")):
        raise format_error(f"{at}p1 is not a coefficient of a fisheye.", "Correct the file.")
    if not given and lens != "fisheye":
        return ()
    # radial terms alone, of a lens that is not stated, may be a fisheye's: as many as that has
    is_brown = lens == "brown-conrady" or "p1" in given
    return tuple(given.get(name, 0.0) for name in (BROWN_TERMS if is_brown else FISHEYE_TERMS))


def _size(names: Names, at: str) -> ImageSize | None:
    width, height = names.first(*WIDTH), names.first(*HEIGHT)
    if width is not None or height is not None:
        for found, name in ((width, "image_width"), (height, "image_height")):
            if found is None:
                raise format_error(f"{at or 'The file '}has no {name}.", f"Add {name}.")
        assert width is not None and height is not None
        return checked_size(width[1], height[1])
    found = names.first(*SIZE)
    if found is None:
        return None
    if isinstance(found[1], dict):
        short = {"w": "width", "h": "height"}
        part = {short.get(str(key), str(key)): side for key, side in found[1].items()}
        return _size(Names(part), f"{at}{found[0]}.")
    return checked_size(*numbers(found[1], at + found[0], (2,)))


def size_in(value: JsonObject) -> JsonObject:
    """Return what states the image size in a mapping; nothing where it is none, as a board's."""
    try:
        found = _size(Names(value), "")
    except BadInput:
        return {}
    if found is None or min(found) < MIN_INHERITED_PX:
        return {}
    return {key: part for key, part in value.items() if plain(key) in (*WIDTH, *HEIGHT, *SIZE)}


def _extrinsics(names: Names) -> tuple[float, ...] | None:
    """Return mrcal's extrinsics, from the file's reference to the camera; older files call them so."""
    found = names.first("rtcamref", "extrinsics")
    return (
        None if found is None or not names.has("lensmodel") else numbers(found[1], found[0], (6,))
    )


def _is_applied(part: Any) -> bool:
    """Whether a binning or region of interest is another than the whole image."""
    if isinstance(part, dict):
        return any(
            _is_applied(part.get(key)) for key in ("x_offset", "y_offset", "width", "height")
        )
    return plain(part) not in ("", "0", "1", "00", "10", "none", "null", "false")
