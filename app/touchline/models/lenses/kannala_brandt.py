"""Kannala–Brandt: the picture's radius grows with the angle, so it reaches past 90°.

    θ = angle from the axis,   r_d = θ + k1 θ³ + k2 θ⁵ + k3 θ⁷ + k4 θ⁹

J. Kannala, S. S. Brandt, "A generic camera model and calibration method …", PAMI 2006; OpenCV's fisheye terms.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import numpy as np

from touchline.core.geometry import Array, Mask
from touchline.models.lenses.projection import (
    PowerTerms,
    invert_radius,
    radial_jacobian,
    smallest_root,
    stays_positive,
)

TERMS = ("k1", "k2", "k3", "k4")
ODD = np.array([3, 5, 7, 9])  # powers of θ
SMALL = 1e-7  # of sin θ: nearer to the axis, θ / sin θ is 1 to all digits


def _powers_of_atan(odd: int) -> Array:
    """Return the coefficients (odd, odd + 1) of t³, t⁵, … in atan(t)ⁿ, n = 1, 3, …, as columns."""
    series = np.zeros(2 * odd + 2)
    series[1::2] = [(-1) ** k / (2 * k + 1) for k in range(odd + 1)]
    columns, power = [], series
    for _ in range(odd + 1):
        columns.append(power[3::2])
        power = np.convolve(np.convolve(power, series), series)[: len(series)]
    return np.stack(columns, axis=1)


OF_TANGENT = _powers_of_atan(len(TERMS))
OWN_FROM_SERIES = np.asarray(np.linalg.inv(OF_TANGENT[:, 1:]), np.float64)


@dataclass(frozen=True, eq=False)
class _Polar:
    """A ray's θ with the powers θ², θ⁴, … (…, terms), its ρ, the gain r_d / ρ, and the slope d r_d / d θ.

    gain: NaN past the angle at which the picture would fold back. per_rho: 1 / ρ, 0 on the axis, which is where near.
    """

    gain: Array
    slope: Array
    theta: Array
    powers: Array
    rho: Array
    per_rho: Array
    near: Mask


class KannalaBrandtLens(PowerTerms):
    TERMS: ClassVar[tuple[str, ...]] = TERMS
    POWERS: ClassVar[tuple[int, ...]] = (2, 4, 6, 8)

    @classmethod
    def rescaled(cls, terms: Array, step: Array, log_scale: float) -> Array:
        """As PowerTerms does, by way of r_d's series in the tangent, as far as there are terms."""
        own, fixed = OF_TANGENT[:, 1:], OF_TANGENT[:, 0]
        moved = super().rescaled(own @ terms + fixed, own @ step, log_scale)
        return OWN_FROM_SERIES @ (moved - fixed)

    @classmethod
    def at_scale(cls, terms: Array, log_scale: float) -> tuple[Array, Array, Array]:
        """As PowerTerms does, by way of the same series."""
        own, fixed = OF_TANGENT[:, 1:], OF_TANGENT[:, 0]
        scaled, by_terms, by_scale = super().at_scale(own @ terms + fixed, log_scale)
        return (
            OWN_FROM_SERIES @ (scaled - fixed),
            OWN_FROM_SERIES @ by_terms @ own,
            OWN_FROM_SERIES @ by_scale,
        )

    @staticmethod
    def distort(terms: Array, rays: Array) -> Array:
        return rays[..., :2] * _polar(terms, rays).gain[..., None]

    @staticmethod
    def distort_jacobian(terms: Array, rays: Array) -> tuple[Array, Array, Array]:
        """plane = (X, Y) g(ρ, Z), where ρ = √(X² + Y²), θ = atan2(ρ, Z), g = r_d(θ) / ρ."""
        seen = _polar(terms, rays)
        xy, z, gain = rays[..., :2], rays[..., 2], seen.gain
        with np.errstate(all="ignore"):
            along = seen.slope / (seen.rho**2 + z * z)
            # d g/d ρ · 1/ρ = (r_d' z/length² - g) / ρ²
            by_rho = (along * z - gain) * seen.per_rho**2
            if seen.near.any():  # on the axis its limit, from the series of r_d and atan
                by_rho = np.where(seen.near, (2 * terms[0] - 2 / 3) / z**3, by_rho)
        by_ray = np.empty((*gain.shape, 2, 3), gain.dtype)
        by_ray[..., :2] = radial_jacobian(xy, gain, by_rho / 2)
        by_ray[..., 2] = xy * -along[..., None]
        by_terms = (xy * (seen.theta * seen.per_rho)[..., None])[..., None] * seen.powers[
            ..., None, :
        ]
        return xy * gain[..., None], by_ray, by_terms

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


def _polar(terms: Array, rays: Array) -> _Polar:
    x, y, z = rays[..., 0], rays[..., 1], rays[..., 2]
    with np.errstate(all="ignore"):
        rho = np.sqrt(x * x + y * y)
        theta = _angle(rho, z)
        powers = np.multiply.accumulate(
            np.repeat((theta * theta)[..., None], len(terms), axis=-1), axis=-1
        )
        rd, slope = theta * (1 + powers @ terms), 1 + powers @ (ODD * terms)
        near = np.abs(rho) < SMALL * np.abs(z)
        per_rho = 1 / rho
        gain = rd * per_rho
        if near.any():
            gain = np.where(near & (z.real > 0), 1 / z, gain)
            per_rho = np.where(near, 0, per_rho)
        widest = float(theta.real.max(initial=0.0))
        if not (widest < np.pi and stays_positive(_slope_in_squares(terms), widest**2)):
            gain = np.where(theta.real <= _end(tuple(np.real(terms))), gain, np.nan)
        return _Polar(gain, slope, theta, powers, rho, per_rho, near)


def _angle(rho: Array, z: Array) -> Array:
    """Return atan2(ρ, z) for ρ ≥ 0, also of complex input (for derivative checks)."""
    if not (np.iscomplexobj(rho) or np.iscomplexobj(z)):
        return np.arctan2(rho, z)
    real = np.arctan2(rho.real, z.real)
    length2 = rho.real**2 + z.real**2
    return real + 1j * (rho.imag * z.real - z.imag * rho.real) / length2


def _slope_in_squares(terms: Array | tuple[float, ...]) -> list[float]:
    """Return the coefficients of r_d' in θ²."""
    return [1.0, *(ODD * np.real(terms)).tolist()]


@lru_cache(maxsize=256)
def _end(terms: tuple[float, ...]) -> float:
    """Return the largest angle used: where the radius stops rising, and never past 180°."""
    return min(float(np.sqrt(smallest_root(_slope_in_squares(terms)))), np.pi)
