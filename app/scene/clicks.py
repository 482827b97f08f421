"""Draw clicked points: rays from the camera to the carpet, and residuals as arrows."""

import numpy as np
import viser
from numpy.typing import NDArray

from app.core.field import Field
from app.core.text_format import format_number
from app.scene import METRES
from app.scene.cameras import Colour, Handle
from app.scene.geometry.scene_camera import SceneCamera

RIGHT, OUTLIER, MOVED = (255, 230, 60), (230, 50, 50), (255, 90, 220)
RAY_MM, SHAFT_MM, HEAD_MM = 3.0, 9.0, 26.0
ABOVE_MM = 12.0


def draw_rays(scene: viser.SceneApi, name: str, camera: SceneCamera, colour: Colour) -> Handle | None:
    """Draw each point's ray; None where there are none."""
    if camera.frustum is None or not len(camera.ray_hits.points):
        return None
    rays = camera.ray_hits.rays_from(camera.frustum.position_mm)
    colours = np.where(camera.ray_hits.outlier[:, None, None], OUTLIER, colour).astype(np.uint8)
    return scene.add_line_segments(name, (rays * METRES).astype(np.float32),
                                   colors=np.broadcast_to(colours, (len(rays), 2, 3)), thickness=RAY_MM * METRES)


def draw_residuals(scene: viser.SceneApi, name: str, camera: SceneCamera, scale: float) -> Handle | None:
    """Draw residuals, enlarged by scale; outliers are red."""
    if not len(camera.ray_hits.points):
        return None
    colours = np.where(camera.ray_hits.outlier[:, None], OUTLIER, RIGHT).astype(np.uint8)
    return _arrows(scene, name, camera.ray_hits.arrows(scale), colours)


def draw_pose_change(scene: viser.SceneApi, name: str, camera: SceneCamera, scale: float) -> Handle | None:
    """Draw how far the newer version puts things from where the older one did, enlarged by scale."""
    if camera.pose_change is None or not len(camera.pose_change.arrows):
        return None
    arrows = camera.pose_change.scaled(scale)
    return _arrows(scene, name, arrows, np.full((len(arrows), 3), MOVED, np.uint8))


def draw_scale(scene: viser.SceneApi, field: Field, scale: float) -> Handle:
    """Write the arrows' scale beside the field: a screenshot must tell it without the page."""
    beside = -(field.width_mm / 2 + field.extras.get("boundary", {}).get("touch_mm", 0.0))
    return scene.add_label("/scale", f"arrows × {format_number(scale)}", position=(0.0, beside * METRES, 0.0),
                           anchor="top-center", font_screen_scale=0.9)


def _arrows(scene: viser.SceneApi, name: str, arrows_mm: NDArray[np.float64], colours: NDArray[np.uint8],
            ) -> Handle:
    raised = (arrows_mm + np.array([0.0, 0.0, ABOVE_MM])) * METRES
    return scene.add_arrows(name, raised.astype(np.float32), colors=colours, shaft_radius=SHAFT_MM * METRES / 2,
                            head_radius=HEAD_MM * METRES / 2, head_length=HEAD_MM * METRES)
