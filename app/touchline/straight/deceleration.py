"""How rolls slow down: a kicked ball slides until it turns as fast as it moves, then it rolls.

    v(t) = v0 + a_slide t                until τ, when v = k v0
    v(t) = k v0 + a_roll (t - τ)         from then on

as the league's packet has it ("straight two-phase"). For a given τ the distance along the roll is linear in s0, v0 and
both accelerations, so that τ alone is searched. A ball that was rolled by hand has only the second phase. What a hand
or a robot does to it at either end is cut off: the longest part counts in which the law holds to the noise.
All rolls together: a weighted mean whose σ has the noise of each and how much they differ, as slope and carpet make
them (DerSimonian and Laird, 1986). Each kick is linearised about what all say: fitted alone, a short slide would weigh
more the weaker noise makes it. A kick lies between two frames, so that the first speed is that of half a frame earlier;
of a ball that was not followed while it lay, the first frames may be missing, of all kicks alike.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

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
MAX_ROLL_M_S2 = 1.0  # of what only rolls; a ball that slides has 2 to 6
MIN_ROLL_M_S2, MIN_SIGMAS = 0.05, 2.0  # what slows down less is driven, or unknown
MIN_SLIDE_M_S2 = 1.0
MIN_SLIDE_PER_ROLL = 2.0
MIN_SWITCH = 0.4  # of a ball; robots that brake have less
MIN_PHASE = 0.06  # of a kick's duration, of either phase: in less it has no acceleration
# of all kicks about their common values, and of one kick's first place and speed
ROUNDS, STEPS = 4, 3
MIN_F = 15.0  # of an F test: less is no second phase
MAX_NOISE, MAX_RMS_M = 2.0, 0.003  # by which the law may be missed: noises, or what a lens is off
CUTS = (0.0, 0.1, 0.2, 0.3, 0.4)  # of a roll, at either end, as
MAX_CUT = 0.5  # together
MIN_MOVED_M = 0.005  # and MAX_OFF_NOISES: with less a ball still lies
EARLY = 4  # points by which the speed of a kick is known well enough to say when it was
# by which kicks may be earlier than half a frame, where the ball was not seen before
LATE_FRAMES = 0.5
GUARD = 0.1  # next to what is cut: the beginning of a touch is hidden in the noise
MAX_OFF_NOISES, MAX_OFF_SHARE = 4.0, 0.1  # a point further off does not count; so many may be
TRIES = 33  # of τ, and once more between the neighbours of the best
# from the median, and of its value: a roll of more does not count
MAX_SPREADS, MIN_SPREAD = 4.0, 0.1
# by which the calibration may be off where the balls rolled, for all of them alike
SCALE_SHARE = 0.01
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

    rolls: of which anything was measured. Others were too short, went as no free ball does (uneven), or have another
    acc_roll than most (apart).
    """

    acc_roll: Estimate | None
    acc_slide: Estimate | None
    k_switch: Estimate | None
    rolls: int
    short: int = 0
    uneven: int = 0
    apart: int = 0


@dataclass(frozen=True, eq=False)
class _Fit:
    """One roll, where it goes as a ball does. t_s (n,) since the kick, s_m (n,) along it.

    terms: s0, v0, a_slide, a_roll. is_clear: no second phase is seen that is no slide. tau_s: None of one phase.
    variance_m2: of a point. kick_sigma_s: of the kick's moment, None where it is unknown; late_s: what all kicks may
    have in common.
    """

    t_s: Array
    s_m: Array
    terms: Array
    tau_s: float | None
    variance_m2: float
    kick_sigma_s: float | None
    late_s: float
    is_clear: bool = True


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
    skipped = {
        "untimed": sum(roll.times_s is None for roll in rolls[-MAX_ROLLS:]),
        "short": found.short,
        "uneven": found.uneven,
        "apart": found.apart,
    }
    values = {
        name: one and one.to_json()
        for name, one in (
            ("acc_roll", found.acc_roll),
            ("acc_slide", found.acc_slide),
            ("k_switch", found.k_switch),
        )
    }
    sentence = _sentence(found, model is not None, is_free)
    if model is not None and is_free and any(skipped.values()):
        why = say(
            "deceleration.skipped",
            "Rolls that do not count: {untimed} without times, {short} too short, {uneven} not "
            "like a free ball, {apart} unlike the others.",
            **skipped,
        )
        sentence = join(sentence, why)
    return stated({**values, "skipped": skipped, "sentence": sentence})


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
                "To measure how it slides, kick a ball that lies in the middle of the image {needed} times.",
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
    timed = [one for roll in rolls if (one := _long_enough(roll)) is not None]
    fits = [fit for one in timed if (fit := _fit(one)) is not None]
    rolled = [_rolled(fit) for fit in fits if fit.tau_s is None]
    kicks = [fit for fit in fits if fit.tau_s is not None]
    begun = [_alone(fit) for fit in kicks if fit.kick_sigma_s is not None]
    common = np.median([_alone(fit) for fit in kicks] or [np.zeros(3)], axis=0)
    common[2] = np.median([k for _, _, k in begun]) if begun else 0.0
    for _ in range(ROUNDS):
        about = [kick for fit in kicks if (kick := _about(fit, common)) is not None]
        slide = _together([kick[0] for kick in about])
        roll = _together(rolled + [kick[1] for kick in about])
        known = [kick for kick in about if np.isfinite(kick[2][1])]
        switch = _together([kick[2] for kick in known], 0.0)
        for at, found in enumerate((slide, roll, switch)):
            common[at] = common[at] if found is None else found.value
    if switch is not None:
        late = float(np.mean([by_late for _, _, _, (by_late, _) in known]))
        switch = replace(switch, sigma=float(np.hypot(switch.sigma, late)))
    slows = roll is not None and -roll.value > max(MIN_ROLL_M_S2, MIN_SIGMAS * roll.sigma)
    short, uneven = len(rolls) - len(timed), len(timed) - len(fits)
    apart = 0 if roll is None else len(rolled) + len(about) - roll.rolls
    return Decelerations(roll if slows else None, slide, switch, len(fits), short, uneven, apart)


def _together(
    found: Sequence[tuple[float, float]], scale_share: float = SCALE_SHARE
) -> Estimate | None:
    """Combine the values and σ of several rolls; None of too few. scale_share: of the value, common to all."""
    values, sigmas = np.array(found, float).reshape(-1, 2).T
    if len(values) < MIN_ROLLS:
        return None
    middle = float(np.median(values))
    off = np.abs(values - middle)
    spread = max(float(np.median(off)) / MEDIAN_PER_SIGMA, MIN_SPREAD * abs(middle))
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
    sigma = np.hypot(few * max(by_noise, by_spread), scale_share * mean)
    return Estimate(mean, float(sigma), len(values))


def _long_enough(roll: TimedRoll) -> TimedRoll | None:
    """Return a roll's finite places and their times; None of one that is too short."""
    finite = np.isfinite(roll.places_mm).all(axis=1)
    places, times = roll.places_mm[finite], roll.times_s[finite]
    if len(times) < MIN_POINTS or _is_short(times, _along(places) / 1000):
        return None
    return TimedRoll(places, times, roll.begins_inside)


def _fit(roll: TimedRoll) -> _Fit | None:
    """Fit one roll; None where no part that is long enough goes as a ball does."""
    times, along = roll.times_s, _along(roll.places_mm) / 1000
    lay, frame_s = False, float(np.median(np.diff(times)))
    least_m = max(MIN_MOVED_M, MAX_OFF_NOISES * _noise(along))
    first = int(np.argmax(along > along[0] + least_m))
    last = len(along) - int(np.argmax(along[::-1] < along[-1] - least_m))
    kick_s, kick_sigma_s = frame_s / 2, frame_s / np.sqrt(12)  # before the first point
    if first > 1 and len(along) > first + EARLY:  # it was followed while it lay
        lay, early = True, slice(first, first + EARLY)
        speed = float(np.polyfit(times[early], along[early], 1)[0])
        gone_m = float(along[first] - np.median(along[: first - 1]))
        kick_s, kick_sigma_s = gone_m / speed, _noise(along[first:]) / speed
    stops = last < len(along) - 1  # by itself, or by a hand
    moves = slice(first if lay else 0, last if stops else len(along))
    along, times = along[moves], times[moves]
    if len(times) < MIN_POINTS:
        return None
    noise_m = _noise(along)

    def part(begin: float, end: float) -> _Fit | None:
        here = slice(round(begin * len(times)), round((1 - end) * len(times)))
        t, s = times[here] - times[here][0] + kick_s, along[here]
        fit = None if _is_short(t, s) else _fit_part(t, s, noise_m)
        if fit is None or fit.tau_s is None:
            return fit
        if begin > 0:  # what was cut off was no kick
            return None
        if not (lay or roll.begins_inside):
            return fit
        late_s = 0.0 if lay else LATE_FRAMES * frame_s
        return replace(fit, kick_sigma_s=kick_sigma_s, late_s=late_s)

    cuts = [(begin, end) for begin in CUTS for end in CUTS if begin + end <= MAX_CUT]
    best = None
    for begin, end in sorted(cuts, key=lambda cut: (sum(cut), cut[0])):
        found = part(begin, end)
        if found is None or not (best is None or found.is_clear):
            continue
        best = part(begin + GUARD * (begin > 0), end + GUARD * (end > 0 or stops)) or found
        if found.is_clear:
            break
    return best


def _is_short(t: Array, s: Array) -> bool:
    return bool(len(t) < MIN_POINTS or np.ptp(t) < MIN_SECONDS or np.ptp(s) < MIN_LENGTH_M)


def _along(places: Points) -> Array:
    """Return the distance along a straight roll, (n,)."""
    chord = places[-1] - places[0]
    return (places - places[0]) @ (chord / max(float(np.hypot(*chord)), 1e-9))


def _noise(along: Array) -> float:
    """Return the σ of a point, whatever the law of motion: from third differences, of which a gap spoils only some."""
    third = np.diff(along, 3)
    return float(np.median(np.abs(third))) / MEDIAN_PER_SIGMA / THIRD_DIFFERENCE_GAIN


def _fit_part(t: Array, s: Array, noise_m: float) -> _Fit | None:
    """Fit one phase, or two where they explain clearly more; None where neither holds to the noise.

    A few points that are far off are ignored.
    """
    limit_m = max(MAX_NOISE * noise_m, MAX_RMS_M)
    for _ in range(2):
        one = _basis(t, np.array([0.0]))[0][:, [0, 1, 3]]
        terms = np.linalg.lstsq(one, s, rcond=None)[0]
        off_1 = s - one @ terms
        tau, off_2, both = _switch(t, s)
        left_1, left_2, free = float(off_1 @ off_1), float(off_2 @ off_2), len(t) - 5
        is_two = left_1 - left_2 > 2 * MIN_F * max(left_2 / free, noise_m**2)
        off = np.abs(off_2 if is_two else off_1)
        # by the median, since a rough one is off by much more than the others
        far = off > MAX_OFF_NOISES * max(float(np.median(off)) / MEDIAN_PER_SIGMA, noise_m, 1e-6)
        in_a_row = (far[2:] & far[1:-1] & far[:-2]).any()  # a push or a touch, not an error
        if not far.any() or in_a_row or far.mean() > MAX_OFF_SHARE:
            break
        t, s = t[~far], s[~far]
    _, v0, slide, roll = both
    is_kick = (
        is_two
        and -slide >= max(MIN_SLIDE_M_S2, -MIN_SLIDE_PER_ROLL * roll)
        and abs(roll) <= MAX_ROLL_M_S2
        and v0 + slide * tau > MIN_SWITCH * v0
    )
    if is_kick and np.sqrt(left_2 / free) <= limit_m:
        return _Fit(t, s, both, tau, max(left_2 / free, noise_m**2), None, 0.0)
    variance = left_1 / (len(t) - 3)
    if np.sqrt(variance) > limit_m or abs(terms[2]) > MAX_ROLL_M_S2:
        return None
    return _Fit(t, s, terms[[0, 1, 2, 2]], None, max(variance, noise_m**2), None, 0.0, not is_two)


def _basis(t: Array, tau: Array) -> Array:
    """Return what s0, v0, a_slide and a_roll contribute to the distance, (τ, n, 4)."""
    late = np.maximum(t - tau[:, None], 0.0)
    slide = t**2 / 2 - late**2 / 2  # from τ on it goes at an even speed
    return np.stack(
        [np.ones_like(late), np.broadcast_to(t, late.shape), slide, late**2 / 2], axis=2
    )


def _switch(t: Array, s: Array) -> tuple[float, Array, Array]:
    """Return the τ that explains the distance best, what it leaves (n,), m, and its terms."""
    low, high = t[0] + 0.06 * np.ptp(t), t[0] + 0.94 * np.ptp(t)
    for _ in range(3):
        tries = np.linspace(low, high, TRIES)
        basis = _basis(t, tries)
        normal = np.einsum("kni,knj->kij", basis, basis)
        terms = np.linalg.solve(normal, np.einsum("kni,n->ki", basis, s)[..., None])[..., 0]
        off = s - np.einsum("kni,ki->kn", basis, terms)
        best = int(np.argmin(np.sum(off**2, axis=1)))
        low, high = tries[max(best - 1, 0)], tries[min(best + 1, TRIES - 1)]
    return float(tries[best]), off[best], terms[best]


def _rolled(fit: _Fit) -> tuple[float, float]:
    """Return a_roll and its σ of a roll with one phase."""
    design = _basis(fit.t_s, np.array([0.0]))[0][:, [0, 1, 3]]
    return float(fit.terms[3]), float(np.sqrt(_covariance(design, fit.variance_m2)[2, 2]))


def _alone(fit: _Fit) -> Array:
    """Return a_slide, a_roll and k of a kick by itself."""
    _, v0, slide, roll = fit.terms
    return np.array([slide, roll, 1 + slide * (fit.tau_s or 0.0) / v0])


def _about(fit: _Fit, common: Array) -> tuple[tuple[float, float], ...] | None:
    """Return a_slide, a_roll and k of a kick, each with σ, linearised about all kicks' common ones; and k by late_s.

    k with an infinite σ where the kick's moment is unknown. None where one of the phases is too short.
    """
    t, s, (slide, roll, k) = fit.t_s, fit.s_m, common
    v0, tau = float(fit.terms[1]), fit.tau_s or 0.0
    for _ in range(STEPS):
        if fit.kick_sigma_s is not None:
            tau = (k - 1) * v0 / slide
        if not MIN_PHASE < (tau - t[0]) / np.ptp(t) < 1 - MIN_PHASE:
            return None
        basis = _basis(t, np.array([tau]))[0]
        rest = s - basis[:, 2:] @ [slide, roll]
        s0, v0 = np.linalg.lstsq(basis[:, :2], rest, rcond=None)[0]
    design = np.column_stack([basis, (slide - roll) * np.maximum(t - tau, 0.0)])
    change = np.linalg.lstsq(design, s - basis @ [s0, v0, slide, roll], rcond=None)[0]
    covariance = _covariance(design, fit.variance_m2)
    # k = 1 + a τ / v0
    slope = np.array([0.0, -slide * tau / v0**2, tau / v0, 0.0, slide / v0])
    by_moment = np.inf if fit.kick_sigma_s is None else k * slide / v0 * fit.kick_sigma_s
    sigma = np.sqrt(np.diag(covariance))
    return (
        (float(slide + change[2]), float(sigma[2])),
        (float(roll + change[3]), float(sigma[3])),
        (
            float(1 + slide * tau / v0 + slope @ change),
            float(np.hypot(np.sqrt(slope @ covariance @ slope), by_moment)),
        ),
        (float(-k * slide / v0 * fit.late_s), 0.0),
    )


def _covariance(design: Array, variance: float) -> Array:
    return np.array(variance * np.linalg.pinv(design.T @ design, hermitian=True), float)
