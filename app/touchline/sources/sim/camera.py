"""A simulated camera: exact both ways between field millimetres and raw pixels, at any height."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import BadInput
from touchline.core.field import BORDERS, Region
from touchline.core.geometry import ImageSize, Points, as_triple, inside_picture
from touchline.core.statements import say
from touchline.sources.sim.lens import Lens

Matrix = tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class SimCamera:
    """A camera's pose and lens.

    camera_from_field: rotation, rows are the camera's x (right), y (down) and z (ahead) in the field frame.
    position_mm: of the centre of projection, field frame.
    """

    image_size: ImageSize
    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    lens: Lens
    camera_from_field: Matrix
    position_mm: tuple[float, float, float]

    @classmethod
    def above(cls, region: Region, image_size: ImageSize, lens: Lens, *, height_mm: float, tilt_deg: float = 0.0,
              pan_deg: float = 0.0, roll_deg: float = 0.0, focal_px: float | None = None, fill: float = 0.9,
              stand_mm: tuple[float, float] | None = None) -> Self:
        """Place a camera that sees the region with the orientation of the corrected picture.

        tilt turns the view up the picture, pan to its right, roll the picture itself. The camera stands where its
        axis meets the region's middle, or at stand_mm. Without focal_px, the region's borders reach across
        `fill` of the picture's half-sizes.
        """
        rotation = _turn(tilt_deg, pan_deg, roll_deg) @ _looking_down(region)
        middle = np.array([np.mean(region.x_mm), np.mean(region.y_mm), 0.0])
        ahead = rotation[2]
        if ahead[2] > -0.05:
            raise BadInput(say("sim.field-out-of-view", "The field is outside the view of the simulated camera."),
                           say("sim.smaller-tilt", "Use tilt and pan below 80°."), reason="bad-camera")
        place = middle + ahead * (height_mm / ahead[2]) if stand_mm is None else np.array([*stand_mm, height_mm])
        camera = cls(image_size, (1.0, 1.0), (0.0, 0.0), lens, _plain(rotation), as_triple(place))
        if focal_px is None:
            focal_px = camera._focal_to_fit(region, fill)
        return cls(image_size, (focal_px, focal_px), image_size.centre, lens, camera.camera_from_field,
                   camera.position_mm)

    def turned(self, tilt_deg: float = 0.0, pan_deg: float = 0.0, roll_deg: float = 0.0) -> Self:
        """Turn the camera about its own axes, as for above()."""
        return replace(self, camera_from_field=_plain(_turn(tilt_deg, pan_deg, roll_deg) @ self._rotation))

    def _focal_to_fit(self, region: Region, fill: float) -> float:
        edge = np.concatenate([region.border(name).sample(65) for name in BORDERS])
        reach = np.abs(self.raw_from_field(edge)).max(axis=0)  # NaN where the lens cannot see a border
        focal = fill * np.array(self.image_size.centre) / np.maximum(reach, 1e-9)
        if not np.isfinite(focal).all():
            raise BadInput(say("sim.area-not-covered", "The simulated camera does not cover the whole area."),
                           say("sim.higher", "Increase its height, reduce its tilt, or use a lens with less "
                               "distortion."), reason="bad-camera")
        return float(focal.min())

    @cached_property
    def _rotation(self) -> NDArray[np.float64]:
        return np.array(self.camera_from_field)

    def raw_from_field(self, points: NDArray) -> Points:
        """Project field points, (..., 2) mm on the carpet or (..., 3) mm, to raw pixels (..., 2)."""
        points = np.asarray(points, dtype=np.float64)
        if points.shape[-1] == 2:
            points = np.concatenate([points, np.zeros((*points.shape[:-1], 1))], axis=-1)
        rays = (points - np.array(self.position_mm)) @ self._rotation.T
        return self.lens.plane_from_ray(rays) * self.focal_px + self.centre_px

    def field_from_raw(self, points: Points, z_mm: float = 0.0) -> Points:
        """Map raw pixels (..., 2) to where their rays meet the plane z_mm above the carpet, (..., 2) mm."""
        rays = self.rays(points)
        position = np.array(self.position_mm)
        with np.errstate(divide="ignore", invalid="ignore"):
            along = (z_mm - position[2]) / rays[..., 2]
            along = np.where(along > 0, along, np.nan)
        return position[:2] + rays[..., :2] * along[..., None]

    def rays(self, points: Points) -> NDArray[np.float64]:
        """Return the directions (..., 3) of raw pixels in the field frame."""
        plane = (np.asarray(points, dtype=np.float64) - self.centre_px) / self.focal_px
        return self.lens.ray_from_plane(plane) @ self._rotation

    def sees(self, points: Points) -> NDArray[np.bool_]:
        """Tell which raw pixels (..., 2) lie in the picture."""
        return inside_picture(points, self.image_size)


def _looking_down(region: Region) -> NDArray[np.float64]:
    """Return the rows right, down (of the region in the picture) and ahead (to the carpet)."""
    right = region.field_from_region(np.array([1.0, 0.0])) - region.field_from_region(np.zeros(2))
    down = region.field_from_region(np.array([0.0, 1.0])) - region.field_from_region(np.zeros(2))
    return np.array([[*right, 0.0], [*down, 0.0], [0.0, 0.0, -1.0]])


def _turn(tilt_deg: float, pan_deg: float, roll_deg: float) -> NDArray[np.float64]:
    (ct, cp, cr), (st, sp, sr) = (f(np.radians([tilt_deg, pan_deg, roll_deg])) for f in (np.cos, np.sin))
    tilt = np.array([[1, 0, 0], [0, ct, st], [0, -st, ct]])
    pan = np.array([[cp, 0, -sp], [0, 1, 0], [sp, 0, cp]])
    roll = np.array([[cr, -sr, 0], [sr, cr, 0], [0, 0, 1]])
    return roll @ tilt @ pan


def _plain(matrix: NDArray) -> Matrix:
    return tuple(map(as_triple, matrix))
