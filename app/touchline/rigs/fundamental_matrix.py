"""The fundamental matrix of two views from matches, some of which may be mistakes.

    (x', y', 1) F (x, y, 1)ᵀ = 0,   F of rank 2: seven numbers

Trials from seven matches each are compared by likelihood. A match is good, its distance spread about zero with an
unknown σ, or a mistake, its distance anything up to the picture's size:

    L = Σ log( γ t(r_j / σ) / σ + (1 - γ) / extent ) + log prior(σ)

t is Student's: some matches are better than others, and under a normal law the worse ones would decide. The best trials
are refined with the same likelihood by expectation and maximisation, σ and γ with them. P. Torr and A. Zisserman,
"MLESAC" (2000); local optimisation after O. Chum, J. Matas and J. Kittler (2003); normalised after R. Hartley (1997);
orthonormal form F = U diag(1, s, 0) Vᵀ after A. Bartoli and P. Sturm (2004); seven points, R. Hartley and A. Zisserman
(2004).

Matches determine F only where the scene is more than a plane and the views have different centres. Everything on the
carpet is one plane: matches there agree with a whole family of geometries, each without a residual. That is refused, as
is a consensus that chance would give as well (a contrario, L. Moisan, B. Stival 2004).
"""

from dataclasses import dataclass, replace
from math import lgamma, log, sqrt
from typing import Self

import numpy as np

from touchline.core import opencv
from touchline.core.errors import FitFailed
from touchline.core.geometry import (
    Array,
    Indices,
    Mask,
    Points,
    as_matches,
    homogeneous,
    root_mean_square,
)
from touchline.fitting.least_squares import minimise
from touchline.models.rotation import cross_matrix, matrix_from_vector
from touchline.rigs.evidence import epipolar_px, sampson_px

MIN_MATCHES = 12  # seven are used up by the answer; the rest must bear it out
SAME_PX = 0.1
GOOD_SIGMAS = 4.0
MIN_SPREAD_PX = 2.0  # matches within such a strip are on one line
# of Student's scale, which is two thirds of a σ; how far a match is off a plane has two directions, and the errors
# of both views
OFF_PLANE_SIGMAS = 10.0
MAX_SIGMA_PX = 4.0  # who matches no better than that has matched nothing
MIN_OFF_PLANE = 4  # two beside the plane make the geometry, two more bear it out
CHANCE = 1e-3  # expected number of such agreements among matches at random
WEAK = 1e-6  # of the scaled derivatives' largest singular value
SIGMAS_PX = np.geomspace(0.08, 2.0, 5)
SHARES = (0.2, 0.5, 0.8, 0.97)
BATCH, MAX_TRIALS = 400, 6000
MISS_CHANCE = 1e-4  # chance to have missed every clean seven
MAX_SCORING_MATCHES = 400  # matches that judge a trial; all of them judge the refined
REFINED, FINISHED = 12, 3  # of the best trials: improved by a few rounds; then of those, to the end
FIRST_ROUNDS, ROUNDS = 4, 40
PARAMETERS = 7
# degrees of freedom; of 1, 2, 4 and 30 the best or nearly so on simulated pairs of every kind
TAIL = 2.0
T_AT_ZERO = 1 / (2 * sqrt(2))  # Student's density at 0 for two degrees of freedom
# what detectors and hands reach, and how many e-folds either way that is sure to
USUAL_PX, USUAL_SPREAD = 0.3, 0.5
MAX_LOG_SIGMA = 4.0


@dataclass(frozen=True, eq=False)
class TwoViews:
    """fundamental (3, 3): (b, 1) F (a, 1)ᵀ = 0, rank 2, norm 1. good (n,); sigma_px: of the good ones.

    epipolar_px (n,): each match's distance from its epipolar lines, root mean square of both views.
    """

    fundamental: Array
    good: Mask
    epipolar_px: Array
    sigma_px: float

    @property
    def rms_px(self) -> float:
        """Return the rms of the good matches."""
        return root_mean_square(self.epipolar_px[self.good])

    @property
    def epipoles(self) -> tuple[Array, Array]:
        """Return both epipoles, homogeneous (3,): the one in view a, then the one in view b."""
        u, _, vt = np.linalg.svd(self.fundamental)
        return vt[2], u[:, 2]


@dataclass(frozen=True, eq=False)
class Consensus:
    """fundamental (3, 3); good (n,): the probability that a match is an inlier; sigma_px of the inliers."""

    fundamental: Array
    good: Array
    sigma_px: float
    share: float
    likelihood: float


@dataclass(frozen=True, eq=False)
class FundamentalParameters:
    """F as a fit moves it, in normalised coordinates: F = t_bᵀ U diag(cos α, sin α, 0) Vᵀ t_a, always of rank 2."""

    u: Array
    angle: float
    v: Array
    t_a: Array
    t_b: Array

    @classmethod
    def of(cls, fundamental: Array, a: Points, b: Points) -> Self:
        t_a, t_b = _normaliser(a), _normaliser(b)
        u, s, vt = np.linalg.svd(np.linalg.inv(t_b).T @ fundamental @ np.linalg.inv(t_a))
        u, vt = u * [1, 1, np.linalg.det(u)], vt * np.array([[1], [1], [np.linalg.det(vt)]])
        return cls(u, float(np.arctan2(s[1], s[0])), vt.T, t_a, t_b)

    def fundamental(self) -> Array:
        f = self.t_b.T @ self._inner @ self.t_a
        return f / np.linalg.norm(f)

    @property
    def _inner(self) -> Array:
        return self.u @ np.diag([np.cos(self.angle), np.sin(self.angle), 0.0]) @ self.v.T

    def retract(self, delta: Array) -> Self:
        """Apply delta (7,): turns of U and V, and the angle."""
        return replace(
            self,
            u=self.u @ matrix_from_vector(delta[:3]),
            v=self.v @ matrix_from_vector(delta[3:6]),
            angle=self.angle + float(delta[6]),
        )

    def residuals(self, a: Points, b: Points) -> tuple[Array, Array]:
        """Return Sampson's distance (n,) px and its derivatives (n, 7)."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        middle = np.diag([c, s, 0.0])
        turns = [cross_matrix(e) for e in np.eye(3)]
        bent = [self.u @ k @ middle @ self.v.T for k in turns]
        bent += [self.u @ middle @ k.T @ self.v.T for k in turns]
        bent.append(self.u @ np.diag([-s, c, 0.0]) @ self.v.T)
        by = np.stack([self.t_b.T @ m @ self.t_a for m in bent])  # (7, 3, 3)
        return _sampson_jacobian(self.t_b.T @ self._inner @ self.t_a, by, a, b)


def fundamental_matrix(a: Points, b: Points, seed: int = 0) -> TwoViews:
    """Estimate F from matches a, b (n, 2) px, some of which may be mistakes.

    Raises FitFailed: too-few-points, collinear-points, no-consensus, one-plane, not-determined; BadInput for what are
    no matches. The same seed gives the same answer.
    """
    a, b = as_matches(a, b)
    once = _distinct_matches(a, b)
    _refuse_too_few(a[once], b[once])
    found = _consensus(a[once], b[once], seed)
    good = (found.good > 0.5) & (
        np.abs(sampson_px(found.fundamental, a[once], b[once])) <= GOOD_SIGMAS * found.sigma_px
    )
    _refuse_chance(found, good, a[once], b[once])
    _refuse_plane(found, good, a[once], b[once])
    _refuse_weak(found, a[once][good], b[once][good])
    all_good = np.zeros(len(a), bool)
    all_good[once[good]] = True
    return TwoViews(
        found.fundamental, all_good, epipolar_px(found.fundamental, a, b), found.sigma_px
    )


def _distinct_matches(a: Points, b: Points) -> Indices:
    """Indices of matches that share no point, in either view, with an earlier one.

    One point is seen at one place: of matches that say otherwise at most one is right. All of them would agree, for
    nothing, with a geometry that has its epipole there.
    """
    keep = np.arange(len(a))
    for points in (a, b):
        first = np.unique(np.round(points[keep] / SAME_PX), axis=0, return_index=True)[1]
        keep = keep[np.sort(first)]
    return keep


def _refuse_too_few(a: Points, b: Points) -> None:
    """Raise FitFailed for matches that are too few, or all on one line."""
    if len(a) < MIN_MATCHES:
        raise FitFailed(
            f"There are {len(a)} different matches; two views require {MIN_MATCHES}.",
            f"Match at least {MIN_MATCHES - len(a)} more points.",
            reason="too-few-points",
        )
    for points, which in ((a, "first"), (b, "second")):
        spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False) / np.sqrt(
            len(points)
        )
        if spread[-1] < MIN_SPREAD_PX:
            raise FitFailed(
                f"The matches are on one line in the {which} view.",
                "Match points all over the shared area.",
                reason="collinear-points",
            )


def _refuse_chance(found: Consensus, good: Mask, a: Points, b: Points) -> None:
    """Raise FitFailed where as many random matches would agree as well."""
    n, k = len(good), int(good.sum())
    if found.sigma_px > MAX_SIGMA_PX:
        raise FitFailed(
            f"The matches agree only within {found.sigma_px:.0f} px.",
            "Check that both images show the same scene, and that points are given in pixels of their own "
            "image.",
            reason="no-consensus",
        )
    if _log_chance(n, k, PARAMETERS, _chance_share(found, a, b)) >= log(CHANCE):
        raise FitFailed(
            f"Only {k} of {n} matches agree with each other, which is no better than chance.",
            "Check that both images show the same scene. Match more points, and more precisely.",
            reason="no-consensus",
        )


def _log_chance(matches: int, agreeing: int, making: int, strip: float) -> float:
    """Return the logarithm of the expected number of agreements as good as this among random matches.

    making: how many matches made the geometry and so agree anyway; strip: the share of the picture in which
    another one agrees by chance.
    """
    if agreeing <= making:
        return 0.0
    return (
        log(matches - making)
        + _log_choose(matches, agreeing)
        + _log_choose(agreeing, making)
        + (agreeing - making) * log(strip)
    )


def _chance_share(found: Consensus, a: Points, b: Points) -> float:
    extent = min(float(np.hypot(*np.ptp(points, axis=0))) for points in (a, b))
    return min(1.0, 2 * GOOD_SIGMAS * found.sigma_px / extent)


def _log_choose(n: int, k: int) -> float:
    return lgamma(n + 1) - lgamma(k + 1) - lgamma(n - k + 1)


def _refuse_plane(found: Consensus, good: Mask, a: Points, b: Points) -> None:
    """Raise FitFailed where a homography explains all but a few: a flat scene, or a camera that only turned.

    Geometries that agree with a plane have two numbers left, so any two mistakes fit one of them, and others by chance.
    """
    off = off_plane(a[good], b[good], found.sigma_px)
    aside = off + int((~good).sum())
    if off < MIN_OFF_PLANE or _log_chance(aside, off, 2, _chance_share(found, a, b)) >= log(CHANCE):
        raise FitFailed(
            "The matches are on one plane, or one camera only rotated: such matches fit many geometries. "
            f"{off} are off the plane.",
            "Match more points that are off that plane, such as robot tops or goal posts. For the carpet "
            "alone use the agreement in millimetres.",
            reason="one-plane",
        )


def off_plane(a: Points, b: Points, sigma_px: float) -> int:
    """Return how many matches the best homography does not explain."""
    limit_px = OFF_PLANE_SIGMAS * sigma_px
    plane = opencv.find_homography(a, b, limit_px)
    if plane is None:
        return len(a)
    with np.errstate(all="ignore"):
        there = homogeneous(a) @ plane.T
        far = np.linalg.norm(there[:, :2] / there[:, 2:] - b, axis=1)
    return int((~(far < limit_px)).sum())


def _refuse_weak(found: Consensus, a: Points, b: Points) -> None:
    jacobian = FundamentalParameters.of(found.fundamental, a, b).residuals(a, b)[1]
    length = np.linalg.norm(jacobian, axis=0)
    spread = np.linalg.svd(jacobian / np.where(length > 0, length, 1.0), compute_uv=False)
    if not (
        np.isfinite(found.fundamental).all()
        and np.isfinite(spread).all()
        and spread[-1] > WEAK * spread[0]
    ):
        raise FitFailed(
            "The matches do not determine the relative position of the views.",
            "Match points at more places and more heights.",
            reason="not-determined",
        )


def _consensus(a: Points, b: Points, seed: int = 0) -> Consensus:
    """Return the likeliest geometry of matches (n, 2), n ≥ 8; the same seed gives the same result."""
    rng = np.random.default_rng(seed)
    extent = float(np.hypot(*np.ptp(b, axis=0)) + np.hypot(*np.ptp(a, axis=0))) / 2
    t_a, t_b = _normaliser(a), _normaliser(b)
    near_a, near_b = homogeneous(a) @ t_a[:2].T, homogeneous(b) @ t_b[:2].T
    jury = rng.permutation(len(a))[:MAX_SCORING_MATCHES]
    best: list[tuple[float, Array]] = []
    tried, enough = 0, BATCH
    while tried < enough:
        sevens = np.argsort(rng.random((BATCH, len(a))), axis=1)[:, :PARAMETERS]
        found = t_b.T @ _seven_point(near_a[sevens], near_b[sevens]) @ t_a
        likelihoods, shares = _best_likelihoods(sampson_px(found, a[jury], b[jury]), extent)
        order = np.argsort(-likelihoods, kind="stable")[:REFINED]
        best = sorted(
            [*best, *((float(likelihoods[i]), found[i]) for i in order)], key=lambda t: -t[0]
        )[:REFINED]
        # Of this batch's best, not of the best so far: a batch that does worse asks for more trials, never for fewer.
        clean = float(np.clip(shares[order[0]], 0.05, 0.999)) ** PARAMETERS
        tried += BATCH
        enough = min(MAX_TRIALS, max(enough, int(np.ceil(np.log(MISS_CHANCE) / np.log1p(-clean)))))
    glimpses = sorted(
        (_refine(f, a, b, extent, FIRST_ROUNDS) for _, f in best), key=lambda c: -c.likelihood
    )
    finished = [_refine(c.fundamental, a, b, extent, ROUNDS) for c in glimpses[:FINISHED]]
    return max(finished, key=lambda c: c.likelihood)


def _best_likelihoods(residuals: Array, extent: float) -> tuple[Array, Array]:
    """Return the best likelihood of each trial (m,) over a grid of σ and γ, and its γ."""
    square = np.where(np.isfinite(residuals), residuals**2, np.inf)
    value = np.full(len(square), -np.inf)
    share = np.zeros(len(square))
    for sigma in SIGMAS_PX:
        density = _density(square, sigma)
        for gamma in SHARES:
            likelihood = np.log(gamma * density + (1 - gamma) / extent).sum(axis=1) + _log_prior(
                sigma
            )
            better = likelihood > value
            value, share = np.where(better, likelihood, value), np.where(better, gamma, share)
    return value, share


def _density(square: Array, sigma: float) -> Array:
    """Return Student's t density with TAIL = 2 degrees of freedom: (1 + z²/2)^(-3/2) / (2 √2 σ)."""
    spread = 1 + square / (TAIL * sigma**2)
    return T_AT_ZERO / sigma / (spread * np.sqrt(spread))


def _log_prior(sigma: float) -> float:
    """Return the log prior of σ: without it, seven exact matches would maximise the likelihood."""
    return -0.5 * (np.log(sigma / USUAL_PX) / USUAL_SPREAD) ** 2


def _refine(fundamental: Array, a: Points, b: Points, extent: float, rounds: int) -> Consensus:
    """Refine F by expectation and maximisation: the inliers' probabilities, then F from them, then σ and γ."""
    state = FundamentalParameters.of(fundamental, a, b)
    r = state.residuals(a, b)[0]
    sigma, share = float(np.clip(1.4826 * np.median(np.abs(r)), SIGMAS_PX[0], SIGMAS_PX[-1])), 0.5
    likelihood = -np.inf
    for _ in range(rounds):
        density = share * _density(r**2, sigma)
        good = density / (density + (1 - share) / extent)
        pull = good * (TAIL + 1) / (TAIL + (r / sigma) ** 2)
        state = _minimise(state, a, b, np.sqrt(pull) / sigma)
        r = state.residuals(a, b)[0]
        sigma = _likeliest_sigma(
            float(np.sum(pull * r**2)), max(float(good.sum()) - PARAMETERS, 1.0)
        )
        share = float(np.clip(good.mean(), 0.02, 0.99))
        before, likelihood = (
            likelihood,
            float(np.sum(np.log(share * _density(r**2, sigma) + (1 - share) / extent)))
            + _log_prior(sigma),
        )
        if abs(likelihood - before) < 1e-6:
            break
    return Consensus(state.fundamental(), good, sigma, share, likelihood)


def _minimise(
    start: FundamentalParameters, a: Points, b: Points, root: Array
) -> FundamentalParameters:
    """Return the parameters near start of least Sampson distances times root (n,)."""

    def weighted(state: FundamentalParameters) -> tuple[Array, Array]:
        value, by = state.residuals(a, b)
        return value * root, by * root[:, None]

    return minimise(start, weighted, lambda state, delta: state.retract(delta), max_steps=4).state


def _likeliest_sigma(square: float, freedom: float) -> float:
    """Return the likeliest σ for a weighted sum of squares and the prior; Newton's method on its logarithm."""
    x = np.log(USUAL_PX)
    for _ in range(40):
        misfit = square * np.exp(-2 * x)
        slope = misfit - freedom - (x - np.log(USUAL_PX)) / USUAL_SPREAD**2
        x += np.clip(slope / (2 * misfit + 1 / USUAL_SPREAD**2), -1, 1)
    return float(np.exp(np.clip(x, -MAX_LOG_SIGMA, MAX_LOG_SIGMA)))


def _normaliser(points: Points) -> Array:
    """Return the similarity (3, 3) that centres points and scales them to a mean distance of √2."""
    middle = points.mean(axis=0)
    scale = np.sqrt(2) / max(float(np.linalg.norm(points - middle, axis=1).mean()), 1e-12)
    return np.array([[scale, 0, -scale * middle[0]], [0, scale, -scale * middle[1]], [0, 0, 1.0]])


def _seven_point(a: Points, b: Points) -> Array:
    """Return every F (m, 3, 3) through seven matches (…, 7, 2), up to three of each seven, in one list."""
    design = (homogeneous(b)[..., :, None] * homogeneous(a)[..., None, :]).reshape(*a.shape[:-1], 9)
    null = np.linalg.svd(design, full_matrices=True)[2][..., -2:, :]
    first, second = (null[..., i, :].reshape(-1, 3, 3) for i in (0, 1))
    # det(α F1 + (1 - α) F2) is a cubic: four values determine it
    at = np.array([-1.0, 0.0, 1.0, 2.0])
    values = np.linalg.det(at[:, None, None, None] * first + (1 - at[:, None, None, None]) * second)
    cubic = np.linalg.solve(np.vander(at, 4), values)  # (4, m), highest power first
    with np.errstate(all="ignore"):
        companion = np.zeros((first.shape[0], 3, 3))
        companion[:, 0] = np.nan_to_num(
            -cubic[1:].T / cubic[0][:, None], nan=0.0, posinf=0.0, neginf=0.0
        )
    companion[:, 1, 0] = companion[:, 2, 1] = 1
    roots = np.linalg.eigvals(companion)
    found = (
        roots.real[..., None, None] * first[:, None]
        + (1 - roots.real[..., None, None]) * second[:, None]
    )
    found = found[np.abs(roots.imag) < 1e-9 * (1 + np.abs(roots.real))]
    return found / np.maximum(np.linalg.norm(found, axis=(1, 2), keepdims=True), 1e-300)


def _sampson_jacobian(f: Array, by: Array, a: Points, b: Points) -> tuple[Array, Array]:
    """Return Sampson's distance (n,) and its derivatives (n, p) where dF = by (p, 3, 3)."""
    xa, xb = homogeneous(a), homogeneous(b)
    in_b, in_a = xa @ f.T, xb @ f
    value = np.sum(xb * in_b, axis=1)
    steep = np.sum(in_b[:, :2] ** 2, axis=1) + np.sum(in_a[:, :2] ** 2, axis=1)
    p, n = len(by), len(a)
    products = (xb[:, :, None] * xa[:, None, :]).reshape(n, 9)
    # d steep / dF, first two rows, by halves
    across = (in_b[:, :2, None] * xa[:, None, :]).reshape(n, 6)
    along = (xb[:, :, None] * in_a[:, None, :2]).reshape(n, 6)  # and first two columns
    d_value = products @ by.reshape(p, 9).T
    d_steep = 2 * (across @ by[:, :2].reshape(p, 6).T + along @ by[:, :, :2].reshape(p, 6).T)
    with np.errstate(all="ignore"):
        root = np.sqrt(steep)[:, None]
        return value / root[:, 0], d_value / root - 0.5 * value[:, None] * d_steep / (
            steep[:, None] * root
        )
