"""The part of the carpet that two cameras both see, as a grid over the field."""

from dataclasses import dataclass

import numpy as np
from typing_extensions import TypedDict

from touchline.core.errors import FitFailed
from touchline.core.field import Field
from touchline.core.geometry import Array, ImageSize, Mask, Points, inside_picture
from touchline.core.json_values import nullable
from touchline.models import CameraModel, raw_from_field

COARSE, FINE = 96, 40  # cells along the longer side: to find the shared part, and to draw it


class AreaMap(TypedDict):
    """x (columns,), y (rows,) mm; mm (rows, columns): a length at each place, null where it is not known."""

    x: list[float]
    y: list[float]
    mm: list[list[float | None]]


@dataclass(frozen=True, eq=False)
class SharedArea:
    """x (w,), y (h,) mm; both (h, w) bool: where both cameras see the carpet."""

    x: Array
    y: Array
    both: Mask

    @property
    def places(self) -> Points:
        return np.stack(np.meshgrid(self.x, self.y), axis=-1)

    @property
    def cell(self) -> Array:
        return np.array([self.x[1] - self.x[0], self.y[1] - self.y[0]])

    @property
    def area_m2(self) -> float:
        return float(self.both.sum() * self.cell[0] * self.cell[1]) / 1e6

    def map_json(self, mm: Array) -> AreaMap:
        return {"x": self.x.tolist(), "y": self.y.tolist(), "mm": nullable(mm)}


def shared_area(a: CameraModel, size_a: ImageSize, b: CameraModel, size_b: ImageSize, field: Field) -> SharedArea:
    """Grid the part of the field that both see, finely. FitFailed no-overlap where there is none."""
    half = np.array([field.length_mm, field.width_mm]) / 2
    coarse = _seen_by_both(a, size_a, b, size_b, -half, half, COARSE)
    if not coarse.both.any():
        raise FitFailed("The areas of the two cameras do not overlap.",
                        "Choose cameras whose images overlap.", reason="no-overlap")
    spans = [(axis[seen][0], axis[seen][-1]) for axis, seen in ((coarse.x, coarse.both.any(axis=0)),
                                                                (coarse.y, coarse.both.any(axis=1)))]
    low, high = np.transpose(spans)
    return _seen_by_both(a, size_a, b, size_b, low - coarse.cell / 2, high + coarse.cell / 2, FINE, 4)


def _seen_by_both(a: CameraModel, size_a: ImageSize, b: CameraModel, size_b: ImageSize, low: Array, high: Array,
                  cells: int, least: int = 2) -> SharedArea:
    sides = high - low
    counts = np.maximum(least, np.round(cells * sides / sides.max())).astype(int)
    x, y = (start + (np.arange(n) + 0.5) / n * side for start, n, side in zip(low, counts, sides, strict=True))
    places = np.stack(np.meshgrid(x, y), axis=-1)
    both = inside_picture(raw_from_field(a, places), size_a) & inside_picture(raw_from_field(b, places), size_b)
    return SharedArea(x, y, both)
