"""What a picture shows of lines, made once for every field and area that is looked for in it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import cv2
import numpy as np

from touchline.core.geometry import Array, ImageSize, Points
from touchline.fitting.field_lines.blind_distortion import UndistortedPlane, estimate_bend
from touchline.fitting.field_lines.four_lines import quadrilaterals
from touchline.fitting.field_lines.line_merging import merge_chains
from touchline.fitting.field_lines.score import RidgeMaps

MAX_LINES = 16


@dataclass(frozen=True, eq=False)
class SeenLines:
    """points (n, 2) raw px on ridges, along (n, 2) unit vectors; lines: the longest, homogeneous, in the plane."""

    size: ImageSize
    plane: UndistortedPlane
    points: Points
    along: Array
    lines: list[Array]
    ridges: RidgeMaps

    @classmethod
    def of(cls, chains: Sequence[Points], along: Sequence[Array], size: ImageSize) -> Self:
        """chains: points (n, 2) raw px along each ridge, longest first; along: unit vectors at them."""
        plane = UndistortedPlane.of(size, estimate_bend(chains, size))
        points, directions = (np.concatenate([np.empty((0, 2)), *parts]) for parts in (chains, along))
        return cls(size, plane, points, directions, merge_chains(chains, plane, MAX_LINES),
                   RidgeMaps.of(points, directions, size))

    @cached_property
    def quadrilaterals(self) -> Array:
        """Of each two lines across two others, (q, 3, 3) from the unit square."""
        return quadrilaterals(self.lines)

    def within(self, outline: Points) -> Self:
        """Return the same of which only the points within an outline (k, 2) px count; the lines stay."""
        mask = np.zeros((self.size.height, self.size.width), np.uint8)
        cv2.fillPoly(mask, [np.round(outline).astype(np.int32)], 1)
        column, row = np.round(self.points).astype(int).T
        inside = mask[np.clip(row, 0, self.size.height - 1), np.clip(column, 0, self.size.width - 1)] > 0
        return replace(self, points=self.points[inside], along=self.along[inside])

    def some(self, most: int) -> tuple[Points, Array]:
        """Return so many of the points, and the directions there; the same each time."""
        picked = np.random.default_rng(0).permutation(len(self.points))[:most]
        return self.points[picked], self.along[picked]
