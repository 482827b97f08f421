"""W_max_rectangle, H_max_rectangle and N_rectangles: equal for all cameras of a rig, Eq. (3) and (7).

Only then do equal corrected coordinates of two cameras mean equal distances on the carpet. They belong to the rig.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from typing_extensions import TypedDict

from touchline.core.errors import BadInput
from touchline.core.field import Region
from touchline.core.geometry import ImageSize
from touchline.core.options import read_options
from touchline.fitting.corrected_rectangle import RECTANGLE_OPTIONS, corrected_rectangle

NAMES = ("w_max_rectangle_px", "h_max_rectangle_px", "n_rectangles_x", "n_rectangles_y")
SAME = 1e-6  # relative: what a product and a quotient of doubles leave


class RectangleOptions(TypedDict):
    """As a fit takes them."""

    w_max_rectangle_px: float
    h_max_rectangle_px: float
    n_rectangles_x: int
    n_rectangles_y: int


@dataclass(frozen=True)
class Rectangles:
    """How large a rectangle is in the corrected picture, px, and how many there are each way."""

    w_max_px: float
    h_max_px: float
    n_x: int
    n_y: int

    @classmethod
    def of_parameters(cls, parameters: Mapping[str, Any]) -> Self | None:
        """Read those that a model was made with; None for parameters without a corrected rectangle."""
        try:
            n_x, n_y = int(parameters["n_rectangles_x"]), int(parameters["n_rectangles_y"])
            return cls(float(parameters["width_px"]) / n_x, float(parameters["height_px"]) / n_y, n_x, n_y)
        except (KeyError, TypeError, ValueError, ZeroDivisionError):
            return None

    @classmethod
    def of_rig(cls, given: Mapping[str, Any]) -> Self | None:
        """Read a rig's rectangles; None where none are given. BadInput where only some are, or they are invalid."""
        values = [given.get(name) for name in NAMES]
        if all(value is None for value in values):
            return None
        if any(value is None for value in values):
            raise BadInput("Some of the calibration rectangles of the rig are missing.",
                           f"Give all of {', '.join(NAMES)}, or none.", reason="bad-rectangles")
        read = read_options(RECTANGLE_OPTIONS, dict(zip(NAMES, values, strict=True)))
        return cls(*(read[name] for name in NAMES))

    def check(self, region: Region, image_size: ImageSize) -> None:
        """BadInput where they make no corrected picture."""
        corrected_rectangle(self.options(), region, image_size)

    def options(self) -> RectangleOptions:
        return {"w_max_rectangle_px": self.w_max_px, "h_max_rectangle_px": self.h_max_px, "n_rectangles_x": self.n_x,
                "n_rectangles_y": self.n_y}

    def same_as(self, other: "Rectangles") -> bool:
        return (self.n_x, self.n_y) == (other.n_x, other.n_y) and bool(np.allclose(
            (self.w_max_px, self.h_max_px), (other.w_max_px, other.h_max_px), rtol=SAME, atol=0))


def most_common(each: Sequence[Rectangles]) -> Rectangles | None:
    """Return the rectangles that most cameras have, the first of a tie; None of none."""
    if not each:
        return None
    votes = Counter(next(i for i, known in enumerate(each) if known.same_as(one)) for one in each)
    return each[max(votes, key=lambda i: (votes[i], -i))]
