"""Draw with viser: field, cameras with pictures and arrows, detections, board poses, surfaces of expected error.

Nothing is computed here. viser counts in metres and all else in millimetres; METRES stands where one becomes the other.
"""

from collections.abc import Mapping, Sequence, Set
from typing import Any, TypedDict

import numpy as np
import viser
import viser.transforms as tf
from numpy.typing import NDArray

from touchline.core.field import Field
from touchline.core.geometry import ImageSize, Pixels
from touchline.core.statements import format_number
from touchline.imaging.correction import CorrectedView, CorrectionMap, correction_map
from touchline.imaging.heat_map import TICKS
from touchline.scene.frustum import BoardViews, Frustum, Pyramid
from touchline.scene.scene_camera import SceneCamera
from touchline.scene.shapes import ErrorSurface, Mesh, TexturedQuad, carpet, goals, paint

METRES = 1e-3
Handle = viser.SceneNodeHandle
Colour = tuple[int, int, int]


class Shadows(TypedDict):
    cast_shadow: bool
    receive_shadow: bool


NO_SHADOWS = Shadows(cast_shadow=False, receive_shadow=False)

# The field. Under viser's lights its colours come out about twice as bright.
GREEN, BLACK, WHITE, POST = (12, 58, 26), (14, 15, 16), (245, 245, 245), (235, 200, 60)
CARPET_BELOW_MM = 8.0  # a card's depth buffer cannot tell two planes at the same height apart
POST_MM = 20.0

# Cameras
COLOURS: tuple[Colour, ...] = (
    (255, 160, 40),
    (70, 160, 255),
    (240, 90, 160),
    (120, 220, 120),
    (190, 130, 255),
    (60, 220, 220),
    (230, 220, 80),
    (255, 110, 90),
)
OLDER: Colour = (150, 150, 150)
FRUSTUM_PX = 480  # width of a frustum's picture: it is drawn small
QUAD_PX = 960
FRUSTUM_EDGE_MM, FOOTPRINT_MM = 12.0, 14.0
PICTURE_ABOVE_MM = 4.0  # height over the carpet's lines: level with them, both would flicker
JPEG_QUALITY = 80
HIDDEN_THROUGH_CAMERA = ("labels", "rays")  # layers that would hide the view through a camera

# Points, arrows and surfaces
RESIDUAL, OUTLIER, MOVED = (255, 230, 60), (230, 50, 50), (255, 90, 220)
RAY_MM, SHAFT_MM, HEAD_MM = 3.0, 9.0, 26.0
ARROWS_ABOVE_MM = 12.0
SURFACE_ABOVE_MM = 6.0

# Detections
BALL, BALL_MM = (255, 120, 20), 21.5
ROBOT_MM = {"radius_mm": 90.0, "height_mm": 150.0}
TEAMS = {"yellow": (240, 210, 50), "blue": (60, 110, 240)}
NO_TEAM = (120, 125, 130)
MARKER_MM, MARKER_HEIGHT_MM = 25.0, 4.0
FRONT_MM = 60.0  # how far a robot's front is drawn beyond its rim

# Boards
BOARD_CAMERA, BOARD, BOARD_EDGE = (255, 160, 40), (70, 160, 255), (20, 60, 120)
BOARD_EDGE_MM = 3.0
QUAD_FACES = np.array([[0, 1, 2], [0, 2, 3]])


def draw_ground(scene: viser.SceneApi, field: Field) -> None:
    """Draw the carpet, its lines and the goals under /field."""
    ground, lines, posts = carpet(field), paint(field), goals(field)
    scene.add_mesh_simple(
        "/field/carpet",
        _metres(ground.vertices - [0, 0, CARPET_BELOW_MM]),
        ground.faces,
        side="double",
        color=BLACK if field.extras.get("carpet") == "black" else GREEN,
        **NO_SHADOWS,
    )
    scene.add_mesh_simple(
        "/field/lines",
        _metres(lines.vertices),
        lines.faces,
        color=WHITE,
        side="double",
        **NO_SHADOWS,
    )
    if len(posts):
        scene.add_line_segments(
            "/field/goals", _metres(posts), colors=POST, thickness=POST_MM * METRES
        )


def _metres(points_mm: NDArray[np.float64]) -> NDArray[np.float32]:
    return (points_mm * METRES).astype(np.float32)


class CameraNode:
    """The viser nodes of one camera, by layer, and its picture, which is replaced as frames come."""

    def __init__(self, scene: viser.SceneApi, camera: SceneCamera, colour: Colour) -> None:
        self.camera = camera
        self.handles: dict[str, list[Handle]] = {}
        # the field's lines over its picture, for the view through it
        self.field_lines: Handle | None = None
        self._scene, self._colour, self._name = scene, colour, f"/cameras/{camera.key}"
        self._frustum: viser.CameraFrustumHandle | None = None
        self._quad: viser.ImageHandle | None = None
        self._map: CorrectionMap | None = None
        self._map_size: ImageSize | None = None
        if camera.frustum is not None:
            self._draw_frustum(camera.frustum, colour)
        if camera.before is not None and camera.before.frustum is not None:
            self._draw_older(camera.before.frustum, camera.before.calibration.version)

    def _draw_frustum(self, frustum: Frustum, colour: Colour) -> None:
        self._frustum = _add_frustum(self._scene, f"{self._name}/frustum", frustum, colour)
        label = (
            f"{self.camera.title}, version {self.camera.calibration.version}\n"
            f"{frustum.height_mm / 1000:.2f} m high, tilted {frustum.tilt_deg:.1f}°"
        )
        self.add(
            "labels",
            self._scene.add_label(
                f"{self._name}/label",
                label,
                position=_place(frustum.position_mm),
                anchor="bottom-center",
            ),
        )
        outline = frustum.footprint()
        segments = np.stack([outline[:-1], outline[1:]], axis=1)
        segments = segments[np.isfinite(segments).all(axis=(1, 2))]
        if len(segments):
            level = np.concatenate(
                [segments, np.full((*segments.shape[:2], 1), PICTURE_ABOVE_MM)], axis=2
            )
            self.add(
                "footprints",
                self._scene.add_line_segments(
                    f"{self._name}/footprint",
                    _metres(level),
                    colors=colour,
                    thickness=FOOTPRINT_MM * METRES,
                ),
            )
        self._draw_field_lines(frustum)

    def _draw_field_lines(self, frustum: Frustum) -> None:
        lines = paint(self.camera.field)
        closer = Mesh(frustum.drawn_closer(lines.vertices), lines.faces)
        seen = np.isfinite(closer.vertices[closer.faces]).all(axis=(1, 2))
        if seen.any():
            self.field_lines = self._scene.add_mesh_simple(
                f"{self._name}/over",
                _metres(np.nan_to_num(closer.vertices)),
                closer.faces[seen],
                color=self._colour,
                side="double",
                opacity=0.75,
                visible=False,
                **NO_SHADOWS,
            )

    def _draw_older(self, frustum: Frustum, version: int) -> None:
        name = f"{self._name}/older"
        self.add(
            "older",
            _add_frustum(self._scene, f"{name}/frustum", frustum, OLDER),
            self._scene.add_label(
                f"{name}/label",
                f"version {version}",
                anchor="top-center",
                position=_place(frustum.position_mm),
            ),
        )

    def show_picture(self, raw: Pixels) -> None:
        """Show a raw picture (h, w, 3) BGR, of any size in the camera's aspect: in the frustum, or on the carpet."""
        size = ImageSize(raw.shape[1], raw.shape[0])
        if self.camera.frustum is not None and self._frustum is not None:
            picture = self.camera.frustum.undistortion(FRUSTUM_PX, size).apply(raw)
            self._frustum.image = picture[..., ::-1]
        elif self.camera.frustum is None:
            corrected = self._corrected(size).apply(raw)[..., ::-1]
            if self._quad is None:
                self._quad = add_quad(
                    self._scene,
                    f"{self._name}/corrected",
                    corrected,
                    self.camera.quad,
                    PICTURE_ABOVE_MM,
                )
                self.add("pictures", self._quad)
            else:
                self._quad.image = corrected

    def _corrected(self, size: ImageSize) -> CorrectionMap:
        """Return the map from raw pictures of this size, which may differ from the calibration's."""
        if self._map is None or self._map_size != size:
            model = self.camera.model
            full = correction_map(
                model, CorrectedView(width=min(QUAD_PX, model.corrected_size.width))
            )
            scale_x, scale_y = (raw / own for raw, own in zip(size, model.image_size, strict=True))
            self._map = CorrectionMap(
                ((full.raw_x + 0.5) * scale_x - 0.5).astype(np.float32),
                ((full.raw_y + 0.5) * scale_y - 0.5).astype(np.float32),
            )
            self._map_size = size
        return self._map

    def add(self, layer: str, *handles: Handle | None) -> None:
        """Add what was drawn to a layer; None is what was not."""
        self.handles.setdefault(layer, []).extend(
            handle for handle in handles if handle is not None
        )

    def set_visible(self, shown: Set[str], looked_through: bool, hidden: bool) -> None:
        """Show what is on. shown: the layers that are switched on. looked_through, hidden: whether the camera is."""
        for layer, handles in self.handles.items():
            in_the_way = looked_through and layer in HIDDEN_THROUGH_CAMERA
            for handle in handles:
                handle.visible = layer in shown and not hidden and not in_the_way
        if self._frustum is not None:
            self._frustum.visible = not hidden and ("pictures" in shown or not looked_through)
        if self.field_lines is not None:
            self.field_lines.visible = looked_through and not hidden


def add_quad(
    scene: viser.SceneApi,
    name: str,
    picture: Pixels,
    quad: TexturedQuad,
    above_mm: float,
) -> viser.ImageHandle:
    """Draw a picture, RGB or RGBA, on the quad raised by above_mm."""
    axes = np.stack([[*quad.right, 0.0], [*quad.down, 0.0], [0.0, 0.0, -1.0]], axis=1)
    return scene.add_image(
        name,
        picture,
        quad.width_mm * METRES,
        quad.height_mm * METRES,
        **NO_SHADOWS,
        format="png" if picture.shape[2] == 4 else "jpeg",
        wxyz=tf.SO3.from_matrix(axes).wxyz,
        position=_place(np.array([*quad.middle_mm, quad.z_mm + above_mm])),
    )


def _add_frustum(
    scene: viser.SceneApi, name: str, frustum: Frustum, colour: Colour
) -> viser.CameraFrustumHandle:
    return scene.add_camera_frustum(
        name,
        frustum.fov_rad,
        frustum.aspect,
        scale=viser_scale(frustum, frustum.depth_mm),
        color=colour,
        thickness=FRUSTUM_EDGE_MM * METRES,
        format="jpeg",
        jpeg_quality=JPEG_QUALITY,
        position=_place(frustum.position_mm),
        wxyz=tf.SO3.from_matrix(frustum.field_from_camera).wxyz,
        **NO_SHADOWS,
    )


def _place(point_mm: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = (float(v) * METRES for v in point_mm)
    return x, y, z


def viser_scale(view: Pyramid, depth_mm: float) -> float:
    """Return the scale at which a frustum is depth_mm deep: viser keeps its volume when its angle changes."""
    return float(depth_mm * METRES * np.cbrt(view.half[0] * view.half[1] / 3))


def draw_rays(
    scene: viser.SceneApi, name: str, camera: SceneCamera, colour: Colour
) -> Handle | None:
    """Draw each point's ray; None where there are none."""
    if camera.frustum is None or not len(camera.ray_hits.points):
        return None
    rays = camera.ray_hits.rays_from(camera.frustum.position_mm)
    colours = np.where(camera.ray_hits.outlier[:, None, None], OUTLIER, colour).astype(np.uint8)
    return scene.add_line_segments(
        name,
        _metres(rays),
        colors=np.broadcast_to(colours, (len(rays), 2, 3)),
        thickness=RAY_MM * METRES,
    )


def draw_residuals(
    scene: viser.SceneApi, name: str, camera: SceneCamera, scale: float
) -> Handle | None:
    """Draw residuals, enlarged by scale; outliers are red."""
    if not len(camera.ray_hits.points):
        return None
    colours = np.where(camera.ray_hits.outlier[:, None], OUTLIER, RESIDUAL).astype(np.uint8)
    return _arrows(scene, name, camera.ray_hits.arrows(scale), colours)


def draw_pose_change(
    scene: viser.SceneApi, name: str, camera: SceneCamera, scale: float
) -> Handle | None:
    """Draw how far the newer version puts things from where the older one did, enlarged by scale."""
    if camera.pose_change is None or not len(camera.pose_change.arrows):
        return None
    arrows = camera.pose_change.scaled(scale)
    return _arrows(scene, name, arrows, np.full((len(arrows), 3), MOVED, np.uint8))


def draw_scale(scene: viser.SceneApi, field: Field, scale: float) -> Handle:
    """Write the arrows' scale beside the field: a screenshot must tell it without the page."""
    beside = -(field.width_mm / 2 + field.extras.get("boundary", {}).get("touch_mm", 0.0))
    return scene.add_label(
        "/scale",
        f"arrows × {format_number(scale)}",
        position=(0.0, beside * METRES, 0.0),
        anchor="top-center",
        font_screen_scale=0.9,
    )


def _arrows(
    scene: viser.SceneApi,
    name: str,
    arrows_mm: NDArray[np.float64],
    colours: NDArray[np.uint8],
) -> Handle:
    raised = arrows_mm + np.array([0.0, 0.0, ARROWS_ABOVE_MM])
    return scene.add_arrows(
        name,
        _metres(raised),
        colors=colours,
        shaft_radius=SHAFT_MM * METRES / 2,
        head_radius=HEAD_MM * METRES / 2,
        head_length=HEAD_MM * METRES,
    )


def draw_detections(
    scene: viser.SceneApi,
    name: str,
    field: Field,
    items: Sequence[Mapping[str, Any]],
) -> list[Handle]:
    """Draw balls, robots and markers. items: of Detections, field mm; those without a position are left out."""
    draw = {"ball": _ball, "robot": _robot, "marker": _marker}
    return [
        draw[one["kind"]](scene, f"{name}/{number}", field, one)
        for number, one in enumerate(items)
        if one["kind"] in draw and one["x_mm"] is not None and one["y_mm"] is not None
    ]


def _at(one: Mapping[str, Any], z_m: float) -> tuple[float, float, float]:
    return one["x_mm"] * METRES, one["y_mm"] * METRES, z_m


def _ball(scene: viser.SceneApi, name: str, field: Field, one: Mapping[str, Any]) -> Handle:
    radius = field.extras.get("ball", {}).get("radius_mm", BALL_MM) * METRES
    return scene.add_icosphere(name, radius, BALL, subdivisions=2, position=_at(one, radius))


def _robot(scene: viser.SceneApi, name: str, field: Field, one: Mapping[str, Any]) -> Handle:
    size = {**ROBOT_MM, **field.extras.get("robot", {})}
    radius, height = size["radius_mm"] * METRES, size["height_mm"] * METRES
    colour = TEAMS.get(one.get("team", ""), NO_TEAM)
    turn = tf.SO3.from_z_radians(float(np.radians(one.get("orientation_deg") or 0.0)))
    body = scene.add_cylinder(
        name, radius, height, colour, position=_at(one, height / 2), wxyz=turn.wxyz
    )
    if one.get("orientation_deg") is not None:
        scene.add_box(
            f"{name}/front",
            (0, 0, 0),
            (FRONT_MM * METRES, radius / 3, height / 4),
            position=(radius, 0.0, height / 2),
        )
    if one.get("id") is not None:
        scene.add_label(
            f"{name}/label", str(one["id"]), position=(0.0, 0.0, height / 2), font_screen_scale=0.8
        )
    return body


def _marker(scene: viser.SceneApi, name: str, field: Field, one: Mapping[str, Any]) -> Handle:
    """Draw a patch of a team's colour at its own height."""
    colour = TEAMS.get(one.get("team", ""), NO_TEAM)
    return scene.add_cylinder(
        name,
        MARKER_MM * METRES,
        MARKER_HEIGHT_MM * METRES,
        colour,
        position=_at(one, one.get("z_mm", 0.0) * METRES),
    )


def draw_boards(scene: viser.SceneApi, boards: BoardViews) -> None:
    """Draw under /boards; the world is the camera's frame."""
    scene.add_camera_frustum(
        "/boards/camera",
        fov=boards.fov_rad,
        aspect=boards.aspect,
        color=BOARD_CAMERA,
        scale=viser_scale(boards, boards.depth_mm),
        image=boards.coverage(),
        format="png",
        thickness=2 * BOARD_EDGE_MM * METRES,
        **NO_SHADOWS,
    )
    vertices = _metres(boards.quads).reshape(-1, 3)
    first = 4 * np.arange(len(boards.quads))[:, None, None]
    scene.add_mesh_simple(
        "/boards/views",
        vertices,
        (QUAD_FACES + first).reshape(-1, 3),
        color=BOARD,
        opacity=0.35,
        side="double",
        **NO_SHADOWS,
    )
    edges = np.stack([boards.quads, np.roll(boards.quads, -1, axis=1)], axis=2).reshape(-1, 2, 3)
    scene.add_line_segments(
        "/boards/edges", _metres(edges), colors=BOARD_EDGE, thickness=BOARD_EDGE_MM * METRES
    )
    for number, quad in enumerate(boards.quads):
        scene.add_label(
            f"/boards/name-{number}",
            boards.names[number] or str(number + 1),
            position=quad[0] * METRES,
            font_screen_scale=0.7,
        )


def common_scale_mm(cameras: list[SceneCamera]) -> float | None:
    """Return the upper end of the common colour scale, mm; None where no error is known."""
    is_known = any(
        isinstance(surface, ErrorSurface)
        for camera in cameras
        for surface in (camera.carpet_error, camera.robot_top_error)
    )
    return TICKS[-1] if is_known else None


def draw_error_surfaces(
    scene: viser.SceneApi,
    name: str,
    camera: SceneCamera,
    top_mm: float,
) -> dict[str, list[Handle]]:
    """Draw the layers "carpet" and "hat", as far as they are known."""
    return {
        which: [
            add_quad(
                scene, f"{name}/{which}", surface.picture(top_mm), surface.quad, SURFACE_ABOVE_MM
            )
        ]
        for which, surface in (("carpet", camera.carpet_error), ("hat", camera.robot_top_error))
        if isinstance(surface, ErrorSurface)
    }
