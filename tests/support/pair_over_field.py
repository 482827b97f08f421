"""Two simulated cameras over one field, each with its own half, calibrated from clicks; and what both of them see."""

from functools import cache
from pathlib import Path

import numpy as np

from tests.support.sim_clicks import border_observations
from tests.support.simulated_source import simulated_source
from touchline.core.records import Calibration
from touchline.sources.sim.camera import SimCamera
from touchline.store.fields import FieldRepository
from touchline.workflows.calibration_request import CalibrationRequest

FIELDS = FieldRepository(Path("no-fields-of-our-own"))
FIELD = FIELDS["ssl-div-b"]
HALVES = ("half-left", "half-right")


@cache
def cameras() -> tuple[SimCamera, ...]:
    url = "sim://ssl-div-b?cameras=2&camera={}&lens=half&tilt=8"
    return tuple(simulated_source(url.format(n), FIELDS).camera for n in (0, 1))


@cache
def calibrations(model: str = "brown-conrady") -> tuple[Calibration, Calibration]:
    """From 12 exact clicks a border, with the heights as they are: what is left is the models' own."""
    made = []
    for camera, half in zip(cameras(), HALVES, strict=True):
        options = (
            {}
            if model == "polynomial"
            else {"height_mm": {"value": camera.position_mm[2], "sigma": 5.0}}
        )
        region = FIELD.region(half)
        task = CalibrationRequest(
            border_observations(camera, region, 12),
            FIELD,
            region,
            camera.image_size,
            model,
            options,
        )
        made.append(task.record(task.run()))
    return made[0], made[1]


def matches(
    count: int = 60,
    noise_px: float = 0.3,
    heights_mm: tuple[float, float] = (0.0, 0.0),
    mistakes: int = 0,
) -> tuple[list, list]:
    """Things near the halfway line at heights in between, as both cameras see them; the first ones matched wrongly."""
    rng = np.random.default_rng(0)
    places = np.column_stack(
        [
            rng.uniform(-400, 400, count),
            rng.uniform(-2500, 2500, count),
            rng.uniform(*heights_mm, count),
        ]
    )
    a, b = (
        camera.raw_from_field(places) + rng.normal(0, noise_px, (count, 2)) for camera in cameras()
    )
    b[:mistakes] = rng.uniform(100, 900, (mistakes, 2))
    return a.tolist(), b.tolist()
