"""Division model: one number bends the whole picture; its form with two or three even terms; the nearest odd series.

    r_u = r_d / (1 + k r_d²)   undistorts, and its inverse   r_d = 2 r_u / (1 + √(1 - 4 k r_u²))   distorts;

k is close to k1 of Brown–Conrady: negative for barrel.

A. W. Fitzgibbon, "Simultaneous linear estimation of multiple view geometry and lens distortion", CVPR 2001. The even
division model has more terms:

    r_u = r_d / (1 + k1 r_d² + k2 r_d⁴ + k3 r_d⁶)

Its terms belong to distorted radii, which end at the picture's corner; those
of Brown–Conrady belong to straight radii, which a wide lens sends far out: there a few terms of a series are no lens
any more, and each picture finds others. After M. Alemán-Flores et al., "Automatic lens distortion correction using
one-parameter division models", IPOL 2014, and A. Fitzgibbon 2001.
"""

from functools import lru_cache
from typing import ClassVar

import numpy as np

from touchline.core.geometry import Array, homogeneous
from touchline.models.lenses.projection import (
    PowerTerms,
    invert_radius,
    pinhole,
    pinhole_jacobian,
    radial_jacobian,
    smallest_root,
    solve_2x2,
)

MIN_DENOMINATOR = 0.2  # of the division lens, beyond which it says nothing of others


class DivisionLens(PowerTerms):
    TERMS: ClassVar[tuple[str, ...]] = ("k",)
    POWERS: ClassVar[tuple[int, ...]] = (2,)

    @staticmethod
    def distort(terms: Array, rays: Array) -> Array:
        xy = pinhole(rays)
        return xy * (2 / (1 + _root(terms[0], np.sum(xy * xy, axis=-1))))[..., None]

    @staticmethod
    def distort_jacobian(terms: Array, rays: Array) -> tuple[Array, Array, Array]:
        k = terms[0]
        xy, by_ray = pinhole_jacobian(rays)
        rr = np.sum(xy * xy, axis=-1)
        root = _root(k, rr)
        gain = 2 / (1 + root)
        by_krr = 4 / ((1 + root) ** 2 * root)  # d gain / d (k r²)
        by_terms = (xy * (by_krr * rr)[..., None])[..., None]
        return xy * gain[..., None], radial_jacobian(xy, gain, by_krr * k) @ by_ray, by_terms

    @staticmethod
    def undistort(terms: Array, plane: Array) -> Array:
        with np.errstate(all="ignore"):
            bend = terms[0] * np.sum(plane * plane, axis=-1)
            # r_d < 1/√-k, where the ray lies flat (barrel), or < 1/√k, where the picture turns back (pincushion).
            xy = plane / np.where(np.abs(bend) < 1, 1 + bend, np.nan)[..., None]
        return np.where(np.isfinite(xy).all(axis=-1, keepdims=True), homogeneous(xy), np.nan)


def _root(k: float, rr: Array) -> Array:
    with np.errstate(all="ignore"):
        square = 1 - 4 * k * rr
        return np.sqrt(np.where(square.real > 0, square, np.nan))


class EvenDivisionLens(PowerTerms):
    TERMS: ClassVar[tuple[str, ...]] = ("k1", "k2", "k3")
    POWERS: ClassVar[tuple[int, ...]] = (2, 4, 6)

    @staticmethod
    def distort(terms: Array, rays: Array) -> Array:
        xy = pinhole(rays)
        straight = np.linalg.norm(xy, axis=-1)
        distorted = invert_radius(straight, lambda r: _radius(terms, r), _horizon(tuple(terms)))
        with np.errstate(all="ignore"):
            return xy * np.where(straight > 0, distorted / straight, 1.0)[..., None]

    @staticmethod
    def distort_jacobian(terms: Array, rays: Array) -> tuple[Array, Array, Array]:
        """Differentiate by way of the inverse U = D⁻¹: D' = (U')⁻¹ and ∂D/∂k = -(U')⁻¹ ∂U/∂k."""
        _, by_ray = pinhole_jacobian(rays)
        plane = EvenDivisionLens.distort(terms, rays)
        rr = np.sum(plane * plane, axis=-1)
        powers = np.stack([rr, rr**2, rr**3], axis=-1)
        gain = 1 / (1 + powers @ terms)
        slope = -(terms[0] + rr * (2 * terms[1] + 3 * rr * terms[2])) * gain**2
        m = radial_jacobian(plane, gain, slope)
        by_terms = -plane[..., :, None] * (gain[..., None] ** 2 * powers)[..., None, :]
        return plane, solve_2x2(m, by_ray), -solve_2x2(m, by_terms)

    @staticmethod
    def undistort(terms: Array, plane: Array) -> Array:
        rr = np.sum(plane * plane, axis=-1)
        with np.errstate(all="ignore"):
            gain = 1 / (1 + rr * (terms[0] + rr * (terms[1] + rr * terms[2])))
            within = rr < _horizon(tuple(terms)) ** 2
        return np.where(within[..., None], homogeneous(plane * gain[..., None]), np.nan)


def _radius(terms: Array, r: Array) -> tuple[Array, Array]:
    rr = r * r
    below = 1 + rr * (terms[0] + rr * (terms[1] + rr * terms[2]))
    by_r = r * (2 * terms[0] + rr * (4 * terms[1] + 6 * rr * terms[2]))
    return r / below, (below - r * by_r) / below**2


@lru_cache(maxsize=256)
def _horizon(terms: tuple[float, ...]) -> float:
    """Return the distorted radius at which the ray is at 90° or the picture folds back; infinity if never."""
    k1, k2, k3 = terms
    # of the divisor, and of the slope times its square
    return float(np.sqrt(smallest_root([1.0, k1, k2, k3], [1.0, -k1, -3 * k2, -5 * k3]))) * (
        1 - 1e-12
    )


def division_radii(k: float, corner: float) -> tuple[Array, Array]:
    """Return undistorted and distorted radii (n,) of a division lens, out to a distorted radius."""
    distorted = np.linspace(corner / 40, corner, 40)
    below = 1 + k * distorted**2
    distorted, below = distorted[below > MIN_DENOMINATOR], below[below > MIN_DENOMINATOR]
    return distorted / below, distorted


def odd_series(radius: Array, distorted: Array, count: int) -> Array:
    """Return c of distorted = r + c₁ r³ + c₂ r⁵ … by least squares, relative to the reach."""
    reach = radius[-1]
    share = radius / reach  # powers of a small r would vanish
    powers = np.stack([share ** (2 * k + 3) for k in range(count)], axis=1)
    found, *_ = np.linalg.lstsq(powers, (distorted - radius) / reach, rcond=None)
    return found / reach ** (2 * np.arange(count) + 2)
