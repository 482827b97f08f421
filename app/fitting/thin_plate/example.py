"""A bent example that is its own best fit, so that the law "its own exact points return it" can hold.

The homography underneath is the one that fits the bent view best, and the spline passes through every click. Both
depend on the clicks, so a thin-plate model is its own fit only for clicks like those it was made from: eleven a border
and a 5 × 5 grid of landmarks, as the laws click. Fitting what it sees, again and again, ends at such a model.
"""

from functools import cache

import numpy as np

from app.core.field import BORDERS, Field, Landmark
from app.core.geometry import ImageSize
from app.core.records import Observation, Observations
from app.models import CameraModel, raw_from_field
from app.models.brown_conrady import BrownConrady
from app.models.thin_plate import ThinPlate

TURNS = 5  # each comes a hundred times nearer
STEPS = np.linspace(-0.8, 0.8, 5)


@cache
def bent_example() -> ThinPlate:
    """What a thin-plate spline makes of a mild lens."""
    seen: CameraModel = next(iter(BrownConrady.examples()))
    region, size = seen.region, ImageSize(*seen.image_size)
    middle = np.array([sum(region.x_mm), sum(region.y_mm)]) / 2
    half = np.array([np.ptp(region.x_mm), np.ptp(region.y_mm)]) / 2
    spots = [tuple(map(float, middle + half * (a, b))) for a in STEPS for b in STEPS]
    field = Field("example", "Example", *map(float, 2 * half), {}, {},
                  {f"spot-{i}": Landmark(f"spot-{i}", spot) for i, spot in enumerate(spots)}, {region.name: region})
    for _ in range(TURNS):
        seen = ThinPlate.fit(_clicks(seen, field), field, region, size, {"smoothing": 0.0, "robust": False}).model
    return seen


def _clicks(model: CameraModel, field: Field) -> Observations:
    (region,) = field.regions.values()
    share = np.linspace(0.02, 0.98, 11)[:, None]
    borders = ((name, region.border(name)) for name in BORDERS)
    lines = [Observation(name, "line", raw_from_field(model, np.array(b.start) * (1 - share) + np.array(b.end) * share))
             for name, b in borders]
    spots = [Observation(m.name, "landmark", raw_from_field(model, np.array([m.position])))
             for m in field.landmarks.values()]
    return (*lines, *spots)
