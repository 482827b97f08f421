"""The corrected frame of models that know the carpet: their region seen straight from above, to scale."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields
from typing import Any

import numpy as np

from app.core.errors import BadInput
from app.core.field import Region
from app.core.geometry import MAX_COORDINATE, Array, ImageSize, Points, as_pair
from app.models.contract import CameraModel


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


@contextmanager
def reading_parameters(model: type[CameraModel], given: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Read what asdict() wrote of a model: exactly its fields.

    Whatever goes wrong in the block is raised as BadInput that names the model.
    """
    try:
        parameters = dict(given)
        names = {f.name for f in fields(model)}
        if set(parameters) != names:
            raise ValueError(f"expected {', '.join(sorted(names))}")
        yield parameters
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise BadInput(f"These are not parameters of the model {model.NAME}: {error}.",
                       "Send the JSON that Touchline exported.", reason="bad-parameters") from None


def read_rectangle(p: Mapping[str, Any]) -> dict[str, Any]:
    """Read the six fields of a TopView from what asdict() wrote.

    Raises BadInput where the numbers describe no rectangle, and KeyError, TypeError, ValueError, AttributeError or
    OverflowError where they are no numbers.
    """
    region = Region(str(p["region"]["name"]), as_pair(p["region"]["x_mm"]), as_pair(p["region"]["y_mm"]),
                    int(p["region"]["rotate_deg"]))
    width_px, height_px = float(p["width_px"]), float(p["height_px"])
    n_x, n_y = int(p["n_rectangles_x"]), int(p["n_rectangles_y"])
    size = ImageSize.of((p["image_size"]["width"], p["image_size"]["height"]))
    numbers = np.array([width_px, height_px, *region.x_mm, *region.y_mm])
    if not (np.abs(numbers).max() < MAX_COORDINATE  # NaN is not less
            and 1 <= width_px <= 65535 and 1 <= height_px <= 65535 and width_px * height_px <= 2e8
            and 1 <= n_x <= 1000 and 1 <= n_y <= 1000
            and region.x_mm[0] < region.x_mm[1] and region.y_mm[0] < region.y_mm[1]):
        raise BadInput("These parameters do not describe a rectangle of a field.",
                       "Send the JSON that Touchline exported.",
                       reason="bad-parameters")
    return {"width_px": width_px, "height_px": height_px, "n_rectangles_x": n_x, "n_rectangles_y": n_y,
            "region": region.rotated(region.rotate_deg), "image_size": size}
