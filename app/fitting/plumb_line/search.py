"""One lens to one choice of chains: where the search starts, the search, and what one more term would change."""

from dataclasses import dataclass, replace

import numpy as np

from app.core.errors import BadInput, FitFailed
from app.core.geometry import Array, ImageSize
from app.fitting.least_squares import Minimum, minimise
from app.fitting.plumb_line.covariance import with_spread
from app.fitting.plumb_line.initial import brown_from_division
from app.fitting.plumb_line.problem import Bent, Chains, lines_through, projected, settled
from app.models.plumb_line import LENSES, unit_px

CENTRE_SIGMA = 0.01  # of the diagonal: how far lenses are commonly mounted beside the sensor's centre
EASE = (1.0, 0.8, 0.6, 0.4, 0.2, 0.0)  # of a first bend, until every chain is within reach


@dataclass(frozen=True)
class Task:
    """Which terms are free in which lens, and how well the centre is known; 0 holds it."""

    lens: str
    names: tuple[str, ...]
    centre_sigma: float
    size: ImageSize

    @property
    def free(self) -> list[int]:
        return [LENSES[self.lens][0].TERMS.index(n) for n in self.names]

    @property
    def columns(self) -> list[int]:
        return [*self.free, *([-2, -1] if self.centre_sigma else [])]

    @property
    def wider(self) -> "Task | None":
        """The same with one more term."""
        if self.lens == "division":
            return replace(self, lens="division-even", names=("k1", "k2"))
        terms = tuple(LENSES[self.lens][1])
        return replace(self, names=terms[:len(self.names) + 1]) if len(self.names) < len(terms) else None


def task_of(lens: str, terms: tuple[str, ...] | None, centre_sigma_px: float | None, size: ImageSize) -> Task:
    if lens not in LENSES:
        raise BadInput(f"Straight lines know no lens {lens!r}.", f"Use one of: {', '.join(LENSES)}.",
                       reason="unknown-lens")
    known = tuple(LENSES[lens][1])
    names = known[:2] if terms is None else tuple(t for t in known if t in terms)
    if not names or names != known[:len(names)]:
        raise BadInput("The terms of a lens are freed in order.", f"Free the first or more of {', '.join(known)}.",
                       reason="bad-option")
    if centre_sigma_px is not None and not 0 <= centre_sigma_px < np.inf:
        raise BadInput("The centre's σ is no length.", "Give it in px, 0 to hold the centre.", reason="bad-option")
    sigma = CENTRE_SIGMA * 2 * unit_px(size) if centre_sigma_px is None else float(centre_sigma_px)
    return Task(lens, names, sigma, size)


def start_of(chains: Chains, task: Task, bend: float) -> Bent:
    lens = LENSES[task.lens][0]
    terms, centre = np.zeros(len(lens.TERMS)), np.array(task.size.centre)
    if task.lens == "brown-conrady":
        reach = float(np.linalg.norm(chains.pixels - centre, axis=1).max()) / chains.unit_px
        terms[task.free] = brown_from_division(bend, reach, len(task.names))
    else:
        terms[0] = bend
    empty = np.empty(0)
    return Bent(lens, terms, centre, empty, empty, empty)


def solve(chains: Chains, start: Bent, task: Task) -> Minimum[Bent]:
    count, columns, free = len(task.names), task.columns, task.free
    extra = len(columns) - count
    prior = np.zeros((extra, len(columns)))
    prior[:, count:] = np.eye(extra) / (task.centre_sigma or 1.0)

    def evaluate(state: Bent) -> tuple[Array, Array]:
        look = state.look(chains)
        rows = projected(replace(look, by_lens=look.by_lens[:, columns]), chains)
        off = (state.centre - task.size.centre)[:extra] / (task.centre_sigma or 1.0)
        return np.concatenate([look.residuals / chains.noise_px, off]), np.concatenate([rows / chains.noise_px, prior])

    def move(state: Bent, delta: Array) -> Bent:
        terms = state.terms.copy()
        terms[free] += delta[:count]
        centre = state.centre + delta[count:] if extra else state.centre
        return settled(replace(state, terms=terms, centre=centre), chains)

    # What the division model reaches, a polynomial may not: the bend is eased until every chain is within reach.
    for ease in EASE:
        first = with_lines(replace(start, terms=start.terms * ease), chains)
        if np.isfinite(first.feet).all():
            break
    else:
        raise FitFailed("The lines lie beyond what any lens of this kind reaches.", "Try another lens.",
                        reason="no-lens")
    return minimise(first, evaluate, move, robust_rows=len(chains.pixels), tolerance=1e-6)


def spread_covariance(narrow: Array, minimum: Minimum[Bent], chains: Chains, task: Task, groups: Array) -> Array:
    """Covariance of terms and centre, with what one more term would move."""
    wider, state, count = task.wider, minimum.state, len(task.names)
    if wider is None:
        return narrow
    terms = np.zeros(len(LENSES[wider.lens][0].TERMS))
    terms[:len(state.terms)] = state.terms
    try:
        more = solve(chains, replace(state, lens=LENSES[wider.lens][0], terms=terms), wider)
    except FitFailed:
        return narrow
    added = float(more.state.terms[wider.free[-1]])
    return with_spread(narrow, more, chains, count - 1, float(state.terms[task.free[-1]]), added, groups)


def with_lines(state: Bent, chains: Chains) -> Bent:
    """The lens with the best lines through these chains; NaN in feet where it does not reach one of them."""
    plane = state.lens.undistort(state.terms, (chains.pixels - state.centre) / chains.unit_px)[..., :2]
    angle, offset, feet = lines_through(plane, chains)
    return settled(replace(state, angle=angle, offset=offset, feet=feet), chains)


def rms_under(state: Bent, chains: Chains) -> Array:
    """Of each chain (c,), px, every one about its own best line; infinite where the lens does not reach."""
    plane = state.lens.undistort(state.terms, (chains.pixels - state.centre) / chains.unit_px)[..., :2]
    reached = chains.sums(np.isfinite(plane).all(axis=1).astype(int)) == chains.counts
    part = some_of(chains, reached)
    rms = np.full(len(reached), np.inf)
    if reached.any():
        rms[reached] = np.sqrt(part.sums(with_lines(state, part).look(part).residuals ** 2) / part.counts)
    return np.where(np.isfinite(rms), rms, np.inf)


def some_of(chains: Chains, which: Array) -> Chains:
    return replace(chains, pixels=chains.pixels[which[chains.owner]],
                   starts=np.concatenate([[0], np.cumsum(chains.counts[which])[:-1]]).astype(int))
