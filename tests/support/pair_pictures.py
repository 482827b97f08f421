"""Two simulated cameras that look at one half of a field from either side, at one moment; and what both see."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from tests.support.sim_clicks import border_clicks
from tests.support.sim_truth import robots_in
from tests.support.simulated_source import simulated_source
from touchline.sources.sim.source import SimSource
from touchline.store.fields import FieldRepository

FIELD = FieldRepository(Path("no-fields-of-our-own"))["ssl-div-b"]
REGION = "half-right"
TILTS = (14, -12)
# Crossings and ends of painted lines, field mm.
CARPET = [
    (0, 3000),
    (0, -3000),
    (4500, 3000),
    (4500, -3000),
    (3500, 1000),
    (3500, -1000),
    (4500, 1000),
    (4500, -1000),
    (0, 0),
    (0, 500),
    (0, -500),
    (500, 0),
]


@dataclass(frozen=True, eq=False)
class PairSeen:
    """pictures: PNG bytes, left and right. a, b (n, 2) raw px: the same things in both, at z_mm (n,)."""

    pictures: tuple[bytes, bytes]
    a: np.ndarray
    b: np.ndarray
    z_mm: np.ndarray


@cache
def sources() -> tuple[SimSource, SimSource]:
    left, right = (
        simulated_source(
            f"sim://ssl-div-b?region={REGION}&tilt={tilt}&lens=half&robots=12&seed=3",
            {FIELD.name: FIELD},
        )
        for tilt in TILTS
    )
    return left, right


@cache
def pair_seen() -> PairSeen:
    """Twelve marks on the carpet, then the twelve robots' hats."""
    hats = [(robot.x_mm, robot.y_mm, robot.z_mm) for robot in robots_in(sources()[0].rendering, 0)]
    places = np.array([(*spot, 0.0) for spot in CARPET] + hats)
    a, b = (source.camera.raw_from_field(places) for source in sources())
    pictures = [
        cv2.imencode(".png", source.rendering.frame(0))[1].tobytes() for source in sources()
    ]
    return PairSeen((pictures[0], pictures[1]), a, b, places[:, 2])


def calibration_body(which: int, snapshot: str, shifted_px: float = 0.0) -> dict[str, Any]:
    """What POST /calibrations takes: clicks of the left (0) or right (1) camera's borders, exact or shifted."""
    camera = sources()[which].camera
    points = border_clicks(camera, FIELD.region(REGION), 11)
    return {
        "snapshot": snapshot,
        "field": FIELD.name,
        "region": REGION,
        "model": "brown-conrady",
        "options": {"height_mm": {"value": camera.position_mm[2], "sigma": 5.0}},
        "observations": [
            {"feature": name, "kind": "line", "points": (found[1:-1] + shifted_px).tolist()}
            for name, found in points.items()
        ],
    }
