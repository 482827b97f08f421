"""A folder of pictures of one simulated camera, its field's lines drawn, with the clicks beside each."""

import json
from functools import cache
from pathlib import Path

import cv2
import numpy as np

from tests.support.sim_clicks import border_observations, line_clicks
from touchline.core.geometry import ImageSize
from touchline.sources.sim.actors import Motion
from touchline.sources.sim.camera import LENSES, SimCamera
from touchline.sources.sim.render import Rendering
from touchline.store.fields import load_fields

FIELD = load_fields()["ssl-div-b"]
REGION = FIELD.regions["full"]
SIZE = ImageSize(640, 480)
HALFWAY = (
    FIELD.lines["halfway-line"]
    if "halfway-line" in FIELD.lines
    else next(iter(FIELD.lines.values()))
)


@cache
def camera(lens: str = "strong", roll_deg: float = 0.0) -> SimCamera:
    return SimCamera.above(
        REGION, SIZE, LENSES[lens], height_mm=6500, tilt_deg=4, roll_deg=roll_deg
    )


@cache
def rendering(lens: str = "strong", roll_deg: float = 0.0) -> Rendering:
    return Rendering.of(camera(lens, roll_deg), FIELD, REGION, Motion(robots=4))


def picture(path: Path, index: int = 0, lens: str = "strong", roll_deg: float = 0.0) -> Path:
    assert cv2.imwrite(str(path), rendering(lens, roll_deg).frame(index))
    return path


def clicks(path: Path, seed: int = 0, lens: str = "strong", roll_deg: float = 0.0, **more) -> Path:
    """36 clicks on the borders and nine on a line inside, 0.2 px noise."""
    rng, seen = np.random.default_rng(seed), camera(lens, roll_deg)
    observations = [o.to_json() for o in border_observations(seen, REGION, 9, 0.2, rng)]
    inside = line_clicks(seen, HALFWAY, 9, 0.2, rng)[0]
    observations.append({"feature": HALFWAY.name, "kind": "line", "points": inside.tolist()})
    path.write_text(
        json.dumps(
            {
                "field": FIELD.name,
                "region": "full",
                "image_size": list(SIZE),
                "observations": observations,
                **more,
            }
        )
    )
    return path


def folder_of(path: Path, count: int) -> Path:
    """So many pictures, north-1.png and so on, each with its clicks."""
    path.mkdir()
    for number in range(1, count + 1):
        picture(path / f"north-{number}.png", number)
        clicks(path / f"north-{number}.json", number)
    return path
