"""SSL model: a pinhole camera with the one radial term that RoboCup's Small Size League transmits."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar, Self

from app.models.lenses.ssl import SslLens
from app.models.ray_camera import RayCamera, example_parameters


@dataclass(frozen=True)
class Ssl(RayCamera):
    """A pinhole behind the league's one-term lens."""

    NAME: ClassVar[str] = "ssl"
    TITLE: ClassVar[str] = "SSL"
    HELP: ClassVar[str] = ("The Small Size League's one-term lens: choose it when the league's software must use "
                           "the result.")
    LENS: ClassVar[type] = SslLens

    @classmethod
    def examples(cls) -> Iterable[Self]:
        """Yield a strong barrel, a pincushion (negative here), and nearly no lens at all."""
        for a, common in zip((0.3, -0.05, 1e-9), example_parameters(), strict=True):
            yield cls(lens_terms=(a,), **common)
