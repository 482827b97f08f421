"""Robust estimation of two-view geometry: trials from seven matches each, compared by likelihood.

A match is good, its distance spread about zero with an unknown σ, or a mistake, its distance anything up to the
picture's size:

    L = Σ log( γ t(r_j / σ) / σ + (1 - γ) / extent ) + log prior(σ)

t is Student's: some matches are better than others, and under a normal law the worse ones would decide. The best trials
are refined with the same likelihood by expectation and maximisation, σ and γ with them. P. Torr and A. Zisserman,
"MLESAC" (2000); local optimisation after O. Chum, J. Matas and J. Kittler (2003).
"""

from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np

from touchline.core.geometry import Array, Points, homogeneous
from touchline.fitting.least_squares import minimise
from touchline.fitting.two_view.epipolar import FundamentalParameters, normaliser, sampson_px, seven_point

SIGMAS_PX = np.geomspace(0.08, 2.0, 5)
SHARES = (0.2, 0.5, 0.8, 0.97)
BATCH, MAX_TRIALS = 400, 6000
MISS_CHANCE = 1e-4  # chance to have missed every clean seven
MAX_SCORING_MATCHES = 400  # matches that judge a trial; all of them judge the refined
REFINED, FINISHED = 12, 3  # of the best trials: improved by a few rounds; then of those, to the end
FIRST_ROUNDS, ROUNDS = 4, 40
PARAMETERS = 7
TAIL = 2.0  # degrees of freedom; of 1, 2, 4 and 30 the best or nearly so on simulated pairs of every kind
T_AT_ZERO = 1 / (2 * sqrt(2))  # Student's density at 0 for two degrees of freedom
USUAL_PX, USUAL_SPREAD = 0.3, 0.5  # what detectors and hands reach, and how many e-folds either way that is sure to
MAX_LOG_SIGMA = 4.0


@dataclass(frozen=True, eq=False)
class Consensus:
    """fundamental (3, 3); good (n,): the probability that a match is an inlier; sigma_px of the inliers."""

    fundamental: Array
    good: Array
    sigma_px: float
    share: float
    likelihood: float


def consensus(a: Points, b: Points, seed: int = 0) -> Consensus:
    """Return the likeliest geometry of matches (n, 2), n ≥ 8; the same seed gives the same result."""
    rng = np.random.default_rng(seed)
    extent = float(np.hypot(*np.ptp(b, axis=0)) + np.hypot(*np.ptp(a, axis=0))) / 2
    t_a, t_b = normaliser(a), normaliser(b)
    near_a, near_b = homogeneous(a) @ t_a[:2].T, homogeneous(b) @ t_b[:2].T
    jury = rng.permutation(len(a))[:MAX_SCORING_MATCHES]
    best: list[tuple[float, Array]] = []
    tried, enough = 0, BATCH
    while tried < enough:
        sevens = np.argsort(rng.random((BATCH, len(a))), axis=1)[:, :PARAMETERS]
        found = t_b.T @ seven_point(near_a[sevens], near_b[sevens]) @ t_a
        likelihoods, shares = _best_likelihoods(sampson_px(found, a[jury], b[jury]), extent)
        order = np.argsort(-likelihoods, kind="stable")[:REFINED]
        best = sorted([*best, *((float(likelihoods[i]), found[i]) for i in order)], key=lambda t: -t[0])[:REFINED]
        clean = float(np.clip(shares[order[0]], 0.05, 0.999)) ** PARAMETERS
        tried += BATCH
        enough = min(MAX_TRIALS, max(enough, int(np.ceil(np.log(MISS_CHANCE) / np.log1p(-clean)))))
    glimpses = sorted((refine(f, a, b, extent, FIRST_ROUNDS) for _, f in best), key=lambda c: -c.likelihood)
    finished = [refine(c.fundamental, a, b, extent, ROUNDS) for c in glimpses[:FINISHED]]
    return max(finished, key=lambda c: c.likelihood)


def _best_likelihoods(residuals: Array, extent: float) -> tuple[Array, Array]:
    """Return the best likelihood of each trial (m,) over a grid of σ and γ, and its γ."""
    square = np.where(np.isfinite(residuals), residuals**2, np.inf)
    value = np.full(len(square), -np.inf)
    share = np.zeros(len(square))
    for sigma in SIGMAS_PX:
        density = _density(square, sigma)
        for gamma in SHARES:
            likelihood = np.log(gamma * density + (1 - gamma) / extent).sum(axis=1) + _log_prior(sigma)
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


def refine(fundamental: Array, a: Points, b: Points, extent: float, rounds: int) -> Consensus:
    """Refine F by expectation and maximisation: the inliers' probabilities, then F from them, then σ and γ."""
    state = FundamentalParameters.of(fundamental, a, b)
    r = state.residuals(a, b)[0]
    sigma, share = float(np.clip(1.4826 * np.median(np.abs(r)), SIGMAS_PX[0], SIGMAS_PX[-1])), 0.5
    likelihood = -np.inf
    for _ in range(rounds):
        density = share * _density(r**2, sigma)
        good = density / (density + (1 - share) / extent)
        pull = good * (TAIL + 1) / (TAIL + (r / sigma) ** 2)
        state = minimise_weighted(state, a, b, np.sqrt(pull) / sigma, max_steps=4)
        r = state.residuals(a, b)[0]
        sigma = _likeliest_sigma(float(np.sum(pull * r**2)), max(float(good.sum()) - PARAMETERS, 1.0))
        share = float(np.clip(good.mean(), 0.02, 0.99))
        before, likelihood = likelihood, float(np.sum(np.log(
            share * _density(r**2, sigma) + (1 - share) / extent))) + _log_prior(sigma)
        if abs(likelihood - before) < 1e-6:
            break
    return Consensus(state.fundamental(), good, sigma, share, likelihood)


def minimise_weighted(start: Any, a: Points, b: Points, root: Array, max_steps: int) -> Any:
    """Return the parameters near start of least Sampson distances times root (n,)."""
    def weighted(state: Any) -> tuple[Array, Array]:
        value, by = state.residuals(a, b)
        return value * root, by * root[:, None]
    return minimise(start, weighted, lambda state, delta: state.retract(delta), max_steps=max_steps).state


def _likeliest_sigma(square: float, freedom: float) -> float:
    """Return the likeliest σ for a weighted sum of squares and the prior; Newton's method on its logarithm."""
    x = np.log(USUAL_PX)
    for _ in range(40):
        misfit = square * np.exp(-2 * x)
        slope = misfit - freedom - (x - np.log(USUAL_PX)) / USUAL_SPREAD**2
        x += np.clip(slope / (2 * misfit + 1 / USUAL_SPREAD**2), -1, 1)
    return float(np.exp(np.clip(x, -MAX_LOG_SIGMA, MAX_LOG_SIGMA)))
