"""Draw the field: carpet, lines of their true width, goals."""

import numpy as np
import viser

from app.core.field import Field
from app.scene import METRES, NO_SHADOWS
from app.scene.geometry.shapes import carpet, goals, paint

# Under viser's lights they come out about twice as bright.
GREEN, BLACK, WHITE, POST = (12, 58, 26), (14, 15, 16), (245, 245, 245), (235, 200, 60)
BELOW_MM = 8.0  # a card's depth buffer cannot tell two planes at the same height apart
POST_MM = 20.0


def draw_ground(scene: viser.SceneApi, field: Field) -> None:
    """Draw under /field."""
    ground, lines, posts = carpet(field), paint(field), goals(field)
    scene.add_mesh_simple("/field/carpet", _metres(ground.vertices - [0, 0, BELOW_MM]), ground.faces, side="double",
                          color=BLACK if field.extras.get("carpet") == "black" else GREEN, **NO_SHADOWS)
    scene.add_mesh_simple("/field/lines", _metres(lines.vertices), lines.faces, color=WHITE, side="double",
                          **NO_SHADOWS)
    if len(posts):
        scene.add_line_segments("/field/goals", _metres(posts), colors=POST, thickness=POST_MM * METRES)


def _metres(points_mm: np.ndarray) -> np.ndarray:
    return (points_mm * METRES).astype(np.float32)
