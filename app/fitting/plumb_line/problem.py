"""How far points lie from the picture of a straight line, with the lines themselves eliminated.

A chain's line in the plane is n·u = c, n = (cos a, sin a); a place on it u(t) = c n + t d. The picture of it is the
curve D(u(t)), and a point's residual is its distance from that curve in raw pixels, along the curve's normal m:

    r = m · (p - D(u(t))),   ∂r/∂x = -m · ∂D(u(t))/∂x   at the foot t, where the distance stands still along the curve.

With q = m · D' n:  ∂r/∂c = -q,  ∂r/∂a = t q,  and ∂r/∂centre = -m. Each chain's two unknowns are solved for whenever
the lens moves, and its columns projected out (variable projection, G. Golub and V. Pereyra 1973; L. Kaufman 1975).
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from app.core.geometry import Array, Points
from app.models.lenses.projection import rays_of

SETTLE_STEPS = 8
SETTLED_PX = 1e-5  # lines stand still to that: far less than clicks or edges can tell
FEET_PX = 1e-2  # feet to that: a foot beside its place costs only by the square, through the line's bend
TURN = 1e-12  # of a chain's own information: keeps two points on one spot from dividing by nought


@dataclass(frozen=True, eq=False)
class Chains:
    """Points of all chains, one after the other: pixels (n, 2), starts (c,) where each begins, unit_px, noise_px."""

    pixels: Points
    starts: Array
    unit_px: float
    noise_px: float

    @classmethod
    def of(cls, chains: list[Points], unit: float, noise_px: float) -> Self:
        lengths = np.array([len(c) for c in chains])
        return cls(np.concatenate(chains), np.concatenate([[0], np.cumsum(lengths)[:-1]]), unit, noise_px)

    @property
    def counts(self) -> Array:
        return np.diff(np.append(self.starts, len(self.pixels)))

    @property
    def owner(self) -> Array:
        """Which chain each point belongs to, (n,)."""
        return np.repeat(np.arange(len(self.starts)), self.counts)

    def sums(self, values: Array) -> Array:
        """Over each chain, (n, …) to (c, …)."""
        return np.add.reduceat(values, self.starts, axis=0)


@dataclass(frozen=True, eq=False)
class Look:
    """At one state: residuals (n,) px, by terms (n, k) and centre (n, 2), by each chain's turn and shift (n, 2)."""

    residuals: Array
    by_lens: Array
    by_line: Array


@dataclass(frozen=True, eq=False)
class Bent:
    """A lens, its centre (2,) px, and each chain's line: angle and offset (c,), feet (n,), in units of the plane."""

    lens: type
    terms: Array
    centre: Array
    angle: Array
    offset: Array
    feet: Array

    def look(self, chains: Chains) -> Look:
        """Residuals and derivatives where the feet stand."""
        return _look(self, chains)[0]


def settled(state: Bent, chains: Chains) -> Bent:
    """The same lens with every chain's line where the robust loss is least; NaN in feet where the lens cannot reach."""
    for _ in range(SETTLE_STEPS):
        look, onward = _look(state, chains)
        if not np.isfinite(look.residuals).all():
            return replace(state, feet=np.full_like(state.feet, np.nan))
        weight = robust_weight(look.residuals, chains.noise_px)
        turn, shift = _line_steps(look.by_line, look.residuals, weight, chains).T
        feet = state.feet + onward
        state = replace(state, angle=state.angle + turn, offset=state.offset + shift, feet=feet)
        across = np.abs(turn).max() * np.abs(feet).max() + np.abs(shift).max()
        if across * chains.unit_px < SETTLED_PX and np.abs(onward).max() * chains.unit_px < FEET_PX:
            break
    return state


def robust_weight(residuals: Array, noise_px: float) -> Array:
    """ρ' of the soft L1 loss that solve.minimise takes."""
    return (1 + (residuals / noise_px) ** 2) ** -0.5


def projected(look: Look, chains: Chains) -> Array:
    """Derivatives by terms and centre (n, k + 2), px, after each chain's line has taken what it can."""
    weight = robust_weight(look.residuals, chains.noise_px)
    taken = np.stack([_line_steps(look.by_line, column, weight, chains) for column in look.by_lens.T], axis=-1)
    return look.by_lens + np.einsum("nl,nlk->nk", look.by_line, taken[chains.owner])


def lines_through(plane: Array, chains: Chains) -> tuple[Array, Array, Array]:
    """The best line of each chain through (…, n, 2): angle and offset (…, c), feet (…, n)."""
    count = chains.counts
    middle = np.add.reduceat(plane, chains.starts, axis=-2) / count[:, None]
    about = plane - np.repeat(middle, count, axis=-2)
    xx, yy, xy = (np.add.reduceat(v, chains.starts, axis=-1) for v in
                  (about[..., 0] ** 2, about[..., 1] ** 2, about[..., 0] * about[..., 1]))
    angle = 0.5 * np.arctan2(2 * xy, xx - yy) + np.pi / 2  # across the direction of greatest spread
    normal = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    n = np.repeat(normal, count, axis=-2)
    return angle, np.sum(normal * middle, axis=-1), plane[..., 1] * n[..., 0] - plane[..., 0] * n[..., 1]


def _look(state: Bent, chains: Chains) -> tuple[Look, Array]:
    """And how far each foot should go on to lie below its point, (n,) in units of the plane."""
    owner = chains.owner
    n = np.stack([np.cos(state.angle), np.sin(state.angle)], axis=-1)[owner]
    d = np.stack([-n[:, 1], n[:, 0]], axis=-1)
    seen = (chains.pixels - state.centre) / chains.unit_px
    with np.errstate(all="ignore"):  # beyond reach: NaN, which the least squares steps back from
        curve, by_ray, by_terms = state.lens.distort_jacobian(
            state.terms, rays_of(state.offset[owner, None] * n + state.feet[:, None] * d))
    along = np.einsum("nij,nj->ni", by_ray[..., :2], d)
    speed = np.sum(along**2, axis=1)
    with np.errstate(all="ignore"):
        onward = np.sum(along * (seen - curve), axis=1) / speed
        m = np.stack([along[:, 1], -along[:, 0]], axis=-1) / np.sqrt(speed)[:, None]  # d turned back by 90° is n
    q = np.einsum("ni,nij,nj->n", m, by_ray[..., :2], n)
    residuals = np.sum(m * (seen - curve), axis=1) * chains.unit_px
    by_terms = -np.einsum("ni,nik->nk", m, by_terms) * chains.unit_px
    by_line = np.stack([state.feet * q, -q], axis=-1) * chains.unit_px
    return Look(residuals, np.concatenate([by_terms, -m], axis=1), by_line), onward


def _line_steps(by_line: Array, values: Array, weight: Array, chains: Chains) -> Array:
    """For each chain the turn and shift (c, 2) that best undo values (n,)."""
    a, b = by_line[:, 0], by_line[:, 1]
    aa, ab, bb, av, bv = chains.sums(np.stack([a * a, a * b, b * b, a * values, b * values], axis=1)
                                     * weight[:, None]).T
    det = aa * bb - ab * ab
    det = det + TURN * aa * bb + np.finfo(float).tiny
    return -np.stack([bb * av - ab * bv, aa * bv - ab * av], axis=-1) / det[:, None]
