"""Draw what is not a camera: the field, clicked points, detections, board poses, and surfaces of expected error."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import viser
import viser.transforms as tf
from numpy.typing import NDArray

from touchline.core.field import Field
from touchline.core.text_format import format_number
from touchline.imaging.heat_map import TICKS
from touchline.scene import METRES, NO_SHADOWS
from touchline.scene.cameras import Colour, Handle, add_quad, viser_scale
from touchline.scene.geometry.boards import BoardViews
from touchline.scene.geometry.error_surface import ErrorSurface
from touchline.scene.geometry.scene_camera import SceneCamera
from touchline.scene.geometry.shapes import carpet, goals, paint

# Under viser's lights they come out about twice as bright.
GREEN, BLACK, WHITE, POST = (12, 58, 26), (14, 15, 16), (245, 245, 245), (235, 200, 60)
BELOW_MM = 8.0  # a card's depth buffer cannot tell two planes at the same height apart
POST_MM = 20.0
RIGHT, OUTLIER, MOVED = (255, 230, 60), (230, 50, 50), (255, 90, 220)
RAY_MM, SHAFT_MM, HEAD_MM = 3.0, 9.0, 26.0
CLICKS_ABOVE_MM = 12.0
BALL, BALL_MM = (255, 120, 20), 21.5
ROBOT_MM = {"radius_mm": 90.0, "height_mm": 150.0}
TEAMS = {"yellow": (240, 210, 50), "blue": (60, 110, 240)}
OTHERS = (120, 125, 130)
MARKER_MM, THIN_MM = 25.0, 4.0
AHEAD_MM = 60.0  # how far a robot's front is drawn beyond its rim
CAMERA, BOARD, EDGE = (255, 160, 40), (70, 160, 255), (20, 60, 120)
EDGE_MM = 3.0
FACES = np.array([[0, 1, 2], [0, 2, 3]])
SURFACE_ABOVE_MM = 6.0


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
    raised = (arrows_mm + np.array([0.0, 0.0, CLICKS_ABOVE_MM])) * METRES
    return scene.add_arrows(name, raised.astype(np.float32), colors=colours, shaft_radius=SHAFT_MM * METRES / 2,
                            head_radius=HEAD_MM * METRES / 2, head_length=HEAD_MM * METRES)


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


def draw_boards(scene: viser.SceneApi, boards: BoardViews) -> None:
    """Draw under /boards; the world is the camera's frame."""
    scene.add_camera_frustum("/boards/camera", fov=boards.fov_rad, aspect=boards.aspect, color=CAMERA,
                             scale=viser_scale(boards, boards.depth_mm), image=boards.coverage(), format="png",
                             thickness=2 * EDGE_MM * METRES, **NO_SHADOWS)
    vertices = (boards.quads * METRES).reshape(-1, 3).astype(np.float32)
    first = 4 * np.arange(len(boards.quads))[:, None, None]
    scene.add_mesh_simple("/boards/views", vertices, (FACES + first).reshape(-1, 3), color=BOARD, opacity=0.35,
                          side="double", **NO_SHADOWS)
    edges = np.stack([boards.quads, np.roll(boards.quads, -1, axis=1)], axis=2).reshape(-1, 2, 3)
    scene.add_line_segments("/boards/edges", (edges * METRES).astype(np.float32), colors=EDGE,
                            thickness=EDGE_MM * METRES)
    for number, quad in enumerate(boards.quads):
        scene.add_label(f"/boards/name-{number}", boards.names[number] or str(number + 1),
                        position=quad[0] * METRES, font_screen_scale=0.7)


def common_scale_mm(cameras: list[SceneCamera]) -> float | None:
    """Return the upper end of the common colour scale, mm; None where no error is known."""
    is_known = any(isinstance(surface, ErrorSurface) for camera in cameras
                   for surface in (camera.carpet_error, camera.hat_error))
    return TICKS[-1] if is_known else None


def draw_error_surfaces(scene: viser.SceneApi, name: str, camera: SceneCamera, top_mm: float,
                ) -> dict[str, list[viser.SceneNodeHandle]]:
    """Draw the layers "carpet" and "hat", as far as they are known."""
    return {which: [add_quad(scene, f"{name}/{which}", surface.picture(top_mm), surface.quad, SURFACE_ABOVE_MM)]
            for which, surface in (("carpet", camera.carpet_error), ("hat", camera.hat_error))
            if isinstance(surface, ErrorSurface)}
