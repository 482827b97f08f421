"""A ball and robots, where somebody has detected them: the scene invents none and looks for none."""

from collections.abc import Mapping, Sequence
from typing import Any

import viser

from app.field import Field
from app.scene import METRES

BALL, BALL_MM = (255, 120, 20), 21.5
ROBOT_MM = {"radius_mm": 90.0, "height_mm": 150.0}
TEAMS = {"yellow": (240, 210, 50), "blue": (60, 110, 240)}
OTHERS = (120, 125, 130)


def draw_things(scene: viser.SceneApi, field: Field, things: Sequence[Mapping[str, Any]],
                ) -> list[viser.SceneNodeHandle]:
    """things: {"kind": "ball" or "robot", "x_mm", "y_mm", "team", "label"} in the field frame, as they stand on it."""
    return [_ball(scene, f"/things/{n}", field, one) if one["kind"] == "ball" else
            _robot(scene, f"/things/{n}", field, one) for n, one in enumerate(things)]


def _ball(scene: viser.SceneApi, name: str, field: Field, one: Mapping[str, Any]) -> viser.SceneNodeHandle:
    radius = field.extras.get("ball", {}).get("radius_mm", BALL_MM) * METRES
    return scene.add_icosphere(name, radius, BALL, position=(one["x_mm"] * METRES, one["y_mm"] * METRES, radius))


def _robot(scene: viser.SceneApi, name: str, field: Field, one: Mapping[str, Any]) -> viser.SceneNodeHandle:
    size = {**ROBOT_MM, **field.extras.get("robot", {})}
    height = size["height_mm"] * METRES
    handle = scene.add_cylinder(name, size["radius_mm"] * METRES, height, TEAMS.get(one.get("team"), OTHERS),
                                position=(one["x_mm"] * METRES, one["y_mm"] * METRES, height / 2))
    if one.get("label"):
        scene.add_label(f"{name}/label", str(one["label"]), position=(0.0, 0.0, height / 2))
    return handle
