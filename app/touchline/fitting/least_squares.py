"""The least squares that fitters share: Levenberg–Marquardt with a robust loss, on any state with a retraction.

    minimise Σ ρ(r_i²),   ρ(s) = 2 (√(1 + s) - 1)   (soft L1) or s

K. Levenberg 1944; D. Marquardt 1963; steps accepted by gain ratio (Madsen, Nielsen, Tingleff 2004, §3.2); the robust
loss by reweighting each linearisation. Columns are scaled by their own length, so units do not matter.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from touchline.core.geometry import Array

State = TypeVar("State")

FIRST_DAMPING = 1e-3
MAX_DAMPING = 1e12
# times a gain that is no gain: a step may promise so much where the cost stands still
STANDING = 10.0
MIN_DAMPING_FACTOR = 0.1  # of one good step; the usual third needs twice the evaluations


@dataclass(frozen=True, eq=False)
class Minimum(Generic[State]):
    """Where the search ended. residuals and jacobian are unweighted, in units of their σ; damping: to go on with."""

    state: State
    cost: float
    residuals: Array
    jacobian: Array
    converged: bool
    damping: float


def minimise(
    start: State,
    evaluate: Callable[[State], tuple[Array, Array]],
    move: Callable[[State, Array], State],
    *,
    robust_rows: int = 0,
    max_steps: int = 60,
    tolerance: float = 1e-10,
    damping: float = FIRST_DAMPING,
    first: tuple[Array, Array] | None = None,
) -> Minimum[State]:
    """Find the state of least cost near start.

    evaluate(state) -> residuals (m,), jacobian (m, n), both in units of σ; non-finite residuals mark a state that is
    out of reach, and the step there is shortened. move(state, delta) applies a step. robust_rows: how many of the
    first rows feel the robust loss. Converged when no parameter would move by more than `tolerance` of what one σ of
    the residuals is worth, or the cost stands still. damping: the first step's; less where the start is near.
    first: evaluate(start), where that is known.
    """
    state = start
    residuals, jacobian = evaluate(state) if first is None else first
    if not (np.isfinite(residuals).all() and np.isfinite(jacobian).all()):
        return Minimum(state, np.inf, residuals, jacobian, False, damping)
    cost = _cost(residuals, robust_rows)
    growth = 2.0
    for _ in range(max_steps):
        weighted, jw = residuals, jacobian
        if robust_rows:
            weight = np.ones_like(residuals)
            weight[:robust_rows] = (1 + residuals[:robust_rows] ** 2) ** -0.25  # √ρ'
            weighted, jw = residuals * weight, jacobian * weight[:, None]
        scale = np.sqrt(np.einsum("ij,ij->j", jw, jw))
        scale[scale == 0] = 1.0
        jw = jw / scale
        gradient, hessian = jw.T @ weighted, jw.T @ jw
        while True:
            try:
                delta = -np.linalg.solve(hessian + damping * np.eye(len(gradient)), gradient)
            except np.linalg.LinAlgError:
                delta = None
            if delta is not None and np.isfinite(delta).all():
                candidate = move(state, delta / scale)
                new_residuals, new_jacobian = evaluate(candidate)
                new_cost = _cost(new_residuals, robust_rows)
                if np.isfinite(new_cost) and np.isfinite(new_jacobian).all() and new_cost <= cost:
                    break
            damping *= growth
            growth *= 2
            if damping > MAX_DAMPING:
                return Minimum(state, cost, residuals, jacobian, True, damping)
        predicted = float(delta @ (damping * delta - gradient))
        ratio = (cost - new_cost) / predicted if predicted > 0 else 1.0
        enough = 0.1 * tolerance * cost + tolerance**2
        # a step too long for a bent valley gains nothing either, where a shorter one would
        still = (cost - new_cost <= enough and predicted <= STANDING * enough) or np.abs(
            delta
        ).max() < tolerance
        state, residuals, jacobian, cost = candidate, new_residuals, new_jacobian, new_cost
        if still:
            return Minimum(state, cost, residuals, jacobian, True, damping)
        damping *= max(MIN_DAMPING_FACTOR, 1 - (2 * ratio - 1) ** 3)
        growth = 2.0
    return Minimum(state, cost, residuals, jacobian, False, damping)


def _cost(residuals: Array, robust_rows: int) -> float:
    squared = residuals**2
    return float(
        np.sum(2 * (np.sqrt(1 + squared[:robust_rows]) - 1)) + np.sum(squared[robust_rows:])
    )
