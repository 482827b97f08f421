"""Fitting one border: a curve (models/polynomial.py) through clicked points that rejects outliers.

Fitted in a Chebyshev basis over the picture's own extent, where degree 8 still costs no digits.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
from numpy.polynomial import chebyshev

from touchline.core.errors import FitFailed
from touchline.core.geometry import Array, Indices, Mask, root_mean_square
from touchline.core.sentences import the_border
from touchline.core.statements import Sentence, capitalised, join, say
from touchline.fitting.contract import first_of_each_place
from touchline.models.polynomial import Curve

Degree = int | Literal["auto"]

MAX_AUTO_DEGREE = 6  # beyond it, a border of a dozen clicks follows the clicks' noise
CLICK_NOISE_PX = 0.5  # what a careful hand leaves; the prior for the spread of few points
PRIOR_CLICKS = 3  # how many points that prior weighs
MIN_OUTLIER_PX = 1.5  # no click nearer than this to the others' curve is an outlier
MAX_PAIRS = 60  # up to this many points, pairs are tried as well: two outliers can hide each other
MISS_PX = 4.0  # what an outlier, or a point that nothing else checks, counts in choosing a degree
CHANCE_ERRORS = 1.0  # measured: with 1.5, a bend that nine clicks show is missed one time in four
SAME_PX = 0.02  # leave-one-out errors closer than this are the same


@dataclass(frozen=True, eq=False)
class CurveFit:
    """A curve, its residuals, and why it has its degree.

    residuals: signed, value minus curve, for every point, outliers included.
    held_out: the same against the curve fitted without that point; NaN where the others do not determine it.
    """

    curve: Curve
    inliers: Mask
    residuals: Array
    held_out: Array
    reason: Sentence

    @property
    def rms(self) -> float:
        return root_mean_square(self.residuals[self.inliers])

    @property
    def held_out_rms(self) -> float | None:
        errors = self.held_out[self.inliers]
        return root_mean_square(errors) if np.isfinite(errors).all() else None


@dataclass(frozen=True, eq=False)
class _Solved:
    coefficients: Array  # Chebyshev
    residuals: Array
    leverage: Array
    hat: Array


def fit_curve(
    position: Array,
    value: Array,
    degree: Degree,
    span: tuple[float, float],
    border: str | None,
    *,
    robust: bool = True,
) -> CurveFit:
    """Fit a border; choose the degree by leave-one-out error if it is "auto".

    position, value: (n,) px. span: where the positions' axis begins and ends, px; t runs from -1 to 1 over it.
    border: its id, for refusals; None where it has none. A second click on one place does not count. Raises FitFailed
    when the points do not determine the curve.
    """
    same = first_of_each_place(np.stack([position, value], axis=1))
    once = np.unique(same)
    whole, position, value = (position, value), position[once], value[once]
    _check_points(position, value, degree, border)
    centre, scale = (span[0] + span[1]) / 2, (span[1] - span[0]) / 2
    t = (position - centre) / scale
    if degree == "auto":
        degree, reason, inliers = _choose_degree(t, value, robust)
    else:
        inliers = _inliers(t, value, degree) if robust else np.ones(t.size, bool)
        reason = say("degree.chosen", "Chosen by the user.")
    solved = _solve(t[inliers], value[inliers], degree)
    plain = _plain_from_chebyshev(degree) @ solved.coefficients
    curve = Curve(tuple(float(c) for c in plain), float(centre), float(scale))
    # an outlier is not in the fit: its residual is held out already
    held_out = value - curve(position)
    held_out[inliers] = _held_out(solved)
    place = np.searchsorted(once, same)
    return CurveFit(curve, inliers[place], whole[1] - curve(whole[0]), held_out[place], reason)


def _check_points(position: Array, value: Array, degree: Degree, border: str | None) -> None:
    least = 3 if degree == "auto" else degree + 1
    line = the_border(border)
    begin = capitalised(line)
    if position.size < least:
        what = (
            say("degree.auto", "an automatic degree")
            if degree == "auto"
            else say("degree.given", "degree {degree}", degree=degree)
        )
        points, missing = position.size, least - position.size
        raise FitFailed(
            say(
                "refused.border-one-point",
                "{line} has 1 point; {what} requires {least}.",
                line=begin,
                what=what,
                least=least,
            )
            if points == 1
            else say(
                "refused.border-few-points",
                "{line} has {n} points; {what} requires {least}.",
                line=begin,
                n=points,
                what=what,
                least=least,
            ),
            say("refused.one-more.fix", "Mark 1 more point on {line}.", line=line)
            if missing == 1
            else say("refused.more.fix", "Mark {n} more points on {line}.", n=missing, line=line),
            reason="too-few-points",
            feature=border,
        )
    if np.ptp(position) < 10:
        raise FitFailed(
            say("refused.not-spread", "The points of {line} are not spread along it.", line=line),
            say(
                "refused.not-spread.fix", "Mark points along its whole length, also near both ends."
            ),
            reason="collinear-points",
            feature=border,
        )


def _solve(t: Array, value: Array, degree: int) -> _Solved:
    q, r = np.linalg.qr(_chebyshev_values(t, degree))
    diagonal = np.abs(np.diag(r))
    if diagonal.min() < 1e-9 * diagonal.max():
        raise FitFailed(
            say(
                "refused.degree",
                "The points do not determine a curve of degree {degree}: too many have the same "
                "position.",
                degree=degree,
            ),
            say(
                "refused.degree.fix",
                "Spread the points along the border, or choose a lower degree.",
            ),
            reason="collinear-points",
        )
    coefficients = np.linalg.solve(r, q.T @ value)
    residuals = value - q @ (q.T @ value)
    return _Solved(coefficients, residuals, np.einsum("ij,ij->i", q, q), q)


def _chebyshev_values(t: Array, degree: int) -> Array:
    """Return T_0(t), …, T_degree(t) as columns (n, degree + 1)."""
    values = np.empty((degree + 1, len(t)))
    values[0], values[1:] = 1.0, t
    for k in range(2, degree + 1):
        values[k] = 2 * t * values[k - 1] - values[k - 2]
    return values.T


@cache
def _plain_from_chebyshev(degree: int) -> Array:
    """Return the matrix from Chebyshev's coefficients to those of powers."""
    columns = [chebyshev.cheb2poly(unit) for unit in np.eye(degree + 1)]
    return np.stack([np.pad(column, (0, degree + 1 - len(column))) for column in columns], axis=1)


def _held_out(solved: _Solved) -> Array:
    """Return leave-one-out residuals in closed form (PRESS): r_i / (1 - h_ii)."""
    free = 1 - solved.leverage
    return np.where(free > 1e-9, solved.residuals / np.maximum(free, 1e-9), np.nan)


def _inliers(t: Array, value: Array, degree: int) -> Mask:
    """Return which points agree with the rest: outliers are removed one or two at a time, worst first.

    A point is an outlier when the curve through the *others* misses it by more than STRAY_PX and by more than
    Student's t allows for the spread of the others (externally studentised residual), with a prior for that
    spread because few points cannot tell it. One point that nothing else checks is never an outlier.
    """
    keep = np.ones(t.size, bool)
    spare = min(t.size // 4, t.size - degree - 2)
    while (~keep).sum() < spare:
        inside = np.flatnonzero(keep)
        solved = _solve(t[inside], value[inside], degree)
        worst = _worst_outliers(
            solved, degree, pairs=inside.size <= MAX_PAIRS and spare - (~keep).sum() >= 2
        )
        if not len(worst):
            break
        keep[inside[worst]] = False
    return keep


def _worst_outliers(solved: _Solved, degree: int, pairs: bool) -> Indices:
    """Return indices of the one or two points whose removal explains most, if that is beyond chance."""
    n = solved.residuals.size
    free = 1 - solved.leverage
    # RSS - RSS without i
    gain = np.where(free > 1e-6, solved.residuals**2 / np.maximum(free, 1e-6), 0.0)
    rss = float(np.sum(solved.residuals**2))
    best = int(np.argmax(gain))
    one = _beyond_chance(
        gain[best], abs(solved.residuals[best]) / max(free[best], 1e-6), rss, n - degree - 2
    )
    if n > MAX_PAIRS and one:  # many points: take all that are as bad at once
        return np.flatnonzero(
            (gain > 0.25 * gain[best]) & (np.abs(solved.residuals) > MIN_OUTLIER_PX)
        )
    if pairs:
        h = solved.hat @ solved.hat.T
        i, j = np.triu_indices(n, 1)
        a, d, b = free[i], free[j], -h[i, j]
        det = a * d - b * b
        ri, rj = solved.residuals[i], solved.residuals[j]
        both = np.where(
            det > 1e-6, (d * ri**2 - 2 * b * ri * rj + a * rj**2) / np.maximum(det, 1e-6), 0.0
        )
        k = int(np.argmax(both))
        ei, ej = (
            (d[k] * ri[k] - b[k] * rj[k]) / max(det[k], 1e-6),
            (a[k] * rj[k] - b[k] * ri[k]) / max(det[k], 1e-6),
        )
        if _beyond_chance(
            both[k] / 2, min(abs(ei), abs(ej)), rss - both[k] / 2, n - degree - 3
        ) and (not one or both[k] > 2 * gain[best]):
            return np.array([i[k], j[k]])
    return np.array([best]) if one else np.array([], int)


def _beyond_chance(gain: float, distance: float, rss: float, freedom: int) -> bool:
    if freedom < 1 or distance < MIN_OUTLIER_PX:
        return False
    freedom += PRIOR_CLICKS
    variance = (max(rss - gain, 0.0) + PRIOR_CLICKS * CLICK_NOISE_PX**2) / freedom
    limit = 3.3 * (1 + 2.9 / freedom + 10 / freedom**2)  # Student's t at 0.1 %, to a few per cent
    return gain > limit**2 * variance


def _choose_degree(t: Array, value: Array, robust: bool) -> tuple[int, Sentence, Mask]:
    """Choose the lowest degree that predicts left-out points as well as the best one, within chance.

    Each degree is tried with its own outliers, which count MISS_PX each: otherwise a high degree would win by
    bending to an outlier at the border's end, or a low one by calling a bend a row of outliers. Within chance means
    that the mean of the paired differences of squared errors is less than CHANCE_ERRORS standard errors from 0.
    """
    errors_px, outliers = {}, {}
    places = np.unique(t).size  # two for each coefficient, or two to spare up to a quartic
    highest = max(1, min(4, places - 3), min(MAX_AUTO_DEGREE, (places + 1) // 2 - 1))
    for degree in range(1, highest + 1):
        inliers = _inliers(t, value, degree) if robust else np.ones(t.size, bool)
        missed = np.full(t.size, MISS_PX)
        missed[inliers] = _held_out(_solve(t[inliers], value[inliers], degree))
        errors_px[degree], outliers[degree] = np.nan_to_num(missed, nan=MISS_PX), inliers
    rms_px = {d: root_mean_square(m) for d, m in errors_px.items()}
    best = min(rms_px, key=rms_px.__getitem__)
    # an rms of n values is known no better
    alike = rms_px[best] * (1 + 1 / np.sqrt(2 * t.size)) + SAME_PX

    def as_good(d: int) -> bool:
        worse = errors_px[d] ** 2 - errors_px[best] ** 2
        return rms_px[d] <= alike or worse.mean() <= CHANCE_ERRORS * worse.std() / np.sqrt(
            worse.size
        )

    degree = next(d for d in rms_px if d == best or as_good(d))
    return degree, _reason(degree, max(best, degree + 1), rms_px), outliers[degree]


def _reason(degree: int, higher: int, rms_px: Mapping[int, float]) -> Sentence:
    """Say what a degree gains. rms_px: of each degree that was tried."""
    return join(
        say(
            "degree.automatic",
            "Chosen automatically: the curve through the other points predicts each point within {px:px} px.",
            px=rms_px[degree],
        ),
        ""
        if rms_px.get(degree - 1, 0.0) <= rms_px[degree]
        else say(
            "degree.lower",
            "Degree {degree} is worse, with {px:px} px.",
            degree=degree - 1,
            px=rms_px[degree - 1],
        ),
        ""
        if higher not in rms_px
        else say(
            "degree.higher",
            "Degree {degree} is not clearly better, with {px:px} px.",
            degree=higher,
            px=rms_px[higher],
        ),
    )
