"""Fisheye model: a camera with a Kannala–Brandt lens."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar, Self

from app.models.lenses.kannala_brandt import KannalaBrandtLens
from app.models.ray_camera import RayCamera, example_parameters


@dataclass(frozen=True)
class Fisheye(RayCamera):
    """A camera behind a Kannala–Brandt fisheye."""

    NAME: ClassVar[str] = "fisheye"
    TITLE: ClassVar[str] = "Fisheye (Kannala–Brandt)"
    HELP: ClassVar[str] = "For lenses so wide that straight lines become arcs; needs points out to the picture's edge."
    LENS: ClassVar[type] = KannalaBrandtLens

    @classmethod
    def examples(cls) -> Iterable[Self]:
        """Yield a plain equidistant lens, a usual wide angle, and a strong one."""
        for terms, common in zip(((0.0, 0.0, 0.0, 0.0), (-0.02, 0.004, -0.001, 0.0), (0.08, -0.03, 0.01, -0.002)),
                                 example_parameters(), strict=True):
            yield cls(lens_terms=terms, **common)
