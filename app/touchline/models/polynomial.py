"""The paper's model: two one-dimensional corrections that pull the four borders straight.

    value = Σ c_k t^k,   t = (position - centre) / scale            # Eq. (1), (2), (5), (6)

A border is a curve by a normalised position: y for a border that runs down the picture and x for one that runs across.

Horizontal, rows stay:      x_c = (x - x_initial(y)) · I_width / (x_final(y) - x_initial(y))          # Eq. (4)
Vertical, columns stay:     y_c = (y - y_initial(x_c)) · I_height / (y_final(x_c) - y_initial(x_c))   # Eq. (8)
with I_width = W_max_rectangle · N_rectangles (Eq. 3), I_height likewise (Eq. 7), then the model relation: field
millimetres linear in x_c, polynomial in y_c. Both ways are explicit, so one map does what two passes did.

"A Study on Image Calibration Technique for Autonomous Robot", ICEEI 2009, section III. Errata kept here: Eq. (4)
and (8) are printed with the fraction upside down, which sends the far border to
(x_final - x_initial)² / I_width instead of I_width; and "length" in Eq. (7) is a height.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from dataclasses import field as member
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import NDArray

from touchline.core.errors import BadInput
from touchline.core.field import Region
from touchline.core.geometry import (
    MAX_COORDINATE,
    Array,
    ImageSize,
    Mask,
    Points,
    unreachable_where,
)
from touchline.core.quarter_turn import QuarterTurn, check_turn
from touchline.core.statements import named
from touchline.models.contract import EXPORTED, CameraModel, read_model

MAX_DEGREE = 8

# how far beyond the picture a border is extrapolated, as a share of the picture's extent
REACH = 1.0
MIN_EXTENT_PX = 1.0  # borders nearer than this have met


@dataclass(frozen=True)
class Curve:
    """A polynomial of a normalised position; its coefficients ascend."""

    coefficients: tuple[float, ...]
    centre: float
    scale: float

    def __call__(self, position: Array | float) -> Array:
        t: Array = (np.asarray(position, np.float64) - self.centre) / self.scale
        value: Array = np.full_like(t, self.coefficients[-1])
        for c in self.coefficients[-2::-1]:  # Horner, in place: a map asks for millions
            value *= t
            value += c
        return value

    @property
    def degree(self) -> int:
        return len(self.coefficients) - 1

    def plain_coefficients(self) -> tuple[float, ...]:
        """Return ascending coefficients in the position itself: Σ a_k position^k."""
        result: NDArray[np.floating] = np.zeros(1)
        for c in reversed(self.coefficients):  # Horner, with polynomials for numbers
            result = polynomial.polyadd(
                polynomial.polymul(result, (-self.centre / self.scale, 1 / self.scale)), (c,)
            )
        return tuple(
            float(c)
            for c in np.pad(result, (0, len(self.coefficients) - len(result)))[: self.degree + 1]
        )


@dataclass(frozen=True)
class Polynomial(CameraModel):
    """Four borders as polynomials, and the relation from corrected pixels to the field.

    left, right: x of the raw row y. top, bottom: raw y of the *corrected* column x_c.
    width_px, height_px: I_width and I_height; the borders lie on columns 0 and I_width, rows 0 and I_height.
    across_mm: u = a + b·x_c. down_mm: v = Σ c_k (y_c / I_height)^k; both in the region's frame.
    turn_deg: by how much the picture was turned clockwise afterwards; the borders are those of the picture before it.
    """

    NAME: ClassVar[str] = "polynomial"
    TITLE: ClassVar[str] = named("model.polynomial", "Boundary polynomials")
    HELP: ClassVar[str] = (
        "Straightens the four borders exactly and requires no lens model. With strong distortion, "
        "errors of centimetres remain inside the field."
    )

    left: Curve
    right: Curve
    top: Curve
    bottom: Curve
    width_px: float
    height_px: float
    n_rectangles_x: int
    n_rectangles_y: int
    across_mm: tuple[float, float]
    down_mm: tuple[float, ...]
    turn_deg: int = member(default=0, kw_only=True)
    region: Region
    image_size: ImageSize

    def corrected_from_raw(self, points: Points) -> Points:
        """Map raw pixels (..., 2) to corrected ones; NaN where borders have met or far outside the picture."""
        points = self._turn.back().points(points)
        x, y = points[..., 0], points[..., 1]
        with np.errstate(all="ignore"):
            x_initial = self.left(y)
            extent_x = self.right(y) - x_initial
            x_c = (x - x_initial) * self.width_px / extent_x  # Eq. (4), as the text means it
            y_initial = self.top(x_c)
            extent_y = self.bottom(x_c) - y_initial
            y_c = (y - y_initial) * self.height_px / extent_y  # Eq. (8), likewise
            return unreachable_where(
                self._beyond(y, x_c, extent_x, extent_y), np.stack([x_c, y_c], axis=-1)
            )

    def raw_from_corrected(self, points: Points) -> Points:
        """Map corrected pixels (..., 2) to raw ones, in one pass; NaN as in corrected_from_raw."""
        return np.stack(self.raw_from_corrected_grid(points[..., 0], points[..., 1]), axis=-1)

    def raw_from_corrected_grid(self, x_c: Array, y_c: Array) -> tuple[Array, Array]:
        """Map corrected pixels with coordinates apart, which may broadcast: columns (w,) and rows (h, 1) cost half."""
        with np.errstate(all="ignore"):
            y_initial = self.top(x_c)
            extent_y = self.bottom(x_c) - y_initial
            y = y_initial + y_c * (extent_y / self.height_px)  # Eq. (8) solved for y
            x_initial = self.left(y)
            extent_x = self.right(y) - x_initial
            x = x_initial + (x_c / self.width_px) * extent_x  # Eq. (4) solved for x
            bad = self._beyond(y, x_c, extent_x, extent_y)
            if bad.any():
                x, y = np.where(bad, np.nan, x), np.where(bad, np.nan, y)
            if not self.turn_deg:
                return x, y
            raw = self._turn.points(np.stack([x, y], axis=-1))
            return raw[..., 0], raw[..., 1]

    @cached_property
    def _turn(self) -> QuarterTurn:
        """Return the turn from the picture of the borders to this one."""
        size = QuarterTurn(
            self.turn_deg, self.image_size
        ).size_after  # a turn back swaps them likewise
        return QuarterTurn(self.turn_deg, size)

    def _beyond(self, y: Array, x_c: Array, extent_x: Array, extent_y: Array) -> Mask:
        """Return where a border would be extrapolated too far: past REACH, or where two borders meet.

        Both ways read each curve at the same place, so the test is the same both ways. NaN counts as beyond.
        """
        before = self._turn.size
        width, (height, middle) = self.width_px, (before.height, before.centre[1])
        near_columns = (extent_y >= MIN_EXTENT_PX) & (
            np.abs(x_c - width / 2) <= (0.5 + REACH) * width
        )
        return ~(
            near_columns
            & (extent_x >= MIN_EXTENT_PX)
            & (np.abs(y - middle) <= (0.5 + REACH) * height)
        )

    def field_from_corrected(self, points: Points) -> Points:
        """Map corrected pixels to field mm by the model relation; NaN where it is not monotonic."""
        a, b = self.across_mm
        rows = points[..., 1] / self.height_px
        low, high = self._rising
        with np.errstate(all="ignore"):
            region = np.stack(
                [a + b * points[..., 0], polynomial.polyval(rows, self.down_mm)], axis=-1
            )
            return self.region.field_from_region(
                unreachable_where(~((rows >= low) & (rows <= high)), region)
            )

    def corrected_from_field(self, points: Points) -> Points:
        """Map field mm to corrected pixels, the exact inverse; NaN where no row has that place."""
        a, b = self.across_mm
        region = self.region.region_from_field(points)
        rows = self._rows_from_down(region[..., 1])
        corrected = np.stack([(region[..., 0] - a) / b, rows * self.height_px], axis=-1)
        return unreachable_where(np.isnan(rows), corrected)

    @cached_property
    def _rising(self) -> tuple[float, float]:
        """Return the widest interval of y_c / I_height around the field on which the relation rises."""
        slope = polynomial.polyder(self.down_mm)
        limits = (-1e3, 1e3)  # a linear relation rises for ever; a thousand fields are enough
        while len(slope) > 1 and abs(slope[-1]) < 1e-12 * np.abs(slope).max():
            slope = slope[:-1]
        if len(slope) < 2:
            return limits
        turns = polynomial.polyroots(slope)
        turns = turns[np.abs(turns.imag) < 1e-9].real
        below, above = turns[turns < 0.5], turns[turns > 0.5]
        return (
            float(below.max()) if below.size else limits[0],
            float(above.min()) if above.size else limits[1],
        )

    def _rows_from_down(self, v: Array) -> Array:
        """Solve v = Σ c_k s^k for s in the rising interval: Newton's method, bisection where it would leave."""
        c = np.asarray(self.down_mm)
        if c.size == 2:
            return (v - c[0]) / c[1]
        low_end, high_end = self._rising
        value = np.asarray(v, float)
        slope = polynomial.polyder(c)
        with np.errstate(all="ignore"):
            reachable = (value >= polynomial.polyval(low_end, c)) & (
                value <= polynomial.polyval(high_end, c)
            )
            value = np.where(reachable, value, c[0])
            low, high = np.full(value.shape, low_end), np.full(value.shape, high_end)
            s = np.clip(value / self.region.height_mm, low_end, high_end)
            for _ in range(100):  # Newton ends it after about 5; bisection alone would need 60
                error = polynomial.polyval(s, c) - value
                low, high = np.where(error <= 0, s, low), np.where(error >= 0, s, high)
                step = s - error / polynomial.polyval(s, slope)
                following = np.where((step >= low) & (step <= high), step, (low + high) / 2)
                moved = np.abs(following - s).max(initial=0.0)
                s = following
                if moved <= 1e-15:
                    break
        return np.where(reachable, s, np.nan)

    def turned(self, turn_deg: int) -> Self:
        """Note the turn: the two corrections follow each other, so that borders cannot take each other's places."""
        return replace(
            self,
            turn_deg=(self.turn_deg + check_turn(turn_deg)) % 360,
            image_size=QuarterTurn(turn_deg, self.image_size).size_after,
        )

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, Any]) -> Self:
        model = read_model(cls, parameters)
        model._refuse_nonsense()
        return model

    def _refuse_nonsense(self) -> None:
        """Raise BadInput for parameters that no fit makes."""
        check_turn(self.turn_deg)
        curves = (self.left, self.right, self.top, self.bottom)
        numbers = [*self.across_mm, *self.down_mm]
        for curve in curves:
            numbers += [curve.centre, curve.scale, *curve.coefficients]
        if not (
            np.isfinite(numbers).all()
            and np.abs(numbers).max() < MAX_COORDINATE * 1e3
            and all(1 <= len(c.coefficients) <= MAX_DEGREE + 1 and c.scale > 0 for c in curves)
            and self.across_mm[1] > 0
            and 2 <= len(self.down_mm) <= 9
            and self.down_mm[1:] != (0.0,) * (len(self.down_mm) - 1)
        ):
            raise BadInput(
                "These parameters do not describe a camera over a field.",
                EXPORTED,
                reason="bad-parameters",
            )
