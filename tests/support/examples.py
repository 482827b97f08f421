"""Example cameras of every model, in an order that tests and golden files count on."""

import json
from functools import cache
from pathlib import Path

from app.models import MODELS, CameraModel
from app.models.thin_plate import ThinPlate


@cache
def examples(name: str) -> tuple[CameraModel, ...]:
    """Return the model's own examples; for the thin-plate spline also one that bends."""
    return (*MODELS[name].examples(), *([bent_thin_plate()] if name == ThinPlate.NAME else []))


def bent_thin_plate() -> ThinPlate:
    """Return a thin-plate model that is its own best fit, so that its own exact points return it.

    The homography underneath is the one that fits the bent view best, and the spline passes through every click. Both
    depend on the clicks, so a thin-plate model is its own fit only for clicks like those it was made from: eleven a
    border and a 5 × 5 grid of landmarks, as the laws click. It is what five fits of a mild lens, each to what the one
    before sees, ended at; kept as numbers, so that what is written of it does not depend on a processor's rounding.
    """
    return ThinPlate.from_parameters(json.loads(Path(__file__).with_name("bent_thin_plate.json").read_text()))
