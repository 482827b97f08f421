"""A camera's pose and field of view, and its picture as a pinhole at the same place would have taken it.

A lens bends its picture, and a frustum is a pinhole's: drawn on one, only the straightened picture lies over the field
that stands behind it. A pinhole cannot see 180°: of a very wide lens the middle MAX_FOV_DEG are shown.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from touchline.core.geometry import ImageSize, Points
from touchline.imaging.correction import CorrectionMap
from touchline.models.ray_camera import RayCamera

MAX_FOV_DEG = 120.0
MAX_ASPECT = 8.0  # either way: an absurd lens leaves a line of its border, or a point
BORDER_STEPS = 33  # points along each side of the picture
REACH_MM = 1000.0  # along a ray: any length will do
DEPTH_SHARE = 0.22  # of the camera's height: how far below it its picture is drawn
MAX_DEPTH_MM = 1200.0
IN_FRONT = 0.985  # of the frustum's depth, where lines are drawn over its picture


class Pyramid:
    """The view of a pinhole. half: half the picture's extent at depth 1, across and down."""

    half: tuple[float, float]

    @property
    def fov_rad(self) -> float:
        """Angle from the picture's top to its bottom."""
        return float(2 * np.arctan(self.half[1]))

    @property
    def aspect(self) -> float:
        return self.half[0] / self.half[1]


@dataclass(frozen=True, eq=False)
class Frustum(Pyramid):
    """position_mm (3,); field_from_camera (3, 3), whose columns are right, down and ahead. half: of the undistorted
    picture. complete: whether that is all that the camera sees."""

    model: RayCamera
    position_mm: NDArray[np.float64]
    field_from_camera: NDArray[np.float64]
    half: tuple[float, float]
    complete: bool

    @classmethod
    def of(cls, model: RayCamera) -> Self:
        rays = model.rays(_border(model.image_size))
        with np.errstate(all="ignore"):
            plane = np.abs(rays[:, :2] / np.where(rays[:, 2:] > 0, rays[:, 2:], np.nan))
        most = float(np.tan(np.radians(MAX_FOV_DEG / 2)))
        known = np.isfinite(plane).all(axis=1)
        seen = np.nanmax(plane[known], axis=0) if known.any() else np.array([most, most])
        half = np.clip(np.maximum(seen, seen[::-1] / MAX_ASPECT), most / MAX_ASPECT**3, most)
        return cls(model, np.array(model.position_mm), model.camera_from_field.T, (float(half[0]), float(half[1])),
                   bool(known.all() and (seen <= most).all()))

    @property
    def height_mm(self) -> float:
        return float(self.position_mm[2])

    @property
    def tilt_deg(self) -> float:
        """Angle of the optical axis against straight down."""
        return float(np.degrees(np.arccos(np.clip(-self.field_from_camera[2, 2], -1, 1))))

    def fov_within(self, aspect: float) -> float:
        """Return the vertical angle at which a window of this aspect shows the whole frustum."""
        return float(2 * np.arctan(max(self.half[1], self.half[0] / aspect)))

    @property
    def depth_mm(self) -> float:
        """Distance from the camera at which its picture is drawn."""
        return min(MAX_DEPTH_MM, DEPTH_SHARE * self.height_mm)

    @property
    def ahead(self) -> NDArray[np.float64]:
        """(3,): the centre of the drawn picture."""
        return self.position_mm + self.field_from_camera[:, 2] * self.depth_mm

    def drawn_closer(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Move points (n, 3) along their rays to just before the drawn picture; NaN beside or behind the camera.

        Seen from the camera they stay where they are."""
        arms = points - self.position_mm
        depth = arms @ self.field_from_camera[:, 2:]
        with np.errstate(all="ignore"):
            return self.position_mm + arms * np.where(depth > 0, IN_FRONT * self.depth_mm / depth, np.nan)

    def footprint(self) -> Points:
        """(n, 2) field mm: the border of the picture as it lies on the carpet, closed; NaN where it looks past it."""
        outline = self.model.unproject(_border(self.model.image_size))
        return np.concatenate([outline, outline[:1]])

    def undistortion(self, width: int, of: ImageSize) -> CorrectionMap:
        """Return the map of the undistorted picture of this width from raw pictures of size `of`."""
        if (width, of) not in self._maps:
            self._maps[width, of] = self._map(width, max(2, round(width / self.aspect)), of)
        return self._maps[width, of]

    @cached_property
    def _maps(self) -> dict[Any, CorrectionMap]:
        return {}

    def _map(self, width: int, height: int, of: ImageSize) -> CorrectionMap:
        x = ((np.arange(width) + 0.5) / width * 2 - 1) * self.half[0]
        y = ((np.arange(height) + 0.5) / height * 2 - 1) * self.half[1]
        rays = np.stack([*np.meshgrid(x, y), np.ones((height, width))], axis=-1) * REACH_MM
        raw = self.model.project(self.position_mm + rays @ self.field_from_camera.T)
        scale = np.array([a / b for a, b in zip(of, self.model.image_size, strict=True)])
        raw = ((raw + 0.5) * scale - 0.5).astype(np.float32)
        return CorrectionMap(raw[..., 0], raw[..., 1])


def _border(size: ImageSize) -> Points:
    """(n, 2) px around the picture, from its top-left corner on."""
    t = np.linspace(0, 1, BORDER_STEPS)[:-1]
    w, h = size.width - 1, size.height - 1
    sides = [(t * w, 0 * t), (0 * t + w, t * h), ((1 - t) * w, 0 * t + h), (0 * t, (1 - t) * h)]
    return np.concatenate([np.stack(side, axis=1) for side in sides])
