"""The fitters of cameras with a lens: which terms each lens starts from, and which sets of terms "auto" tries."""

from dataclasses import replace
from typing import ClassVar

import numpy as np

from app.core.geometry import Array
from app.core.options import Option
from app.fitting.ray_camera.fit import RayFitter
from app.fitting.ray_camera.options import RAY_OPTIONS, TERMS_OPTION
from app.models.brown_conrady import BrownConrady
from app.models.division import Division
from app.models.fisheye import Fisheye
from app.models.ray_camera import RayCamera
from app.models.ssl import Ssl


class DivisionFitter(RayFitter):
    MODEL: ClassVar[type[RayCamera]] = Division

    @classmethod
    def start_terms(cls, k1: float) -> Array:
        return np.array([k1])


class BrownConradyFitter(RayFitter):
    MODEL: ClassVar[type[RayCamera]] = BrownConrady
    OPTIONS: ClassVar[tuple[Option, ...]] = (replace(TERMS_OPTION, choices=BrownConrady.LENS.TERMS), *RAY_OPTIONS)

    @classmethod
    def start_terms(cls, k1: float) -> Array:
        return np.array([k1, 0, 0, 0, 0, 0, 0, 0], float)

    @classmethod
    def term_sets(cls) -> tuple[tuple[str, ...], ...]:
        return (), ("k1",), ("k1", "k2"), ("k1", "k2", "k3"), ("k1", "k2", "p1", "p2", "k3")


class FisheyeFitter(RayFitter):
    MODEL: ClassVar[type[RayCamera]] = Fisheye
    OPTIONS: ClassVar[tuple[Option, ...]] = (replace(TERMS_OPTION, choices=Fisheye.LENS.TERMS), *RAY_OPTIONS)

    @classmethod
    def start_terms(cls, k1: float) -> Array:
        return np.array([k1 + 1 / 3, 0, 0, 0], float)  # atan r = r - r³/3 …: k1 = -1/3 is the equidistant lens

    @classmethod
    def term_sets(cls) -> tuple[tuple[str, ...], ...]:
        return (), ("k1",), ("k1", "k2"), ("k1", "k2", "k3", "k4")


class SslFitter(RayFitter):
    MODEL: ClassVar[type[RayCamera]] = Ssl

    @classmethod
    def start_terms(cls, k1: float) -> Array:
        return np.array([-k1])
