"""Fitting a lens to chains of points, each on one straight edge of the world.

A first bend comes from trying many; then distances in raw pixels are minimised, chains that stay crooked are left out
by name, those that turn out straight come back, until the choice stands still.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from touchline.core.errors import FitFailed
from touchline.core.geometry import Array, ImageSize, Indices, Mask, Points, as_points
from touchline.core.statements import say
from touchline.fitting.plumb_line.covariance import covariance, groups_of
from touchline.fitting.plumb_line.initial import chain_rms, initial_bend
from touchline.fitting.plumb_line.problem import Chains
from touchline.fitting.plumb_line.search import PlumbLineProblem, chain_rms_px, initial_fit, solve, spread_covariance
from touchline.models.distortion import Distortion, half_diagonal_px

MIN_POINTS = 3  # two make a line whatever the lens
MIN_LENGTH = 0.02  # of half the diagonal: shorter ones are straight whatever the lens
SPARE_CHAINS = 2  # beyond the terms: a lens that makes one chain straight has proved nothing
MAX_POINTS = 8_000  # that are fitted; all are evaluated. Neighbours on an edge have the same error
MIN_CHAIN_POINTS, MAX_CHAIN_POINTS = 12, 64
CLICK_PX = 0.3  # about what careful clicks and fair edges err
MIN_NOISE_PX = 0.01  # exact points must not make σ 0
CROOKED_RATIO = 2.5  # times what the straighter half errs: such a chain is no straight line
MIN_CROOKED_PX = 0.35  # ... and no chain straighter than that is called crooked
MAX_STRAIGHT_PX = 3.0  # no click and no edge is so far off along a whole straight line
ROUNDS = 6
TAU_PX = 1.0  # a crooked chain counts against every lens alike


@dataclass(frozen=True)
class ChainFit:
    """One chain of the caller's list: points, length px, straightness rms px before and after."""

    index: int
    picture: int
    count: int
    length_px: float
    before_px: float
    after_px: float
    used: bool
    reason: str = ""  # why it was left out: "not-straight", "too-few-points", "too-short"


@dataclass(frozen=True, eq=False)
class PlumbLineFit:
    """A lens; values of names (terms per unit, then the centre in px); every chain.

    statistical_covariance: if the lens is of exactly this kind; covariance: also as far as that is not known.
    """

    lens: Distortion
    names: tuple[str, ...]
    values: Array
    covariance: Array
    statistical_covariance: Array
    chains: tuple[ChainFit, ...]
    before_px: float  # rms of all points of the chains used, each about its own best line
    after_px: float
    noise_px: float
    groups: int  # objects that the chains used belong to
    converged: bool

    @property
    def sigma(self) -> Array:
        return np.sqrt(np.diag(self.covariance))

    @property
    def misfit(self) -> float:
        """Return that of all chains, used or not, so that a lens gains nothing by leaving some out."""
        square = np.array([min(c.after_px, 1e6) ** 2 for c in self.chains if np.isfinite(c.before_px)])
        counts = np.array([c.count for c in self.chains if np.isfinite(c.before_px)])
        return float(np.sqrt(np.sum(counts * square / (square + TAU_PX**2)) / counts.sum()))


def fit_plumb_lines(chains: Sequence[Points], image_size: ImageSize, lens: str = "division",
              terms: tuple[str, ...] | None = None, *, pictures: Sequence[int] | None = None,
              centre_sigma_px: float | None = None, noise_px: float = CLICK_PX) -> PlumbLineFit:
    """Fit a lens to chains (n, 2) px of one or more pictures of one camera; pictures: which each chain is in.

    terms: those that are free, the first two by default. centre_sigma_px: how well the picture's centre is known to
    be the lens's; 0 fixes it there, None takes 1 % of the diagonal. noise_px: a first guess; it is then measured.
    Raises FitFailed where there are too few lines, or no lens makes half of their points straight.
    """
    problem = PlumbLineProblem.of(lens, terms, centre_sigma_px, image_size)
    given = [as_points(c, f"The points of line {i + 1}").reshape(-1, 2) for i, c in enumerate(chains)]
    where = np.zeros(len(given), int) if pictures is None else np.asarray(pictures, int)
    unit, centre, need = half_diagonal_px(image_size), np.array(image_size.centre), len(problem.names) + SPARE_CHAINS
    long = [_length(c) >= MIN_LENGTH * unit for c in given]
    usable = np.array([i for i, c in enumerate(given) if len(c) >= MIN_POINTS and long[i]], int)
    if len(usable) < need:
        raise FitFailed(
            say("refused.few-edges", "There are {n} lines of {px:.0f} px or longer with at least {points} points; "
                "{least} are required.", n=len(usable), px=MIN_LENGTH * unit, points=MIN_POINTS, least=need),
            say("refused.few-edges.fix", "Mark more straight edges: long ones, and some near the edge of the image."),
            reason="too-few-lines")
    most = int(np.clip(MAX_POINTS // len(usable), MIN_CHAIN_POINTS, MAX_CHAIN_POINTS))
    thin = Chains.of([_thinned(given[i], most) for i in usable], unit, noise_px)
    bend = initial_bend(thin, centre)
    plane = (thin.pixels - centre) / unit
    picked = _straight(chain_rms(plane, thin, bend), thin.counts)
    state, tried = initial_fit(thin, problem, bend), []
    for _ in range(ROUNDS):
        if picked.sum() < need or thin.counts[picked].sum() < 0.5 * thin.counts.sum():
            raise FitFailed(say("refused.not-straight", "No lens makes enough of the lines straight."), say(
                "refused.not-straight.fix", "Mark edges that are straight in reality, each one separately."),
                reason="no-straight-lines")
        tried.append(picked)
        part = replace(thin.only(picked), noise_px=noise_px)
        minimum = solve(part, state, problem)
        state = minimum.state
        noise_px = max(1.4826 * float(np.median(np.abs(state.linearise(part).residuals))), MIN_NOISE_PX)
        picked = _straight(chain_rms_px(state, thin), thin.counts)
        if any((picked == t).all() for t in tried):
            break
    picked = tried[-1]  # the chains that the last fit is about
    groups = groups_of(state, part, where[usable[picked]])
    if groups.max() == 0:
        raise FitFailed(say("refused.one-edge", "All the straight lines are one edge, or the sides of one."),
                        say("refused.one-edge.fix", "Mark other edges elsewhere in the image."), reason="one-edge")
    statistical = covariance(minimum, part, groups)
    full = Chains.of([given[i] for i in usable], unit, noise_px)
    before = chain_rms((full.pixels - centre) / unit, full, 0.0)
    after = chain_rms_px(state, full)
    if not np.isfinite(after[picked]).all():
        raise FitFailed(say("refused.edges-lens", "The best fitting lens does not cover the whole image."), say(
            "refused.edges-lens.fix", "Try a lens with fewer terms, or mark edges elsewhere in the image."),
            reason="no-lens")
    fits = {int(i): ChainFit(int(i), int(where[i]), len(given[i]), _length(given[i]), float(b), float(a), bool(p),
                             "" if p else "not-straight")
            for i, b, a, p in zip(usable, before, after, picked, strict=True)}
    every = tuple(fits.get(i, ChainFit(i, int(where[i]), len(c), _length(c), np.nan, np.nan, False,
                                    "too-short" if len(c) >= MIN_POINTS else "too-few-points"))
                  for i, c in enumerate(given))
    found = Distortion(lens, tuple(state.terms.tolist()), tuple(state.centre.tolist()), image_size)
    held = problem.centre_sigma == 0
    return PlumbLineFit(found, (*problem.names, *(() if held else ("centre_x", "centre_y"))),
                    np.concatenate([state.terms[problem.free], [] if held else state.centre]),
                    spread_covariance(statistical, minimum, part, problem, groups), statistical, every,
                    _overall_rms(before[picked], full.counts[picked]), _overall_rms(after[picked], full.counts[picked]),
                    noise_px, int(groups.max()) + 1, minimum.converged)


def _straight(rms: Array, counts: Indices) -> Mask:
    """Return which chains are straight: as good as the better half by points, or nearly."""
    order = np.argsort(rms)
    half = rms[order][np.searchsorted(np.cumsum(counts[order]), counts.sum() / 2)]
    return rms <= min(max(CROOKED_RATIO * half, MIN_CROOKED_PX), MAX_STRAIGHT_PX)


def _overall_rms(rms: Array, counts: Indices) -> float:
    return float(np.sqrt(np.sum(rms**2 * counts) / counts.sum()))


def _thinned(chain: Points, most: int) -> Points:
    return chain[np.unique(np.linspace(0, len(chain) - 1, most).round().astype(int))]


def _length(chain: Points) -> float:
    return float(np.linalg.norm(np.ptp(chain, axis=0))) if len(chain) else 0.0
