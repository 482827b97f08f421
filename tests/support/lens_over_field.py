"""The camera whose lens the board of board_views.py tells, hung over a plain field and clicked."""

import numpy as np

from tests.support.board_views import SIZE, TRUTH
from tests.support.examples import example_parameters
from touchline.core.field import BORDERS
from touchline.models import raw_from_field
from touchline.models.ray_camera import BrownConrady

FIELD = {
    "name": "plain-4x3",
    "title": "Plain",
    "length_mm": 4000,
    "width_mm": 3000,
    "lines": [],
    "arcs": [],
    "landmarks": {},
    "regions": {"full": {"x": [-2000, 2000], "y": [-1500, 1500], "rotate": 0}},
}


def clicks_through_the_lens() -> tuple[BrownConrady, dict]:
    """36 clicks on the borders of a plain field, seen through the board's camera a little tilted."""
    where = {
        **list(example_parameters())[1],
        "focal_px": TRUTH.focal_px,
        "centre_px": TRUTH.centre_px,
    }
    model = BrownConrady(lens_terms=TRUTH.terms, **where)
    rng = np.random.default_rng(0)
    observations = []
    for name in BORDERS:
        line = model.region.border(name)
        places = line.start + rng.uniform(size=(9, 1)) * np.subtract(line.end, line.start)
        clicks = raw_from_field(model, places) + rng.normal(0, 0.3, (9, 2))
        seen_ones = clicks[np.isfinite(clicks).all(axis=1)].tolist()
        observations.append({"feature": name, "kind": "line", "points": seen_ones})
    return model, {
        "field": "plain-4x3",
        "region": "full",
        "image_size": list(SIZE),
        "model": "brown-conrady",
        "observations": observations,
    }
