"""A simulated camera: exact lens models, both ways between field millimetres and raw pixels, at any height.

A ray (..., 3) leaves the camera along z (x right, y down); the plane (..., 2) is the normalised one, so that a
pixel is focal · plane + centre. These lenses share no code with touchline/models, which are tested against them. What a
lens cannot see is NaN, and so is everything past the radius at which a polynomial folds back on itself.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.polynomial.polynomial import polyadd, polyder, polymul, polysub, polyval
from numpy.typing import NDArray

from touchline.core.errors import BadInput
from touchline.core.field import BORDERS, Region
from touchline.core.geometry import ImageSize, Points, as_triple, inside_picture
from touchline.core.statements import say

Rays = NDArray[np.float64]  # (..., 3), any length
_STEPS = 12  # Newton from a table good to 1e-5 needs three; the rest is for folds
_EXACT = 1e-13  # on the normalised plane: 1e-10 px at a focal length of 1000 px


@dataclass(frozen=True)
class OddCurve:
    """t (1 + c₀ t² + c₁ t⁴ + …) / (1 + d₀ t² + …) on 0 ≤ t < end, where it rises; exact both ways."""

    coefficients: tuple[float, ...]
    longest: float  # the largest t that is used
    below: tuple[float, ...] = ()

    @cached_property
    def _above(self) -> NDArray:
        return np.array([1.0, *self.coefficients])  # in t², lowest first

    @cached_property
    def _below(self) -> NDArray:
        return np.array([1.0, *self.below])

    @cached_property
    def _rise(self) -> NDArray:
        """d gain / d t² times the divisor's square."""
        return polysub(
            polymul(polyder(self._above), self._below), polymul(self._above, polyder(self._below))
        )

    @cached_property
    def _climb(self) -> NDArray:
        """The slope times the divisor's square."""
        return polyadd(polymul(self._above, self._below), polymul([0.0, 2.0], self._rise))

    @cached_property
    def end(self) -> float:
        """Where the slope or the divisor first reaches zero, or `longest`."""
        roots = [r for factor in (self._climb, self._below) for r in np.roots(factor[::-1])]
        turns = [np.sqrt(r.real) for r in roots if abs(r.imag) < 1e-12 and r.real > 0]
        return float(min([*turns, self.longest]))

    def value(self, t: NDArray) -> NDArray:
        return t * self.gain(t * t)

    def gain(self, tt: NDArray) -> NDArray:
        """value / t as a function of t²."""
        return polyval(tt, self._above) / polyval(tt, self._below)

    def rise(self, tt: NDArray) -> NDArray:
        """d gain / d t²."""
        return polyval(tt, self._rise) / polyval(tt, self._below) ** 2

    def slope(self, t: NDArray) -> NDArray:
        tt = t * t
        return polyval(tt, self._climb) / polyval(tt, self._below) ** 2

    def solve(self, value: NDArray) -> NDArray:
        """Return the t with this value; NaN beyond the end."""
        table = np.linspace(0, self.end, 4097)
        t = np.interp(value, self.value(table), table, right=np.nan)
        for _ in range(_STEPS):
            with np.errstate(divide="ignore", invalid="ignore"):
                step = (self.value(t) - value) / self.slope(t)
            t = np.clip(t - step, 0, self.end)
            if not np.nanmax(np.abs(step), initial=0) > _EXACT:
                break
        return t


@dataclass(frozen=True)
class BrownConrady:
    """Radial k1…k6 and tangential p1, p2, as OpenCV has them: they distort. All zero is a pinhole."""

    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    k5: float = 0.0
    k6: float = 0.0

    @cached_property
    def radial(self) -> OddCurve:
        longest = 12.0  # 85° off the axis
        return OddCurve((self.k1, self.k2, self.k3), longest, (self.k4, self.k5, self.k6))

    def plane_from_ray(self, rays: Rays) -> Points:
        with np.errstate(divide="ignore", invalid="ignore"):
            x, y = rays[..., 0] / rays[..., 2], rays[..., 1] / rays[..., 2]
        seen = (rays[..., 2] > 0) & (np.hypot(x, y) < self.radial.end)
        x, y = np.where(seen, x, np.nan), np.where(seen, y, np.nan)
        return np.stack(self._distorted(x, y), axis=-1)

    def _distorted(self, x: NDArray, y: NDArray) -> tuple[NDArray, NDArray]:
        rr = x * x + y * y
        gain = self.radial.gain(rr)
        return (
            x * gain + 2 * self.p1 * x * y + self.p2 * (rr + 2 * x * x),
            y * gain + self.p1 * (rr + 2 * y * y) + 2 * self.p2 * x * y,
        )

    def ray_from_plane(self, points: Points) -> Rays:
        """The radial part by its table, then Newton in two dimensions where there is a tangential part."""
        u, v = points[..., 0], points[..., 1]
        radius = np.hypot(u, v)
        with np.errstate(invalid="ignore", divide="ignore"):
            shrink = np.where(radius > 0, self.radial.solve(radius) / radius, 1.0)
        x, y = u * shrink, v * shrink
        if self.p1 or self.p2:
            for _ in range(_STEPS):
                step_x, step_y = self._newton_step(x, y, u, v)
                x, y = x - step_x, y - step_y
                if not np.nanmax(np.abs([step_x, step_y]), initial=0) > _EXACT:
                    break
            back_x, back_y = self._distorted(x, y)
            found = (np.hypot(back_x - u, back_y - v) < 1e-9) & (np.hypot(x, y) < self.radial.end)
            lost = ~found  # Newton went over the fold
            x, y = np.where(lost, np.nan, x), np.where(lost, np.nan, y)
        return np.stack([x, y, np.where(np.isfinite(x), 1.0, np.nan)], axis=-1)

    def _newton_step(
        self, x: NDArray, y: NDArray, u: NDArray, v: NDArray
    ) -> tuple[NDArray, NDArray]:
        rr = x * x + y * y
        gain = self.radial.gain(rr)
        rise = self.radial.rise(rr)
        xx = gain + 2 * x * x * rise + 2 * self.p1 * y + 6 * self.p2 * x
        yy = gain + 2 * y * y * rise + 6 * self.p1 * y + 2 * self.p2 * x
        xy = 2 * x * y * rise + 2 * self.p1 * x + 2 * self.p2 * y
        du, dv = self._distorted(x, y)
        du, dv = du - u, dv - v
        with np.errstate(divide="ignore", invalid="ignore"):
            det = xx * yy - xy * xy
            return (yy * du - xy * dv) / det, (xx * dv - xy * du) / det


@dataclass(frozen=True)
class KannalaBrandt:
    """Fisheye: the radius on the plane is a polynomial of the angle off the axis, as in OpenCV's fisheye."""

    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0

    @cached_property
    def radial(self) -> OddCurve:
        return OddCurve((self.k1, self.k2, self.k3, self.k4), longest=np.pi)

    def plane_from_ray(self, rays: Rays) -> Points:
        side = np.hypot(rays[..., 0], rays[..., 1])
        angle = np.arctan2(side, rays[..., 2])
        angle = np.where(angle < self.radial.end, angle, np.nan)
        radius = self.radial.value(angle)
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = np.where(side > 0, radius / side, radius)  # on the axis 0; straight behind NaN
        return rays[..., :2] * scale[..., None]

    def ray_from_plane(self, points: Points) -> Rays:
        radius = np.hypot(points[..., 0], points[..., 1])
        angle = self.radial.solve(radius)
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = np.where(radius > 0, np.sin(angle) / radius, 0.0)
        return np.concatenate([points * scale[..., None], np.cos(angle)[..., None]], axis=-1)


@dataclass(frozen=True)
class Division:
    """r_ideal = r / (1 + k r²): one number. k < 0 is barrel."""

    k: float = 0.0

    def plane_from_ray(self, rays: Rays) -> Points:
        with np.errstate(divide="ignore", invalid="ignore"):
            ideal = rays[..., :2] / rays[..., 2:]
            # This form of the root holds at k = 0 as well; past the fold (k > 0) it is NaN.
            scale = 2 / (1 + np.sqrt(1 - 4 * self.k * (ideal * ideal).sum(axis=-1, keepdims=True)))
        return np.where(rays[..., 2:] > 0, ideal * scale, np.nan)

    def ray_from_plane(self, points: Points) -> Rays:
        rr = (points * points).sum(axis=-1, keepdims=True)
        bend = 1 + self.k * rr
        seen = (bend > 0) & (self.k * rr < 1)  # the horizon if k < 0, the fold if k > 0
        with np.errstate(divide="ignore", invalid="ignore"):
            ideal = np.where(seen, points / bend, np.nan)
        return np.concatenate([ideal, np.where(seen, 1.0, np.nan)], axis=-1)


@dataclass(frozen=True)
class Ssl:
    """r_ideal = r (1 + a r²), as the Small Size League's geometry messages have it. a > 0 is barrel."""

    a: float = 0.0

    @cached_property
    def radial(self) -> OddCurve:
        return OddCurve((self.a,), longest=12.0)

    def plane_from_ray(self, rays: Rays) -> Points:
        with np.errstate(divide="ignore", invalid="ignore"):
            ideal = rays[..., :2] / rays[..., 2:]
            radius = np.linalg.norm(ideal, axis=-1, keepdims=True)
            scale = np.where(radius > 0, self.radial.solve(radius) / radius, 1.0)
        return np.where(rays[..., 2:] > 0, ideal * scale, np.nan)

    def ray_from_plane(self, points: Points) -> Rays:
        radius = np.linalg.norm(points, axis=-1, keepdims=True)
        with np.errstate(invalid="ignore"):
            seen = radius < self.radial.end
        ideal = np.where(seen, points * self.radial.gain(radius * radius), np.nan)
        return np.concatenate([ideal, np.where(seen, 1.0, np.nan)], axis=-1)


Lens = BrownConrady | KannalaBrandt | Division | Ssl
LENSES: dict[str, Lens] = {
    "none": BrownConrady(),
    "mild": BrownConrady(k1=-0.06, k2=0.005),
    "half": BrownConrady(k1=-0.14, k2=0.045),  # half of strong, as in the method's table
    "strong": BrownConrady(k1=-0.28, k2=0.09),
    # the glass sits askew
    "crooked": BrownConrady(k1=-0.20, k2=0.05, p1=0.003, p2=-0.002, k3=-0.004),
    "pincushion": BrownConrady(k1=0.10, k2=0.02),
    "brown-conrady": BrownConrady(k1=-0.28, k2=0.09),  # strong, by the name of its model
    "division": Division(-0.25),
    "fisheye": KannalaBrandt(k1=-0.02, k2=0.004, k3=-0.001),
    "ssl": Ssl(0.25),
}


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
    def above(
        cls,
        region: Region,
        image_size: ImageSize,
        lens: Lens,
        *,
        height_mm: float,
        tilt_deg: float = 0.0,
        pan_deg: float = 0.0,
        roll_deg: float = 0.0,
        focal_px: float | None = None,
        fill: float = 0.9,
        stand_mm: tuple[float, float] | None = None,
    ) -> Self:
        """Place a camera that sees the region with the orientation of the corrected picture.

        tilt turns the view up the picture, pan to its right, roll the picture itself. The camera stands where its
        axis meets the region's middle, or at stand_mm. Without focal_px, the region's borders reach across
        `fill` of the picture's half-sizes.
        """
        rotation = _turn(tilt_deg, pan_deg, roll_deg) @ _looking_down(region)
        middle = np.array([np.mean(region.x_mm), np.mean(region.y_mm), 0.0])
        ahead = rotation[2]
        if ahead[2] > -0.05:
            raise BadInput(
                say(
                    "sim.field-out-of-view",
                    "The field is outside the view of the simulated camera.",
                ),
                say("sim.smaller-tilt", "Use tilt and pan below 80°."),
                reason="bad-camera",
            )
        place = (
            middle + ahead * (height_mm / ahead[2])
            if stand_mm is None
            else np.array([*stand_mm, height_mm])
        )
        camera = cls(image_size, (1.0, 1.0), (0.0, 0.0), lens, _plain(rotation), as_triple(place))
        if focal_px is None:
            focal_px = camera._focal_to_fit(region, fill)
        return cls(
            image_size,
            (focal_px, focal_px),
            image_size.centre,
            lens,
            camera.camera_from_field,
            camera.position_mm,
        )

    def turned(self, tilt_deg: float = 0.0, pan_deg: float = 0.0, roll_deg: float = 0.0) -> Self:
        """Turn the camera about its own axes, as for above()."""
        return replace(
            self, camera_from_field=_plain(_turn(tilt_deg, pan_deg, roll_deg) @ self._rotation)
        )

    def _focal_to_fit(self, region: Region, fill: float) -> float:
        edge = np.concatenate([region.border(name).sample(65) for name in BORDERS])
        # NaN where the lens cannot see a border
        reach = np.abs(self.raw_from_field(edge)).max(axis=0)
        focal = fill * np.array(self.image_size.centre) / np.maximum(reach, 1e-9)
        if not np.isfinite(focal).all():
            raise BadInput(
                say("sim.area-not-covered", "The simulated camera does not cover the whole area."),
                say(
                    "sim.higher",
                    "Increase its height, reduce its tilt, or use a lens with less distortion.",
                ),
                reason="bad-camera",
            )
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
    (ct, cp, cr), (st, sp, sr) = (
        f(np.radians([tilt_deg, pan_deg, roll_deg])) for f in (np.cos, np.sin)
    )
    tilt = np.array([[1, 0, 0], [0, ct, st], [0, -st, ct]])
    pan = np.array([[cp, 0, -sp], [0, 1, 0], [sp, 0, cp]])
    roll = np.array([[cr, -sr, 0], [sr, cr, 0], [0, 0, 1]])
    return roll @ tilt @ pan


def _plain(matrix: NDArray) -> Matrix:
    return tuple(map(as_triple, matrix))
