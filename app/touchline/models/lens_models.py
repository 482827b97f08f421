"""The cameras with a lens: each is a ray camera behind one of lenses/."""

from dataclasses import dataclass
from typing import ClassVar

from touchline.core.statements import named
from touchline.models.lenses import Lens
from touchline.models.lenses.brown_conrady import BrownConradyLens
from touchline.models.lenses.division import DivisionLens
from touchline.models.lenses.kannala_brandt import KannalaBrandtLens
from touchline.models.lenses.ssl import SslLens
from touchline.models.ray_camera import RayCamera


@dataclass(frozen=True)
class Division(RayCamera):
    """A pinhole behind the division lens."""

    NAME: ClassVar[str] = "division"
    TITLE: ClassVar[str] = named("model.division", "Division")
    HELP: ClassVar[str] = ("A pinhole with one distortion parameter: requires the fewest points of all models with "
                           "distortion.")
    LENS: ClassVar[type[Lens]] = DivisionLens


@dataclass(frozen=True)
class BrownConrady(RayCamera):
    """A pinhole behind Brown and Conrady's lens, as OpenCV has it."""

    NAME: ClassVar[str] = "brown-conrady"
    TITLE: ClassVar[str] = named("model.brown-conrady", "Brown–Conrady")
    HELP: ClassVar[str] = "A pinhole with radial and tangential distortion: suitable for nearly every field camera."
    LENS: ClassVar[type[Lens]] = BrownConradyLens


@dataclass(frozen=True)
class Fisheye(RayCamera):
    """A fisheye behind Kannala and Brandt's lens."""

    NAME: ClassVar[str] = "fisheye"
    TITLE: ClassVar[str] = named("model.fisheye", "Fisheye (Kannala–Brandt)")
    HELP: ClassVar[str] = ("For very wide lenses that show straight lines as arcs. Requires points out to the edge of "
                           "the image.")
    LENS: ClassVar[type[Lens]] = KannalaBrandtLens


@dataclass(frozen=True)
class Ssl(RayCamera):
    """A pinhole behind the lens of the league's geometry messages."""

    NAME: ClassVar[str] = "ssl"
    TITLE: ClassVar[str] = named("model.ssl", "SSL")
    HELP: ClassVar[str] = ("The one-parameter lens of the Small Size League: choose it when SSL-Vision must use the "
                           "result.")
    LENS: ClassVar[type[Lens]] = SslLens
