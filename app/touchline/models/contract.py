"""The contract of a camera model: what every model can do, and what those with rays can do besides.

Models are frozen dataclasses; their fields are their parameters, and asdict() is their JSON. Points are (..., 2) and
keep their shape; a point out of reach is NaN.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import Field as DataclassField
from typing import Any, ClassVar, Self

import numpy as np

from touchline.core.field import Region
from touchline.core.geometry import Array, ImageSize, Points


class Rectification(ABC):
    """Maps between the raw and a corrected picture: all that a correction map needs to know."""

    @property
    @abstractmethod
    def corrected_size(self) -> ImageSize:
        """Return the size of the corrected picture."""

    @abstractmethod
    def corrected_from_raw(self, points: Points) -> Points:
        """Map raw pixels to corrected ones."""

    @abstractmethod
    def raw_from_corrected(self, points: Points) -> Points:
        """Map corrected pixels to raw ones, the exact inverse."""

    def raw_from_corrected_grid(self, x_c: Array, y_c: Array) -> tuple[Array, Array]:
        """Map a grid of corrected columns (w,) and rows (h, 1) to raw x and y, (h, w) each."""
        raw = self.raw_from_corrected(np.stack(np.broadcast_arrays(x_c, y_c), axis=-1))
        return raw[..., 0], raw[..., 1]


class CameraModel(Rectification):
    """Maps between raw pixels, corrected pixels and the carpet.

    width_px, height_px: I_width and I_height, the extent of the corrected rectangle, which holds n_rectangles_x by
    n_rectangles_y calibration rectangles of the region. image_size: of the raw picture.
    """

    NAME: ClassVar[str]
    TITLE: ClassVar[str]
    HELP: ClassVar[str]

    __dataclass_fields__: ClassVar[dict[str, DataclassField[Any]]]  # each model is a dataclass

    width_px: float
    height_px: float
    n_rectangles_x: int
    n_rectangles_y: int
    region: Region
    image_size: ImageSize

    @property
    def corrected_size(self) -> ImageSize:
        """One more than I_width × I_height, so that the far borders are in the picture too."""
        return ImageSize(round(self.width_px) + 1, round(self.height_px) + 1)

    @abstractmethod
    def field_from_corrected(self, points: Points) -> Points:
        """Map corrected pixels to field mm on the carpet."""

    @abstractmethod
    def corrected_from_field(self, points: Points) -> Points:
        """Map field mm on the carpet to corrected pixels, the exact inverse."""

    @classmethod
    @abstractmethod
    def from_parameters(cls, parameters: Mapping[str, Any]) -> Self:
        """Read what asdict() wrote; raise BadInput for anything else."""


class RayModel(CameraModel):
    """A camera with a centre of projection: it maps between raw pixels and field points at any height."""

    @abstractmethod
    def project(self, points_field_xyz: Array) -> Points:
        """Map field mm (..., 3) to raw pixels (..., 2)."""

    @abstractmethod
    def unproject(self, pixels: Points, z_mm: float | Array = 0.0) -> Points:
        """Map raw pixels (..., 2) to field mm (..., 2) in the plane at z_mm."""
