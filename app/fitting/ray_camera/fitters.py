"""The fitters of cameras with a lens: which terms each lens starts from, and which sets of terms "auto" tries."""

from dataclasses import replace
from typing import ClassVar

import numpy as np

from app.core.geometry import Array
from app.core.options import Option
from app.fitting.options import RAY_OPTIONS, TERMS_OPTION
from app.fitting.ray_camera.fit import RayFitter
from app.models.lens_models import BrownConrady, Division, Fisheye, Ssl
from app.models.ray_camera import RayCamera

USUAL_CORNER = 0.75  # of the picture, in focal lengths
MIN_DENOMINATOR = 0.2  # of the division lens, beyond which it says nothing of others


def _division_radii(k1: float, corner: float) -> tuple[Array, Array]:
    """Return undistorted and distorted radii (n,) of a division lens, out to a distorted radius."""
    distorted = np.linspace(corner / 40, corner, 40)
    below = 1 + k1 * distorted**2
    distorted, below = distorted[below > MIN_DENOMINATOR], below[below > MIN_DENOMINATOR]
    return distorted / below, distorted


def _odd_series(radius: Array, distorted: Array, count: int) -> Array:
    """Return c of distorted = r + c₁ r³ + c₂ r⁵ … by least squares, relative to the reach."""
    reach = radius[-1]
    share = radius / reach
    powers = np.stack([share ** (2 * k + 3) for k in range(count)], axis=1)
    found, *_ = np.linalg.lstsq(powers, (distorted - radius) / reach, rcond=None)
    return found / reach ** (2 * np.arange(count) + 2)


class DivisionFitter(RayFitter):
    MODEL: ClassVar[type[RayCamera]] = Division
    TERMS: ClassVar[tuple[str, ...]] = Division.LENS.TERMS

    @classmethod
    def start_terms(cls, k1: float, corner: float = USUAL_CORNER) -> Array:
        return np.array([k1])


class BrownConradyFitter(RayFitter):
    MODEL: ClassVar[type[RayCamera]] = BrownConrady
    TERMS: ClassVar[tuple[str, ...]] = ("k1", "k2", "p1", "p2", "k3")
    OPTIONS: ClassVar[tuple[Option, ...]] = (replace(TERMS_OPTION, choices=BrownConrady.LENS.TERMS), *RAY_OPTIONS)

    @classmethod
    def start_terms(cls, k1: float, corner: float = USUAL_CORNER) -> Array:
        undistorted, distorted = _division_radii(k1, corner)
        k1, k2, k3 = _odd_series(undistorted, distorted, 3)
        return np.array([k1, k2, 0, 0, k3, 0, 0, 0], float)


class FisheyeFitter(RayFitter):
    MODEL: ClassVar[type[RayCamera]] = Fisheye
    TERMS: ClassVar[tuple[str, ...]] = Fisheye.LENS.TERMS
    OPTIONS: ClassVar[tuple[Option, ...]] = (replace(TERMS_OPTION, choices=Fisheye.LENS.TERMS), *RAY_OPTIONS)

    @classmethod
    def start_terms(cls, k1: float, corner: float = USUAL_CORNER) -> Array:
        undistorted, distorted = _division_radii(k1, corner)
        return np.array([*_odd_series(np.arctan(undistorted), distorted, 2), 0, 0], float)


class SslFitter(RayFitter):
    MODEL: ClassVar[type[RayCamera]] = Ssl
    TERMS: ClassVar[tuple[str, ...]] = Ssl.LENS.TERMS
    ASPECT_SIGMA: ClassVar[float] = 0.0  # the league's message has one focal length

    @classmethod
    def start_terms(cls, k1: float, corner: float = USUAL_CORNER) -> Array:
        return np.array([-k1])
