"""One lens to one choice of chains: where the search starts, and the search.

It starts with the bend, of the many that are tried, which straightens most chains. Chains that are no straight lines in
the world would lead the choice astray; each counts by s / (s + τ²) of its mean square s, so that beyond a few px it no
longer matters how wrong it is (S. Geman and D. McClure 1987).
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from touchline.core.errors import BadInput, FitFailed
from touchline.core.geometry import Array, ImageSize
from touchline.fitting.least_squares import Minimum, minimise
from touchline.fitting.linear import BENDS
from touchline.models.distortion import LINE_LENSES, half_diagonal_px
from touchline.models.lenses.division import division_radii, odd_series
from touchline.straight.problem import Chains, LineFit, fit_lines, lines_through, project_out_lines

CENTRE_SIGMA = 0.01  # of the diagonal: how far lenses are commonly mounted beside the sensor's centre
TAU_PX = 1.0  # beyond, a chain's cost hardly grows
MIN_SCALE = 0.05  # of the scale at the centre: beyond, the picture would be torn apart
BEND_ROUNDS = 3  # the first over all bends, each later one between the neighbours of the best
REFINED_STEPS = 9  # bends that a later round tries
START_SHARES = (1.0, 0.8, 0.6, 0.4, 0.2, 0.0)  # of a first bend, until every chain is within reach


@dataclass(frozen=True)
class PlumbLineProblem:
    """Which terms are free in which lens, and how well the centre is known: σ in px, 0 fixes it."""

    lens: str
    names: tuple[str, ...]
    centre_sigma: float
    size: ImageSize

    @classmethod
    def of(cls, lens: str, terms: tuple[str, ...] | None, centre_sigma_px: float | None, size: ImageSize) -> Self:
        """Read the choices; two terms, and 1 % of the diagonal for the centre, where none are given."""
        if lens not in LINE_LENSES:
            raise BadInput(f"The lens {lens!r} is not available for straight lines.",
                           f"Use one of: {', '.join(LINE_LENSES)}.",
                           reason="unknown-lens")
        known = LINE_LENSES[lens][1]
        names = known[:2] if terms is None else tuple(t for t in known if t in terms)
        if not names or names != known[:len(names)]:
            raise BadInput("The terms of a lens must be freed in order.",
                           f"Free the first term or more of {', '.join(known)}.",
                           reason="bad-option")
        if centre_sigma_px is not None and not 0 <= centre_sigma_px < np.inf:
            raise BadInput("The σ of the centre is not a length.",
                           "Give it in px; 0 fixes the centre.", reason="bad-option")
        sigma = CENTRE_SIGMA * 2 * half_diagonal_px(size) if centre_sigma_px is None else float(centre_sigma_px)
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
        if self.lens == "division":
            return replace(self, lens="division-even", names=("k1", "k2"))
        terms = LINE_LENSES[self.lens][1]
        return replace(self, names=terms[:len(self.names) + 1]) if len(self.names) < len(terms) else None


def initial_bend(chains: Chains, centre: Array) -> float:
    """Return k of the division model per unit² that straightens most chains."""
    plane = chains.plane(centre)
    reach2 = float(np.max(np.sum(plane**2, axis=1)))
    tau2 = max(TAU_PX, chains.noise_px) ** 2
    bends = np.sort(BENDS[1 + BENDS * 1.0 > MIN_SCALE]) / reach2
    for _ in range(BEND_ROUNDS):
        mean_squares = [np.square(division_rms(plane, chains, k)) for k in bends]
        best = int(np.argmin([np.sum(chains.counts * s / (s + tau2)) for s in mean_squares]))
        answer = bends[best]
        bends = np.linspace(bends[max(best - 1, 0)], bends[min(best + 1, len(bends) - 1)], REFINED_STEPS)
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
    gradient = gain[:, None] * normal - 2 * k * (gain**2 * np.sum(plane * normal, axis=1))[:, None] * plane
    return (np.sqrt(chains.sums((distance / np.linalg.norm(gradient, axis=1)) ** 2) / chains.counts)
            * chains.unit_px)


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
    extra = len(columns) - count
    prior = np.zeros((extra, len(columns)))
    prior[:, count:] = np.eye(extra) / (problem.centre_sigma or 1.0)

    def evaluate(state: LineFit) -> tuple[Array, Array]:
        linearisation = state.linearise(chains)
        rows = project_out_lines(replace(linearisation, by_lens=linearisation.by_lens[:, columns]), chains)
        off_centre = (state.centre - problem.size.centre)[:extra] / (problem.centre_sigma or 1.0)
        return (np.concatenate([linearisation.residuals / chains.noise_px, off_centre]),
                np.concatenate([rows / chains.noise_px, prior]))

    def move(state: LineFit, delta: Array) -> LineFit:
        terms = state.terms.copy()
        terms[free] += delta[:count]
        centre = state.centre + delta[count:] if extra else state.centre
        return fit_lines(replace(state, terms=terms, centre=centre), chains)

    return minimise(_within_reach(start, chains), evaluate, move, robust_rows=len(chains.pixels), tolerance=1e-6)


def _within_reach(start: LineFit, chains: Chains) -> LineFit:
    """Return the start with its lines, its terms eased until every chain is within reach.

    What the division model reaches, a polynomial may not.
    """
    for share in START_SHARES:
        eased = with_best_lines(replace(start, terms=start.terms * share), chains)
        if np.isfinite(eased.feet).all():
            return eased
    raise FitFailed("The lines are outside the range of this lens type.", "Try another lens.", reason="no-lens")


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
        rms[reached] = np.sqrt(part.sums(residuals ** 2) / part.counts)
    return np.where(np.isfinite(rms), rms, np.inf)
