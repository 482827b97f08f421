"""Brown–Conrady model: a pinhole camera with radial and tangential distortion."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar, Self

from app.models.lenses.brown_conrady import BrownConradyLens
from app.models.ray_camera import RayCamera, example_parameters


@dataclass(frozen=True)
class BrownConrady(RayCamera):
    """A pinhole behind a Brown–Conrady lens; lens_terms in the order of TERMS."""

    NAME: ClassVar[str] = "brown-conrady"
    TITLE: ClassVar[str] = "Brown–Conrady"
    HELP: ClassVar[str] = "A pinhole with radial and tangential distortion: right for nearly every field camera."
    LENS: ClassVar[type] = BrownConradyLens

    @classmethod
    def examples(cls) -> Iterable[Self]:
        """Yield a strong barrel, a tilted mild pincushion with tangential terms, and a rational wide angle."""
        lenses: list[tuple[float, ...]] = [(-0.28, 0.09, 0, 0, 0, 0, 0, 0), (0.06, 0.01, 0.001, -0.002, 0.003, 0, 0, 0),
                                         (0.35, 0.05, 0, 0, 0, 0.68, 0, 0)]
        for terms, common in zip(lenses, example_parameters(), strict=True):
            yield cls(lens_terms=tuple(float(t) for t in terms), **common)
