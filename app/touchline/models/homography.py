"""Homography: a camera without a lens; straight lines stay straight, and eight numbers say all.

    (X, Y, 1) ~ M (x, y, 1),   M = field_from_raw, scaled to det M = -1

A picture's y runs down and the field's up, so a camera above the carpet has det M < 0 exactly where depth, the third
component, is positive: the scale makes M unique, and its sign says which side of the horizon is seen. R. Hartley,
A. Zisserman, "Multiple View Geometry" (2004), ch. 4.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np

from touchline.core.errors import BadInput
from touchline.core.field import Region
from touchline.core.geometry import (
    MAX_COORDINATE,
    Array,
    ImageSize,
    Points,
    as_triple,
    unreachable_where,
)
from touchline.core.quarter_turn import QuarterTurn
from touchline.core.statements import named
from touchline.models.contract import EXPORTED, TopView, read_model

UNIT_DET = 1e-6  # how far a determinant may be from -1 after a trip through text

Matrix = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]


@dataclass(frozen=True)
class Homography(TopView):
    """field_from_raw: rows of M, which takes raw pixels (x, y, 1) to field mm."""

    NAME: ClassVar[str] = "homography"
    TITLE: ClassVar[str] = named("model.homography", "Homography")
    HELP: ClassVar[str] = (
        "A camera without lens distortion, directly from four lines. Exact for a perfect lens; with "
        "distortion, errors of centimetres remain."
    )

    field_from_raw: Matrix
    width_px: float
    height_px: float
    n_rectangles_x: int
    n_rectangles_y: int
    region: Region
    image_size: ImageSize

    @cached_property
    def _matrix(self) -> Array:
        return np.array(self.field_from_raw)

    @cached_property
    def raw_from_field(self) -> Array:
        """Return the inverse matrix (3, 3)."""
        return np.asarray(np.linalg.inv(self._matrix), np.float64)

    def corrected_from_raw(self, points: Points) -> Points:
        """Map raw pixels to corrected ones; NaN on and beyond the horizon."""
        return self.corrected_from_field(apply_homography(self._matrix, points))

    def raw_from_corrected(self, points: Points) -> Points:
        """Map corrected pixels to raw ones; NaN for places behind the camera."""
        with np.errstate(invalid="ignore"):
            return apply_homography(self.raw_from_field, self.field_from_corrected(points))

    def turned(self, turn_deg: int) -> Self:
        """Return M T⁻¹, where T turns pixels: det T = 1, so that the scale stays as it is."""
        turn = QuarterTurn(turn_deg, self.image_size)
        first, second, third = self._matrix @ turn.back().turned_from_pixel
        return replace(
            self,
            field_from_raw=(as_triple(first), as_triple(second), as_triple(third)),
            image_size=turn.size_after,
        )

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, Any]) -> Self:
        model = read_model(cls, parameters)
        matrix = np.array(model.field_from_raw)
        with np.errstate(all="ignore"):
            if not (
                (np.abs(matrix) < MAX_COORDINATE).all()
                and abs(np.linalg.det(matrix) + 1) < UNIT_DET
            ):
                raise BadInput(
                    "The determinant of field_from_raw is not -1.",
                    EXPORTED,
                    reason="bad-parameters",
                )
        return model


def normalise(matrix: Array) -> Matrix:
    """Scale a homography to determinant -1; nested tuples."""
    first, second, third = matrix / np.cbrt(-np.linalg.det(matrix))
    return as_triple(first), as_triple(second), as_triple(third)


def apply_homography(matrix: Array, points: Points) -> Points:
    """Map points (..., 2) by a homography; NaN where depth is not positive, or a coordinate exceeds MAX_COORDINATE."""
    with np.errstate(all="ignore"):
        points = np.asarray(points, float)
        there = points @ matrix[:, :2].T + matrix[:, 2]
        mapped = there[..., :2] / there[..., 2:]
        near = (np.abs(points) < MAX_COORDINATE).all(axis=-1) & (
            np.abs(mapped) < MAX_COORDINATE
        ).all(axis=-1)
    return unreachable_where(~near | ~(there[..., 2] > 0), mapped)
