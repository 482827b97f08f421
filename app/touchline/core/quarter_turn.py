"""A quarter turn of a picture, clockwise: what a driver does for a camera that is mounted upside down or sideways.

    turned = R pixel + shift,   R = [[cos, -sin], [sin, cos]]

with x right and y down; the shift brings the corner that went furthest back to pixel (0, 0). At 90° the pixel (x, y) of
a picture of height H goes to (H - 1 - y, x). R has only 0, 1 and -1: the turn is exact.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from touchline.core.errors import BadInput
from touchline.core.field import QUARTER_TURNS
from touchline.core.geometry import Array, ImageSize, Points, as_pair
from touchline.core.statements import say


@dataclass(frozen=True)
class QuarterTurn:
    """turn_deg: clockwise, one of QUARTER_TURNS. size: of the picture before the turn."""

    turn_deg: int
    size: ImageSize

    def __post_init__(self) -> None:
        check_turn(self.turn_deg)

    @property
    def is_sideways(self) -> bool:
        """Whether width and height change places."""
        return self.turn_deg % 180 != 0

    @property
    def size_after(self) -> ImageSize:
        width, height = self.size
        return ImageSize(height, width) if self.is_sideways else self.size

    @cached_property
    def matrix(self) -> Array:
        """Return R (2, 2), which turns directions and distances in the picture."""
        cos, sin = ((1, 0), (0, 1), (-1, 0), (0, -1))[self.turn_deg // 90]
        return np.array([[cos, -sin], [sin, cos]], float)

    @cached_property
    def about_axis(self) -> Array:
        """Return (3, 3): the same for directions in the camera's frame, z ahead."""
        turned = np.eye(3)
        turned[:2, :2] = self.matrix
        return turned

    @cached_property
    def turned_from_pixel(self) -> Array:
        """Return the map of pixels as a matrix (3, 3) for (x, y, 1)."""
        corner = self.matrix @ (np.array(tuple(self.size)) - 1)
        turned = self.about_axis.copy()
        turned[:2, 2] = np.maximum(-corner, 0)
        return turned

    def points(self, pixels: Points) -> Points:
        """Map pixels (..., 2) to the turned picture."""
        if not self.turn_deg:
            return pixels
        return pixels @ self.matrix.T + self.turned_from_pixel[:2, 2]

    def back(self) -> "QuarterTurn":
        """Return the turn that undoes it."""
        return QuarterTurn(-self.turn_deg % 360, self.size_after)

    def pinhole(
        self, focal_px: float, aspect: float, centre_px: Iterable[float]
    ) -> tuple[float, float, tuple[float, float]]:
        """Return focal length in x, aspect (that in y by that in x) and centre: sideways the two lengths swap."""
        centre = as_pair(self.points(np.array(tuple(centre_px))))
        return (
            (focal_px * aspect, 1 / aspect, centre)
            if self.is_sideways
            else (focal_px, aspect, centre)
        )


def turn_in_words(turn_deg: int) -> str:
    """Return a turn other than 0 in words, for a note."""
    return {
        90: "turned by 90° clockwise",
        180: "turned by 180°",
        270: "turned by 90° counter-clockwise",
    }[turn_deg]


def check_turn(turn_deg: Any) -> int:
    """Return a turn that is one of QUARTER_TURNS; BadInput for anything else."""
    if isinstance(turn_deg, bool) or turn_deg not in QUARTER_TURNS:
        raise BadInput(
            say("turn.not-quarter", "An image cannot be turned by {degrees}°.", degrees=turn_deg),
            say("turn.quarters", "Use 90, 180 or 270, clockwise."),
            reason="bad-turn",
        )
    return int(turn_deg)
