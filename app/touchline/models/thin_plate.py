"""Thin-plate spline on top of another model: bends away what that model leaves.

    s(q) = a0 + a1 X + a2 Y + Σ w_i U(|Q - K_i|),   U(r) = r² log r,   Q = (X, Y) = (q - middle) / unit

It is read, and no longer fitted. F. Bookstein, "Principal Warps", PAMI 11 (1989).

    raw = base.raw_from_corrected(q + s(q)),   q corrected px, s a thin-plate spline

so the map that draws the corrected picture is explicit; the way back solves q + s(q) = p by Newton's method. s is known
only around the field and must not fold the picture: on the box that the model reaches, I + ds/dq has a positive
definite symmetric part, which makes q + s(q) one-to-one on a convex set.

It bends the picture of the carpet and has no rays: it cannot place what is above the carpet.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, Literal, Self

import numpy as np
from typing_extensions import TypedDict

from touchline.core.errors import BadInput
from touchline.core.geometry import MAX_COORDINATE, Array, Mask, Points, unreachable_where
from touchline.core.json_values import read
from touchline.core.statements import named
from touchline.models import CameraModel, model_from_json
from touchline.models.contract import EXPORTED

BLOCK = 1 << 19  # so many kernel values at a time stay in the cache

# of the field's extent on each side; the widest without a fold is kept
REACHES = (0.5, 0.25, 0.1, 0.05)
MIN_STRETCH = 0.05  # a picture squeezed to less than this share is folding
FOLD_GRID = 41
NEWTON_STEPS = 40
NEWTON_PX = 1e-11


@dataclass(frozen=True, eq=False)
class Spline:
    """A displacement of the plane: knots (n, 2) normalised, weights (n, 2) and plane (3, 2) px."""

    knots: Array
    weights: Array
    plane: Array

    def __call__(self, places: Array) -> Array:
        """Return the displacement (m, 2) px at normalised places (m, 2)."""
        return self._sum(places, gradient=False)[0]

    def with_gradient(self, places: Array) -> tuple[Array, Array]:
        """Return the displacement and its derivative (m, 2, 2) by the normalised place."""
        return self._sum(places, gradient=True)

    def _sum(self, places: Array, gradient: bool) -> tuple[Array, Array]:
        value = places @ self.plane[1:] + self.plane[0]
        slope = np.broadcast_to(self.plane[1:].T, (len(places), 2, 2)).copy()
        step = max(1, BLOCK // max(1, len(self.knots)))
        for begin in range(0, len(places) if len(self.knots) else 0, step):
            some = places[begin : begin + step]
            square = _squares(some, self.knots)
            log = np.log(square)
            value[begin : begin + step] += (0.5 * square * log) @ self.weights
            if gradient:  # dU/dQ = (log r² + 1) (Q - K)
                log += 1
                for c in range(2):
                    by = log * self.weights[:, c]
                    slope[begin : begin + step, c] += (
                        some * by.sum(axis=1, keepdims=True) - by @ self.knots
                    )
        return value, slope


def _squares(places: Array, knots: Array) -> Array:
    """Return r² (m, n), at least 1e-300, so that r² log r² is 0 at 0."""
    square = np.subtract.outer(places[:, 0], knots[:, 0]) ** 2
    square += np.subtract.outer(places[:, 1], knots[:, 1]) ** 2
    return np.maximum(square, 1e-300)


Pair = tuple[float, float]
Base = Literal["homography", "division", "brown-conrady"]


class _Parameters(TypedDict):
    base_name: Base
    base: dict[str, Any]
    knots: tuple[Pair, ...]
    weights: tuple[Pair, ...]
    plane: tuple[Pair, Pair, Pair]
    reach: float


@dataclass(frozen=True)
class ThinPlate(CameraModel):
    """A base model and a displacement of its corrected pixels.

    knots: corrected px. weights, plane: px, of a Spline whose unit is half the corrected picture's longer side.
    reach: how far around the field the spline is used, as a share of the field's extent.
    """

    NAME: ClassVar[str] = "thin-plate"
    TITLE: ClassVar[str] = named("model.thin-plate", "Thin-plate spline")
    HELP: ClassVar[str] = "A model of earlier versions, which can be used and is no longer fitted."

    base_name: str
    base: CameraModel
    knots: tuple[Pair, ...]
    weights: tuple[Pair, ...]
    plane: tuple[Pair, Pair, Pair]
    reach: float

    width_px = property(lambda self: self.base.width_px)
    height_px = property(lambda self: self.base.height_px)
    n_rectangles_x = property(lambda self: self.base.n_rectangles_x)
    n_rectangles_y = property(lambda self: self.base.n_rectangles_y)
    region = property(lambda self: self.base.region)
    image_size = property(lambda self: self.base.image_size)

    @cached_property
    def _spline(self) -> Spline:
        middle, unit = spline_frame(self.base)
        return Spline(
            (np.array(self.knots).reshape(-1, 2) - middle) / unit,
            np.array(self.weights).reshape(-1, 2),
            np.array(self.plane),
        )

    def field_from_corrected(self, points: Points) -> Points:
        return self.base.field_from_corrected(points)

    def corrected_from_field(self, points: Points) -> Points:
        return self.base.corrected_from_field(points)

    def raw_from_corrected(self, points: Points) -> Points:
        """Map corrected pixels to raw ones; NaN outside the box of the spline's reach."""
        points = np.asarray(points, float)
        return self.base.raw_from_corrected(
            unreachable_where(~self._inside(points), self._bent(points))
        )

    def corrected_from_raw(self, points: Points) -> Points:
        """Map raw pixels to corrected ones, to 1e-9 px; NaN outside the box of the spline's reach."""
        wanted = self.base.corrected_from_raw(points)
        flat = wanted.reshape(-1, 2)
        found = np.full_like(wanted, np.nan)
        known = np.flatnonzero(np.isfinite(flat).all(axis=1))
        found.reshape(-1, 2)[known] = self._unbent(flat[known])
        return unreachable_where(~self._inside(found), found)

    def _bent(self, points: Points) -> Points:
        middle, unit = spline_frame(self.base)
        with np.errstate(all="ignore"):
            near = np.where(self._inside(points)[..., None], points, np.nan)
            return near + self._spline(((near - middle) / unit).reshape(-1, 2)).reshape(
                points.shape
            )

    def _unbent(self, wanted: Points) -> Points:
        """Solve q + s(q) = wanted (n, 2) inside a slightly larger box; NaN where Newton's method does not end there."""
        middle, unit = spline_frame(self.base)
        half = np.array([self.width_px, self.height_px]) * (0.5 + self.reach) + 1.0
        goal = (wanted - middle) / unit
        limit = half / unit
        q = np.clip(goal, -limit, limit)
        todo = np.arange(len(q))
        for _ in range(NEWTON_STEPS):
            value, slope = self._spline.with_gradient(q[todo])
            error = goal[todo] - q[todo] - value / unit
            step = np.linalg.solve(np.eye(2) + slope / unit, error[..., None])[..., 0]
            q[todo] = np.clip(q[todo] + step, -limit, limit)  # stay in the box
            todo = todo[np.abs(error).max(axis=1) * unit > NEWTON_PX]
            if not todo.size:
                break
        left = np.abs(goal - q - self._spline(q) / unit).max(axis=1, initial=0.0) * unit
        return np.where((left < 1e-9)[:, None], q * unit + middle, np.nan)

    def _inside(self, points: Points) -> Mask:
        middle, _ = spline_frame(self.base)
        half = np.array([self.width_px, self.height_px]) * (0.5 + self.reach)
        return np.all(np.abs(points - middle) <= half, axis=-1)

    def turned(self, turn_deg: int) -> Self:
        """Turn the base alone: the spline bends corrected pixels, which stay where they are."""
        return replace(self, base=self.base.turned(turn_deg))

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, Any]) -> Self:
        p = read(
            _Parameters,
            parameters,
            f"The parameters of the model {cls.NAME}",
            EXPORTED,
            "bad-parameters",
        )
        model = cls(
            p["base_name"],
            model_from_json(p["base_name"], p["base"]),
            p["knots"],
            p["weights"],
            p["plane"],
            p["reach"],
        )
        numbers = np.array([*model.knots, *model.weights, *model.plane])
        if not (
            len(model.knots) == len(model.weights)
            and (np.abs(numbers) < MAX_COORDINATE).all()
            and model.reach in REACHES
        ):
            raise BadInput(
                "The numbers of the thin-plate spline do not belong together.",
                EXPORTED,
                reason="bad-parameters",
            )
        if unfolded_reach(model.base, model._spline) < model.reach:
            raise BadInput(
                "This thin-plate spline folds the image.", EXPORTED, reason="bad-parameters"
            )
        return model


def spline_frame(base: CameraModel) -> tuple[Array, float]:
    """Return origin and unit of a spline's coordinates, px: the corrected picture's middle, half its longer side."""
    return np.array([base.width_px, base.height_px]) / 2, max(base.width_px, base.height_px) / 2


def unfolded_reach(base: CameraModel, spline: Spline) -> float:
    """Return the widest of REACHES in which the spline does not fold the picture; 0 if it folds at the field."""
    _, unit = spline_frame(base)
    extent = np.array([base.width_px, base.height_px]) / unit
    for reach in REACHES:
        x, y = (np.linspace(-1, 1, FOLD_GRID) * e * (0.5 + reach) for e in extent)
        places = np.concatenate([np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2), spline.knots])
        slope = spline.with_gradient(places)[1] / unit + np.eye(2)
        mean, half = (slope[:, 0, 0] + slope[:, 1, 1]) / 2, (slope[:, 0, 0] - slope[:, 1, 1]) / 2
        # eigenvalue of the symmetric part
        least = mean - np.hypot(half, (slope[:, 0, 1] + slope[:, 1, 0]) / 2)
        if least.min() > MIN_STRETCH:
            return reach
    return 0.0
