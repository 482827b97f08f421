"""Calibrations to be exported, of every example of every model, over a field of its own; and what is seen of it."""

import json
from dataclasses import replace

import numpy as np

from tests.support.examples import examples
from tests.support.fields import plain_field
from touchline.core.field import Field, Region
from touchline.core.records import Calibration
from touchline.formats import FORMATS
from touchline.models import MODELS, CameraModel, RayModel, parameters_json

EXAMPLES = [(name, i) for name in MODELS for i, _ in enumerate(examples(name))]
LENS_FORMATS = [name for name in FORMATS if FORMATS[name].lenses]
READABLE = [name for name in FORMATS if FORMATS[name].read]
OF_LEAGUE = [name for name in LENS_FORMATS if "ssl" in FORMATS[name].lenses]
RAY_EXAMPLES = [(name, i) for name, i in EXAMPLES if issubclass(MODELS[name], RayModel)]


def field_around(region: Region) -> Field:
    """The plain field, so large that the region lies within it."""
    return replace(
        plain_field(region),
        length_mm=2 * float(np.abs(region.x_mm).max()),
        width_mm=2 * float(np.abs(region.y_mm).max()),
    )


def model_of(name: str, index: int) -> CameraModel:
    return examples(name)[index]


def of_model(model: CameraModel, **changes) -> Calibration:
    """A calibration without clicks."""
    made = Calibration(
        "c0ffee",
        3,
        "north",
        field_around(model.region).to_json(),
        model.region.name,
        model.region.rotate_deg,
        model.NAME,
        json.loads(json.dumps(parameters_json(model))),
        model.image_size,
        model.corrected_size,
        (),
        {},
        {"rms_px": None},
        "2026-01-01T00:00:00Z",
        "0.1.0",
    )
    return replace(made, **changes)


def example(name: str, index: int) -> Calibration:
    return of_model(model_of(name, index))


def places(region: Region, z_mm: float = 0.0, n: int = 15) -> np.ndarray:
    """(n², 3) field mm over the region."""
    u, v = np.meshgrid(np.linspace(0, region.width_mm, n), np.linspace(0, region.height_mm, n))
    flat = region.field_from_region(np.stack([u, v], axis=-1)).reshape(-1, 2)
    return np.concatenate([flat, np.full((len(flat), 1), z_mm)], axis=1)


def seen_places(model: RayModel, z_mm: float = 0.0) -> np.ndarray:
    """Those that its picture shows."""
    found = places(model.region, z_mm)
    pixels = model.project(found)
    inside = ((pixels > -0.5) & (pixels < np.array(tuple(model.image_size)) - 0.5)).all(axis=1)
    return found[inside]
