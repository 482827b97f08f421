"""One lens to one choice of chains: where the search starts, the search, and what one more term would change."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from touchline.core.errors import BadInput, FitFailed
from touchline.core.geometry import Array, ImageSize, Indices
from touchline.fitting.division import division_radii, odd_series
from touchline.fitting.least_squares import Minimum, minimise
from touchline.fitting.plumb_line.covariance import with_next_term
from touchline.fitting.plumb_line.problem import Chains, LineFit, fit_lines, lines_through, project_out_lines
from touchline.models.distortion import LINE_LENSES, half_diagonal_px

CENTRE_SIGMA = 0.01  # of the diagonal: how far lenses are commonly mounted beside the sensor's centre
START_SHARES = (1.0, 0.8, 0.6, 0.4, 0.2, 0.0)  # of a first bend, until every chain is within reach


@dataclass(frozen=True)
class PlumbLineProblem:
    """Which terms are free in which lens, and how well the centre is known; 0 fixes it."""

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
        return [LINE_LENSES[self.lens][0].TERMS.index(n) for n in self.names]

    @property
    def columns(self) -> list[int]:
        return [*self.free, *([-2, -1] if self.centre_sigma else [])]

    @property
    def wider(self) -> Self | None:
        """Return the same with one more term."""
        if self.lens == "division":
            return replace(self, lens="division-even", names=("k1", "k2"))
        terms = LINE_LENSES[self.lens][1]
        return replace(self, names=terms[:len(self.names) + 1]) if len(self.names) < len(terms) else None


def initial_fit(chains: Chains, problem: PlumbLineProblem, bend: float) -> LineFit:
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
    count, columns, free = len(problem.names), problem.columns, problem.free
    extra = len(columns) - count
    prior = np.zeros((extra, len(columns)))
    prior[:, count:] = np.eye(extra) / (problem.centre_sigma or 1.0)

    def evaluate(state: LineFit) -> tuple[Array, Array]:
        linearisation = state.linearise(chains)
        rows = project_out_lines(replace(linearisation, by_lens=linearisation.by_lens[:, columns]), chains)
        off = (state.centre - problem.size.centre)[:extra] / (problem.centre_sigma or 1.0)
        return (np.concatenate([linearisation.residuals / chains.noise_px, off]),
                np.concatenate([rows / chains.noise_px, prior]))

    def move(state: LineFit, delta: Array) -> LineFit:
        terms = state.terms.copy()
        terms[free] += delta[:count]
        centre = state.centre + delta[count:] if extra else state.centre
        return fit_lines(replace(state, terms=terms, centre=centre), chains)

    # What the division model reaches, a polynomial may not: the bend is eased until every chain is within reach.
    for ease in START_SHARES:
        first = with_best_lines(replace(start, terms=start.terms * ease), chains)
        if np.isfinite(first.feet).all():
            break
    else:
        raise FitFailed("The lines are outside the range of this lens type.", "Try another lens.",
                        reason="no-lens")
    return minimise(first, evaluate, move, robust_rows=len(chains.pixels), tolerance=1e-6)


def spread_covariance(narrow: Array, minimum: Minimum[LineFit], chains: Chains, problem: PlumbLineProblem,
                      groups: Indices) -> Array:
    """Return the covariance of terms and centre, with what one more term would move."""
    wider, state, count = problem.wider, minimum.state, len(problem.names)
    if wider is None:
        return narrow
    terms = np.zeros(len(LINE_LENSES[wider.lens][0].TERMS))
    terms[:len(state.terms)] = state.terms
    try:
        more = solve(chains, replace(state, lens=LINE_LENSES[wider.lens][0], terms=terms), wider)
    except FitFailed:
        return narrow
    added = float(more.state.terms[wider.free[-1]])
    return with_next_term(narrow, more, chains, count - 1, float(state.terms[problem.free[-1]]), added, groups)


def with_best_lines(state: LineFit, chains: Chains) -> LineFit:
    """Return the lens with the best lines through these chains; NaN in feet where it does not reach one of them."""
    plane = state.lens.undistort(state.terms, (chains.pixels - state.centre) / chains.unit_px)[..., :2]
    angle, offset, feet = lines_through(plane, chains)
    return fit_lines(replace(state, angle=angle, offset=offset, feet=feet), chains)


def chain_rms_px(state: LineFit, chains: Chains) -> Array:
    """Return the rms of each chain (c,), px, about its own best line; infinite where the lens does not reach."""
    plane = state.lens.undistort(state.terms, (chains.pixels - state.centre) / chains.unit_px)[..., :2]
    reached = chains.sums(np.isfinite(plane).all(axis=1).astype(int)) == chains.counts
    part = chains.only(reached)
    rms = np.full(len(reached), np.inf)
    if reached.any():
        rms[reached] = np.sqrt(part.sums(with_best_lines(state, part).linearise(part).residuals ** 2) / part.counts)
    return np.where(np.isfinite(rms), rms, np.inf)
