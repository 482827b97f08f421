"""A level rectangle that carries a picture: a corrected picture on the carpet, or an error surface over it."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from app.core.field import Region


@dataclass(frozen=True, eq=False)
class TexturedQuad:
    """A rectangle in the plane at z_mm: its middle (2,), its size, and unit vectors (2,) to its right and down it."""

    middle_mm: NDArray[np.float64]
    width_mm: float
    height_mm: float
    right: NDArray[np.float64]
    down: NDArray[np.float64]
    z_mm: float = 0.0

    @classmethod
    def through(cls, corners: NDArray[np.float64], z_mm: float = 0.0) -> Self:
        """From its top-left, top-right and bottom-left corners (3, 2) mm."""
        across, along = corners[1] - corners[0], corners[2] - corners[0]
        width, height = float(np.linalg.norm(across)), float(np.linalg.norm(along))
        return cls(corners[0] + (across + along) / 2, width, height, across / width, along / height, z_mm)

    @classmethod
    def over(cls, region: Region, z_mm: float = 0.0) -> Self:
        """The whole region, as it stands in the corrected picture."""
        w, h = region.width_mm, region.height_mm
        return cls.through(region.field_from_region(np.array([[0.0, 0.0], [w, 0.0], [0.0, h]])), z_mm)
