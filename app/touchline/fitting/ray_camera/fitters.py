"""The fitters of cameras with a lens: which terms each lens starts from, and which sets of terms "auto" tries."""

from dataclasses import replace
from typing import ClassVar

import numpy as np

from touchline.core.geometry import Array
from touchline.core.options import Option
from touchline.fitting.division import division_radii, odd_series
from touchline.fitting.options import RAY_OPTIONS, TERMS_OPTION
from touchline.fitting.ray_camera.fit import RayFitter
from touchline.models.ray_camera import BrownConrady, Division, Fisheye, RayCamera, Ssl

USUAL_CORNER = 0.75  # of the picture, in focal lengths


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
        k1, k2, k3 = odd_series(*division_radii(k1, corner), 3)
        return np.array([k1, k2, 0, 0, k3, 0, 0, 0], float)


class FisheyeFitter(RayFitter):
    MODEL: ClassVar[type[RayCamera]] = Fisheye
    TERMS: ClassVar[tuple[str, ...]] = Fisheye.LENS.TERMS
    OPTIONS: ClassVar[tuple[Option, ...]] = (replace(TERMS_OPTION, choices=Fisheye.LENS.TERMS), *RAY_OPTIONS)

    @classmethod
    def start_terms(cls, k1: float, corner: float = USUAL_CORNER) -> Array:
        undistorted, distorted = division_radii(k1, corner)
        return np.array([*odd_series(np.arctan(undistorted), distorted, 2), 0, 0], float)


class SslFitter(RayFitter):
    MODEL: ClassVar[type[RayCamera]] = Ssl
    TERMS: ClassVar[tuple[str, ...]] = Ssl.LENS.TERMS
    ASPECT_SIGMA: ClassVar[float] = 0.0  # the league's message has one focal length

    @classmethod
    def start_terms(cls, k1: float, corner: float = USUAL_CORNER) -> Array:
        return np.array([-k1])
