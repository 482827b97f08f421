"""Draw detected balls, robots and markers; the scene itself detects nothing."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import viser
import viser.transforms as tf

from app.core.field import Field
from app.scene import METRES

BALL, BALL_MM = (255, 120, 20), 21.5
ROBOT_MM = {"radius_mm": 90.0, "height_mm": 150.0}
TEAMS = {"yellow": (240, 210, 50), "blue": (60, 110, 240)}
OTHERS = (120, 125, 130)
MARKER_MM, THIN_MM = 25.0, 4.0
AHEAD_MM = 60.0  # how far a robot's front is drawn beyond its rim


def draw_detections(scene: viser.SceneApi, name: str, field: Field, items: Sequence[Mapping[str, Any]],
                ) -> list[viser.SceneNodeHandle]:
    """items: as core/detections writes them, field mm; those without a position are left out."""
    draw = {"ball": _ball, "robot": _robot, "marker": _marker}
    return [draw[one["kind"]](scene, f"{name}/{number}", field, one) for number, one in enumerate(items)
            if one["kind"] in draw and one["x_mm"] is not None and one["y_mm"] is not None]


def _at(one: Mapping[str, Any], z_m: float) -> tuple[float, float, float]:
    return one["x_mm"] * METRES, one["y_mm"] * METRES, z_m


def _ball(scene: viser.SceneApi, name: str, field: Field, one: Mapping[str, Any]) -> viser.SceneNodeHandle:
    radius = field.extras.get("ball", {}).get("radius_mm", BALL_MM) * METRES
    return scene.add_icosphere(name, radius, BALL, subdivisions=2, position=_at(one, radius))


def _robot(scene: viser.SceneApi, name: str, field: Field, one: Mapping[str, Any]) -> viser.SceneNodeHandle:
    size = {**ROBOT_MM, **field.extras.get("robot", {})}
    radius, height = size["radius_mm"] * METRES, size["height_mm"] * METRES
    colour = TEAMS.get(one.get("team", ""), OTHERS)
    turn = tf.SO3.from_z_radians(float(np.radians(one.get("orientation_deg") or 0.0)))
    body = scene.add_cylinder(name, radius, height, colour, position=_at(one, height / 2), wxyz=turn.wxyz)
    if one.get("orientation_deg") is not None:
        scene.add_box(f"{name}/front", (0, 0, 0), (AHEAD_MM * METRES, radius / 3, height / 4),
                      position=(radius, 0.0, height / 2))
    if one.get("id") is not None:
        scene.add_label(f"{name}/label", str(one["id"]), position=(0.0, 0.0, height / 2), font_screen_scale=0.8)
    return body


def _marker(scene: viser.SceneApi, name: str, field: Field, one: Mapping[str, Any]) -> viser.SceneNodeHandle:
    """Draw a patch of a team's colour at its own height."""
    return scene.add_cylinder(name, MARKER_MM * METRES, THIN_MM * METRES, TEAMS.get(one.get("team", ""), OTHERS),
                              position=_at(one, one.get("z_mm", 0.0) * METRES))
