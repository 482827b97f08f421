"""Brown–Conrady: radial and tangential distortion of a pinhole, with OpenCV's terms in OpenCV's order.

    r² = x² + y²,   L = (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶)
    x_d = x L + 2 p1 x y + p2 (r² + 2 x²),   y_d = y L + p1 (r² + 2 y²) + 2 p2 x y

D. C. Brown, "Close-range camera calibration", 1971; A. E. Conrady, 1919.
"""

from functools import lru_cache
from typing import ClassVar

import numpy as np

from touchline.core.geometry import Array, Mask, homogeneous
from touchline.models.lenses.projection import (
    PowerTerms,
    invert_radius,
    pinhole,
    pinhole_jacobian,
    radial_jacobian,
    smallest_root,
    stays_positive,
)

TERMS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
SHORT_OF_POLE = 1 - 1e-12  # where the divisor is 0 there is no value
SHORT_OF_SIDEWAYS = 20.0  # a tangent: 87° from the axis
NEWTON_STEPS = 50  # five are usual; near the horizon a few more


class BrownConradyLens(PowerTerms):
    TERMS: ClassVar[tuple[str, ...]] = TERMS
    POWERS: ClassVar[tuple[int, ...]] = (2, 4, 1, 1, 6, 2, 4, 6)
    # the tangential part is 2 (t · x) x + r² t with t = (p2, p1)
    VECTORS: ClassVar[tuple[tuple[str, str], ...]] = (("p2", "p1"),)

    @staticmethod
    def distort(terms: Array, rays: Array) -> Array:
        p1, p2 = terms[2], terms[3]
        xy = pinhole(rays)
        x, y = xy[..., 0], xy[..., 1]
        rr = x * x + y * y
        plane = xy * _gain(terms, rr)[..., None]
        if p1 or p2:
            plane = plane + np.stack(
                [2 * p1 * x * y + p2 * (rr + 2 * x * x), p1 * (rr + 2 * y * y) + 2 * p2 * x * y],
                axis=-1,
            )
        known = tuple(np.real(terms))
        if np.max(rr.real, initial=0.0) < _unfolded(known) ** 2:
            return plane
        gain, slope, _ = _gain_and_slope(terms, rr)
        rising = _rises(radial_jacobian(xy, gain, slope) + _tangential_jacobian(p1, p2, x, y))
        return np.where((rising & (rr.real < _horizon(known) ** 2))[..., None], plane, np.nan)

    @staticmethod
    def distort_jacobian(terms: Array, rays: Array) -> tuple[Array, Array, Array]:
        p1, p2 = terms[2], terms[3]
        xy, by_ray = pinhole_jacobian(rays)
        x, y = xy[..., 0], xy[..., 1]
        rr = x * x + y * y
        gain, slope, below = _gain_and_slope(terms, rr)
        plane = xy * gain[..., None]
        plane[..., 0] += 2 * p1 * x * y + p2 * (rr + 2 * x * x)
        plane[..., 1] += p1 * (rr + 2 * y * y) + 2 * p2 * x * y
        by_xy = radial_jacobian(xy, gain, slope) + _tangential_jacobian(p1, p2, x, y)
        plane = np.where((_inside(terms, rr.real) & _rises(by_xy))[..., None], plane, np.nan)
        by_terms = np.empty((*xy.shape, 8), xy.dtype)
        powers = np.stack([rr, rr**2, rr**3], axis=-1) / below[..., None]
        by_powers = xy[..., :, None] * powers[..., None, :]
        by_terms[..., [0, 1, 4]] = by_powers
        by_terms[..., 5:] = -gain[..., None, None] * by_powers
        by_terms[..., 0, 2], by_terms[..., 1, 2] = 2 * x * y, rr + 2 * y * y
        by_terms[..., 0, 3], by_terms[..., 1, 3] = rr + 2 * x * x, 2 * x * y
        return plane, by_xy @ by_ray, by_terms

    @staticmethod
    def undistort(terms: Array, plane: Array) -> Array:
        """Invert the radial part in one dimension, then the tangential part by Newton's method."""
        limit = _horizon(tuple(terms))

        def distorted_radius(r: Array) -> tuple[Array, Array]:
            rr = r * r
            gain, slope, _ = _gain_and_slope(terms, rr)
            return r * gain, gain + 2 * rr * slope

        with np.errstate(all="ignore"):
            rd = np.linalg.norm(plane, axis=-1)
            r = invert_radius(
                np.minimum(rd, distorted_radius(np.asarray(limit))[0] if np.isfinite(limit) else rd)
                if terms[2] or terms[3]
                else rd,
                distorted_radius,
                limit,
            )
            xy = plane * np.where(rd > 0, r / np.where(rd > 0, rd, 1), 1)[..., None]
            if terms[2] or terms[3]:
                for _ in range(NEWTON_STEPS):
                    found, by_ray, _ = BrownConradyLens.distort_jacobian(terms, homogeneous(xy))
                    m = by_ray[..., :2]
                    det = m[..., 0, 0] * m[..., 1, 1] - m[..., 0, 1] * m[..., 1, 0]
                    e = found - plane
                    step = (
                        np.stack(
                            [
                                m[..., 1, 1] * e[..., 0] - m[..., 0, 1] * e[..., 1],
                                m[..., 0, 0] * e[..., 1] - m[..., 1, 0] * e[..., 0],
                            ],
                            -1,
                        )
                        / det[..., None]
                    )
                    xy = xy - step
                    if not np.nanmax(np.abs(step), initial=0.0) > 1e-14:
                        break
                error = np.linalg.norm(
                    BrownConradyLens.distort(terms, homogeneous(xy)) - plane, axis=-1
                )
                xy = np.where((error < 1e-9)[..., None], xy, np.nan)
        return np.where(np.isfinite(xy).all(axis=-1, keepdims=True), homogeneous(xy), np.nan)


def _gain(terms: Array, rr: Array) -> Array:
    k1, k2, _, _, k3, k4, k5, k6 = terms
    above = 1 + rr * (k1 + rr * (k2 + rr * k3))
    return above if not (k4 or k5 or k6) else above / (1 + rr * (k4 + rr * (k5 + rr * k6)))


def _gain_and_slope(terms: Array, rr: Array) -> tuple[Array, Array, Array]:
    """Return L, its derivative by r², and its divisor."""
    k1, k2, _, _, k3, k4, k5, k6 = terms
    if not (k4 or k5 or k6):
        return (
            1 + rr * (k1 + rr * (k2 + rr * k3)),
            k1 + rr * (2 * k2 + 3 * rr * k3),
            np.ones_like(rr),
        )
    below = 1 + rr * (k4 + rr * (k5 + rr * k6))
    gain = (1 + rr * (k1 + rr * (k2 + rr * k3))) / below
    return (
        gain,
        ((k1 + rr * (2 * k2 + 3 * rr * k3)) - gain * (k4 + rr * (2 * k5 + 3 * rr * k6))) / below,
        below,
    )


def _tangential_jacobian(p1: float, p2: float, x: Array, y: Array) -> Array:
    """Return d(tangential part)/d(x, y) (…, 2, 2)."""
    by_x, by_y = (
        np.array([[6 * p2, 2 * p1], [2 * p1, 2 * p2]]),
        np.array([[2 * p1, 2 * p2], [2 * p2, 6 * p1]]),
    )
    return x[..., None, None] * by_x + y[..., None, None] * by_y


def _rises(by_xy: Array) -> Mask:
    """Return where the picture has not folded, that is, both eigenvalues of the symmetric by_xy are positive.

    With a tangential part that is a little less far than the radius rises.
    """
    m = np.real(by_xy)
    a, b, d = m[..., 0, 0], m[..., 0, 1], m[..., 1, 1]
    return (a + d > 0) & (a * d > b * b)


def _inside(terms: Array, rr: Array) -> Mask | bool:
    """Return where squared radii lie before the horizon."""
    k1, k2, _, _, k3, k4, k5, k6 = np.real(terms).tolist()
    if not (k4 or k5 or k6) and stays_positive(
        [1, 3 * k1, 5 * k2, 7 * k3], float(rr.max(initial=0.0))
    ):
        return True
    return rr < _horizon((k1, k2, 0.0, 0.0, k3, k4, k5, k6)) ** 2


@lru_cache(maxsize=256)
def _unfolded(terms: tuple[float, ...]) -> float:
    """Return an r up to which nothing folds whatever the direction: there the radial part outweighs the tangential."""
    r = np.linspace(0, min(_horizon(terms), SHORT_OF_SIDEWAYS), 200)
    gain, slope, _ = _gain_and_slope(np.array(terms), r * r)
    folds = np.minimum(gain, gain + 2 * r * r * slope) <= 8 * np.hypot(terms[2], terms[3]) * r
    return float(r[max(int(np.argmax(folds)) - 1, 0)] if folds.any() else r[-1])


@lru_cache(maxsize=256)
def _horizon(terms: tuple[float, ...]) -> float:
    """Return the r at which the radial part stops rising; infinity if never."""
    k1, k2, _, _, k3, k4, k5, k6 = terms
    if not (k4 or k5 or k6):
        return float(np.sqrt(smallest_root(np.array([1, 3 * k1, 5 * k2, 7 * k3]))))
    above, below, order = np.array([1, k1, k2, k3]), np.array([1, k4, k5, k6]), np.arange(4)
    # (r L)' below² in r²; s a'(s) has the coefficients n aₙ
    rising = np.convolve(above, below) + 2 * (
        np.convolve(order * above, below) - np.convolve(above, order * below)
    )
    return float(np.sqrt(smallest_root(rising, below))) * SHORT_OF_POLE
