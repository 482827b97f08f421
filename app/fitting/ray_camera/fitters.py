"""The fitters of cameras with a lens: which terms each lens starts from, and which sets of terms "auto" tries."""

from dataclasses import replace
from typing import ClassVar

from app.core.options import Option
from app.fitting.options import RAY_OPTIONS, TERMS_OPTION
from app.fitting.ray_camera.fit import RayFitter
from app.models.lens_models import BrownConrady, Division, Fisheye, Ssl
from app.models.ray_camera import RayCamera


class DivisionFitter(RayFitter):
    MODEL: ClassVar[type[RayCamera]] = Division


class BrownConradyFitter(RayFitter):
    MODEL: ClassVar[type[RayCamera]] = BrownConrady
    OPTIONS: ClassVar[tuple[Option, ...]] = (replace(TERMS_OPTION, choices=BrownConrady.LENS.TERMS), *RAY_OPTIONS)
    TERM_SETS: ClassVar = (), ("k1",), ("k1", "k2"), ("k1", "k2", "k3"), ("k1", "k2", "p1", "p2", "k3")


class FisheyeFitter(RayFitter):
    MODEL: ClassVar[type[RayCamera]] = Fisheye
    OPTIONS: ClassVar[tuple[Option, ...]] = (replace(TERMS_OPTION, choices=Fisheye.LENS.TERMS), *RAY_OPTIONS)
    TERM_SETS: ClassVar = (), ("k1",), ("k1", "k2"), ("k1", "k2", "k3", "k4")
    FIRST_TERM: ClassVar = (1.0, 1 / 3)  # atan r = r - r³/3 …: k1 = -1/3 is the equidistant lens


class SslFitter(RayFitter):
    MODEL: ClassVar[type[RayCamera]] = Ssl
    FIRST_TERM: ClassVar = (-1.0, 0.0)
