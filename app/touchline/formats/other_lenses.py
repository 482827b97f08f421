"""Lenses that other programs have and Touchline has not, read as the nearest fisheye, with its error in pixels.

All of them are radial: a ray at the angle θ from the axis is seen at the radius r(θ) · focal length from the centre.

    stereographic       r = 2 tan(θ / 2)
    omni (C. Mei and P. Rives, ICRA 2007)           ρ = sin θ / (cos θ + ξ), r = ρ (1 + k1 ρ² + k2 ρ⁴)
    ds (V. Usenko, N. Demmel, D. Cremers, 3DV 2018) z = cos θ + ξ, d = √(sin² θ + z²), r = sin θ / (α d + (1 - α) z)
    eucm (B. Khomutenko et al., RA-L 2016)          d = √(β sin² θ + cos² θ), r = sin θ / (α d + (1 - α) cos θ)
    fov (F. Devernay and O. Faugeras, 2001)         r = atan(2 tan(ω / 2) tan θ) / ω

The fisheye's r = θ (1 + k1 θ² + … + k4 θ⁸) is fitted to them over the angles that the image shows.
"""

import re
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from touchline.core.geometry import Array, ImageSize
from touchline.core.json_values import JsonObject
from touchline.formats.camera_names import (
    LENS,
    LENS_NAMES,
    MATRIX,
    TERMS,
    Names,
    is_matrix,
    plain,
    size_of,
)
from touchline.formats.numbers import flat_numbers, format_error, number, numbers
from touchline.formats.program_forms import in_usual_names
from touchline.formats.stated_camera import (
    StatedCamera,
    extrinsics,
    focal_and_centre,
    pair,
    refuse_unread,
)

WIDEST_RAD = np.radians(95.0)  # what a fisheye is fitted to at most
UNKNOWN_SIZE_RAD = np.radians(75.0)
STEPS = 400
MAX_ERROR_PX = 0.5
FISHEYE_TERMS = 4
MATRICES = (3, 9)  # lists that are one, and no parameters
LISTING = ("kalibr", "mrcal")  # programs that list parameters, focal lengths and centre
LISTED = ("k1", "k2", "p1", "p2")  # one by one


def _stereographic(angle: Array, _: tuple[float, ...]) -> Array:
    return 2 * np.tan(angle / 2)


def _omni(angle: Array, parameters: tuple[float, ...]) -> Array:
    xi, k1, k2 = parameters
    rho = np.sin(angle) / (np.cos(angle) + xi)
    return rho * (1 + k1 * rho**2 + k2 * rho**4)


def _double_sphere(angle: Array, parameters: tuple[float, ...]) -> Array:
    xi, alpha = parameters
    z = np.cos(angle) + xi
    plane: Array = alpha * np.hypot(np.sin(angle), z) + (1 - alpha) * z
    return np.sin(angle) / plane


def _extended_unified(angle: Array, parameters: tuple[float, ...]) -> Array:
    alpha, beta = parameters
    distance = np.sqrt(beta * np.sin(angle) ** 2 + np.cos(angle) ** 2)
    radius: Array = np.sin(angle) / (alpha * distance + (1 - alpha) * np.cos(angle))
    return radius


def _field_of_view(angle: Array, parameters: tuple[float, ...]) -> Array:
    (omega,) = parameters
    radius: Array = np.arctan(2 * np.tan(omega / 2) * np.tan(angle)) / omega
    return radius


class OtherLens(NamedTuple):
    """called: by programs. parameters: names and limits, in the order in which a list has them before fx."""

    title: str
    called: re.Pattern[str]
    radius: Callable[[Array, tuple[float, ...]], Array]
    parameters: dict[str, tuple[float, float]]
    widest_rad: float = WIDEST_RAD


LENSES = (
    OtherLens("stereographic", re.compile(r"(lensmodel)?ste(reo|rio)graphic"), _stereographic, {}),
    OtherLens("omni", re.compile(r"omni(directional)?|mei"), _omni, {"xi": (-0.99, 20)}),
    OtherLens(
        "double sphere",
        re.compile(r"ds|doublesphere"),
        _double_sphere,
        {"xi": (-0.99, 20), "alpha": (0, 1)},
    ),
    OtherLens(
        "extended unified",
        re.compile(r"eucm"),
        _extended_unified,
        {"alpha": (0, 1), "beta": (0.01, 100)},
    ),
    OtherLens(
        "field of view", re.compile(r"fov"), _field_of_view, {"w": (0.01, 3)}, np.radians(88.0)
    ),
)


def stated_as_fisheye(
    value: JsonObject, program: str, at: str, given: str | None = None
) -> StatedCamera | None:
    """Read a camera with one of these lenses; None for another, BadInput where its numbers are wrong.

    at: of the mapping, "" for the file. given: the lens that the caller states.
    """
    names = Names(in_usual_names(value, program, at)[0] if program == "vins" else value)
    stated = [plain(text) for _, text in names.find(LENS) if isinstance(text, str)]
    lens = next((one for one in LENSES if any(map(one.called.fullmatch, stated))), None)
    if lens is None:
        return None
    if given is not None and given != "fisheye":
        raise format_error(
            f"The file states its lens: {lens.title}.", "Choose none. From a program, omit model."
        )
    if any(map(LENS_NAMES["fisheye"].fullmatch, stated)):
        raise format_error(
            f"{at[:-1] or 'The file'} states two lenses: {lens.title} and a fisheye.",
            "Correct the file.",
        )
    refuse_unread(names, at, is_complete=True, read=lens.parameters)
    parameters, focal, centre = _numbers(names, lens, program, at)
    size = size_of(names, at)
    radius_px = None if size is None else _reach_px(size, centre)
    terms, scale, error_px, widest_deg = _nearest(lens, parameters, max(focal), radius_px)
    if not error_px <= MAX_ERROR_PX:
        raise format_error(
            f"No fisheye is close to this lens ({lens.title}): the nearest differs by {error_px:.1f} px.",
            "Calibrate with radtan or equidistant.",
        )
    error = f"{max(error_px, 1e-4):.2g} px"
    notes = [f"The lens ({lens.title}) was read as the nearest fisheye, to {error}."]
    if widest_deg is not None:
        notes.append(
            f"They were compared up to {widest_deg:.0f}° from the axis. The image may show more."
        )
    return StatedCamera(
        program,
        "fisheye",
        terms,
        (focal[0] * scale, focal[1] * scale),
        centre,
        size,
        extrinsics(names),
        tuple(notes),
    )


def _numbers(
    names: Names, lens: OtherLens, program: str, at: str
) -> tuple[tuple[float, ...], tuple[float, float], tuple[float, float]]:
    """Return the lens's parameters, the focal lengths and the centre."""
    wanted = [*lens.parameters]
    found = next((it for it in names.find(MATRIX) if is_matrix(it[1])), None)
    given: list[float] = []
    if found is None:
        focal, centre = pair(names, at, "fx", "fy"), pair(names, at, "cx", "cy")
    elif isinstance(found[1], list) and (program in LISTING or len(found[1]) not in MATRICES):
        *given, fx, fy, cx, cy = numbers(found[1], at + found[0], {4, 4 + len(wanted)})
        focal, centre = (fx, fy), (cx, cy)
    else:
        focal, centre, _ = focal_and_centre(found[1], at + found[0], "opencv")
    terms = _coefficients(names, at)
    if lens.radius is _field_of_view and len(terms) == 1:
        given, terms = terms, []
    for name in wanted[len(given) :]:
        if (one := names.first(name)) is None:
            raise format_error(f"{at[:-1] or 'The file'} has no {name}.", f"Add {name}.")
        given.append(number(one[1], at + one[0]))
    for name, parameter in zip(wanted, given, strict=True):
        number(parameter, at + name, *lens.parameters[name])
    if lens.radius is _omni:
        given += [*terms, 0.0, 0.0][:2]
        terms = terms[2:]
    if any(terms):
        raise format_error(
            f"{at[:-1] or 'The file'} has a lens ({lens.title}) with coefficients that no fisheye has.",
            "Calibrate with radtan or equidistant.",
        )
    return tuple(given), focal, centre


def _coefficients(names: Names, at: str) -> list[float]:
    """Return the coefficients beside the lens's own parameters, in OpenCV's order."""
    if (found := names.first(*TERMS)) is not None and isinstance(found[1], (list, dict)):
        flat = flat_numbers(found[1], at + found[0])
    else:
        flat = [one[1] if (one := names.first(name)) else 0.0 for name in LISTED]
    return [number(value, f"{at}distortion[{i}]") for i, value in enumerate(flat)]


def _reach_px(size: ImageSize, centre: tuple[float, float]) -> float:
    """Return the distance from the centre to the image's farthest corner."""
    return float(
        np.hypot(
            max(abs(centre[0]), abs(size.width - centre[0])),
            max(abs(centre[1]), abs(size.height - centre[1])),
        )
    )


def _nearest(
    lens: OtherLens, parameters: tuple[float, ...], focal_px: float, radius_px: float | None
) -> tuple[tuple[float, ...], float, float, float | None]:
    """Return the fisheye's terms, what its focal length is of the given one, and the largest error in px.

    Also the angle to which they were compared, where the image may show more.
    """
    widest = min(lens.widest_rad, WIDEST_RAD if radius_px is not None else UNKNOWN_SIZE_RAD)
    angle = np.linspace(0, widest, STEPS + 1)[1:]
    with np.errstate(all="ignore"):
        radius = lens.radius(angle, parameters)
    rising = np.isfinite(radius) & (np.diff(radius, prepend=0) > 0)
    seen = np.logical_and.accumulate(rising)
    beyond = radius * focal_px > (np.inf if radius_px is None else radius_px)
    whole = bool((seen & beyond).any())  # of the image
    seen &= ~beyond
    if seen.sum() <= 2 * FISHEYE_TERMS:
        raise format_error(
            "These numbers do not describe a lens.", "Check them, or calibrate with equidistant."
        )
    angle, radius = angle[seen], radius[seen]
    powers = angle[:, None] ** np.arange(1, 2 * FISHEYE_TERMS + 2, 2)
    found, *_ = np.linalg.lstsq(powers, radius, rcond=None)
    error_px = float(np.abs(powers @ found - radius).max() * focal_px)
    terms = tuple(float(v) for v in found[1:] / found[0])
    return terms, float(found[0]), error_px, None if whole else float(np.degrees(angle[-1]))
