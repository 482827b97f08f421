"""What lenses share: the pinhole projection, radial scaling, the inverse of a rising radius, and terms by power."""

from collections.abc import Callable, Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from touchline.core.geometry import Array

UNDISTORT_STEPS = 50  # Newton needs about five; near the horizon a few more
UNDISTORT_TOLERANCE = 1e-13  # focal lengths: 1e-10 px
MAX_COEFFICIENT = 1e9  # what no lens has; beyond, rounding makes roots of its own


class PowerTerms:
    """A lens each of whose terms belongs to a power of the ray's tangent."""

    TERMS: ClassVar[tuple[str, ...]]
    POWERS: ClassVar[tuple[int, ...]]
    VECTORS: ClassVar[
        tuple[tuple[str, str], ...]
    ] = ()  # a radial lens looks the same after any turn

    @classmethod
    def power(cls, name: str) -> int:
        """Return a term's power by its name; 0 for what is no term, such as the centre."""
        return cls.POWERS[cls.TERMS.index(name)] if name in cls.TERMS else 0

    @classmethod
    def rescaled(cls, terms: Array, step: Array, log_scale: float) -> Array:
        """Return terms + step to first order, for a focal length e^s as long and tangents e^-s as large.

        A step = POWERS · terms · s leaves the picture exactly as it was, and so it is for all s: longer lenses from
        further above bend it likewise. A search along terms alone leaves that curve, and creeps.
        """
        powers = np.array(cls.POWERS)
        return (terms + step - powers * terms * log_scale) * np.exp(powers * log_scale)

    @classmethod
    def at_scale(cls, terms: Array, log_scale: float) -> tuple[Array, Array, Array]:
        """Return the terms that bend a picture likewise at a focal length e^s as long, and d/d terms (k, k), d/d s."""
        powers = np.array(cls.POWERS)
        scale = np.exp(powers * log_scale)
        return terms * scale, np.diag(scale), powers * terms * scale

    @classmethod
    def turned(cls, terms: Array, rotation: Array) -> Array:
        """Return the terms of the same lens in a turned picture; rotation (2, 2)."""
        found = np.array(terms, float)
        for pair in cls.VECTORS:
            places = [cls.TERMS.index(name) for name in pair]
            found[places] = rotation @ found[places]
        return found


def pinhole(rays: Array) -> Array:
    """Return (X/Z, Y/Z); NaN behind the camera."""
    with np.errstate(all="ignore"):
        z = np.where(rays[..., 2:].real > 0, rays[..., 2:], np.nan)
        return rays[..., :2] / z


def stays_positive(coefficients: Sequence[float], end: float) -> bool:
    """Return whether a polynomial, its coefficients ascending and the first one positive, surely has no root up to end.

    No is no answer: only the falling terms are counted, all at once, which costs less than the roots.
    """
    falling = 0.0
    for coefficient in reversed(coefficients[1:]):
        falling = end * (falling + min(coefficient, 0.0))
    return coefficients[0] + falling > 0 and max(coefficients) < MAX_COEFFICIENT


def pinhole_jacobian(rays: Array) -> tuple[Array, Array]:
    """Return pinhole(rays) and its derivative by the ray, (…, 2) and (…, 2, 3)."""
    plane = pinhole(rays)
    derivative = np.zeros((*plane.shape, 3), plane.dtype)
    with np.errstate(all="ignore"):
        inverse = 1 / rays[..., 2]
    derivative[..., 0, 0] = derivative[..., 1, 1] = inverse
    derivative[..., :, 2] = -plane * inverse[..., None]
    return plane, derivative


def radial_jacobian(xy: Array, gain: Array, slope: Array) -> Array:
    """Return d(xy · gain)/d(xy) (…, 2, 2), where slope = d gain / d r²."""
    return (
        gain[..., None, None] * np.eye(2)
        + 2 * slope[..., None, None] * xy[..., :, None] * xy[..., None, :]
    )


def invert_radius(
    value: Array, function: Callable[[Array], tuple[Array, Array]], limit: float
) -> Array:
    """Solve function(r)[0] = value for 0 ≤ r ≤ limit, where it rises; function returns the value and its derivative.

    Newton's method, and bisection where a step would leave or is no shorter than half of the one before, so that it
    cannot go to and fro (W. Press et al., Numerical Recipes, "rtsafe"). NaN where value lies beyond function(limit).
    """
    with np.errstate(all="ignore"):
        top = function(np.asarray(limit))[0] if np.isfinite(limit) else np.inf
        reachable = (value >= 0) & (value <= top)
        goal = np.where(reachable, value, 0.0)
        low, high = np.zeros_like(goal), np.full_like(goal, limit)
        r = np.minimum(goal, limit)
        before = np.full_like(goal, np.inf)
        for _ in range(UNDISTORT_STEPS):
            found, slope = function(r)
            error = found - goal
            low, high = np.where(error < 0, r, low), np.where(error > 0, r, high)
            step = r - error / slope
            halfway = np.where(np.isfinite(high), (low + high) / 2, 2 * r + 1)
            newton = (
                (step >= low)
                & (step <= high)
                & (np.abs(step - r) <= np.maximum(before / 2, UNDISTORT_TOLERANCE))
            )
            following = np.where(newton, step, halfway)
            before, r = np.abs(following - r), following
            if before.max(initial=0.0) < UNDISTORT_TOLERANCE:
                break
        return np.where(reachable, r, np.nan)


def smallest_root(*polynomials: ArrayLike) -> float:
    """Return the smallest positive real root of polynomials with ascending coefficients; infinity if there is none.

    NaN where a coefficient is not finite. One so small that the others cannot be divided by it counts as 0.
    """
    found = []
    for polynomial in polynomials:
        coefficients = np.asarray(polynomial, np.float64)
        if not np.isfinite(coefficients).all():
            return np.nan
        with np.errstate(all="ignore"):
            while len(coefficients) > 1 and not np.isfinite(coefficients / coefficients[-1]).all():
                coefficients = coefficients[:-1]
        if len(coefficients) > 1:
            roots = np.roots(coefficients[::-1])
            near_real = np.abs(roots.imag) < 1e-9 * np.maximum(1, np.abs(roots.real))
            found += [float(v) for v in roots[near_real & (roots.real > 0)].real]
    return min(found, default=np.inf)


def solve_2x2(matrix: Array, right: Array) -> Array:
    """Solve matrix (…, 2, 2) · x = right (…, 2, n); not finite where it is singular."""
    (a, b), (c, d) = np.moveaxis(matrix, (-2, -1), (0, 1))
    with np.errstate(all="ignore"):
        det = a * d - b * c
        inverse = (
            np.stack([np.stack([d, -b], -1), np.stack([-c, a], -1)], -2) / det[..., None, None]
        )
        return inverse @ right
