"""A lens known from straight lines alone: its terms, its centre, and no focal length.

Straight lines say how a picture bends, not how wide it sees. Terms are therefore given in units of half the picture's
diagonal: a place on the plane is (pixel - centre) / unit. A camera of focal length f has the same lens with

    k (per f²) = k (per unit²) · (f / unit)²     for a term of r², to the second power for r⁴, and so on.

D. C. Brown, "Close-range camera calibration", 1971 (the plumb-line method); F. Devernay and O. Faugeras 2001.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from touchline.core.errors import BadInput
from touchline.core.geometry import Array, ImageSize, Points, as_pair, homogeneous
from touchline.core.quarter_turn import QuarterTurn
from touchline.models.lenses import Lens
from touchline.models.lenses.brown_conrady import BrownConradyLens
from touchline.models.lenses.division import DivisionLens, EvenDivisionLens

# name: the lens, and its terms that straight lines can tell
LINE_LENSES: dict[str, tuple[type[Lens], tuple[str, ...]]] = {
    "division": (DivisionLens, ("k",)),
    "division-even": (EvenDivisionLens, ("k1", "k2", "k3")),
    "brown-conrady": (BrownConradyLens, ("k1", "k2", "k3")),
}


@dataclass(frozen=True)
class Distortion:
    """A lens's distortion. terms: in the order of its TERMS, per unit_px; centre_px: raw pixels."""

    name: str
    terms: tuple[float, ...]
    centre_px: tuple[float, float]
    image_size: ImageSize

    @property
    def lens(self) -> type[Lens]:
        return LINE_LENSES[self.name][0]

    @property
    def unit_px(self) -> float:
        return half_diagonal_px(self.image_size)

    def undistorted_from_raw(self, raw: Points) -> Points:
        """Map raw pixels (..., 2) to those of an undistorted picture of the same scale at the centre."""
        rays = self.lens.undistort(np.array(self.terms), self._plane(raw))
        return rays[..., :2] * self.unit_px + self.centre_px

    def raw_from_undistorted(self, straight: Points) -> Points:
        """Map undistorted pixels (..., 2) to raw ones; NaN beyond the lens's horizon."""
        plane = self.lens.distort(np.array(self.terms), homogeneous(self._plane(straight)))
        return plane * self.unit_px + self.centre_px

    def terms_for(self, focal_px: float) -> dict[str, float]:
        """Return the terms in units of that focal length."""
        scale = focal_px / self.unit_px
        return {
            name: float(self.terms[self.lens.TERMS.index(name)] * scale ** self.lens.power(name))
            for name in LINE_LENSES[self.name][1]
        }

    def turned(self, turn_deg: int) -> Self:
        """Return the same lens for its picture turned clockwise; exact."""
        turn = QuarterTurn(turn_deg, self.image_size)
        return replace(
            self,
            terms=tuple(map(float, self.lens.turned(np.array(self.terms), turn.matrix))),
            centre_px=as_pair(turn.points(np.array(self.centre_px))),
            image_size=turn.size_after,
        )

    def to_json(self) -> dict[str, Any]:
        return {
            "name": self.name,
            "terms": dict(zip(self.lens.TERMS, self.terms, strict=True)),
            "unit": "half-diagonal",
            "unit_px": self.unit_px,
            "centre_px": list(self.centre_px),
            "image_size": [self.image_size.width, self.image_size.height],
        }

    @classmethod
    def from_json(cls, value: Any) -> Self:
        try:
            name = value["name"]
            if name not in LINE_LENSES or not isinstance(value["terms"], Mapping):
                raise KeyError(name)
            terms = tuple(float(value["terms"].get(t, 0.0)) for t in LINE_LENSES[name][0].TERMS)
            x, y = (float(v) for v in value["centre_px"])
            size = ImageSize.of(value["image_size"])
            if not np.isfinite([*terms, x, y]).all():
                raise ValueError("not finite")
        except (KeyError, TypeError, ValueError, OverflowError):
            raise BadInput(
                "This is not a lens from straight lines.",
                "Send a lens as the report on straight lines gives it.",
                reason="bad-lens",
            ) from None
        return cls(name, terms, (x, y), size)

    def _plane(self, pixels: Points) -> Array:
        return (pixels - np.array(self.centre_px)) / self.unit_px


def half_diagonal_px(size: ImageSize) -> float:
    """Return half the picture's diagonal."""
    return float(np.hypot(size.width, size.height)) / 2
