"""The covariance of a lens from straight lines: by a jackknife over groups of edges, and by one more term.

Points of one edge err together (it is not quite straight, its light is uneven), and so do edges side by side (two
sides of one bar). Thousands of points are worth far less than thousands. So:

    σ² = jackknife over groups · (t / z)²  +  what one more term would move

The jackknife leaves out one group after another and sees how the answer moves (B. Efron 1982; J. MacKinnon, M. Nielsen,
M. Webb 2023, CV3); where few groups carry the answer, 2 σ is widened to what Student's t asks. A series of terms cut
short fits each part of the picture by other terms; how far they would move with one more, as large as the edges allow,
is part of what is not known of them.
"""

import numpy as np

from touchline.core.geometry import Array, Indices
from touchline.fitting.least_squares import Minimum
from touchline.fitting.plumb_line.problem import Chains, LineFit

ADJACENT = 0.03  # of the plane's unit: edges so near and as parallel as that are one object's
PARALLEL = np.cos(np.radians(4))
NEXT_TERM = 0.5  # of the last: series of lenses that are used as such fall off at least so quickly
MIN_NEXT_TERM = 0.01  # ... or to that, where the last is 0
Z = 1.96


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
        near = np.maximum(np.abs(away @ normal[i]), np.abs(np.sum(away * normal, axis=1))) < ADJACENT
        same = near & (pictures == pictures[i]) & (np.abs(normal @ normal[i]) > PARALLEL)
        for g in np.unique(group[same]):
            group[group == g] = group[i]
    return np.unique(group, return_inverse=True)[1]


def covariance(minimum: Minimum[LineFit], chains: Chains, groups: Indices) -> Array:
    """Return the covariance of terms and centre by jackknife; never less than independent points would give."""
    n = len(chains.pixels)
    rows, residuals, prior = minimum.jacobian[:n], minimum.residuals[:n], minimum.jacobian[n:]
    weight = (1 + residuals**2) ** -0.5
    size = rows.shape[1]
    information, scores = np.zeros((groups.max() + 1, size, size)), np.zeros((groups.max() + 1, size))
    weighted = rows * weight[:, None]
    np.add.at(information, groups, chains.sums(weighted[:, :, None] * rows[:, None, :]))
    np.add.at(scores, groups, chains.sums(weighted * residuals[:, None]))
    total = information.sum(axis=0) + prior.T @ prior
    inverse = np.linalg.pinv(total, hermitian=True)
    spread = float(np.sum(weight * residuals**2) / max(n - 2 * len(chains.starts) - size, 1))
    plain = inverse * spread
    count = len(scores)
    moved = np.stack([np.linalg.lstsq(total - own, score, rcond=1e-12)[0]
                      for own, score in zip(information, scores, strict=True)])
    widen = np.sqrt([_student_widening(float(np.sum(m**2) ** 2 / max(np.sum(m**4), 1e-300))) for m in moved.T])
    jackknife = (count - 1) / count * moved.T @ moved * np.outer(widen, widen)
    # The prior of the centre is independent of all groups.
    jackknife = jackknife + inverse @ prior.T @ prior @ inverse
    return jackknife * max(1.0, float(np.max(np.diag(plain) / np.diag(jackknife))))


def with_next_term(narrow: Array, wider: Minimum[LineFit], chains: Chains, last: int, last_value: float,
                added_value: float, groups: Indices) -> Array:
    """Add to narrow (n, n) what the term moves that the wider fit added after column `last`.

    Before the edges are asked, that term is taken to be within NEXT_TERM of the one before it; they may know better.
    """
    n, added = len(chains.pixels), last + 1
    others = [i for i in range(wider.jacobian.shape[1]) if i != added]
    weight = np.ones(len(wider.residuals))
    weight[:n] = (1 + wider.residuals[:n] ** 2) ** -0.5
    information = wider.jacobian.T @ (wider.jacobian * weight[:, None])
    moves = np.linalg.lstsq(information[np.ix_(others, others)], information[others, added], rcond=1e-12)[0]
    known, found = max(NEXT_TERM * abs(last_value), MIN_NEXT_TERM) ** 2, covariance(wider, chains, groups)[added, added]
    trust = known / (known + found)
    return narrow + np.outer(moves, moves) * ((trust * added_value) ** 2 + trust * found)


def _student_widening(freedom: float) -> float:
    """Return the square of t's 97.5 % point over the normal one's, by Cornish and Fisher's series."""
    v = max(freedom - 1, 1.5)
    t = Z + (Z**3 + Z) / (4 * v) + (5 * Z**5 + 16 * Z**3 + 3 * Z) / (96 * v**2)
    return (t / Z) ** 2
