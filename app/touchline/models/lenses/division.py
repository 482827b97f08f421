"""Division model: one number bends the whole picture.

    r_u = r_d / (1 + k r_d²)   undistorts, and its inverse   r_d = 2 r_u / (1 + √(1 - 4 k r_u²))   distorts;
k is close to k1 of Brown–Conrady: negative for barrel.

A. W. Fitzgibbon, "Simultaneous linear estimation of multiple view geometry and lens distortion", CVPR 2001.
"""

from typing import ClassVar

import numpy as np

from touchline.core.geometry import Array, homogeneous
from touchline.models.lenses.projection import PowerTerms, pinhole, pinhole_jacobian, radial_jacobian


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
