"""Clicked points: rays from the camera to where they land, and arrows to where they should have landed."""

import numpy as np
import viser
from numpy.typing import NDArray

from app.core.field import Field
from app.core.text_format import format_number
from app.scene import METRES
from app.scene.cameras import Colour
from app.scene.geometry.scene_camera import Standing

RIGHT, STRAY, MOVED = (255, 230, 60), (230, 50, 50), (255, 90, 220)
RAY_MM, SHAFT_MM, HEAD_MM = 3.0, 9.0, 26.0
ABOVE_MM = 12.0


def draw_rays(scene: viser.SceneApi, name: str, standing: Standing, colour: Colour) -> viser.SceneNodeHandle | None:
    """None where there are no rays."""
    if standing.hung is None or not len(standing.landings.feet):
        return None
    rays = standing.landings.rays_from(standing.hung.position_mm)
    colours = np.where(standing.landings.stray[:, None, None], STRAY, colour).astype(np.uint8)
    return scene.add_line_segments(name, (rays * METRES).astype(np.float32),
                                   colors=np.broadcast_to(colours, (len(rays), 2, 3)), thickness=RAY_MM * METRES)


def draw_misses(scene: viser.SceneApi, name: str, standing: Standing, scale: float) -> viser.SceneNodeHandle | None:
    """Residuals, so many times their length; strays are red."""
    if not len(standing.landings.feet):
        return None
    colours = np.where(standing.landings.stray[:, None], STRAY, RIGHT).astype(np.uint8)
    return _arrows(scene, name, standing.landings.arrows(scale), colours)


def draw_moved(scene: viser.SceneApi, name: str, standing: Standing, scale: float) -> viser.SceneNodeHandle | None:
    """Where the older version puts what the newer one puts elsewhere, so many times as far."""
    if standing.moved is None or not len(standing.moved.arrows):
        return None
    arrows = standing.moved.scaled(scale)
    return _arrows(scene, name, arrows, np.full((len(arrows), 3), MOVED, np.uint8))


def draw_scale(scene: viser.SceneApi, field: Field, scale: float) -> viser.SceneNodeHandle:
    """Beside the field, how many times arrows are enlarged: a picture of it goes where no page tells."""
    beside = -(field.width_mm / 2 + field.extras.get("boundary", {}).get("touch_mm", 0.0))
    return scene.add_label("/scale", f"arrows × {format_number(scale)}", position=(0.0, beside * METRES, 0.0),
                           anchor="top-center", font_screen_scale=0.9)


def _arrows(scene: viser.SceneApi, name: str, arrows_mm: NDArray[np.float64], colours: NDArray[np.uint8],
            ) -> viser.SceneNodeHandle:
    raised = (arrows_mm + np.array([0.0, 0.0, ABOVE_MM])) * METRES
    return scene.add_arrows(name, raised.astype(np.float32), colors=colours, shaft_radius=SHAFT_MM * METRES / 2,
                            head_radius=HEAD_MM * METRES / 2, head_length=HEAD_MM * METRES)
