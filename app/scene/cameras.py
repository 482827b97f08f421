"""Cameras: a frustum with its straightened picture, a label, the border of what it sees on the carpet; or, for a model
that knows of no camera, its corrected picture on the carpet."""

from collections.abc import Callable

import numpy as np
import viser
import viser.transforms as tf
from numpy.typing import NDArray

from app.core import opencv
from app.core.geometry import ImageSize
from app.imaging.correction import CorrectedView, CorrectionMap, correction_map
from app.scene import METRES
from app.scene.geometry.frustum import Hung
from app.scene.geometry.scene_camera import Standing
from app.scene.geometry.shapes import Mesh, paint
from app.scene.geometry.textured_quad import Lying

Pixels = NDArray[np.uint8]
Handle = viser.SceneNodeHandle
Colour = tuple[int, int, int]
COLOURS: tuple[Colour, ...] = ((255, 160, 40), (70, 160, 255), (240, 90, 160), (120, 220, 120), (190, 130, 255),
                               (60, 220, 220), (230, 220, 80), (255, 110, 90))
OLDER: Colour = (150, 150, 150)
PICTURE_PX = 480  # of a frustum's picture: it is drawn small
LYING_PX = 960
EDGE_MM, BORDER_MM = 12.0, 14.0
ABOVE_MM = 4.0  # of the carpet's lines: level with them, both would flicker
QUALITY = 80


class Camera:
    """One camera as it is drawn: handles by layer, and how its picture is changed."""

    def __init__(self, scene: viser.SceneApi, standing: Standing, colour: Colour) -> None:
        self.standing = standing
        self.handles: dict[str, list[Handle]] = {}
        self.over_picture: Handle | None = None  # lines over its picture, for who looks through it
        self._scene, self._colour, self._name = scene, colour, f"/cameras/{standing.key}"
        self._frustum: viser.CameraFrustumHandle | None = None
        self._lying: viser.ImageHandle | None = None
        if standing.hung is not None:
            self._draw_hung(standing.hung, colour)
        if standing.before is not None and standing.before.hung is not None:
            self._draw_older(standing.before.hung)

    def _draw_hung(self, hung: Hung, colour: Colour) -> None:
        self._frustum = self._scene.add_camera_frustum(
            f"{self._name}/frustum", fov=hung.fov_rad, aspect=hung.aspect, scale=_scale(hung), color=colour,
            thickness=EDGE_MM * METRES, cast_shadow=False, receive_shadow=False, format="jpeg", jpeg_quality=QUALITY,
            **_pose(hung))
        label = (f"{self.standing.label}\n{hung.height_mm / 1000:.2f} m high, tilted {hung.tilt_deg:.1f}°")
        self._keep("labels", self._scene.add_label(f"{self._name}/label", label, position=_place(hung.position_mm),
                                                   anchor="bottom-center"))
        outline = hung.footprint()
        between = np.stack([outline[:-1], outline[1:]], axis=1)
        between = between[np.isfinite(between).all(axis=(1, 2))]
        if len(between):
            level = np.concatenate([between, np.full((*between.shape[:2], 1), ABOVE_MM)], axis=2)
            self._keep("footprints", self._scene.add_line_segments(
                f"{self._name}/footprint", (level * METRES).astype(np.float32), colors=colour,
                thickness=BORDER_MM * METRES))
        self._draw_over_picture(hung)

    def _draw_over_picture(self, hung: Hung) -> None:
        lines = paint(self.standing.field)
        closer = Mesh(hung.drawn_closer(lines.vertices), lines.faces)
        seen = np.isfinite(closer.vertices[closer.faces]).all(axis=(1, 2))
        if seen.any():
            self.over_picture = self._scene.add_mesh_simple(
                f"{self._name}/over", (np.nan_to_num(closer.vertices) * METRES).astype(np.float32), closer.faces[seen],
                color=self._colour, side="double", opacity=0.75, visible=False, cast_shadow=False,
                receive_shadow=False)

    def _draw_older(self, hung: Hung) -> None:
        name, version = f"{self._name}/older", self.standing.before.calibration.version
        self._keep("moved", self._scene.add_camera_frustum(
            f"{name}/frustum", fov=hung.fov_rad, aspect=hung.aspect, scale=_scale(hung), color=OLDER,
            thickness=EDGE_MM * METRES, cast_shadow=False, receive_shadow=False, **_pose(hung)))
        self._keep("moved", self._scene.add_label(f"{name}/label", f"version {version}", anchor="top-center",
                                                  position=_place(hung.position_mm)))

    def show_picture(self, raw: Pixels) -> None:
        """A raw picture (h, w, 3) BGR of any size but its own shape: straightened in the frustum, or lying."""
        size = ImageSize(raw.shape[1], raw.shape[0])
        if self.standing.hung is not None and self._frustum is not None:
            straight = self.standing.hung.straight(PICTURE_PX, size).apply(raw)
            self._frustum.image = straight[..., ::-1]
        elif self.standing.hung is None:
            corrected = self._corrected(size).apply(raw)[..., ::-1]
            if self._lying is None:
                self._lying = add_lying(self._scene, f"{self._name}/lying", corrected, self.standing.lying, ABOVE_MM)
                self._keep("pictures", self._lying)
            else:
                self._lying.image = corrected

    def _corrected(self, size: ImageSize) -> CorrectionMap:
        """From a raw picture of another size than the calibration's."""
        if getattr(self, "_map_of", None) != size:
            model = self.standing.model
            full = correction_map(model, CorrectedView(width=min(LYING_PX, model.corrected_size.width)))
            kx, ky = (a / b for a, b in zip(size, model.image_size, strict=True))
            self._map = CorrectionMap(((full.raw_x + 0.5) * kx - 0.5).astype(np.float32),
                                      ((full.raw_y + 0.5) * ky - 0.5).astype(np.float32))
            self._map_of = size
        return self._map

    def _keep(self, layer: str, handle: Handle) -> None:
        self.handles.setdefault(layer, []).append(handle)

    def set_visible(self, shown: Callable[[str], bool], looked_through: bool, hidden: bool) -> None:
        """shown: whether a layer is."""
        for layer, handles in self.handles.items():
            for handle in handles:
                handle.visible = shown(layer) and not hidden and not (looked_through and layer == "labels")
        if self._frustum is not None:
            self._frustum.visible = not hidden and (shown("pictures") or not looked_through)
        if self.over_picture is not None:
            self.over_picture.visible = looked_through and not hidden


def add_lying(scene: viser.SceneApi, name: str, picture: Pixels, lying: Lying, above_mm: float) -> viser.ImageHandle:
    """A picture in the plane of `lying`, raised by so much; RGB, or RGBA."""
    axes = np.stack([[*lying.right, 0.0], [*lying.down, 0.0], [0.0, 0.0, -1.0]], axis=1)
    return scene.add_image(name, picture, lying.width_mm * METRES, lying.height_mm * METRES, cast_shadow=False,
                           receive_shadow=False, format="png" if picture.shape[2] == 4 else "jpeg",
                           wxyz=tf.SO3.from_matrix(axes).wxyz,
                           position=_place(np.array([*lying.middle_mm, lying.z_mm + above_mm])))


def small(raw: Pixels) -> Pixels:
    """As large as it is ever drawn."""
    return opencv.shrink_to_width(raw, LYING_PX)


def _pose(hung: Hung) -> dict[str, object]:
    return {"wxyz": tf.SO3.from_matrix(hung.field_from_camera).wxyz, "position": _place(hung.position_mm)}


def _place(point_mm: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = (float(v) * METRES for v in point_mm)
    return x, y, z


def _scale(hung: Hung) -> float:
    """viser keeps a frustum's volume when its angle changes; this is the scale at which it is depth_mm deep."""
    return float(hung.depth_mm * METRES * np.cbrt(hung.half[0] * hung.half[1] / 3))
