"""From chains of points, each on one straight edge of the world, to the lens that makes them straight.

A first bend comes from trying many; then distances in raw pixels are minimised, chains that stay crooked are left out
by name, those that turn out straight come back, until the choice stands still.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from app.errors import BadInput, FitFailed
from app.geometry import ImageSize, Points, as_points
from app.models.lens import Array
from app.models.plumb_line import LENSES, PlumbLens, unit_px
from app.models.plumb_problem import Bent, Chains, lines_through, projected, settled
from app.models.plumb_sigma import covariance, groups_of, with_spread
from app.models.plumb_start import brown_from_division, chain_rms, first_bend
from app.models.solve import Minimum, minimise

MIN_POINTS = 3  # two make a line whatever the lens
SPARE_CHAINS = 2  # beyond the terms: a lens that makes one chain straight has proved nothing
MOST_POINTS = 8_000  # that are fitted; all are judged. Neighbours on an edge err alike and tell nothing new
LEAST_OF_A_CHAIN, MOST_OF_A_CHAIN = 12, 64
CLICK_PX = 0.3  # about what careful clicks and fair edges err
LEAST_NOISE_PX = 0.01  # exact points must not make σ nought
CROOKED = 2.5  # times what the straighter half errs: such a chain is no straight line
CROOKED_PX = 0.35  # ... and no chain straighter than that is called crooked
HOPELESS_PX = 3.0  # no click and no edge errs so much along a whole straight line
ROUNDS = 6
CENTRE_SIGMA = 0.01  # of the diagonal: how far lenses are commonly mounted beside the sensor's centre
EASE = (1.0, 0.8, 0.6, 0.4, 0.2, 0.0)


@dataclass(frozen=True)
class ChainFit:
    """One chain by its place in the caller's list: points, length px, straightness rms px before and after."""

    index: int
    picture: int
    count: int
    length_px: float
    before_px: float
    after_px: float
    used: bool
    reason: str = ""  # why it was left out: "not-straight", "too-few-points"


@dataclass(frozen=True, eq=False)
class PlumbFit:
    """The lens; values of names (terms per unit, then the centre in px); every chain.

    chance: their covariance if the lens is of exactly this kind; covariance: also as far as that is not known.
    """

    lens: PlumbLens
    names: tuple[str, ...]
    values: Array
    covariance: Array
    chance: Array
    chains: tuple[ChainFit, ...]
    before_px: float  # rms of all points of the chains used, each about its own best line
    after_px: float
    noise_px: float
    groups: int  # objects that the chains used belong to
    converged: bool

    @property
    def sigma(self) -> Array:
        return np.sqrt(np.diag(self.covariance))


@dataclass(frozen=True)
class _Task:
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
    def wider(self) -> "_Task | None":
        """The same with one more term."""
        if self.lens == "division":
            return replace(self, lens="division-even", names=("k1", "k2"))
        terms = tuple(LENSES[self.lens][1])
        return replace(self, names=terms[:len(self.names) + 1]) if len(self.names) < len(terms) else None


def fit_plumb(chains: Sequence[Points], image_size: ImageSize, lens: str = "division",
              terms: tuple[str, ...] | None = None, *, pictures: Sequence[int] | None = None,
              centre_sigma_px: float | None = None, noise_px: float = CLICK_PX) -> PlumbFit:
    """Fit a lens to chains (n, 2) px of one or more pictures of one camera; pictures: which each chain is in.

    terms: those that are free, the first two by default. centre_sigma_px: how well the picture's centre is known to
    be the lens'; 0 holds it there, None takes 1 % of the diagonal. noise_px: a first guess; it is then measured.
    Raises FitFailed where there are too few lines, or no lens makes half of their points straight.
    """
    task = _task(lens, terms, centre_sigma_px, image_size)
    given = [as_points(c, f"The points of line {i + 1}").reshape(-1, 2) for i, c in enumerate(chains)]
    where = np.zeros(len(given), int) if pictures is None else np.asarray(pictures, int)
    usable = np.array([i for i, c in enumerate(given) if len(c) >= MIN_POINTS and _length(c) > 0], int)
    need = len(task.names) + SPARE_CHAINS
    if len(usable) < need:
        raise FitFailed(f"There are {len(usable)} lines with {MIN_POINTS} points or more; {need} are needed.",
                        "Mark more straight edges, long ones, and near the picture's edge.", reason="too-few-lines")
    unit, centre = unit_px(image_size), np.array(image_size.centre)
    most = int(np.clip(MOST_POINTS // len(usable), LEAST_OF_A_CHAIN, MOST_OF_A_CHAIN))
    thin = Chains.of([_thinned(given[i], most) for i in usable], unit, noise_px)
    bend = first_bend(thin, centre)
    plane = (thin.pixels - centre) / unit
    picked = _straight(chain_rms(plane, thin, bend), thin.counts)
    state, tried = _start(thin, task, bend), []
    for _ in range(ROUNDS):
        if picked.sum() < need or thin.counts[picked].sum() < 0.5 * thin.counts.sum():
            raise FitFailed("No lens makes enough of the lines straight.",
                            "Mark edges that are straight in the world, each by itself.", reason="no-straight-lines")
        tried.append(picked)
        part = replace(_some(thin, picked), noise_px=noise_px)
        minimum = _solve(part, state, task)
        state = minimum.state
        noise_px = max(1.4826 * float(np.median(np.abs(state.look(part).residuals))), LEAST_NOISE_PX)
        picked = _straight(_rms_under(state, thin), thin.counts)
        if any((picked == t).all() for t in tried):
            break
    picked = tried[-1]  # the chains that the last fit is about
    groups = groups_of(state, part, where[usable[picked]])
    chance = covariance(minimum, part, groups)
    full = Chains.of([given[i] for i in usable], unit, noise_px)
    before = chain_rms((full.pixels - centre) / unit, full, 0.0)
    after = _rms_under(state, full)
    if not np.isfinite(after[picked]).all():
        raise FitFailed("The lens that fits best would end inside the picture.",
                        "Try a lens with fewer terms, or mark edges elsewhere in the picture.", reason="no-lens")
    told = {int(i): ChainFit(int(i), int(where[i]), len(given[i]), _length(given[i]), float(b), float(a), bool(p),
                             "" if p else "not-straight")
            for i, b, a, p in zip(usable, before, after, picked, strict=True)}
    every = tuple(told.get(i, ChainFit(i, int(where[i]), len(c), _length(c), np.nan, np.nan, False, "too-few-points"))
                  for i, c in enumerate(given))
    found = PlumbLens(lens, tuple(state.terms.tolist()), tuple(state.centre.tolist()), image_size)
    held = task.centre_sigma == 0
    return PlumbFit(found, (*task.names, *(() if held else ("centre_x", "centre_y"))),
                    np.concatenate([state.terms[task.free], [] if held else state.centre]),
                    _spread(chance, minimum, part, task, groups), chance, every,
                    _together(before[picked], full.counts[picked]), _together(after[picked], full.counts[picked]),
                    noise_px, int(groups.max()) + 1, minimum.converged)


def _task(lens: str, terms: tuple[str, ...] | None, centre_sigma_px: float | None, size: ImageSize) -> _Task:
    if lens not in LENSES:
        raise BadInput(f"Straight lines know no lens {lens!r}.", f"Use one of: {', '.join(LENSES)}.",
                       reason="unknown-lens")
    known = tuple(LENSES[lens][1])
    names = known[:2] if terms is None else tuple(t for t in known if t in terms)
    if not names:
        raise BadInput("No term of the lens is free.", f"Free some of {', '.join(known)}.", reason="bad-option")
    sigma = CENTRE_SIGMA * 2 * unit_px(size) if centre_sigma_px is None else float(centre_sigma_px)
    return _Task(lens, names, sigma, size)


def _start(chains: Chains, task: _Task, bend: float) -> Bent:
    lens = LENSES[task.lens][0]
    terms, centre = np.zeros(len(lens.TERMS)), np.array(task.size.centre)
    if task.lens == "brown-conrady":
        reach = float(np.linalg.norm(chains.pixels - centre, axis=1).max()) / chains.unit_px
        terms[task.free] = brown_from_division(bend, reach, len(task.names))
    else:
        terms[0] = bend
    empty = np.empty(0)
    return Bent(lens, terms, centre, empty, empty, empty)


def _solve(chains: Chains, start: Bent, task: _Task) -> Minimum[Bent]:
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


def _spread(narrow: Array, minimum: Minimum[Bent], chains: Chains, task: _Task, groups: Array) -> Array:
    """Covariance of terms and centre, with what one more term would move."""
    wider, state, count = task.wider, minimum.state, len(task.names)
    if wider is None:
        return narrow
    terms = np.zeros(len(LENSES[wider.lens][0].TERMS))
    terms[:len(state.terms)] = state.terms
    try:
        more = _solve(chains, replace(state, lens=LENSES[wider.lens][0], terms=terms), wider)
    except FitFailed:
        return narrow
    added = float(more.state.terms[wider.free[-1]])
    return with_spread(narrow, more, chains, count - 1, float(state.terms[task.free[-1]]), added, groups)


def with_lines(state: Bent, chains: Chains) -> Bent:
    """The lens with the best lines through these chains; NaN in feet where it does not reach one of them."""
    plane = state.lens.undistort(state.terms, (chains.pixels - state.centre) / chains.unit_px)[..., :2]
    angle, offset, feet = lines_through(plane, chains)
    return settled(replace(state, angle=angle, offset=offset, feet=feet), chains)


def _rms_under(state: Bent, chains: Chains) -> Array:
    """Of each chain (c,), px, every one about its own best line; infinite where the lens does not reach."""
    plane = state.lens.undistort(state.terms, (chains.pixels - state.centre) / chains.unit_px)[..., :2]
    reached = chains.sums(np.isfinite(plane).all(axis=1).astype(int)) == chains.counts
    part = _some(chains, reached)
    rms = np.full(len(reached), np.inf)
    if reached.any():
        rms[reached] = np.sqrt(part.sums(with_lines(state, part).look(part).residuals ** 2) / part.counts)
    return np.where(np.isfinite(rms), rms, np.inf)


def _some(chains: Chains, which: Array) -> Chains:
    return replace(chains, pixels=chains.pixels[which[chains.owner]],
                   starts=np.concatenate([[0], np.cumsum(chains.counts[which])[:-1]]).astype(int))


def _straight(rms: Array, counts: Array) -> Array:
    """Which chains are straight: as good as the better half by points, or nearly."""
    order = np.argsort(rms)
    half = rms[order][np.searchsorted(np.cumsum(counts[order]), counts.sum() / 2)]
    return rms <= min(max(CROOKED * half, CROOKED_PX), HOPELESS_PX)


def _together(rms: Array, counts: Array) -> float:
    return float(np.sqrt(np.sum(rms**2 * counts) / counts.sum()))


def _thinned(chain: Points, most: int) -> Points:
    return chain[np.unique(np.linspace(0, len(chain) - 1, most).round().astype(int))]


def _length(chain: Points) -> float:
    return float(np.linalg.norm(np.ptp(chain, axis=0))) if len(chain) else 0.0
