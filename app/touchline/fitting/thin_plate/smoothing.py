"""Smoothing thin-plate splines: the displacement that bends least and agrees with the clicks.

    minimise   Σ (D_j (d_j - n_j·s(q_j)))² + λ ∫∫ (s_xx² + 2 s_xy² + s_yy²),   s of both coordinates

A click on a line determines the displacement across the line only, n_j·s(q_j) = d_j, so the knots are the clicks and
their weights point across their lines. Linear functionals instead of values, and the choice of λ by generalised
cross-validation: G. Wahba, "Spline Models for Observational Data" (1990).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from touchline.core.errors import FitFailed
from touchline.core.geometry import Array
from touchline.core.statements import say
from touchline.fitting.linear import MORE_LINES
from touchline.models.thin_plate_spline import Spline, kernel

MIN_SMOOTHING = 1e-14  # of the largest stiffness: as good as none in double precision
SMOOTHINGS = np.geomspace(1e-12, 1e4, 65)  # of the largest stiffness: from interpolation to an affine displacement
CAUTION = 1.4  # makes cross-validation smooth a little more: with few clicks it follows noise (Kim and Gu 2004)
MAX_COUNTED_PX = 5.0  # a left-out click that is further off counts no more: it may be an outlier
PLANE = 6  # parameters of an affine displacement


@dataclass(frozen=True, eq=False)
class Constraints:
    """Constraints of clicks on the displacement: n·s(q) = value, to within 1/weight, row by row.

    places (n, 2) normalised, directions (n, 2) unit vectors, values (n,) px corrected, weights (n,) raw px per
    corrected px, so that residuals are in raw pixels.
    """

    places: Array
    directions: Array
    values: Array
    weights: Array


class SmoothingSplines:
    """All smoothing splines of the same constraints, whatever their smoothing, by one decomposition."""

    def __init__(self, constraints: Constraints) -> None:
        """Raises FitFailed where not even a plane displacement is determined."""
        self.constraints = constraints
        pulls, plane = design(constraints)
        if len(plane) < PLANE or np.linalg.svd(plane, compute_uv=False)[-1] < 1e-6 * np.linalg.norm(plane):
            raise _too_few_lines()
        q, _ = np.linalg.qr(plane, mode="complete")
        free = q[:, PLANE:]
        stiff, turn = np.linalg.eigh(free.T @ pulls @ free)
        self._stiff = np.maximum(stiff, 0.0)
        self._modes = free @ turn
        self._modal = self._modes.T @ (constraints.values * constraints.weights)

    @cached_property
    def unit(self) -> float:
        """Return the largest stiffness: smoothings are in units of it, so that they mean the same for any field."""
        return float(self._stiff[-1]) if self._stiff.size and self._stiff[-1] > 0 else 1.0

    def _share(self, smoothing: float) -> Array:
        """Return the share of each mode that stays in the residual."""
        return self.strength(smoothing) / (self._stiff + self.strength(smoothing))

    def residuals(self, smoothing: float) -> Array:
        """Return (n,) raw px."""
        return self._modes @ (self._share(smoothing) * self._modal)

    def free_share(self, smoothing: float) -> Array:
        """Return 1 - leverage (n,), 1 - A_jj: residual / free_share is a click's leave-one-out error."""
        return np.maximum(self._modes**2 @ self._share(smoothing), 1e-12)

    def effective_parameters(self, smoothing: float) -> float:
        return float(len(self._modes) - self._share(smoothing).sum())

    def sigma_px(self, smoothing: float) -> float:
        freedom = max(float(self._share(smoothing).sum()), 1e-6)
        return float(np.linalg.norm(self.residuals(smoothing)) / np.sqrt(freedom))

    def cross_validated(self) -> float:
        """Return the smoothing of least generalised cross-validation error."""
        n = len(self._modes)

        def score(smoothing: float) -> float:
            spent = CAUTION * self.effective_parameters(smoothing)
            return float(np.sum(self.residuals(smoothing) ** 2)) / (n - spent) ** 2 if spent < n else np.inf
        return _minimise_smoothing(score)

    def robust_cross_validated(self) -> float:
        """Return the smoothing of least leave-one-out error, each click's limited to MAX_COUNTED_PX."""
        return _minimise_smoothing(lambda smoothing: float(np.sum(np.minimum(
            np.abs(self.residuals(smoothing) / self.free_share(smoothing)), MAX_COUNTED_PX) ** 2)))

    def strength(self, smoothing: float) -> float:
        """Return λ of a smoothing."""
        return max(smoothing, MIN_SMOOTHING) * self.unit

    def spline(self, smoothing: float) -> Spline:
        return spline_through(self.constraints, self.strength(smoothing))


def spline_through(constraints: Constraints, strength: float) -> Spline:
    """Return the spline of λ = strength, with one knot for each place, in the order of the rows."""
    system, size = _system(constraints, strength)
    n = len(constraints.values)
    values = np.concatenate([constraints.values * constraints.weights, np.zeros(PLANE)])
    try:
        solution = np.linalg.solve(system, values)
    except np.linalg.LinAlgError:
        raise _too_few_lines() from None
    _, first, where = np.unique(constraints.places, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)  # np.unique's order depends on the last digit of places whose x is equal but for rounding
    knots = constraints.places[first[order]]
    weights = np.zeros_like(knots)
    pulls = (solution[:n] / size * constraints.weights)[:, None] * constraints.directions
    np.add.at(weights, np.argsort(order)[where.ravel()], pulls)
    return Spline(knots, weights, solution[n:].reshape(2, 3).T)


def hat_matrix(constraints: Constraints, strength: float, places: Array) -> Array:
    """Return (2 m, n): the displacement px at places (m, 2), x and y in turn, by each value times its weight."""
    system, size = _system(constraints, strength)
    n, m = len(constraints.values), len(places)
    reads = np.zeros((m, 2, n + PLANE))
    reads[:, :, :n] = kernel_columns(constraints, places).reshape(m, 2, n) / size
    for axis in range(2):
        reads[:, axis, n + 3 * axis:n + 3 * axis + 3] = np.concatenate([np.ones((m, 1)), places], axis=1)
    try:
        return np.asarray(np.linalg.solve(system, reads.reshape(2 * m, -1).T)[:n].T, np.float64)
    except np.linalg.LinAlgError:
        raise _too_few_lines() from None


def kernel_columns(constraints: Constraints, places: Array) -> Array:
    """Return (2 m, n): what each row's knot, times its weight, adds at places (m, 2) to x and y in turn."""
    by = kernel(places, constraints.places)[:, None] * (constraints.directions.T * constraints.weights)
    return by.reshape(2 * len(places), -1)


def _system(constraints: Constraints, strength: float) -> tuple[Array, float]:
    """Return the symmetric equations of a spline, and the scale that its kernel was divided by."""
    pulls, plane = design(constraints)
    n = len(pulls)
    size = np.abs(pulls).max() or 1.0
    system = np.zeros((n + PLANE, n + PLANE))
    system[:n, :n] = (pulls + strength * np.eye(n)) / size
    system[:n, n:], system[n:, :n] = plane, plane.T
    return system, size


def design(constraints: Constraints) -> tuple[Array, Array]:
    """Return what each row's knot adds at each row (n, n), and what an affine displacement adds (n, 6); weighted."""
    d, directions = constraints.weights, constraints.directions
    bends = kernel(constraints.places, constraints.places) * (directions @ directions.T) * np.outer(d, d)
    ones = np.concatenate([np.ones((len(d), 1)), constraints.places], axis=1)
    return bends, np.concatenate([directions[:, :1] * ones, directions[:, 1:] * ones], axis=1) * d[:, None]


def _too_few_lines() -> FitFailed:
    return FitFailed(say("refused.no-spline", "The marked lines do not determine the spline."), MORE_LINES,
                     reason="lines-not-enough")


def _minimise_smoothing(score: Callable[[float], float]) -> float:
    """Return the smoothing of least score: over a grid, then by thirds between its neighbours."""
    scores = [score(s) for s in SMOOTHINGS]
    best = int(np.argmin(scores))
    low, high = SMOOTHINGS[max(best - 1, 0)], SMOOTHINGS[min(best + 1, len(SMOOTHINGS) - 1)]
    for _ in range(12):
        a, b = np.exp(np.log(low) + np.log(high / low) * np.array([1, 2]) / 3)
        low, high = (low, b) if score(a) <= score(b) else (a, high)
    middle = float(np.sqrt(low * high))
    return middle if score(middle) < scores[best] else float(SMOOTHINGS[best])
