"""Small motion of a whole picture, from how far lines moved across themselves; what moved otherwise is an outlier.

A camera that is bumped turns, and may sink a little: four numbers q, each with a field of shifts B(p) over the picture,
in px where it is strongest. For a camera with rays they are turns about its three axes and its height. For another
model the picture shifts, turns and grows.

    n(p) · B(p) q = d        n: the line's normal, d: how far it moved across itself
"""

from dataclasses import dataclass, replace

import numpy as np

from touchline.core.geometry import Array, ImageSize, Mask, Points, inside_picture, with_z
from touchline.models import CameraModel, field_from_raw, raw_from_field
from touchline.models.ray_camera import RayCamera
from touchline.models.rotation import matrix_from_vector

STEP_PX = 0.05  # of q, for a difference
STEPS = 12
TUKEY = 4.0  # spreads, beyond which a place has no weight
MODEL_ERROR = 0.08  # of the motion itself: the model is linear
MIN_SPREAD = 0.3  # of the places' own σ, which may be too large
PRIOR_PX = 1e3  # σ of the prior of each number
PERCENTILE = 95  # of the region's places do not move further


@dataclass(frozen=True, eq=False)
class ImageMotion:
    """q (k,), its covariance (k, k), and which places agree (n,). sure: how many σ it is from 0."""

    q: Array
    covariance: Array
    agreeing: Mask

    @property
    def sure(self) -> float:
        return float(np.sqrt(max(float(self.q @ np.linalg.solve(self.covariance, self.q)), 0.0)))

    def compose(self, q: Array) -> "ImageMotion":
        """Return the motion after a first one by q."""
        return replace(self, q=self.q + q)


@dataclass(frozen=True, eq=False)
class MotionField:
    """How the places of a camera's picture move with q. size: of the picture, px."""

    model: CameraModel
    size: tuple[int, int]

    @property
    def _unit_px(self) -> float:
        return float(np.hypot(*self.size)) / 2

    def shifts(self, places: Points, q: Array) -> Points:
        """Return by how much each place (n, 2) px moves (n, 2) px; NaN out of the model's reach."""
        if not isinstance(self.model, RayCamera):
            return self._similar(places) @ q
        model = self.model
        position = np.array(model.position_mm)
        turn = q[:3] / np.array([model.focal_px, model.focal_px, self._unit_px])
        arms = with_z(field_from_raw(model, places)) - position
        arms = arms @ matrix_from_vector(turn @ model.camera_from_field).T
        arms[:, 2] -= q[3] / self._unit_px * position[2]
        return model.project(position + arms) - places

    def at(self, places: Points) -> Array:
        """Return B (n, 2, 4) px."""
        if not isinstance(self.model, RayCamera):
            return self._similar(places)
        steps = STEP_PX * np.eye(4)
        return np.stack(
            [(self.shifts(places, s) - self.shifts(places, -s)) / (2 * STEP_PX) for s in steps],
            axis=-1,
        )

    def _similar(self, places: Points) -> Array:
        """Return B of a shift right, a shift down, a turn and growth."""
        x, y = np.moveaxis(
            (np.asarray(places) - (np.array(self.size) - 1) / 2) / self._unit_px, -1, 0
        )
        one, none = np.ones_like(x), np.zeros_like(x)
        return np.stack(
            [np.stack([one, none, -y, x], axis=-1), np.stack([none, one, x, y], axis=-1)], axis=-2
        )


def estimate_motion(across: Array, off_px: Array, sigma_px: Array) -> ImageMotion:
    """Estimate the motion robustly from across (n, k), n · B, and off_px, sigma_px (n,)."""
    weight = np.ones(len(off_px))
    for step in range(STEPS):
        q, _ = _solve(across, off_px, sigma_px, weight)
        ratio = _deviations(across @ q, off_px, sigma_px)[0] / TUKEY
        # From mild to strict: the first estimate may be pulled by a robot's edge.
        new = (
            np.where(ratio < 1, (1 - ratio**2) ** 2, 0.0)
            if step > 1
            else 1 / np.maximum(ratio * TUKEY, 1.0)
        )
        settled = step > 3 and np.abs(new - weight).max() < 1e-3
        weight = new
        if settled:
            break
    q, precision = _solve(across, off_px, sigma_px, weight)
    ratio, spread = _deviations(across @ q, off_px, sigma_px)
    covariance = np.asarray(np.linalg.inv(precision), np.float64) * spread**2
    return ImageMotion(q, covariance, ratio < TUKEY)


def _deviations(predicted: Array, off: Array, sigma: Array) -> tuple[Array, float]:
    """Return how many spreads each place is off, and the spread in its own σ."""
    apart = np.abs(off - predicted) / np.hypot(sigma, MODEL_ERROR * predicted)
    spread = max(1.4826 * float(np.median(apart)), MIN_SPREAD)
    return apart / spread, spread


def _solve(across: Array, off: Array, sigma: Array, weight: Array) -> tuple[Array, Array]:
    heavy = across * (weight / sigma**2)[:, None]
    precision = across.T @ heavy + np.eye(across.shape[1]) / PRIOR_PX**2
    return np.asarray(np.linalg.solve(precision, heavy.T @ off), np.float64), precision


@dataclass(frozen=True, eq=False)
class MotionSize:
    """The size of a motion over a region: what 95 % of its places do not exceed, and σ of that."""

    px: float
    mm: float
    sigma_px: float
    sigma_mm: float


@dataclass(frozen=True, eq=False)
class RegionSamples:
    """Samples of a region: raw px and field mm (n, 2), B (n, 2, 4), and field mm a px (n, 2, 2)."""

    flow: MotionField
    raw: Points
    field: Points
    linear: Array
    mm_per_px: Array

    @classmethod
    def of(cls, flow: MotionField, field_places: Points) -> "RegionSamples | None":
        """Make samples at field_places (n, 2) mm; None where the camera sees none of them."""
        model = flow.model
        raw = raw_from_field(model, field_places)
        raw = raw[inside_picture(raw, ImageSize(*flow.size), 0)]
        right, left, down, up = (
            field_from_raw(model, raw + np.array([dx, dy]))
            for dx, dy in ((0.5, 0), (-0.5, 0), (0, 0.5), (0, -0.5))
        )
        scale, linear, field = (
            np.stack([right - left, down - up], axis=-1),
            flow.at(raw),
            field_from_raw(model, raw),
        )
        fine = (
            np.isfinite(scale).all(axis=(1, 2))
            & np.isfinite(linear).all(axis=(1, 2))
            & np.isfinite(field).all(1)
        )
        return cls(flow, raw[fine], field[fine], linear[fine], scale[fine]) if fine.any() else None

    def measure(self, motion: ImageMotion) -> MotionSize:
        shift = self.flow.shifts(self.raw, motion.q)
        mm = field_from_raw(self.flow.model, self.raw + shift) - self.field
        spread = self.linear @ motion.covariance @ self.linear.transpose(0, 2, 1)
        spread_mm = self.mm_per_px @ spread @ self.mm_per_px.transpose(0, 2, 1)
        return MotionSize(
            *(
                float(np.nan_to_num(np.nanpercentile(values, PERCENTILE)))
                for values in (
                    np.linalg.norm(shift, axis=1),
                    np.linalg.norm(mm, axis=1),
                    np.sqrt(np.trace(spread, axis1=1, axis2=2)),
                    np.sqrt(np.trace(spread_mm, axis1=1, axis2=2)),
                )
            )
        )
