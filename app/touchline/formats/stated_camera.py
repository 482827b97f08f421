"""A camera's numbers in another program's mapping, in the shapes that they are written in.

One table of names serves all programs (camera_names.py); what has a form of its own (MATLAB, VINS, COLMAP) is brought
into these names first (program_forms.py).
"""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

from touchline.core.geometry import ImageSize
from touchline.core.json_values import JsonObject
from touchline.formats.camera_names import (
    ALWAYS_UNREAD,
    LENS,
    MATRIX,
    TERMS,
    UNREAD,
    Names,
    has_numbers,
    is_matrix,
    is_read,
    other_lens,
    plain,
    size_of,
    stated_lens,
)
from touchline.formats.numbers import (
    camera_matrix,
    flat_numbers,
    format_error,
    number,
    numbers,
)
from touchline.formats.program_forms import OWN_LENS, PROGRAMS, in_usual_names
from touchline.models.lenses.brown_conrady import TERMS as BROWN_TERMS
from touchline.models.lenses.kannala_brandt import TERMS as FISHEYE_TERMS

MRCAL_COUNTS = {"OPENCV4": 4, "OPENCV5": 5, "OPENCV8": 8, "OPENCV12": 12}
COUNTS = (0, 4, 5, 8, 12, 14)  # of coefficients in a list, as OpenCV has it


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


def stated_camera(
    value: JsonObject, program: str, at: str, given: str | None = None
) -> StatedCamera:
    """Read a camera's numbers; BadInput names the place of what is wrong.

    at: of the mapping, "" for the file. given: the lens that the caller states, where the file does not.
    """
    notes: list[str] = []
    value, lens, offset_px = in_usual_names(value, program, at)
    names = Names(value)
    own = names.first(OWN_LENS.get(program, ""))
    if own is not None and not is_read(str(own[1])):
        raise other_lens(at + own[0], own[1])
    lens = lens or stated_lens(names, at)
    if given is not None and lens is not None and given != lens:
        raise format_error(
            f"The file states its lens: {lens}.", "Choose none. From a program, omit model."
        )
    lens = lens or given
    found = next((it for it in names.find(MATRIX) if is_matrix(it[1])), None)
    if found is None:
        focal, centre, more = pair(names, at, "fx", "fy"), pair(names, at, "cx", "cy"), ()
    else:
        focal, centre, more = focal_and_centre(found[1], at + found[0], program)
    if program == "mrcal":
        stated = names.first("lensmodel")
        count = MRCAL_COUNTS.get(str(stated and stated[1]).removeprefix("LENSMODEL_"), 0)
        numbers(found and found[1], f"{at}intrinsics", (4 + count,))
    assumed = PROGRAMS[program][1]
    terms = _terms(names, lens or assumed, more, at)
    refuse_unread(names, at, is_complete=bool(terms) or program in ("matlab", "colmap", "vins"))
    if not terms and not _says_none(names):
        notes.append("The file states no distortion.")
    if not terms and lens == "fisheye":
        terms = (0.0,) * len(FISHEYE_TERMS)
    if lens is None and len(terms) != 4:  # a fisheye has four
        lens = "brown-conrady"
    if lens is None and assumed is not None and any(terms):
        notes.append(f"The file does not state its lens: {PROGRAMS[program][0]} assumes {assumed}.")
    for name, part in names.find(("binningx", "binningy", "roi")):
        if _is_applied(part):
            notes.append(f"{name} was not applied: the lens is that of the whole image.")
    if names.has("tcncnm1"):
        notes.append(
            "The transformation from the camera before it was not used: a rig's cameras are joined by their field."
        )
    return StatedCamera(
        program,
        lens or assumed,
        terms,
        focal,
        (centre[0] + offset_px, centre[1] + offset_px),
        size_of(names, at),
        extrinsics(names),
        tuple(notes),
    )


def focal_and_centre(
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


def pair(names: Names, at: str, x: str, y: str) -> tuple[float, float]:
    """Return two numbers by their names; RealSense calls the centre ppx, ppy."""
    first, second = (names.first(name, name.replace("c", "pp", 1)) for name in (x, y))
    if first is None or second is None:
        raise format_error(
            f"{at[:-1] or 'The file'} has no {x if first is None else y}.", "Add it."
        )
    return number(first[1], at + first[0]), number(second[1], at + second[0])


def _says_none(names: Names) -> bool:
    return any(plain(value) in ("none", "lensmodelpinhole") for _, value in names.find(LENS))


def refuse_unread(names: Names, at: str, is_complete: bool, read: Collection[str] = ()) -> None:
    """BadInput where a name that is not read may have the lens's numbers.

    is_complete: it has terms already. read: names that this lens has and others have not.
    """
    for name, key in names.keys.items():
        if name in read or (
            name not in ALWAYS_UNREAD and (is_complete or not UNREAD.fullmatch(name))
        ):
            continue
        if has_numbers(next(names.find((name,)))[1]):
            raise format_error(
                f"{at}{key} is not read, and may belong to the lens.",
                "Call the coefficients distortion_coefficients, in OpenCV's order, or remove it.",
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
    if not given:
        return ()
    # radial terms alone, of a lens that is not stated, may be a fisheye's: as many as that has
    is_brown = lens == "brown-conrady" or "p1" in given
    return tuple(given.get(name, 0.0) for name in (BROWN_TERMS if is_brown else FISHEYE_TERMS))


def extrinsics(names: Names) -> tuple[float, ...] | None:
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
