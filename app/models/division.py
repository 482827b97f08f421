"""Division model: a pinhole camera with a division lens."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar, Self

from app.models.lenses.division import DivisionLens
from app.models.ray_camera import RayCamera, example_parameters


@dataclass(frozen=True)
class Division(RayCamera):
    """A pinhole behind a division lens."""

    NAME: ClassVar[str] = "division"
    TITLE: ClassVar[str] = "Division"
    HELP: ClassVar[str] = "A pinhole with one distortion number: the fewest clicks a bent picture can be fitted with."
    LENS: ClassVar[type] = DivisionLens

    @classmethod
    def examples(cls) -> Iterable[Self]:
        """Yield a strong barrel, a pincushion, and nearly no lens at all."""
        for k, common in zip((-0.25, 0.06, -1e-9), example_parameters(), strict=True):
            yield cls(lens_terms=(k,), **common)
