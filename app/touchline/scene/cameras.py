"""Draw cameras: frustum, undistorted picture, label, footprint; without a pose, the corrected picture on the carpet."""

from collections.abc import Set

import numpy as np
import viser
import viser.transforms as tf
from numpy.typing import NDArray

from touchline.core import opencv
from touchline.core.geometry import ImageSize, Pixels
from touchline.imaging.correction import CorrectedView, CorrectionMap, correction_map
from touchline.scene import METRES, NO_SHADOWS
from touchline.scene.geometry.frustum import Frustum, Pyramid
from touchline.scene.geometry.scene_camera import SceneCamera
from touchline.scene.geometry.shapes import Mesh, TexturedQuad, paint

Handle = viser.SceneNodeHandle
Colour = tuple[int, int, int]
COLOURS: tuple[Colour, ...] = ((255, 160, 40), (70, 160, 255), (240, 90, 160), (120, 220, 120), (190, 130, 255),
                               (60, 220, 220), (230, 220, 80), (255, 110, 90))
OLDER: Colour = (150, 150, 150)
PICTURE_PX = 480  # width of a frustum's picture: it is drawn small
QUAD_PX = 960
EDGE_MM, BORDER_MM = 12.0, 14.0
ABOVE_MM = 4.0  # height over the carpet's lines: level with them, both would flicker
QUALITY = 80
IN_THE_WAY = ("labels", "rays")  # layers that would hide the view through a camera


class CameraNode:
    """The viser nodes of one camera, by layer, and its picture, which is replaced as frames come."""

    def __init__(self, scene: viser.SceneApi, camera: SceneCamera, colour: Colour) -> None:
        self.camera = camera
        self.handles: dict[str, list[Handle]] = {}
        self.field_lines: Handle | None = None  # the field's lines over its picture, for the view through it
        self._scene, self._colour, self._name = scene, colour, f"/cameras/{camera.key}"
        self._frustum: viser.CameraFrustumHandle | None = None
        self._quad: viser.ImageHandle | None = None
        if camera.frustum is not None:
            self._draw_frustum(camera.frustum, colour)
        if camera.before is not None and camera.before.frustum is not None:
            self._draw_older(camera.before.frustum, camera.before.calibration.version)

    def _draw_frustum(self, frustum: Frustum, colour: Colour) -> None:
        self._frustum = _add_frustum(self._scene, f"{self._name}/frustum", frustum, colour)
        label = (f"{self.camera.title}, version {self.camera.calibration.version}\n"
                 f"{frustum.height_mm / 1000:.2f} m high, tilted {frustum.tilt_deg:.1f}°")
        self.add("labels", self._scene.add_label(f"{self._name}/label", label, position=_place(frustum.position_mm),
                                                   anchor="bottom-center"))
        outline = frustum.footprint()
        between = np.stack([outline[:-1], outline[1:]], axis=1)
        between = between[np.isfinite(between).all(axis=(1, 2))]
        if len(between):
            level = np.concatenate([between, np.full((*between.shape[:2], 1), ABOVE_MM)], axis=2)
            self.add("footprints", self._scene.add_line_segments(
                f"{self._name}/footprint", (level * METRES).astype(np.float32), colors=colour,
                thickness=BORDER_MM * METRES))
        self._draw_field_lines(frustum)

    def _draw_field_lines(self, frustum: Frustum) -> None:
        lines = paint(self.camera.field)
        closer = Mesh(frustum.drawn_closer(lines.vertices), lines.faces)
        seen = np.isfinite(closer.vertices[closer.faces]).all(axis=(1, 2))
        if seen.any():
            self.field_lines = self._scene.add_mesh_simple(
                f"{self._name}/over", (np.nan_to_num(closer.vertices) * METRES).astype(np.float32), closer.faces[seen],
                color=self._colour, side="double", opacity=0.75, visible=False, **NO_SHADOWS)

    def _draw_older(self, frustum: Frustum, version: int) -> None:
        name = f"{self._name}/older"
        self.add("older", _add_frustum(self._scene, f"{name}/frustum", frustum, OLDER),
                 self._scene.add_label(f"{name}/label", f"version {version}", anchor="top-center",
                                       position=_place(frustum.position_mm)))

    def show_picture(self, raw: Pixels) -> None:
        """Show a raw picture (h, w, 3) BGR, of any size in the camera's aspect: in the frustum, or on the carpet."""
        size = ImageSize(raw.shape[1], raw.shape[0])
        if self.camera.frustum is not None and self._frustum is not None:
            picture = self.camera.frustum.undistortion(PICTURE_PX, size).apply(raw)
            self._frustum.image = picture[..., ::-1]
        elif self.camera.frustum is None:
            corrected = self._corrected(size).apply(raw)[..., ::-1]
            if self._quad is None:
                self._quad = add_quad(self._scene, f"{self._name}/corrected", corrected, self.camera.quad, ABOVE_MM)
                self.add("pictures", self._quad)
            else:
                self._quad.image = corrected

    def _corrected(self, size: ImageSize) -> CorrectionMap:
        """Return the map from raw pictures of this size, which may differ from the calibration's."""
        if getattr(self, "_map_of", None) != size:
            model = self.camera.model
            full = correction_map(model, CorrectedView(width=min(QUAD_PX, model.corrected_size.width)))
            kx, ky = (a / b for a, b in zip(size, model.image_size, strict=True))
            self._map = CorrectionMap(((full.raw_x + 0.5) * kx - 0.5).astype(np.float32),
                                      ((full.raw_y + 0.5) * ky - 0.5).astype(np.float32))
            self._map_of = size
        return self._map

    def add(self, layer: str, *handles: Handle | None) -> None:
        """Add what was drawn to a layer; None is what was not."""
        self.handles.setdefault(layer, []).extend(handle for handle in handles if handle is not None)

    def set_visible(self, shown: Set[str], looked_through: bool, hidden: bool) -> None:
        """shown: the layers that are switched on."""
        for layer, handles in self.handles.items():
            for handle in handles:
                handle.visible = layer in shown and not hidden and not (looked_through and layer in IN_THE_WAY)
        if self._frustum is not None:
            self._frustum.visible = not hidden and ("pictures" in shown or not looked_through)
        if self.field_lines is not None:
            self.field_lines.visible = looked_through and not hidden


def add_quad(scene: viser.SceneApi, name: str, picture: Pixels, quad: TexturedQuad, above_mm: float,
             ) -> viser.ImageHandle:
    """Draw a picture, RGB or RGBA, on the quad raised by above_mm."""
    axes = np.stack([[*quad.right, 0.0], [*quad.down, 0.0], [0.0, 0.0, -1.0]], axis=1)
    return scene.add_image(name, picture, quad.width_mm * METRES, quad.height_mm * METRES, **NO_SHADOWS,
                           format="png" if picture.shape[2] == 4 else "jpeg", wxyz=tf.SO3.from_matrix(axes).wxyz,
                           position=_place(np.array([*quad.middle_mm, quad.z_mm + above_mm])))


def shrink(raw: Pixels) -> Pixels:
    """Shrink a picture to the largest size that is drawn."""
    return opencv.shrink_to_width(raw, QUAD_PX)


def _add_frustum(scene: viser.SceneApi, name: str, frustum: Frustum, colour: Colour) -> viser.CameraFrustumHandle:
    return scene.add_camera_frustum(
        name, frustum.fov_rad, frustum.aspect, scale=viser_scale(frustum, frustum.depth_mm), color=colour,
        thickness=EDGE_MM * METRES, format="jpeg", jpeg_quality=QUALITY, position=_place(frustum.position_mm),
        wxyz=tf.SO3.from_matrix(frustum.field_from_camera).wxyz, **NO_SHADOWS)


def _place(point_mm: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = (float(v) * METRES for v in point_mm)
    return x, y, z


def viser_scale(view: Pyramid, depth_mm: float) -> float:
    """viser keeps a frustum's volume when its angle changes; this is the scale at which it is depth_mm deep."""
    return float(depth_mm * METRES * np.cbrt(view.half[0] * view.half[1] / 3))
