"""The corrected frame of models that know the carpet: their region seen straight from above, to scale."""

from collections.abc import Mapping
from typing import Any, TypeVar

import numpy as np

from touchline.core.errors import BadInput
from touchline.core.geometry import MAX_COORDINATE, Array, ImageSize, Points
from touchline.core.json_values import read
from touchline.models.contract import CameraModel

EXPORTED = "Send the JSON that Touchline exported."
Model = TypeVar("Model", bound=CameraModel)


class TopView(CameraModel):
    """A model whose corrected frame is to scale: column 0 is the region's left border, column I_width its right one."""

    @property
    def _mm_per_px(self) -> Array:
        return np.array([self.region.width_mm / self.width_px, self.region.height_mm / self.height_px])

    def field_from_corrected(self, points: Points) -> Points:
        """Map corrected pixels to field mm: a scale and the region's place."""
        with np.errstate(invalid="ignore"):
            return self.region.field_from_region(np.asarray(points, float) * self._mm_per_px)

    def corrected_from_field(self, points: Points) -> Points:
        with np.errstate(invalid="ignore"):
            return self.region.region_from_field(np.asarray(points, float)) / self._mm_per_px


RECTANGLE_FIELDS = ("width_px", "height_px", "n_rectangles_x", "n_rectangles_y", "region", "image_size")


def read_model(kind: type[Model], parameters: Mapping[str, Any]) -> Model:
    """Read what asdict() wrote of a model with a rectangle of the field; BadInput for anything else."""
    model = read(kind, parameters, f"The parameters of the model {kind.NAME}", EXPORTED, "bad-parameters")
    region = model.region.rotated(model.region.rotate_deg)
    ImageSize.of(model.image_size)
    if not (max(map(abs, (*region.x_mm, *region.y_mm))) < MAX_COORDINATE
            and 1 <= model.width_px <= 65535 and 1 <= model.height_px <= 65535
            and model.width_px * model.height_px <= 2e8
            and 1 <= model.n_rectangles_x <= 1000 and 1 <= model.n_rectangles_y <= 1000
            and region.x_mm[0] < region.x_mm[1] and region.y_mm[0] < region.y_mm[1]):
        raise BadInput("These parameters do not describe a rectangle of a field.", EXPORTED, reason="bad-parameters")
    return model
