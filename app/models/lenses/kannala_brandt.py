"""Kannala–Brandt: the picture's radius grows with the angle, so it reaches past 90°.

    θ = angle from the axis,   r_d = θ + k1 θ³ + k2 θ⁵ + k3 θ⁷ + k4 θ⁹

J. Kannala, S. S. Brandt, "A generic camera model and calibration method …", PAMI 2006; OpenCV's fisheye terms.
"""

from functools import lru_cache
from typing import ClassVar

import numpy as np

from app.core.geometry import Array
from app.models.lenses.projection import PowerTerms, invert_radius, smallest_root

TERMS = ("k1", "k2", "k3", "k4")
SMALL = 1e-7  # of sin θ: nearer to the axis, θ / sin θ is 1 to all digits


def _powers_of_atan(odd: int) -> Array:
    """Return the coefficients (odd, odd + 1) of t³, t⁵, … in atan(t)ⁿ, n = 1, 3, …, as columns."""
    series = np.zeros(2 * odd + 2)
    series[1::2] = [(-1) ** k / (2 * k + 1) for k in range(odd + 1)]
    columns, power = [], series
    for _ in range(odd + 1):
        columns.append(power[3::2])
        power = np.convolve(np.convolve(power, series), series)[:len(series)]
    return np.stack(columns, axis=1)


OF_TANGENT = _powers_of_atan(len(TERMS))


class KannalaBrandtLens(PowerTerms):
    TERMS: ClassVar[tuple[str, ...]] = TERMS
    POWERS: ClassVar[tuple[int, ...]] = (2, 4, 6, 8)

    @classmethod
    def rescaled(cls, terms: Array, step: Array, log_scale: float) -> Array:
        """As PowerTerms does, by way of r_d's series in the tangent, as far as there are terms."""
        own, fixed = OF_TANGENT[:, 1:], OF_TANGENT[:, 0]
        moved = super().rescaled(own @ terms + fixed, own @ step, log_scale)
        return np.asarray(np.linalg.solve(own, moved - fixed), np.float64)

    @classmethod
    def at_scale(cls, terms: Array, log_scale: float) -> tuple[Array, Array, Array]:
        """As PowerTerms does, by way of the same series."""
        own, fixed = OF_TANGENT[:, 1:], OF_TANGENT[:, 0]
        scaled, by_terms, by_scale = super().at_scale(own @ terms + fixed, log_scale)
        own_from_scaled = np.asarray(np.linalg.inv(own), np.float64)
        return own_from_scaled @ (scaled - fixed), own_from_scaled @ by_terms @ own, own_from_scaled @ by_scale

    @staticmethod
    def distort(terms: Array, rays: Array) -> Array:
        gain, _, _ = _gain(terms, rays)
        return rays[..., :2] * gain[..., None]

    @staticmethod
    def distort_jacobian(terms: Array, rays: Array) -> tuple[Array, Array, Array]:
        """plane = (X, Y) g(ρ, Z), where ρ = √(X² + Y²), θ = atan2(ρ, Z), g = r_d(θ) / ρ."""
        gain, theta, rho = _gain(terms, rays)
        x, y, z = rays[..., 0], rays[..., 1], rays[..., 2]
        length2 = rho**2 + z**2
        _, slope = _radius(terms, theta)
        near = np.abs(rho) < SMALL * np.abs(z)
        with np.errstate(all="ignore"):
            rho2 = np.where(near, 1, rho**2)
            # d g/d ρ · 1/ρ = (r_d' z/length² - g) / ρ²;  on the axis its limit, from the series of r_d and atan
            by_rho = np.where(near, (2 * terms[0] - 2 / 3) / z**3, (slope * z / length2 - gain) / rho2)
        by_z = -slope / length2
        by_ray = np.zeros((*gain.shape, 2, 3), gain.dtype)
        by_ray[..., 0, 0], by_ray[..., 1, 1] = gain + x * x * by_rho, gain + y * y * by_rho
        by_ray[..., 0, 1] = by_ray[..., 1, 0] = x * y * by_rho
        by_ray[..., 0, 2], by_ray[..., 1, 2] = x * by_z, y * by_z
        with np.errstate(all="ignore"):
            per_rho = np.where(near, 0, 1 / np.where(near, 1, rho))
        squared = (theta * theta)[..., None]
        powers = np.cumprod(np.concatenate([(theta * per_rho)[..., None] * squared, *[squared] * 3], axis=-1), axis=-1)
        by_terms = rays[..., :2, None] * powers[..., None, :]
        return rays[..., :2] * gain[..., None], by_ray, by_terms

    @staticmethod
    def undistort(terms: Array, plane: Array) -> Array:
        """Return rays of unit length: past 90° there is no unit depth."""
        with np.errstate(all="ignore"):
            rd = np.linalg.norm(plane, axis=-1)
            theta = invert_radius(rd, lambda theta: _radius(terms, theta), _end(tuple(terms)))
            side = np.where(rd > 0, np.sin(theta) / np.where(rd > 0, rd, 1), 1.0)
            rays = np.concatenate([plane * side[..., None], np.cos(theta)[..., None]], axis=-1)
        return np.where(np.isfinite(rays).all(axis=-1, keepdims=True), rays, np.nan)


def _radius(terms: Array, theta: Array) -> tuple[Array, Array]:
    """Return r_d(θ) and its derivative."""
    squared = theta * theta
    last = len(terms) - 1
    value, slope = squared * terms[last], squared * ((2 * last + 3) * terms[last])
    for k in range(last - 1, -1, -1):  # by Horner's rule: powers cost ten times as much
        value, slope = squared * (terms[k] + value), squared * ((2 * k + 3) * terms[k] + slope)
    return theta * (1 + value), 1 + slope


def _gain(terms: Array, rays: Array) -> tuple[Array, Array, Array]:
    """Return r_d / ρ, θ and ρ; NaN past the angle at which the picture would fold back."""
    with np.errstate(all="ignore"):
        rho = np.sqrt(rays[..., 0] ** 2 + rays[..., 1] ** 2)
        z = rays[..., 2]
        theta = _angle(rho, z)
        near = (np.abs(rho) < SMALL * np.abs(z)) & (z.real > 0)
        rd, _ = _radius(terms, theta)
        gain = np.where(near, 1 / z, rd / np.where(near, 1, rho))
        return np.where(theta.real <= _end(tuple(np.real(terms))), gain, np.nan), theta, rho


def _angle(rho: Array, z: Array) -> Array:
    """Return atan2(ρ, z) for ρ ≥ 0, also of complex input (for derivative checks)."""
    if not (np.iscomplexobj(rho) or np.iscomplexobj(z)):
        return np.arctan2(rho, z)
    real = np.arctan2(rho.real, z.real)
    length2 = rho.real**2 + z.real**2
    return real + 1j * (rho.imag * z.real - z.imag * rho.real) / length2


@lru_cache(maxsize=256)
def _end(terms: tuple[float, ...]) -> float:
    """Return the largest angle used: where the radius stops rising, and never past 180°."""
    slope = [1.0, *((2 * k + 3) * t for k, t in enumerate(terms))]  # of r_d, in θ²
    return min(float(np.sqrt(smallest_root(slope))), np.pi)
