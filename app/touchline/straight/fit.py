"""Fit a lens to chains of points, each on one straight edge of the world.

A first bend comes from trying many; then distances in raw pixels are minimised, chains that stay crooked are left out
by name, those that turn out straight come back, until the choice stands still.

Covariance. Points of one edge err together (it is not quite straight, its light is uneven), and so do edges side by
side (two sides of one bar). Thousands of points are worth far less than thousands. So:

    σ² = jackknife over groups · (t / z)²  +  what one more term would move

The jackknife leaves out one group after another and sees how the answer moves (B. Efron 1982; J. MacKinnon, M. Nielsen,
M. Webb 2023, CV3); where few groups carry the answer, 2 σ is widened to what Student's t asks. A series of terms cut
short fits each part of the picture by other terms; how far they would move with one more, as large as the edges allow,
is part of what is not known of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from touchline.core.errors import FitFailed
from touchline.core.geometry import Array, ImageSize, Indices, Mask, Points, as_points
from touchline.core.statements import say
from touchline.fitting.least_squares import Minimum
from touchline.models.distortion import LINE_LENSES, Distortion, half_diagonal_px
from touchline.straight.search import (
    Chains,
    LineFit,
    PlumbLineProblem,
    chain_rms,
    division_rms,
    initial_bend,
    initial_fit,
    robust_weight,
    solve,
)

MIN_POINTS = 3  # two make a line whatever the lens
MIN_LENGTH = 0.02  # of half the diagonal: shorter ones are straight whatever the lens
SPARE_CHAINS = 2  # beyond the terms: a lens that makes one chain straight has proved nothing
MAX_POINTS = 8_000  # that are fitted; all are evaluated. Neighbours on an edge have the same error
MIN_CHAIN_POINTS, MAX_CHAIN_POINTS = 12, 64
CLICK_PX = 0.3  # about what careful clicks and fair edges err
MIN_NOISE_PX = 0.01  # exact points must not make σ 0
SIGMA_PER_MEDIAN = 1.4826  # σ of a normal distribution over the median of its absolute values
CROOKED_RATIO = 2.5  # times what the straighter half errs: such a chain is no straight line
MIN_CROOKED_PX = 0.35  # ... and no chain straighter than that is called crooked
MAX_STRAIGHT_PX = 3.0  # no click and no edge is so far off along a whole straight line
MIN_STRAIGHT_SHARE = 0.5  # of all points, on straight chains
MAX_ROUNDS = 6
TAU_PX = 1.0  # a crooked chain counts against every lens alike
MAX_MISFIT_PX = 1e6  # in place of infinity, where the lens does not reach
MAX_ADJACENT = 0.03  # of the plane's unit: edges so near and as parallel as that are one object's
MIN_PARALLEL = np.cos(np.radians(4))
# of the last: series of lenses that are used as such fall off at least so quickly
MAX_NEXT_TERM = 0.5
MIN_NEXT_TERM = 0.01  # ... or to that, where the last is 0
Z = 1.96  # the normal distribution's 97.5 % point


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
    before_px, after_px: rms of all points of the chains used, each about its own best line. groups: objects that the
    chains used belong to.
    """

    lens: Distortion
    names: tuple[str, ...]
    values: Array
    covariance: Array
    statistical_covariance: Array
    chains: tuple[ChainFit, ...]
    before_px: float
    after_px: float
    noise_px: float
    groups: int
    converged: bool

    @property
    def sigma(self) -> Array:
        """Return σ of values."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def misfit(self) -> float:
        """Return that of all chains, used or not, so that a lens gains nothing by leaving some out."""
        square = np.array(
            [min(c.after_px, MAX_MISFIT_PX) ** 2 for c in self.chains if np.isfinite(c.before_px)]
        )
        counts = np.array([c.count for c in self.chains if np.isfinite(c.before_px)])
        return float(np.sqrt(np.sum(counts * square / (square + TAU_PX**2)) / counts.sum()))


def fit_plumb_lines(
    chains: Sequence[Points],
    image_size: ImageSize,
    lens: str = "division",
    terms: tuple[str, ...] | None = None,
    *,
    pictures: Sequence[int] | None = None,
    centre_sigma_px: float | None = None,
    noise_px: float = CLICK_PX,
) -> PlumbLineFit:
    """Fit a lens to chains (n, 2) px of one or more pictures of one camera; pictures: which each chain is in.

    terms: those that are free, the first two by default. centre_sigma_px: how well the picture's centre is known to
    be the lens's; 0 fixes it there, None takes 1 % of the diagonal. noise_px: a first guess; it is then measured.
    Raises FitFailed where there are too few lines, or no lens makes half of their points straight.
    """
    problem = PlumbLineProblem.of(lens, terms, centre_sigma_px, image_size)
    given = [
        as_points(c, f"The points of line {i + 1}").reshape(-1, 2) for i, c in enumerate(chains)
    ]
    picture_of = np.zeros(len(given), int) if pictures is None else np.asarray(pictures, int)
    usable = _usable_chains(given, problem)
    max_points = int(np.clip(MAX_POINTS // len(usable), MIN_CHAIN_POINTS, MAX_CHAIN_POINTS))
    unit_px = half_diagonal_px(image_size)
    found = _fit_straight_ones(
        Chains.of([_thinned(given[i], max_points) for i in usable], unit_px, noise_px), problem
    )
    state, straight = found.minimum.state, found.straight
    groups = groups_of(state, found.chains, picture_of[usable[straight]])
    if groups.max() == 0:
        raise FitFailed(
            say("refused.one-edge", "All the straight lines are one edge, or the sides of one."),
            say("refused.one-edge.fix", "Mark other edges elsewhere in the image."),
            reason="one-edge",
        )
    statistical = jackknife_covariance(found.minimum, found.chains, groups)

    every_point = Chains.of([given[i] for i in usable], unit_px, found.noise_px)
    before = division_rms(every_point.plane(np.array(image_size.centre)), every_point, 0.0)
    after = chain_rms(state, every_point)
    if not np.isfinite(after[straight]).all():
        raise FitFailed(
            say("refused.edges-lens", "The best fitting lens does not cover the whole image."),
            say(
                "refused.edges-lens.fix",
                "Try a lens with fewer terms, or mark edges elsewhere in the image.",
            ),
            reason="no-lens",
        )
    used_counts = every_point.counts[straight]
    centre_is_free = problem.centre_sigma != 0
    return PlumbLineFit(
        Distortion(lens, tuple(state.terms.tolist()), tuple(state.centre.tolist()), image_size),
        (*problem.names, *(("centre_x", "centre_y") if centre_is_free else ())),
        np.concatenate([state.terms[problem.free], state.centre if centre_is_free else []]),
        _with_next_term(statistical, found.minimum, found.chains, problem, groups),
        statistical,
        _chain_fits(given, picture_of, usable, before, after, straight),
        _overall_rms(before[straight], used_counts),
        _overall_rms(after[straight], used_counts),
        found.noise_px,
        int(groups.max()) + 1,
        found.minimum.converged,
    )


def _min_chains(problem: PlumbLineProblem) -> int:
    return len(problem.names) + SPARE_CHAINS


def _usable_chains(given: Sequence[Points], problem: PlumbLineProblem) -> Indices:
    """Return which chains are long enough to be bent; FitFailed where they are too few."""
    min_px = MIN_LENGTH * half_diagonal_px(problem.size)
    usable = np.array(
        [i for i, c in enumerate(given) if len(c) >= MIN_POINTS and _length(c) >= min_px], int
    )
    if len(usable) < _min_chains(problem):
        raise FitFailed(
            say(
                "refused.few-edges",
                "There are {n} lines of {px:.0f} px or longer with at least {points} points; "
                "{least} are required.",
                n=len(usable),
                px=min_px,
                points=MIN_POINTS,
                least=_min_chains(problem),
            ),
            say(
                "refused.few-edges.fix",
                "Mark more straight edges: long ones, and some near the edge of the image.",
            ),
            reason="too-few-lines",
        )
    return usable


@dataclass(frozen=True, eq=False)
class _StraightFit:
    """A lens fitted to those of the chains that are straight: which (c,), they alone, and their noise under it."""

    straight: Mask
    chains: Chains
    minimum: Minimum[LineFit]
    noise_px: float


def _fit_straight_ones(chains: Chains, problem: PlumbLineProblem) -> _StraightFit:
    """Fit, and choose the straight chains anew under the lens found, until a choice comes back; FitFailed."""
    centre, noise_px = np.array(problem.size.centre), chains.noise_px
    bend = initial_bend(chains, centre)
    straight = _straight(division_rms(chains.plane(centre), chains, bend), chains.counts)
    state, tried = initial_fit(chains, problem, bend), []
    for _ in range(MAX_ROUNDS):
        points = chains.counts[straight].sum()
        if (
            straight.sum() < _min_chains(problem)
            or points < MIN_STRAIGHT_SHARE * chains.counts.sum()
        ):
            raise FitFailed(
                say("refused.not-straight", "No lens makes enough of the lines straight."),
                say(
                    "refused.not-straight.fix",
                    "Mark edges that are straight in reality, each one separately.",
                ),
                reason="no-straight-lines",
            )
        tried.append(straight)
        part = replace(chains.only(straight), noise_px=noise_px)
        minimum = solve(part, state, problem)
        state = minimum.state
        off_px = np.abs(state.linearise(part).residuals)
        noise_px = max(SIGMA_PER_MEDIAN * float(np.median(off_px)), MIN_NOISE_PX)
        straight = _straight(chain_rms(state, chains), chains.counts)
        if any((straight == before).all() for before in tried):
            break
    return _StraightFit(tried[-1], part, minimum, noise_px)  # the choice that the last fit is about


def _straight(rms: Array, counts: Indices) -> Mask:
    """Return which chains are straight: as good as the better half by points, or nearly."""
    order = np.argsort(rms)
    half = rms[order][np.searchsorted(np.cumsum(counts[order]), counts.sum() / 2)]
    return rms <= min(max(CROOKED_RATIO * half, MIN_CROOKED_PX), MAX_STRAIGHT_PX)


def _chain_fits(
    given: Sequence[Points],
    picture_of: Indices,
    usable: Indices,
    before: Array,
    after: Array,
    straight: Mask,
) -> tuple[ChainFit, ...]:
    """Return every chain that was given. before, after, straight: of the usable ones."""

    def unusable(index: int, chain: Points) -> ChainFit:
        return ChainFit(
            index,
            int(picture_of[index]),
            len(chain),
            _length(chain),
            np.nan,
            np.nan,
            False,
            "too-short" if len(chain) >= MIN_POINTS else "too-few-points",
        )

    fits = {
        int(i): ChainFit(
            int(i),
            int(picture_of[i]),
            len(given[i]),
            _length(given[i]),
            float(before_px),
            float(after_px),
            bool(used),
            "" if used else "not-straight",
        )
        for i, before_px, after_px, used in zip(usable, before, after, straight, strict=True)
    }
    return tuple(fits.get(i) or unusable(i, chain) for i, chain in enumerate(given))


def _overall_rms(rms: Array, counts: Indices) -> float:
    return float(np.sqrt(np.sum(rms**2 * counts) / counts.sum()))


def _thinned(chain: Points, max_points: int) -> Points:
    return chain[np.unique(np.linspace(0, len(chain) - 1, max_points).round().astype(int))]


def _length(chain: Points) -> float:
    return float(np.linalg.norm(np.ptp(chain, axis=0))) if len(chain) else 0.0


def groups_of(state: LineFit, chains: Chains, pictures: Indices) -> Indices:
    """Number each chain (c,); edges of one picture that are one object's share a number."""
    normal = np.stack([np.cos(state.angle), np.sin(state.angle)], axis=1)
    along = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
    low = np.minimum.reduceat(state.feet, chains.starts)
    high = np.maximum.reduceat(state.feet, chains.starts)
    middle = normal * state.offset[:, None] + along * ((low + high) / 2)[:, None]
    group = np.arange(len(middle))
    for i in range(len(middle)):
        away = middle - middle[i]
        # The middle of each of the two must lie near the other's line.
        gap = np.maximum(np.abs(away @ normal[i]), np.abs(np.sum(away * normal, axis=1)))
        parallel = np.abs(normal @ normal[i]) > MIN_PARALLEL
        for other in np.unique(group[(gap < MAX_ADJACENT) & (pictures == pictures[i]) & parallel]):
            group[group == other] = group[i]
    return np.unique(group, return_inverse=True)[1]


def jackknife_covariance(minimum: Minimum[LineFit], chains: Chains, groups: Indices) -> Array:
    """Return the covariance of terms and centre by jackknife; never less than independent points would give."""
    n = len(chains.pixels)
    rows, residuals, prior = minimum.jacobian[:n], minimum.residuals[:n], minimum.jacobian[n:]
    weight = robust_weight(residuals, 1.0)  # they are in units of the noise
    weighted, size, count = rows * weight[:, None], rows.shape[1], groups.max() + 1
    # Normal equations by group: AᵀWA, and AᵀWr, which is 0 over all of them at the minimum.
    information, scores = np.zeros((count, size, size)), np.zeros((count, size))
    np.add.at(information, groups, chains.sums(weighted[:, :, None] * rows[:, None, :]))
    np.add.at(scores, groups, chains.sums(weighted * residuals[:, None]))
    total = information.sum(axis=0) + prior.T @ prior
    inverse = np.linalg.pinv(total, hermitian=True)
    freedom = max(n - 2 * len(chains.starts) - size, 1)  # each chain's line took two
    of_points = inverse * float(np.sum(weight * residuals**2) / freedom)
    # How far the answer moves where one group is left out: one step of Newton's.
    moved = np.stack(
        [
            np.linalg.lstsq(total - own, score, rcond=1e-12)[0]
            for own, score in zip(information, scores, strict=True)
        ]
    )
    # Few groups that carry the answer have few degrees of freedom (Satterthwaite's count of them).
    widen = np.sqrt(
        [_student_widening(float(np.sum(m**2) ** 2 / max(np.sum(m**4), 1e-300))) for m in moved.T]
    )
    jackknife = (count - 1) / count * moved.T @ moved * np.outer(widen, widen)
    # The prior of the centre is independent of all groups.
    jackknife = jackknife + inverse @ prior.T @ prior @ inverse
    return jackknife * max(1.0, float(np.max(np.diag(of_points) / np.diag(jackknife))))


def _with_next_term(
    narrow: Array,
    minimum: Minimum[LineFit],
    chains: Chains,
    problem: PlumbLineProblem,
    groups: Indices,
) -> Array:
    """Add to a covariance of terms and centre what one more term would move; nothing where none can be fitted."""
    wider, state, last = problem.wider, minimum.state, len(problem.names) - 1
    if wider is None:
        return narrow
    lens = LINE_LENSES[wider.lens][0]
    terms = np.zeros(len(lens.TERMS))
    terms[: len(state.terms)] = state.terms
    try:
        more = solve(chains, replace(state, lens=lens, terms=terms), wider)
    except FitFailed:
        return narrow
    return narrow + _moved_by_term(
        more,
        last + 1,
        chains,
        groups,
        value=float(more.state.terms[wider.free[-1]]),
        before=float(state.terms[problem.free[-1]]),
    )


def _moved_by_term(
    wider: Minimum[LineFit],
    column: int,
    chains: Chains,
    groups: Indices,
    *,
    value: float,
    before: float,
) -> Array:
    """Return the mean outer product of the moves of the other parameters where this column's term is left out.

    value: what the edges give the term. before: the term before it; without edges, this one is taken to be within
    MAX_NEXT_TERM of that. They may know better: the two are weighed against each other.
    """
    n = len(chains.pixels)
    others = [i for i in range(wider.jacobian.shape[1]) if i != column]
    weight = np.ones(len(wider.residuals))
    weight[:n] = robust_weight(wider.residuals[:n], 1.0)
    information = wider.jacobian.T @ (wider.jacobian * weight[:, None])
    moves = np.linalg.lstsq(
        information[np.ix_(others, others)], information[others, column], rcond=1e-12
    )[0]
    prior = max(MAX_NEXT_TERM * abs(before), MIN_NEXT_TERM) ** 2
    by_edges = jackknife_covariance(wider, chains, groups)[column, column]
    trust = prior / (prior + by_edges)
    return np.outer(moves, moves) * ((trust * value) ** 2 + trust * by_edges)


def _student_widening(freedom: float) -> float:
    """Return the square of t's 97.5 % point over the normal one's, by Cornish and Fisher's series."""
    v = max(freedom - 1, 1.5)
    t = Z + (Z**3 + Z) / (4 * v) + (5 * Z**5 + 16 * Z**3 + 3 * Z) / (96 * v**2)
    return (t / Z) ** 2
