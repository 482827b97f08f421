"""The contract of a camera model: what every model can do, what those with rays can do, and the view from above.

Models are frozen dataclasses; their fields are their parameters, and asdict() is their JSON. Points are (..., 2) and
keep their shape; a point out of reach is NaN.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import Field as DataclassField
from typing import Any, ClassVar, Self, TypeVar

import numpy as np

from touchline.core.errors import BadInput
from touchline.core.field import Region
from touchline.core.geometry import MAX_COORDINATE, Array, ImageSize, Points
from touchline.core.json_values import read

EXPORTED = "Send the JSON that Touchline exported."
RECTANGLE_FIELDS = (
    "width_px",
    "height_px",
    "n_rectangles_x",
    "n_rectangles_y",
    "region",
    "image_size",
)


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

    @abstractmethod
    def turned(self, turn_deg: int) -> Self:
        """Return the same camera for its picture turned clockwise: only raw pixels lie elsewhere, exactly.

        The corrected picture stays as it is, and so does the region with its own rotation.
        """

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


Model = TypeVar("Model", bound=CameraModel)


class TopView(CameraModel):
    """A model whose corrected frame is to scale: column 0 is the region's left border, column I_width its right one."""

    @property
    def _mm_per_px(self) -> Array:
        return np.array(
            [self.region.width_mm / self.width_px, self.region.height_mm / self.height_px]
        )

    def field_from_corrected(self, points: Points) -> Points:
        """Map corrected pixels to field mm: a scale and the region's place."""
        with np.errstate(invalid="ignore"):
            return self.region.field_from_region(np.asarray(points, float) * self._mm_per_px)

    def corrected_from_field(self, points: Points) -> Points:
        with np.errstate(invalid="ignore"):
            return self.region.region_from_field(np.asarray(points, float)) / self._mm_per_px


def read_model(kind: type[Model], parameters: Mapping[str, Any]) -> Model:
    """Read what asdict() wrote of a model with a rectangle of the field; BadInput for anything else."""
    model = read(
        kind, parameters, f"The parameters of the model {kind.NAME}", EXPORTED, "bad-parameters"
    )
    region = model.region.rotated(model.region.rotate_deg)
    ImageSize.of(model.image_size)
    if not (
        max(map(abs, (*region.x_mm, *region.y_mm))) < MAX_COORDINATE
        and 1 <= model.width_px <= 65535
        and 1 <= model.height_px <= 65535
        and model.width_px * model.height_px <= 2e8
        and 1 <= model.n_rectangles_x <= 1000
        and 1 <= model.n_rectangles_y <= 1000
        and region.x_mm[0] < region.x_mm[1]
        and region.y_mm[0] < region.y_mm[1]
    ):
        raise BadInput(
            "These parameters do not describe a rectangle of a field.",
            EXPORTED,
            reason="bad-parameters",
        )
    return model
