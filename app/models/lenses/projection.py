"""What lenses share: the pinhole projection, radial scaling, and the inverse of a rising radius."""

from collections.abc import Callable

import numpy as np

from app.core.geometry import Array

UNDISTORT_STEPS = 50  # Newton needs about five; near the horizon a few more
UNDISTORT_TOLERANCE = 1e-13  # focal lengths: 1e-10 px


def pinhole(rays: Array) -> Array:
    """Return (X/Z, Y/Z); NaN behind the camera."""
    with np.errstate(all="ignore"):
        z = np.where(rays[..., 2:].real > 0, rays[..., 2:], np.nan)
        return rays[..., :2] / z


def pinhole_jacobian(rays: Array) -> tuple[Array, Array]:
    """Return pinhole(rays) and its derivative by the ray, (…, 2) and (…, 2, 3)."""
    plane = pinhole(rays)
    derivative = np.zeros((*plane.shape, 3), plane.dtype)
    with np.errstate(all="ignore"):
        inverse = 1 / rays[..., 2]
    derivative[..., 0, 0] = derivative[..., 1, 1] = inverse
    derivative[..., :, 2] = -plane * inverse[..., None]
    return plane, derivative


def rays_of(plane: Array) -> Array:
    """Append a coordinate of 1: (x, y) to (x, y, 1)."""
    return np.concatenate([plane, np.ones((*plane.shape[:-1], 1))], axis=-1)


def radial(xy: Array, gain: Array) -> Array:
    """Return xy · gain, where gain is a function of r² = x² + y²."""
    return xy * gain[..., None]


def radial_jacobian(xy: Array, gain: Array, slope: Array) -> Array:
    """Return d(xy · gain)/d(xy) (…, 2, 2), where slope = d gain / d r²."""
    return gain[..., None, None] * np.eye(2) + 2 * slope[..., None, None] * xy[..., :, None] * xy[..., None, :]


def invert_radius(value: Array, function: Callable[[Array], tuple[Array, Array]], limit: float) -> Array:
    """Solve function(r)[0] = value for 0 ≤ r ≤ limit, where it rises; function returns the value and its derivative.

    Newton's method kept inside by bisection. NaN where value lies beyond function(limit).
    """
    with np.errstate(all="ignore"):
        top = function(np.asarray(limit))[0] if np.isfinite(limit) else np.inf
        reachable = (value >= 0) & (value <= top)
        goal = np.where(reachable, value, 0.0)
        low, high = np.zeros_like(goal), np.full_like(goal, limit)
        r = np.minimum(goal, limit)
        for _ in range(UNDISTORT_STEPS):
            found, slope = function(r)
            error = found - goal
            low, high = np.where(error < 0, r, low), np.where(error > 0, r, high)
            step = r - error / slope
            halfway = np.where(np.isfinite(high), (low + high) / 2, 2 * r + 1)
            following = np.where((step >= low) & (step <= high), step, halfway)
            moved = np.abs(following - r).max(initial=0.0)
            r = following
            if moved < UNDISTORT_TOLERANCE:
                break
        return np.where(reachable, r, np.nan)


def first_turn(coefficients: Array) -> float:
    """Return the smallest positive r at which Σ c_k r^(2k+1) stops rising; infinity if never."""
    powers = (2 * np.arange(len(coefficients)) + 1) * coefficients  # derivative as a polynomial in r²
    powers = np.trim_zeros(powers, "b")
    if len(powers) < 2:
        return np.inf
    roots = np.polynomial.polynomial.polyroots(powers)
    roots = roots[(np.abs(roots.imag) < 1e-9 * np.maximum(1, np.abs(roots.real))) & (roots.real > 0)].real
    return float(np.sqrt(roots.min())) if roots.size else np.inf
