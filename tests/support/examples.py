"""Example cameras of every model, in an order that tests and golden files count on."""

import json
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from touchline.core.field import Region
from touchline.core.geometry import ImageSize
from touchline.models import CameraModel
from touchline.models.contract import RECTANGLE_FIELDS
from touchline.models.homography import Homography, normalise
from touchline.models.polynomial import Curve, Polynomial
from touchline.models.ray_camera import lens_model
from touchline.models.rotation import matrix_from_vector
from touchline.models.thin_plate import REACHES, ThinPlate

FULL = Region("full", (-2000.0, 2000.0), (-1500.0, 1500.0), 0)
HALF = Region("half", (0.0, 3025.0), (-2025.0, 2025.0), 90)
LENS_TERMS = {
    # a strong barrel, a pincushion, and nearly no lens at all
    "division": ((-0.25,), (0.06,), (-1e-9,)),
    # a strong barrel, a mild pincushion with tangential terms, and a rational wide angle
    "brown-conrady": (
        (-0.28, 0.09, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        (0.06, 0.01, 0.001, -0.002, 0.003, 0.0, 0.0, 0.0),
        (0.35, 0.05, 0.0, 0.0, 0.0, 0.68, 0.0, 0.0),
    ),
    # a plain equidistant lens, a usual wide angle, and a strong one
    "fisheye": ((0.0, 0.0, 0.0, 0.0), (-0.02, 0.004, -0.001, 0.0), (0.08, -0.03, 0.01, -0.002)),
    # a strong barrel, a pincushion (negative here), and nearly no lens at all
    "ssl": ((0.3,), (-0.05,), (1e-9,)),
}


@cache
def examples(name: str) -> tuple[CameraModel, ...]:
    """Return a few real cameras; for the thin-plate spline also one that bends."""
    return (*plain_examples(name), *([bent_thin_plate()] if name == ThinPlate.NAME else []))


@cache
def plain_examples(name: str) -> tuple[CameraModel, ...]:
    """Return those that need no numbers kept in a file."""
    if name in LENS_TERMS:
        return tuple(
            lens_model(name)(lens_terms=terms, **common)
            for terms, common in zip(LENS_TERMS[name], example_parameters(), strict=True)
        )
    return tuple(
        {"homography": _homographies, "polynomial": _polynomials, "thin-plate": _thin_plates}[
            name
        ]()
    )


def example_parameters() -> Iterator[dict[str, Any]]:
    """Yield the parameters of three cameras but for their lenses: straight down, tilted, tilted over half a field."""
    size = ImageSize(1280, 1024)
    down = {
        "aspect": 1.0,
        "centre_px": size.centre,
        "width_px": 1280.0,
        "height_px": 960.0,
        "n_rectangles_x": 10,
        "n_rectangles_y": 8,
        "region": FULL,
        "image_size": size,
    }
    yield {
        **down,
        "focal_px": 900.0,
        "rotation": (float(np.pi), 0.0, 0.0),
        "position_mm": (30.0, -20.0, 4150.0),
    }
    yield {
        **down,
        "focal_px": 850.0,
        "rotation": (2.85, 0.05, 0.1),
        "position_mm": (-150.0, -900.0, 4000.0),
    }
    yield {
        **down,
        "focal_px": 760.0,
        "aspect": 1.0,
        "width_px": 1280.0,
        "height_px": 956.0,
        "region": HALF,
        "rotation": (-2.2, 2.2, 0.12),
        "position_mm": (1400.0, 100.0, 4300.0),
    }


def _homographies() -> Iterator[Homography]:
    """Yield pinhole cameras: straight down, tilted, and tilted over half a field."""
    for common in example_parameters():
        rotation, position = (
            matrix_from_vector(np.array(common["rotation"])),
            np.array(common["position_mm"]),
        )
        focal, (x, y) = common["focal_px"], common["centre_px"]
        camera = np.array([[focal, 0, x], [0, focal, y], [0, 0, 1.0]])
        raw_from_field = (
            camera
            @ rotation
            @ np.array([[1, 0, -position[0]], [0, 1, -position[1]], [0, 0, -position[2]]])
        )
        yield Homography(
            field_from_raw=normalise(np.linalg.inv(raw_from_field)),
            **{name: common[name] for name in RECTANGLE_FIELDS},
        )


def _polynomials() -> Iterator[Polynomial]:
    """Yield a strong barrel over half a field, a mild pincushion, and a tilted camera with a cubic relation."""
    size = ImageSize(780, 580)
    y, x = (size.height - 1) / 2, 360.0
    yield Polynomial(
        Curve((62.0, 2.0, 11.0, 0.5), y, 290.0),
        Curve((703.0, -1.5, -12.0), y, 290.0),
        Curve((48.0, -8.0, 9.0, 0.4, 1.0), x, x),
        Curve((524.0, -7.0, -13.0), x, x),
        720.0,
        538.0,
        10,
        7,
        (0.0, 5.625),
        (0.0, 3025.0),
        HALF,
        size,
    )
    size, y, x = ImageSize(1280, 1024), 511.5, 580.0
    yield Polynomial(
        Curve((70.0, 0.0, -6.0), y, 512.0),
        Curve((1210.0, 3.0, 7.0), y, 512.0),
        Curve((80.0, 1.0, -5.0), x, x),
        Curve((935.0, -2.0, 6.0), x, x),
        1160.0,
        870.0,
        8,
        6,
        (0.0, 3.4482758620689653),
        (0.0, 3000.0),
        FULL,
        size,
    )
    yield Polynomial(
        Curve((120.0, -60.0, 4.0), y, 512.0),
        Curve((1160.0, 55.0, -5.0), y, 512.0),
        Curve((90.0, 3.0, 8.0), x, x),
        Curve((930.0, -4.0, -9.0), x, x),
        1160.0,
        870.0,
        8,
        6,
        (0.0, 3.4482758620689653),
        (0.0, 3600.0, -900.0, 300.0),
        FULL,
        size,
    )


def _thin_plates() -> Iterator[ThinPlate]:
    """Yield two that bend nothing."""
    for base in (plain_examples("homography")[1], plain_examples("division")[2]):
        yield ThinPlate(base.NAME, base, (), (), 3 * ((0.0, 0.0),), REACHES[0])


def bent_thin_plate() -> ThinPlate:
    """Return a thin-plate model that an earlier version has fitted.

    The homography underneath is the one that fits the bent view best, and the spline passes through every click. Both
    depend on the clicks, so a thin-plate model is its own fit only for clicks like those it was made from: eleven a
    border and a 5 × 5 grid of landmarks, as the laws click. It is what five fits of a mild lens, each to what the one
    before sees, ended at; kept as numbers, so that what is written of it does not depend on a processor's rounding.
    """
    return ThinPlate.from_parameters(
        json.loads(Path(__file__).with_name("bent_thin_plate.json").read_text())
    )
