"""How rolls slow down: a kicked ball slides until it turns as fast as it moves, then it rolls.

    v(t) = v0 + a_slide t                until τ, when v = k v0
    v(t) = k v0 + a_roll (t - τ)         from then on

as the league's packet has it ("straight two-phase"). For a given τ the distance along the roll is linear in s0, v0 and
both accelerations, so that τ alone is searched. A ball that was rolled by hand has only the second phase. What a hand
or a robot does to it at either end is cut off: the longest part counts in which the law holds to the noise.
All rolls together: a weighted mean whose σ has the noise of each and how much they differ, as slope and carpet make
them (DerSimonian and Laird, 1986).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from touchline.core.geometry import Array, ImageSize, Points
from touchline.core.json_values import JsonObject
from touchline.core.statements import Sentence, join, say, stated
from touchline.models import CameraModel, field_from_raw
from touchline.models.contract import RayModel
from touchline.straight.rolls import RecordedRoll

BALL_CENTRE_MM = 21.5  # above the carpet
BORDER_SHARE = 0.05  # of a picture: what is first seen there has come into it
MAX_ROLLS = 60  # the newest count: more tell nothing new

MIN_POINTS, MIN_LENGTH_M, MIN_SECONDS = 12, 0.3, 0.4  # of a roll
MIN_ROLLS = 3  # with fewer it is unknown how much they differ
MAX_ROLL_M_S2 = 1.5  # of what only rolls; a ball that slides has 2 to 5
MIN_ROLL_M_S2, MIN_SIGMAS = 0.05, 2.0  # what slows down less is driven, or unknown
MIN_SLIDE_M_S2 = 1.0
MIN_SLIDE_PER_ROLL = 2.0
MIN_F = 15.0  # of an F test: less is no second phase
MAX_NOISE, MAX_RMS_M = 2.0, 0.003  # by which the law may be missed: noises, or what a lens is off
CUTS = (0.0, 0.1, 0.2, 0.3, 0.4)  # of a roll, at either end
TRIES = 33  # of τ, and once more between the neighbours of the best
MAX_SPREADS = 4.0  # from the median: a roll of more does not count
MEDIAN_PER_SIGMA = 0.6745
THIRD_DIFFERENCE_GAIN = np.sqrt(20.0)  # of 1, -3, 3, -1: σ of it per σ of a point


@dataclass(frozen=True, eq=False)
class TimedRoll:
    """One roll on the carpet. places_mm (n, 2), times_s (n,); begins_inside: it has not come into the picture."""

    places_mm: Points
    times_s: Array
    begins_inside: bool = True


@dataclass(frozen=True)
class Estimate:
    """A value of several rolls."""

    value: float
    sigma: float
    rolls: int

    def to_json(self) -> JsonObject:
        return {"value": self.value, "sigma": self.sigma, "rolls": self.rolls}


@dataclass(frozen=True)
class Decelerations:
    """m/s², negative; k_switch: share of the first speed at which a ball begins to roll. None: unknown.

    rolls: of which anything was measured.
    """

    acc_roll: Estimate | None
    acc_slide: Estimate | None
    k_switch: Estimate | None
    rolls: int


@dataclass(frozen=True)
class _Fit:
    """Of one roll: value and σ of each, None where it does not tell."""

    acc_roll: tuple[float, float] | None = None
    acc_slide: tuple[float, float] | None = None
    k_switch: tuple[float, float] | None = None


def deceleration_json(
    rolls: Sequence[RecordedRoll], model: CameraModel | None, size: ImageSize, is_free: bool
) -> JsonObject:
    """Return what a camera's rolls tell, with a sentence; null where it is unknown.

    rolls: oldest first, in pictures of that size. model: of the camera's calibration for that size, None without.
    """
    timed = [
        TimedRoll(_places(model, roll.points), roll.times_s, _is_inside(roll.points[0], size))
        for roll in rolls[-MAX_ROLLS:]
        if model is not None and roll.times_s is not None
    ]
    found = measure_deceleration(timed if is_free else [])
    values = {
        name: one and one.to_json()
        for name, one in (
            ("acc_roll", found.acc_roll),
            ("acc_slide", found.acc_slide),
            ("k_switch", found.k_switch),
        )
    }
    return stated({**values, "sentence": _sentence(found, model is not None, is_free)})


def _places(model: CameraModel | None, points: Points) -> Points:
    if isinstance(model, RayModel):
        return model.unproject(points, BALL_CENTRE_MM)
    assert model is not None
    return field_from_raw(model, points)  # of a top view the height is unknown


def _is_inside(point: Points, size: ImageSize) -> bool:
    edge = BORDER_SHARE * np.array([size.width, size.height])
    return bool(((point > edge) & (point < np.array([size.width, size.height]) - edge)).all())


def _sentence(found: Decelerations, is_calibrated: bool, is_free: bool) -> Sentence:
    if not is_calibrated:
        return say(
            "deceleration.no-calibration",
            "The deceleration of the ball needs an active calibration for images of this size.",
        )
    if not is_free:
        return say(
            "deceleration.driven",
            "The deceleration of the ball is unknown: the rolls are not free.",
        )
    if found.acc_roll is None and found.rolls >= MIN_ROLLS:
        return say(
            "deceleration.unclear",
            "The rolls show no deceleration on which they agree. Roll one ball freely, more often, "
            "while nothing else moves.",
        )
    if found.acc_roll is None:
        return say(
            "deceleration.roll-more",
            "The deceleration of the ball is known from {needed} rolls of 0.3 m or more; so far "
            "{rolls}. Roll the ball more often.",
            needed=MIN_ROLLS,
            rolls=found.rolls,
        )
    roll = found.acc_roll
    rolling = say(
        "deceleration.rolling",
        "The ball rolls with {value:.3f} ± {sigma:.3f} m/s² ({rolls} rolls).",
        value=roll.value,
        sigma=roll.sigma,
        rolls=roll.rolls,
    )
    if found.acc_slide is None or found.k_switch is None:
        return join(
            rolling,
            say(
                "deceleration.kick",
                "To measure how it slides, kick it {needed} times in the middle of the image.",
                needed=MIN_ROLLS,
            ),
        )
    slide, switch = found.acc_slide, found.k_switch
    return join(
        rolling,
        say(
            "deceleration.sliding",
            "After a kick it slides with {value:.2f} ± {sigma:.2f} m/s², until it has {k:.3f} ± "
            "{k_sigma:.3f} of its first speed ({rolls} kicks).",
            value=slide.value,
            sigma=slide.sigma,
            k=switch.value,
            k_sigma=switch.sigma,
            rolls=slide.rolls,
        ),
    )


def measure_deceleration(rolls: Sequence[TimedRoll]) -> Decelerations:
    """Return what rolls tell together; places that are not finite are ignored."""
    fits = [fit for roll in rolls if (fit := _fit(roll)) is not None]
    roll = _together([fit.acc_roll for fit in fits if fit.acc_roll is not None])
    slows = roll is not None and -roll.value > max(MIN_ROLL_M_S2, MIN_SIGMAS * roll.sigma)
    return Decelerations(
        roll if slows else None,
        _together([fit.acc_slide for fit in fits if fit.acc_slide is not None]),
        _together([fit.k_switch for fit in fits if fit.k_switch is not None]),
        len(fits),
    )


def _together(found: Sequence[tuple[float, float]]) -> Estimate | None:
    """Combine the values and σ of several rolls; None of too few."""
    values, sigmas = np.array(found, float).reshape(-1, 2).T
    off = np.abs(values - np.median(values)) if len(values) else values
    spread = max(float(np.median(off)) / MEDIAN_PER_SIGMA, 1e-9) if len(values) else 1.0
    agrees = off <= MAX_SPREADS * np.hypot(spread, sigmas)
    values, sigmas = values[agrees], sigmas[agrees]
    if len(values) < MIN_ROLLS:
        return None
    weight = 1 / sigmas**2
    mean = np.average(values, weights=weight)
    excess = np.sum(weight * (values - mean) ** 2) - (len(values) - 1)
    between = max(0.0, excess / (weight.sum() - np.sum(weight**2) / weight.sum()))
    weight = 1 / (sigmas**2 + between)
    mean = float(np.average(values, weights=weight))
    by_noise = 1 / np.sqrt(weight.sum())
    by_spread = np.linalg.norm(weight * (values - mean)) / weight.sum()
    few = np.sqrt(1 + 3 / (len(values) - 1))  # the spread is itself estimated from a few
    return Estimate(mean, float(few * max(by_noise, by_spread)), len(values))


def _fit(roll: TimedRoll) -> _Fit | None:
    """Measure one roll; None where no part of it is long enough, or goes as a ball does."""
    finite = np.isfinite(roll.places_mm).all(axis=1)
    places, times = roll.places_mm[finite] / 1000, roll.times_s[finite]
    if len(times) < MIN_POINTS:
        return None
    along = _along(places)
    noise_m = _noise(along)
    parts = sorted(
        ((begin, end) for begin in CUTS for end in CUTS), key=lambda cut: (sum(cut), cut[0])
    )
    for begin, end in parts:
        here = slice(round(begin * len(times)), len(times) - round(end * len(times)))
        t, s = times[here] - times[here][0], along[here]
        if len(t) < MIN_POINTS or t[-1] < MIN_SECONDS or np.ptp(s) < MIN_LENGTH_M:
            continue
        found = _fit_part(t, s, noise_m, roll.begins_inside and begin == 0)
        if found is not None:
            return found
    return None


def _along(places: Points) -> Array:
    """Return the distance along a straight roll, (n,)."""
    chord = places[-1] - places[0]
    return (places - places[0]) @ (chord / max(float(np.hypot(*chord)), 1e-9))


def _noise(along: Array) -> float:
    """Return the σ of a point, whatever the law of motion: from third differences, of which a gap spoils only some."""
    third = np.diff(along, 3)
    return float(np.median(np.abs(third))) / MEDIAN_PER_SIGMA / THIRD_DIFFERENCE_GAIN


def _fit_part(t: Array, s: Array, noise_m: float, knows_start: bool) -> _Fit | None:
    """Fit one phase, or two where they explain clearly more; None where neither holds to the noise."""
    one = np.stack([np.ones_like(t), t, t**2 / 2], axis=1)
    terms = np.linalg.lstsq(one, s, rcond=None)[0]
    left_1 = float(np.sum((s - one @ terms) ** 2))
    tau, left_2 = _switch(t, s)
    limit_m = max(MAX_NOISE * noise_m, MAX_RMS_M)
    free_2 = len(t) - 5
    is_two = left_1 - left_2 > 2 * MIN_F * max(left_2 / free_2, noise_m**2)
    if is_two:
        return (
            _two_phases(t, s, tau, left_2, noise_m, knows_start)
            if np.sqrt(left_2 / free_2) <= limit_m
            else None
        )
    if np.sqrt(left_1 / (len(t) - 3)) > limit_m or abs(terms[2]) > MAX_ROLL_M_S2:
        return None
    covariance = _covariance(one, max(left_1 / (len(t) - 3), noise_m**2))
    return _Fit(acc_roll=(float(terms[2]), float(np.sqrt(covariance[2, 2]))))


def _basis(t: Array, tau: Array) -> Array:
    """Return what s0, v0, a_slide and a_roll contribute to the distance, (τ, n, 4)."""
    late = np.maximum(t - tau[:, None], 0.0)
    slide = t**2 / 2 - late**2 / 2  # from τ on it goes at an even speed
    return np.stack(
        [np.ones_like(late), np.broadcast_to(t, late.shape), slide, late**2 / 2], axis=2
    )


def _switch(t: Array, s: Array) -> tuple[float, float]:
    """Return the τ that explains the distance best, and the sum of squares that it leaves, m²."""
    low, high = 0.08 * t[-1], 0.92 * t[-1]
    tau, left = low, np.inf
    for _ in range(2):
        tries = np.linspace(low, high, TRIES)
        basis = _basis(t, tries)
        normal = np.einsum("kni,knj->kij", basis, basis)
        terms = np.linalg.solve(normal, np.einsum("kni,n->ki", basis, s)[..., None])[..., 0]
        squares = np.sum((s - np.einsum("kni,ki->kn", basis, terms)) ** 2, axis=1)
        best = int(np.argmin(squares))
        tau, left = float(tries[best]), float(squares[best])
        low, high = tries[max(best - 1, 0)], tries[min(best + 1, TRIES - 1)]
    return tau, left


def _two_phases(
    t: Array, s: Array, tau: float, left: float, noise_m: float, knows_start: bool
) -> _Fit | None:
    """Return a kicked ball's values; None where these are no slide and roll."""
    basis = _basis(t, np.array([tau]))[0]
    _, v0, slide, roll = np.linalg.lstsq(basis, s, rcond=None)[0]
    is_slide = -slide >= max(MIN_SLIDE_M_S2, -MIN_SLIDE_PER_ROLL * roll)
    speed = v0 + slide * tau
    if not is_slide or abs(roll) > MAX_ROLL_M_S2 or speed <= 0:
        return None
    by_tau = (slide - roll) * np.maximum(t - tau, 0.0)
    design = np.column_stack([basis, by_tau])
    covariance = _covariance(design, max(left / (len(t) - 5), noise_m**2))
    sigma = np.sqrt(np.diag(covariance))
    # k = 1 + a τ / v0
    slope = np.array([0.0, -slide * tau / v0**2, tau / v0, 0.0, slide / v0])
    k_sigma = float(np.sqrt(slope @ covariance @ slope))
    return _Fit(
        acc_roll=(float(roll), float(sigma[3])),
        acc_slide=(float(slide), float(sigma[2])),
        k_switch=(float(speed / v0), k_sigma) if knows_start else None,
    )


def _covariance(design: Array, variance: float) -> Array:
    return np.array(variance * np.linalg.pinv(design.T @ design, hermitian=True), float)
