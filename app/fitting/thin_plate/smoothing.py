"""Smoothing thin-plate splines: the displacement that bends least and agrees with the clicks.

    minimise   Σ (D_j (d_j - n_j·s(q_j)))² + λ ∫∫ (s_xx² + 2 s_xy² + s_yy²),   s of both coordinates

A click on a line determines the displacement across the line only, n_j·s(q_j) = d_j, so the knots are the clicks and
their weights point across their lines. Linear functionals instead of values, and the choice of λ by generalised
cross-validation: G. Wahba, "Spline Models for Observational Data" (1990).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from app.core.errors import FitFailed
from app.core.geometry import Array
from app.models.thin_plate_spline import Spline, kernel

LEAST_SMOOTHING = 1e-14  # of the stiffest direction: what stands for none in double precision
SMOOTHINGS = np.geomspace(1e-12, 1e4, 65)  # of the stiffest direction: from through every click to a plane
CAUTION = 1.4  # makes cross-validation smooth a little more; few clicks tempt it to follow noise (Kim and Gu 2004)
CAP_PX = 5.0  # a left-out click that is further off counts no more: it may be a stray
PLANE = 6  # numbers of a displacement without bends


@dataclass(frozen=True, eq=False)
class Knowledge:
    """What clicks tell of the displacement: n·s(q) = value, to within 1/weight, row by row.

    places (n, 2) normalised, directions (n, 2) unit vectors, values (n,) px corrected, weights (n,) raw px per
    corrected px, so that residuals are in raw pixels.
    """

    places: Array
    directions: Array
    values: Array
    weights: Array


class Smoother:
    """Every thin-plate spline through the same knowledge, whatever its smoothing; found by one decomposition."""

    def __init__(self, known: Knowledge) -> None:
        """Raises FitFailed where not even a plane displacement is determined."""
        self.known = known
        pulls, plane = equations(known)
        if len(plane) < PLANE or np.linalg.svd(plane, compute_uv=False)[-1] < 1e-6 * np.linalg.norm(plane):
            raise _not_enough()
        q, _ = np.linalg.qr(plane, mode="complete")
        free = q[:, PLANE:]
        stiff, turn = np.linalg.eigh(free.T @ pulls @ free)
        self._stiff = np.maximum(stiff, 0.0)
        self._modes = free @ turn
        self._told = self._modes.T @ (known.values * known.weights)

    @cached_property
    def unit(self) -> float:
        """The stiffest direction: smoothings are in units of it, so that they mean the same for any field."""
        return float(self._stiff[-1]) if self._stiff.size and self._stiff[-1] > 0 else 1.0

    def _share(self, smoothing: float) -> Array:
        """How much of each mode is left to the residual."""
        return self.strength(smoothing) / (self._stiff + self.strength(smoothing))

    def residuals(self, smoothing: float) -> Array:
        """(n,) raw px."""
        return self._modes @ (self._share(smoothing) * self._told)

    def leeway(self, smoothing: float) -> Array:
        """(n,) 1 - A_jj: how little each click pulls the spline to itself; residual / leeway is its error left out."""
        return np.maximum(self._modes**2 @ self._share(smoothing), 1e-12)

    def effective_parameters(self, smoothing: float) -> float:
        return float(len(self._modes) - self._share(smoothing).sum())

    def sigma_px(self, smoothing: float) -> float:
        freedom = max(float(self._share(smoothing).sum()), 1e-6)
        return float(np.linalg.norm(self.residuals(smoothing)) / np.sqrt(freedom))

    def cross_validated(self) -> float:
        """The smoothing of least generalised cross-validation error."""
        n = len(self._modes)

        def score(smoothing: float) -> float:
            spent = CAUTION * self.effective_parameters(smoothing)
            return float(np.sum(self.residuals(smoothing) ** 2)) / (n - spent) ** 2 if spent < n else np.inf
        return _least(score)

    def cautious(self) -> float:
        """The smoothing of least left-out error, each click's counted up to CAP_PX, so that strays do not choose it."""
        return _least(lambda smoothing: float(np.sum(np.minimum(
            np.abs(self.residuals(smoothing) / self.leeway(smoothing)), CAP_PX) ** 2)))

    def strength(self, smoothing: float) -> float:
        """λ itself."""
        return max(smoothing, LEAST_SMOOTHING) * self.unit

    def spline(self, smoothing: float) -> Spline:
        return spline_through(self.known, self.strength(smoothing))


def spline_through(known: Knowledge, strength: float) -> Spline:
    """The spline of λ = strength, with one knot for each place, in the order of the rows."""
    system, size = _system(known, strength)
    n = len(known.values)
    told = np.concatenate([known.values * known.weights, np.zeros(PLANE)])
    try:
        solution = np.linalg.solve(system, told)
    except np.linalg.LinAlgError:
        raise _not_enough() from None
    _, first, where = np.unique(known.places, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)  # that of np.unique hangs on the last digit of places that are level
    knots = known.places[first[order]]
    weights = np.zeros_like(knots)
    pulls = (solution[:n] / size * known.weights)[:, None] * known.directions
    np.add.at(weights, np.argsort(order)[where.ravel()], pulls)
    return Spline(knots, weights, solution[n:].reshape(2, 3).T)


def hat_matrix(known: Knowledge, strength: float, places: Array) -> Array:
    """(2 m, n): what the displacement px at places (m, 2), x and y in turn, takes of each value times its weight."""
    system, size = _system(known, strength)
    n, m = len(known.values), len(places)
    reads = np.zeros((m, 2, n + PLANE))
    reads[:, :, :n] = pull(known, places).reshape(m, 2, n) / size
    for axis in range(2):
        reads[:, axis, n + 3 * axis:n + 3 * axis + 3] = np.concatenate([np.ones((m, 1)), places], axis=1)
    try:
        return np.linalg.solve(system, reads.reshape(2 * m, -1).T)[:n].T
    except np.linalg.LinAlgError:
        raise _not_enough() from None


def pull(known: Knowledge, places: Array) -> Array:
    """(2 m, n): what each row's knot, times its weight, does at places (m, 2) to x and y in turn."""
    by = kernel(places, known.places)[:, None] * (known.directions.T * known.weights)
    return by.reshape(2 * len(places), -1)


def _system(known: Knowledge, strength: float) -> tuple[Array, float]:
    """The symmetric equations of a spline, and what its kernel was divided by to keep them even."""
    pulls, plane = equations(known)
    n = len(pulls)
    size = np.abs(pulls).max() or 1.0
    system = np.zeros((n + PLANE, n + PLANE))
    system[:n, :n] = (pulls + strength * np.eye(n)) / size
    system[:n, n:], system[n:, :n] = plane, plane.T
    return system, size


def equations(known: Knowledge) -> tuple[Array, Array]:
    """What each click's pull does at each click (n, n), and what a plane displacement does (n, 6); weighted."""
    d = known.weights
    pulls = kernel(known.places, known.places) * (known.directions @ known.directions.T) * np.outer(d, d)
    ones = np.concatenate([np.ones((len(d), 1)), known.places], axis=1)
    return pulls, np.concatenate([known.directions[:, :1] * ones, known.directions[:, 1:] * ones], axis=1) * d[:, None]


def _not_enough() -> FitFailed:
    return FitFailed("The clicked lines do not determine how the picture is to be bent.",
                     "Click points on at least four lines, two in each direction, along their whole length.",
                     reason="lines-not-enough")


def _least(score) -> float:
    """The smoothing of least score: over a grid, then by thirds between its neighbours."""
    scores = [score(s) for s in SMOOTHINGS]
    best = int(np.argmin(scores))
    low, high = SMOOTHINGS[max(best - 1, 0)], SMOOTHINGS[min(best + 1, len(SMOOTHINGS) - 1)]
    for _ in range(12):
        a, b = np.exp(np.log(low) + np.log(high / low) * np.array([1, 2]) / 3)
        low, high = (low, b) if score(a) <= score(b) else (a, high)
    middle = float(np.sqrt(low * high))
    return middle if score(middle) < scores[best] else float(SMOOTHINGS[best])
