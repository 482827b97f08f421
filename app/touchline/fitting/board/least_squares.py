"""Levenberg–Marquardt for many views that share a few unknowns: each view's own six are eliminated first.

    | U   W | | shared |     | a |          S = U - Σ W_v V_v⁻¹ W_vᵀ    (Schur complement)
    | Wᵀ  V | | own    | = - | b |          shared = - S⁻¹ (a - Σ W_v V_v⁻¹ b_v)

V is block-diagonal, one 6 × 6 block a view, so 300 views cost 300 small inversions and not one of 1800 rows.
B. Triggs et al., "Bundle adjustment – a modern synthesis", 1999, §6.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from touchline.core.geometry import Array

State = TypeVar("State")
BlockLinearisation = tuple[Array, Array, Array]  # residuals (v, m, 2), by shared (v, m, 2, n), by own (v, m, 2, k)

FIRST_DAMPING = 1e-4
MAX_DAMPING = 1e10
TOLERANCE = 1e-7


@dataclass(frozen=True, eq=False)
class BlockMinimum(Generic[State]):
    """Where the search ended. residuals, shared, own: unweighted, in σ."""

    state: State
    cost: float
    residuals: Array  # (v, m, 2), 0 where nothing was seen
    shared: Array
    own: Array

    @property
    def reduced(self) -> Array:
        """Return derivatives by the shared (v, 2 m, n), each view's own unknowns eliminated."""
        v = len(self.residuals)
        shared, own = self.shared.reshape(v, -1, self.shared.shape[-1]), self.own.reshape(v, -1, self.own.shape[-1])
        own_t = own.transpose(0, 2, 1)
        blocks = own_t @ own
        # a little more on the diagonals, so that a view with too few corners does not make the system singular
        blocks += np.einsum("vi,ij->vij", np.einsum("vii->vi", blocks) * 1e-13 + 1e-12, np.eye(blocks.shape[-1]))
        return shared - own @ np.linalg.solve(blocks, own_t @ shared)

    @property
    def information(self) -> Array:
        """Return the information matrix (n, n) of the shared unknowns; poses are eliminated."""
        reduced = self.reduced
        return np.einsum("vij,vik->jk", reduced, reduced, optimize=True)


def minimise_blocks(start: State, linearise: Callable[[State], BlockLinearisation],
                    move: Callable[[State, Array, Array], State], *, prior: Array,
                    prior_at: Callable[[State], Array], robust: bool = False,
                    max_steps: int = 50) -> BlockMinimum[State]:
    """Find the state of least cost near start.

    linearise(state): residuals and derivatives in σ, 0 where nothing was seen. prior (n,): 1/σ of what is known of
    each shared unknown, 0 where nothing is; prior_at(state) (n,): how far each is from its value, in its units.
    robust: soft L1 on the length of each corner's residual. Converged when no step would lower the cost by more than
    TOLERANCE of one residual's worth.
    """
    state = start
    residuals, shared, own = linearise(state)
    cost = _cost(residuals, prior * prior_at(state), robust)
    damping, growth = FIRST_DAMPING, 2.0
    if not np.isfinite(cost):
        return BlockMinimum(state, np.inf, residuals, shared, own)
    for _ in range(max_steps):
        weight = (1 + np.sum(residuals**2, axis=-1)) ** -0.5 if robust else None
        normal = _normal_equations(residuals, shared, own, weight)
        while True:
            delta, own_delta, gain = _step(normal, prior, prior * prior_at(state), damping)
            if np.isfinite(delta).all() and np.isfinite(own_delta).all():
                if gain < TOLERANCE:
                    return BlockMinimum(state, cost, residuals, shared, own)
                candidate = move(state, delta, own_delta)
                new = linearise(candidate)
                new_cost = _cost(new[0], prior * prior_at(candidate), robust)
                if np.isfinite(new_cost) and new_cost < cost:
                    break
            damping, growth = damping * growth, growth * 2
            if damping > MAX_DAMPING:
                return BlockMinimum(state, cost, residuals, shared, own)
        ratio = (cost - new_cost) / gain
        state, cost, (residuals, shared, own) = candidate, new_cost, new
        damping, growth = max(damping * max(1 / 5, 1 - (2 * ratio - 1) ** 3), 1e-12), 2.0
    return BlockMinimum(state, cost, residuals, shared, own)


NormalEquations = tuple[Array, Array, Array, Array, Array]


def _normal_equations(residuals: Array, shared: Array, own: Array, weight: Array | None) -> NormalEquations:
    """Return U (n, n), W (v, k, n), V (v, k, k), a (n,), b (v, k) of the normal equations."""
    v, rows, n, k = len(residuals), residuals[0].size, shared.shape[-1], own.shape[-1]
    r, s, o = residuals.reshape(v, rows), shared.reshape(v, rows, n), own.reshape(v, rows, k)
    if weight is None:
        sw, ow = s.transpose(0, 2, 1), o.transpose(0, 2, 1)
    else:
        w = np.repeat(weight, 2, axis=1)[..., None]
        sw, ow = (s * w).transpose(0, 2, 1), (o * w).transpose(0, 2, 1)
    a, b = (sw @ r[..., None])[..., 0], (ow @ r[..., None])[..., 0]
    return np.sum(sw @ s, axis=0), ow @ s, ow @ o, np.sum(a, axis=0), b


def _step(normal: NormalEquations, prior: Array, prior_residual: Array, damping: float) -> tuple[Array, Array, float]:
    """Return the step, and how much the linear model predicts it to lower the cost."""
    u, w, v, a, b = normal
    u = u + np.diag(prior**2)
    a = a + prior * prior_residual
    diag_u, diag_v = np.diag(u).copy(), np.einsum("vii->vi", v).copy()
    diag_u[diag_u <= 0] = 1.0
    diag_v[diag_v <= 0] = 1.0
    try:
        damped = v + damping * np.einsum("vi,ij->vij", diag_v, np.eye(v.shape[-1]))
        solution = np.linalg.solve(damped, np.concatenate([w, b[..., None]], axis=-1))
        vw, vb = solution[..., :-1], solution[..., -1]
        schur = u + damping * np.diag(diag_u) - np.einsum("vkn,vkm->nm", w, vw, optimize=True)
        right = a - np.einsum("vkn,vk->n", w, vb)
        scale = 1 / np.sqrt(diag_u)
        delta = -scale * np.linalg.solve(schur * np.outer(scale, scale), scale * right)
    except np.linalg.LinAlgError:
        return np.full(len(a), np.nan), np.full_like(b, np.nan), np.nan
    own = -(vb + vw @ delta)
    # (H + D) step = -gradient, so the linear model's gain -2 gradientᵀ step - stepᵀ H step is
    gain = -(a @ delta + np.sum(b * own)) + damping * (diag_u @ delta**2 + np.sum(diag_v * own**2))
    return delta, own, float(gain)


def _cost(residuals: Array, prior_residual: Array, robust: bool) -> float:
    squared = np.sum(residuals**2, axis=-1)
    fit = np.sum(2 * (np.sqrt(1 + squared) - 1)) if robust else np.sum(squared)
    return float(fit + prior_residual @ prior_residual)
