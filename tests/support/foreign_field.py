"""A field that is in no rule book, and pictures of it."""

from dataclasses import replace
from functools import cache

import pytest

from tests.support import auto_scenes
from tests.support.auto_scenes import SceneSpec, SeenScene, fields, scene_of
from touchline.core.field import Field
from touchline.core.field_json import field_from_json

LENGTH_MM, WIDTH_MM, AREA_MM, RADIUS_MM = 8000.0, 4900.0, (1300.0, 900.0), 800.0
NAME = "ssl-div-b"  # under which it is drawn
SPEC = SceneSpec(3, NAME, "full", "mild", (1224, 1024), 5500.0, 10.0, 0.0, 3.0, 0.7, 2.0, 0.1, 4, 0)


def foreign_field(is_round: bool = True) -> Field:
    """Return the field. is_round: whether it has a centre circle."""
    x, y = LENGTH_MM / 2, WIDTH_MM / 2
    (deep, wide), lines = (
        AREA_MM,
        {
            "touch-line-top": ((-x, y), (x, y)),
            "touch-line-bottom": ((-x, -y), (x, -y)),
            "goal-line-left": ((-x, -y), (-x, y)),
            "goal-line-right": ((x, -y), (x, y)),
            "halfway-line": ((0, -y), (0, y)),
        },
    )
    for side, sign in (("left", -1), ("right", 1)):
        near, far = sign * x, sign * (x - deep)
        lines |= {
            f"goal-area-{side}-front": ((far, -wide), (far, wide)),
            f"goal-area-{side}-top": ((near, wide), (far, wide)),
            f"goal-area-{side}-bottom": ((near, -wide), (far, -wide)),
        }
    circle = {
        "name": "centre-circle",
        "centre": [0, 0],
        "radius_mm": RADIUS_MM,
        "start_deg": 0,
        "end_deg": 360,
        "width_mm": 30,
    }
    return field_from_json(
        {
            "name": NAME,
            "length_mm": LENGTH_MM,
            "width_mm": WIDTH_MM,
            "arcs": [circle] if is_round else [],
            "lines": [
                {"name": name, "from": start, "to": end, "width_mm": 30}
                for name, (start, end) in lines.items()
            ],
            "regions": {
                "full": {"x": [-x, x], "y": [-y, y]},
                "half-left": {"x": [-x, 0], "y": [-y, y]},
            },
        }
    )


@cache
def foreign_scene(is_round: bool = True, region: str = "full") -> SeenScene:
    """Return a picture of a hall that has this field."""
    with pytest.MonkeyPatch.context() as hall:
        hall.setattr(auto_scenes, "fields", lambda: {**fields(), NAME: foreign_field(is_round)})
        return scene_of(replace(SPEC, region=region))
