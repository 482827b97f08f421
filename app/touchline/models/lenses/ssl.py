"""The SSL model: one radial term in the undistort direction, as RoboCup's Small Size League puts it on the wire.

    r_u = r_d (1 + a r_d²);   a is close to -k1 of Brown–Conrady: positive for barrel.

Its inverse solves the cubic by Newton's method. Known from the league's geometry messages (formats.md's facts).
"""

from typing import ClassVar

import numpy as np

from touchline.core.geometry import Array, homogeneous
from touchline.models.lenses.projection import (
    PowerTerms,
    invert_radius,
    pinhole,
    pinhole_jacobian,
    radial_jacobian,
)


class SslLens(PowerTerms):
    TERMS: ClassVar[tuple[str, ...]] = ("a",)
    POWERS: ClassVar[tuple[int, ...]] = (2,)

    @staticmethod
    def distort(terms: Array, rays: Array) -> Array:
        xy = pinhole(rays)
        return xy * _gain(terms[0], np.sum(xy * xy, axis=-1))[..., None]

    @staticmethod
    def distort_jacobian(terms: Array, rays: Array) -> tuple[Array, Array, Array]:
        """Differentiate g (1 + a g² r_u²) = 1, where g = r_d / r_u."""
        a = terms[0]
        xy, by_ray = pinhole_jacobian(rays)
        rr = np.sum(xy * xy, axis=-1)
        gain = _gain(a, rr)
        below = 1 + 3 * a * gain**2 * rr
        slope, by_a = -a * gain**3 / below, -(gain**3) * rr / below
        return (
            xy * gain[..., None],
            radial_jacobian(xy, gain, slope) @ by_ray,
            (xy * by_a[..., None])[..., None],
        )

    @staticmethod
    def undistort(terms: Array, plane: Array) -> Array:
        a = terms[0]
        with np.errstate(all="ignore"):
            rr = np.sum(plane * plane, axis=-1)
            # beyond, the undistorted radius would shrink
            gain = np.where(1 + 3 * a * rr > 0, 1 + a * rr, np.nan)
            xy = plane * gain[..., None]
        return np.where(np.isfinite(xy).all(axis=-1, keepdims=True), homogeneous(xy), np.nan)


def _gain(a: float, rr: Array) -> Array:
    """Return r_d / r_u at r_u² = rr; complex input (for derivative checks) takes Newton steps from the real root."""
    real_a = float(np.real(a))
    r_u = np.sqrt(np.fmax(np.real(rr), 0.0))  # fmax: NaN, behind the camera, is put back below
    limit = 1 / np.sqrt(-3 * real_a) if real_a < 0 else np.inf
    r_d = invert_radius(r_u, lambda r: (r * (1 + real_a * r * r), 1 + 3 * real_a * r * r), limit)
    with np.errstate(all="ignore"):
        gain = np.where(r_u > 0, r_d / np.where(r_u > 0, r_u, 1), 1.0)
    gain = np.where(np.isnan(np.real(rr)), np.nan, gain)
    if np.iscomplexobj(rr) or np.iscomplexobj(a):
        gain = gain.astype(complex)
        for _ in range(3):
            gain = gain - (gain * (1 + a * gain**2 * rr) - 1) / (1 + 3 * a * gain**2 * rr)
    return gain
