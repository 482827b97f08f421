"""The cameras with a lens: each is a ray camera behind one of lenses/, with the terms of three examples.

The examples stand where example_parameters() has its three cameras: straight down, tilted, tilted over half a field.
"""

from dataclasses import dataclass
from typing import ClassVar

from app.core.statements import named
from app.models.lenses import Lens
from app.models.lenses.brown_conrady import BrownConradyLens
from app.models.lenses.division import DivisionLens
from app.models.lenses.kannala_brandt import KannalaBrandtLens
from app.models.lenses.ssl import SslLens
from app.models.ray_camera import RayCamera


@dataclass(frozen=True)
class Division(RayCamera):
    """A strong barrel, a pincushion, and nearly no lens at all as examples."""

    NAME: ClassVar[str] = "division"
    TITLE: ClassVar[str] = named("model.division", "Division")
    HELP: ClassVar[str] = ("A pinhole with one distortion parameter: requires the fewest points of all models with "
                           "distortion.")
    LENS: ClassVar[type[Lens]] = DivisionLens
    EXAMPLE_TERMS: ClassVar = ((-0.25,), (0.06,), (-1e-9,))


@dataclass(frozen=True)
class BrownConrady(RayCamera):
    """A strong barrel, a mild pincushion with tangential terms, and a rational wide angle as examples."""

    NAME: ClassVar[str] = "brown-conrady"
    TITLE: ClassVar[str] = named("model.brown-conrady", "Brown–Conrady")
    HELP: ClassVar[str] = "A pinhole with radial and tangential distortion: suitable for nearly every field camera."
    LENS: ClassVar[type[Lens]] = BrownConradyLens
    EXAMPLE_TERMS: ClassVar = ((-0.28, 0.09, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
                               (0.06, 0.01, 0.001, -0.002, 0.003, 0.0, 0.0, 0.0),
                               (0.35, 0.05, 0.0, 0.0, 0.0, 0.68, 0.0, 0.0))


@dataclass(frozen=True)
class Fisheye(RayCamera):
    """A plain equidistant lens, a usual wide angle, and a strong one as examples."""

    NAME: ClassVar[str] = "fisheye"
    TITLE: ClassVar[str] = named("model.fisheye", "Fisheye (Kannala–Brandt)")
    HELP: ClassVar[str] = ("For very wide lenses that show straight lines as arcs. Requires points out to the edge of "
                           "the image.")
    LENS: ClassVar[type[Lens]] = KannalaBrandtLens
    EXAMPLE_TERMS: ClassVar = ((0.0, 0.0, 0.0, 0.0), (-0.02, 0.004, -0.001, 0.0), (0.08, -0.03, 0.01, -0.002))


@dataclass(frozen=True)
class Ssl(RayCamera):
    """A strong barrel, a pincushion (negative here), and nearly no lens at all as examples."""

    NAME: ClassVar[str] = "ssl"
    TITLE: ClassVar[str] = named("model.ssl", "SSL")
    HELP: ClassVar[str] = ("The one-parameter lens of the Small Size League: choose it when SSL-Vision must use the "
                           "result.")
    LENS: ClassVar[type[Lens]] = SslLens
    EXAMPLE_TERMS: ClassVar = ((0.3,), (-0.05,), (1e-9,))
