"""One lens to one choice of chains: how far points lie from the picture of a straight line, and the search.

A chain's line in the undistorted plane is n·u = c, n = (cos a, sin a); a place on it u(t) = c n + t d. The picture of
it is the curve D(u(t)), and a point's residual is its distance from that curve in raw pixels, along the curve's normal
m:

    r = m · (p - D(u(t))),   ∂r/∂x = -m · ∂D(u(t))/∂x   at the foot t, where the distance stands still along the curve.

With q = m · D' n:  ∂r/∂c = -q,  ∂r/∂a = t q,  and ∂r/∂centre = -m. Each chain's two unknowns are solved for whenever
the lens moves, and its columns projected out (variable projection, G. Golub and V. Pereyra 1973; L. Kaufman 1975).

It starts with the bend, of the many that are tried, which straightens most chains. Chains that are no straight lines in
the world would lead the choice astray; each counts by s / (s + τ²) of its mean square s, so that beyond a few px it no
longer matters how wrong it is (S. Geman and D. McClure 1987).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from touchline.core.errors import BadInput, FitFailed
from touchline.core.geometry import Array, ImageSize, Indices, Mask, Points, homogeneous
from touchline.fitting.least_squares import Minimum, minimise
from touchline.fitting.linear import BENDS
from touchline.models.distortion import LINE_LENSES, half_diagonal_px
from touchline.models.lenses import Lens
from touchline.models.lenses.division import division_radii, odd_series

MAX_STEPS = 8
LINE_TOLERANCE_PX = 1e-5  # far below the noise of clicks and edges
FOOT_TOLERANCE_PX = 1e-2  # a foot beside its place has only a second-order effect
REGULARISATION = 1e-12  # of a chain's own information: two points on one place must not divide by 0

# of the diagonal: how far lenses are commonly mounted beside the sensor's centre
CENTRE_SIGMA = 0.01
TAU_PX = 1.0  # beyond, a chain's cost hardly grows
MIN_SCALE = 0.05  # of the scale at the centre: beyond, the picture would be torn apart
BEND_ROUNDS = 3  # the first over all bends, each later one between the neighbours of the best
REFINED_STEPS = 9  # bends that a later round tries
START_SHARES = (1.0, 0.8, 0.6, 0.4, 0.2, 0.0)  # of a first bend, until every chain is within reach


@dataclass(frozen=True, eq=False)
class Chains:
    """Points of all chains, one after the other.

    pixels (n, 2) raw px. starts (c,): where each chain begins. unit_px: length of the plane's unit. noise_px: σ of a
    point across its line.
    """

    pixels: Points
    starts: Indices
    unit_px: float
    noise_px: float

    @classmethod
    def of(cls, chains: Sequence[Points], unit_px: float = 1.0, noise_px: float = 1.0) -> Self:
        """Join chains, (n, 2) px each."""
        lengths = np.array([len(chain) for chain in chains])
        return cls(
            np.concatenate(chains),
            np.concatenate([[0], np.cumsum(lengths)[:-1]]),
            unit_px,
            noise_px,
        )

    @property
    def counts(self) -> Indices:
        """Return how many points each chain has, (c,)."""
        return np.diff(np.append(self.starts, len(self.pixels)))

    @property
    def owner(self) -> Indices:
        """Return which chain each point belongs to, (n,)."""
        return np.repeat(np.arange(len(self.starts)), self.counts)

    def only(self, which: Mask) -> Self:
        """Return some of the chains; which (c,)."""
        return replace(
            self,
            pixels=self.pixels[which[self.owner]],
            starts=np.concatenate([[0], np.cumsum(self.counts[which])[:-1]]).astype(int),
        )

    def sums(self, values: Array) -> Array:
        """Sum over each chain, (n, …) to (c, …)."""
        return np.add.reduceat(values, self.starts, axis=0)

    def plane(self, centre: Array) -> Points:
        """Return the points about a centre (2,) px in units of the plane, (n, 2), still distorted."""
        return (self.pixels - centre) / self.unit_px


@dataclass(frozen=True, eq=False)
class Linearisation:
    """Residuals and their derivatives, px.

    residuals (n,). by_lens (n, k + 2): by terms, then by the centre's x and y. by_line (n, 2): by the angle and the
    offset of the chain's own line.
    """

    residuals: Array
    by_lens: Array
    by_line: Array


@dataclass(frozen=True, eq=False)
class LineFit:
    """A lens with a line for each chain.

    terms (k,). centre (2,) px. angle, offset (c,): each line, in units of the plane. feet (n,): places of the points
    along their lines; NaN where the lens does not reach.
    """

    lens: type[Lens]
    terms: Array
    centre: Array
    angle: Array
    offset: Array
    feet: Array

    def linearise(self, chains: Chains) -> Linearisation:
        """Return residuals and derivatives at the feet."""
        return _linearise(self, chains)[0]

    def undistorted(self, chains: Chains) -> Array:
        """Return the points in the plane without the lens's distortion, (n, 2); NaN where it does not reach."""
        return self.lens.undistort(self.terms, chains.plane(self.centre))[..., :2]


def fit_lines(state: LineFit, chains: Chains) -> LineFit:
    """Fit every chain's line by the robust loss; NaN in feet where the lens cannot reach."""
    for _ in range(MAX_STEPS):
        linearisation, foot_step = _linearise(state, chains)
        if not np.isfinite(linearisation.residuals).all():
            return replace(state, feet=np.full_like(state.feet, np.nan))
        weight = robust_weight(linearisation.residuals, chains.noise_px)
        turn, shift = _line_steps(linearisation.by_line, linearisation.residuals, weight, chains).T
        feet = state.feet + foot_step
        state = replace(state, angle=state.angle + turn, offset=state.offset + shift, feet=feet)
        line_step = np.abs(turn).max() * np.abs(feet).max() + np.abs(shift).max()
        if (
            line_step * chains.unit_px < LINE_TOLERANCE_PX
            and np.abs(foot_step).max() * chains.unit_px < FOOT_TOLERANCE_PX
        ):
            break
    return state


def robust_weight(residuals: Array, noise_px: float) -> Array:
    """Return ρ' of the soft L1 loss of least_squares.minimise."""
    return (1 + (residuals / noise_px) ** 2) ** -0.5


def project_out_lines(linearisation: Linearisation, chains: Chains) -> Array:
    """Return by_lens (n, k + 2) with each chain's line eliminated."""
    weight = robust_weight(linearisation.residuals, chains.noise_px)
    # How each chain's line follows when one column of the lens moves its points.
    steps = np.stack(
        [
            _line_steps(linearisation.by_line, column, weight, chains)
            for column in linearisation.by_lens.T
        ],
        axis=-1,
    )
    return linearisation.by_lens + np.einsum(
        "nl,nlk->nk", linearisation.by_line, steps[chains.owner]
    )


def lines_through(plane: Array, chains: Chains) -> tuple[Array, Array, Array]:
    """Return the best line of each chain through (…, n, 2): angle and offset (…, c), feet (…, n)."""
    count = chains.counts
    middle = np.add.reduceat(plane, chains.starts, axis=-2) / count[:, None]
    about = plane - np.repeat(middle, count, axis=-2)
    xx, yy, xy = (
        np.add.reduceat(product, chains.starts, axis=-1)
        for product in (about[..., 0] ** 2, about[..., 1] ** 2, about[..., 0] * about[..., 1])
    )
    angle = 0.5 * np.arctan2(2 * xy, xx - yy) + np.pi / 2  # across the direction of greatest spread
    normal = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    n = np.repeat(normal, count, axis=-2)
    return (
        angle,
        np.sum(normal * middle, axis=-1),
        plane[..., 1] * n[..., 0] - plane[..., 0] * n[..., 1],
    )


def _linearise(state: LineFit, chains: Chains) -> tuple[Linearisation, Array]:
    """Linearise; also return how far each foot is from the nearest place to its point, (n,) in units of the plane."""
    owner = chains.owner
    normal = np.stack([np.cos(state.angle), np.sin(state.angle)], axis=-1)[owner]
    direction = np.stack([-normal[:, 1], normal[:, 0]], axis=-1)
    on_line = state.offset[owner, None] * normal + state.feet[:, None] * direction
    with np.errstate(all="ignore"):  # beyond reach: NaN, which the least squares steps back from
        on_curve, by_ray, by_terms = state.lens.distort_jacobian(state.terms, homogeneous(on_line))
    by_place = by_ray[..., :2]
    tangent = np.einsum("nij,nj->ni", by_place, direction)
    speed2 = np.sum(tangent**2, axis=1)
    off_curve = chains.plane(state.centre) - on_curve
    with np.errstate(all="ignore"):
        foot_step = np.sum(tangent * off_curve, axis=1) / speed2
        # The line's direction turned back by 90° is its normal: so is the curve's.
        curve_normal = np.stack([tangent[:, 1], -tangent[:, 0]], axis=-1) / np.sqrt(speed2)[:, None]
    q = np.einsum("ni,nij,nj->n", curve_normal, by_place, normal)
    residuals = np.sum(curve_normal * off_curve, axis=1) * chains.unit_px
    by_terms = -np.einsum("ni,nik->nk", curve_normal, by_terms) * chains.unit_px
    by_line = np.stack([state.feet * q, -q], axis=-1) * chains.unit_px
    return Linearisation(
        residuals, np.concatenate([by_terms, -curve_normal], axis=1), by_line
    ), foot_step


def _line_steps(by_line: Array, values: Array, weight: Array, chains: Chains) -> Array:
    """Return for each chain the turn and shift (c, 2) that best undo values (n,): weighted normal equations, 2 × 2."""
    a, b = by_line[:, 0], by_line[:, 1]
    aa, ab, bb, av, bv = chains.sums(
        np.stack([a * a, a * b, b * b, a * values, b * values], axis=1) * weight[:, None]
    ).T
    det = aa * bb - ab * ab
    det = det + REGULARISATION * aa * bb + np.finfo(float).tiny
    return -np.stack([bb * av - ab * bv, aa * bv - ab * av], axis=-1) / det[:, None]


@dataclass(frozen=True)
class PlumbLineProblem:
    """Which terms are free in which lens, and how well the centre is known: σ in px, 0 fixes it."""

    lens: str
    names: tuple[str, ...]
    centre_sigma: float
    size: ImageSize

    @classmethod
    def of(
        cls,
        lens: str,
        terms: tuple[str, ...] | None,
        centre_sigma_px: float | None,
        size: ImageSize,
    ) -> Self:
        """Read the choices; two terms, and 1 % of the diagonal for the centre, where none are given."""
        if lens not in LINE_LENSES:
            raise BadInput(
                f"The lens {lens!r} is not available for straight lines.",
                f"Use one of: {', '.join(LINE_LENSES)}.",
                reason="unknown-lens",
            )
        known = LINE_LENSES[lens][1]
        names = known[:2] if terms is None else tuple(t for t in known if t in terms)
        if not names or names != known[: len(names)]:
            raise BadInput(
                "The terms of a lens must be freed in order.",
                f"Free the first term or more of {', '.join(known)}.",
                reason="bad-option",
            )
        if centre_sigma_px is not None and not 0 <= centre_sigma_px < np.inf:
            raise BadInput(
                "The σ of the centre is not a length.",
                "Give it in px; 0 fixes the centre.",
                reason="bad-option",
            )
        sigma = (
            CENTRE_SIGMA * 2 * half_diagonal_px(size)
            if centre_sigma_px is None
            else float(centre_sigma_px)
        )
        return cls(lens, names, sigma, size)

    @property
    def free(self) -> list[int]:
        """Return the indices of the free terms among all of the lens."""
        return [LINE_LENSES[self.lens][0].TERMS.index(n) for n in self.names]

    @property
    def columns(self) -> list[int]:
        """Return the columns of Linearisation.by_lens that are free."""
        return [*self.free, *([-2, -1] if self.centre_sigma else [])]

    @property
    def wider(self) -> Self | None:
        """Return the same with one more term; None where the lens has no more."""
        if self.lens == "division":  # with its first term alone, "division-even" is the same lens
            return replace(self, lens="division-even", names=("k1", "k2"))
        terms = LINE_LENSES[self.lens][1]
        return (
            replace(self, names=terms[: len(self.names) + 1])
            if len(self.names) < len(terms)
            else None
        )


def initial_bend(chains: Chains, centre: Array) -> float:
    """Return k of the division model per unit² that straightens most chains."""
    plane = chains.plane(centre)
    reach2 = float(np.max(np.sum(plane**2, axis=1)))
    tau2 = max(TAU_PX, chains.noise_px) ** 2
    # Bends are tried for the furthest point at radius 1, where their scale is 1 + k.
    bends = np.sort(BENDS[1 + BENDS > MIN_SCALE]) / reach2
    for _ in range(BEND_ROUNDS):
        mean_squares = [np.square(division_rms(plane, chains, k)) for k in bends]
        best = int(np.argmin([np.sum(chains.counts * s / (s + tau2)) for s in mean_squares]))
        answer = bends[best]
        bends = np.linspace(
            bends[max(best - 1, 0)], bends[min(best + 1, len(bends) - 1)], REFINED_STEPS
        )
    return float(answer)


def division_rms(plane: Array, chains: Chains, k: float) -> Array:
    """Return the rms of each chain (c,), raw px, under the division model of that k.

    To first order: a point's distance from the chain's line in the undistorted plane, over how fast that distance
    grows with the raw point. plane (n, 2): the raw points in units of the plane. k = 0: without a lens.
    """
    gain = 1 / (1 + k * np.sum(plane**2, axis=1))
    undistorted = plane * gain[:, None]
    angle, offset, _ = lines_through(undistorted, chains)
    normal = np.stack([np.cos(angle), np.sin(angle)], axis=1)[chains.owner]
    distance = np.sum(normal * undistorted, axis=1) - offset[chains.owner]
    gradient = (
        gain[:, None] * normal - 2 * k * (gain**2 * np.sum(plane * normal, axis=1))[:, None] * plane
    )
    return (
        np.sqrt(chains.sums((distance / np.linalg.norm(gradient, axis=1)) ** 2) / chains.counts)
        * chains.unit_px
    )


def initial_fit(chains: Chains, problem: PlumbLineProblem, bend: float) -> LineFit:
    """Return the lens of that problem with a first bend, about the image centre; its lines are not yet fitted."""
    lens = LINE_LENSES[problem.lens][0]
    terms, centre = np.zeros(len(lens.TERMS)), np.array(problem.size.centre)
    if problem.lens == "brown-conrady":
        reach = float(np.linalg.norm(chains.pixels - centre, axis=1).max()) / chains.unit_px
        terms[problem.free] = odd_series(*division_radii(bend, reach), len(problem.names))
    else:
        terms[0] = bend
    empty = np.empty(0)
    return LineFit(lens, terms, centre, empty, empty, empty)


def solve(chains: Chains, start: LineFit, problem: PlumbLineProblem) -> Minimum[LineFit]:
    """Fit the free terms and the centre to chains; FitFailed where the lens does not reach them.

    Rows of the minimum: the points, in units of their noise, then the prior of the centre, where it is free.
    """
    count, columns, free = len(problem.names), problem.columns, problem.free
    extra = len(columns) - count  # 2 where the centre is free, else 0
    prior = np.zeros((extra, len(columns)))
    prior[:, count:] = np.eye(extra) / (problem.centre_sigma or 1.0)

    def evaluate(state: LineFit) -> tuple[Array, Array]:
        linearisation = state.linearise(chains)
        rows = project_out_lines(
            replace(linearisation, by_lens=linearisation.by_lens[:, columns]), chains
        )
        off_centre = (state.centre - problem.size.centre)[:extra] / (problem.centre_sigma or 1.0)
        return (
            np.concatenate([linearisation.residuals / chains.noise_px, off_centre]),
            np.concatenate([rows / chains.noise_px, prior]),
        )

    def move(state: LineFit, delta: Array) -> LineFit:
        terms = state.terms.copy()
        terms[free] += delta[:count]
        centre = state.centre + delta[count:] if extra else state.centre
        return fit_lines(replace(state, terms=terms, centre=centre), chains)

    return minimise(
        _within_reach(start, chains), evaluate, move, robust_rows=len(chains.pixels), tolerance=1e-6
    )


def _within_reach(start: LineFit, chains: Chains) -> LineFit:
    """Return the start with its lines, its terms eased until every chain is within reach.

    What the division model reaches, a polynomial may not.
    """
    for share in START_SHARES:
        eased = with_best_lines(replace(start, terms=start.terms * share), chains)
        if np.isfinite(eased.feet).all():
            return eased
    raise FitFailed(
        "The lines are outside the range of this lens type.", "Try another lens.", reason="no-lens"
    )


def with_best_lines(state: LineFit, chains: Chains) -> LineFit:
    """Return the lens with the best lines through these chains; NaN in feet where it does not reach one of them."""
    angle, offset, feet = lines_through(state.undistorted(chains), chains)
    return fit_lines(replace(state, angle=angle, offset=offset, feet=feet), chains)


def chain_rms(state: LineFit, chains: Chains) -> Array:
    """Return the rms of each chain (c,), px, about its own best line; infinite where the lens does not reach."""
    is_reached = np.isfinite(state.undistorted(chains)).all(axis=1)
    reached = chains.sums(is_reached.astype(int)) == chains.counts
    part = chains.only(reached)
    rms = np.full(len(reached), np.inf)
    if reached.any():
        residuals = with_best_lines(state, part).linearise(part).residuals
        rms[reached] = np.sqrt(part.sums(residuals**2) / part.counts)
    return np.where(np.isfinite(rms), rms, np.inf)
