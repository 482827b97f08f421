"""Distortion from straight rolls of a ball or robot, by the paper's Eq. (9): of each, of zones, of the lens.

    analysis = analyse_rolls(points, seconds, size)    figures of each roll, and of the lens
    report = roll_report(rolls, size)                  the same as plain JSON with sentences
    report = roll_report(rolls, size, model, name)     ... and of the picture that the model corrects

A thing that rolls freely goes straight over the carpet; how far its track bows in the picture is distortion, all of it
in a raw picture, what is left in a corrected one. One number for the lens comes from all rolls together: the division
model's k under which their bows vanish, each roll counting by how well its bow is known and by how much k moves it:

    bow_i(k) = 0 + noise_i,    k ← k - Σ w g b / Σ w g²,    g = ∂bow/∂k,    1/w = σ_i² + (a T_i² / 8)²

a T²/8 is what a roll of duration T swerves by itself, as spin or a slope push it sideways with a: so quick rolls count
most. How large a is tells how much the rolls disagree (as between studies: DerSimonian and Laird 1986).
The number that is shown is Eq. (9) of a straight line along the picture's edge, signed as everywhere: barrel negative.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from touchline.core.geometry import Array, ImageSize, Indices, Points
from touchline.core.json_values import JsonObject, nullable
from touchline.core.statements import Sentence, say, stated
from touchline.evaluate.distortion import STANDARD_LENS_PCT, sag_pct
from touchline.models import CameraModel
from touchline.models.distortion import Distortion
from touchline.straight.bow import picture_of_line
from touchline.straight.search import Chains

# of the picture's diagonal per s²: before rolls can be compared; slow balls on a pool table do 2e-3
SIDEWAYS = 1e-3
MIN_FOR_SIDEWAYS = 4  # rolls
# of the diagonal per s²: more, and it is driven, or pushed; balls on a pool table do 1e-3 to 2e-3
MAX_SIDEWAYS = 8e-3
MAX_FULL_WEIGHT_SIGMAS = 2.0  # a bow of more counts less (P. Huber 1964)
MAX_AGREEING_SIGMAS = 3  # a roll of more is left out
# of its bow that a lens of another kind may bow a line otherwise: no disagreement
OTHER_LENS_SHARE = 0.05
# nor is less than this one: a ball's middle is seen so well, but a pixel at a time
MIN_OFF_PX = 0.1
SHARED_FREEDOM = 10  # degrees of freedom with which all rolls' noise counts beside a roll's own
MEDIAN_PER_SIGMA = 0.6745  # median of the absolute values of a normal distribution over its σ
ROUNDS = 12
K_STEP = 1e-4  # for derivatives by k
MAX_K_MOVE = 0.2  # in one round
MAX_K = 0.9
PRIOR_K_SIGMA = 0.4  # over all lenses there are
MIN_POINTS = 5
ZONES = 3  # to a side
ALONG = np.linspace(0, 1, 65)[:, None]
MIN_SEEN_SIGMAS = 2  # a bow of fewer is none that is seen
RAW = say("rolls.raw", "the raw image")
CORRECTED = say("rolls.corrected", "the corrected image")


@dataclass(frozen=True)
class Roll:
    """One roll, by its number among those given. sag_pct: Eq. (9), signed about the picture's middle.

    sigma_pct: from its points' noise; spread_pct: also as far as spin and slope may have pushed it aside. zone: column
    and row. used: it agrees with the others.
    """

    number: int
    length_px: float
    sag_px: float
    sag_pct: float
    sigma_pct: float
    spread_pct: float
    rms_px: float
    zone: tuple[int, int]
    used: bool


@dataclass(frozen=True, eq=False)
class RollAnalysis:
    """Result of all rolls. border_pct ± border_sigma_pct: Eq. (9) along the picture's edge; lens: what undoes it.

    sideways_px: per s².
    """

    rolls: tuple[Roll, ...]
    lens: Distortion
    k_sigma: float
    border_pct: float
    border_sigma_pct: float
    sideways_px: float

    @property
    def is_free(self) -> bool:
        """Whether these were things that rolled by themselves: robots and hands go curves of their own."""
        size = self.lens.image_size
        return self.sideways_px <= MAX_SIDEWAYS * float(np.hypot(size.width, size.height))

    def to_json(self) -> JsonObject:
        """Return plain JSON; null where nothing is known."""
        return {
            "border_pct": nullable(self.border_pct),
            "border_sigma_pct": nullable(self.border_sigma_pct),
            "k": self.lens.terms[0],
            "k_sigma": nullable(self.k_sigma),
            "sideways_px": self.sideways_px,
            "free": self.is_free,
            "lens": self.lens.to_json(),
            "zones": zones(self.rolls),
            "rolls": [
                {
                    "length_px": r.length_px,
                    "bow_px": r.sag_px,
                    "bow_pct": r.sag_pct,
                    "sigma_pct": r.sigma_pct,
                    "spread_pct": r.spread_pct,
                    "rms_px": r.rms_px,
                    "zone": list(r.zone),
                    "used": r.used,
                }
                for r in self.rolls
            ],
        }


def analyse_rolls(
    points: Sequence[Points], seconds: Sequence[float], size: ImageSize
) -> RollAnalysis:
    """Return what rolls tell of the lens.

    points: of each roll (n, 2) px, in order along it, of a picture of that size, raw or corrected. seconds: each roll's
    duration. Without a roll σ is infinite. Rolls with fewer than five finite points are left out.
    """
    finite = [p[np.isfinite(p).all(axis=1)] for p, _ in zip(points, seconds, strict=True)]
    numbers = [
        i for i, p in enumerate(finite) if len(p) >= MIN_POINTS and np.ptp(p, axis=0).max() > 1
    ]
    first_sideways = SIDEWAYS * float(np.hypot(size.width, size.height))
    if not numbers:
        return RollAnalysis((), _division(0.0, size), np.inf, 0.0, np.inf, first_sideways)
    tracks = _Tracks([finite[i] for i in numbers], size)
    # A constant sideways acceleration a bends a roll of T seconds into an arc of height a T² / 8.
    push = np.array([seconds[i] for i in numbers]) ** 2 / 8
    raw = tracks.bows(tracks.chains.pixels)  # of the picture that was given, which may be corrected
    sigma = _pooled_noise(raw.rms_px, tracks.chains.counts) * raw.per_px
    found = _fit_k(tracks, sigma, push, first_sideways)
    k, left, spread = found.k, tracks.bows_under(found.k), np.hypot(sigma, found.sideways * push)
    k_sigma = _k_sigma(found, left)
    tolerance = np.sqrt(spread**2 + (OTHER_LENS_SHARE * found.gain * k) ** 2 + MIN_OFF_PX**2)
    agrees = np.abs(left) <= MAX_AGREEING_SIGMAS * tolerance
    rolls = tuple(
        _roll(
            number,
            finite[number],
            size,
            sag_px=float(raw.px[i]),
            length_px=float(raw.length_px[i]),
            rms_px=float(raw.rms_px[i]),
            sigma_px=float(sigma[i]),
            spread_px=float(spread[i]),
            used=bool(agrees[i]),
        )
        for i, number in enumerate(numbers)
    )
    border_by_k = (border_pct(k + K_STEP, size) - border_pct(k - K_STEP, size)) / (2 * K_STEP)
    return RollAnalysis(
        rolls,
        _division(k, size),
        k_sigma,
        border_pct(k, size),
        abs(border_by_k) * k_sigma,
        found.sideways,
    )


def border_pct(k: float, size: ImageSize) -> float:
    """Return Eq. (9) of the straight line along the picture's long edge, as a division lens of that k shows it."""
    along_x = size.width >= size.height
    ends = np.array([[0.0, 0.0], [size.width - 1, 0.0] if along_x else [0.0, size.height - 1]])
    return sag_pct(picture_of_line(_division(k, size), ends, ALONG), np.array(size.centre))


def zones(rolls: Sequence[Roll]) -> list[list[dict[str, float] | None]]:
    """Return Eq. (9) by the ninth of the picture in which a roll's middle lies, weighted; None where nothing rolled."""

    def zone(row: int, column: int) -> dict[str, float] | None:
        here = [r for r in rolls if r.zone == (column, row) and r.used]
        if not here:
            return None
        weight = np.array([1 / max(r.spread_pct, 1e-6) ** 2 for r in here])
        return {
            "pct": float(np.average([r.sag_pct for r in here], weights=weight)),
            "sigma_pct": float(1 / np.sqrt(weight.sum())),
            "rolls": len(here),
        }

    return [[zone(row, column) for column in range(ZONES)] for row in range(ZONES)]


def _division(k: float, size: ImageSize) -> Distortion:
    return Distortion("division", (k,), size.centre, size)


@dataclass(frozen=True, eq=False)
class _Bows:
    """Of a parabola across each chord, (n,): its height; that height's σ for noise of 1 px; rms about it; length."""

    px: Array
    per_px: Array
    rms_px: Array
    length_px: Array


class _Tracks:
    """Several tracks, one after the other, so that one computation measures the bows of all."""

    def __init__(self, tracks: Sequence[Points], size: ImageSize) -> None:
        self.chains, self._size = Chains.of(tracks), size

    def bows(self, points: Points) -> _Bows:
        """Fit a parabola to each of the tracks, with their points there instead, (n, 2) px."""
        owner, starts, sums, counts = (
            self.chains.owner,
            self.chains.starts,
            self.chains.sums,
            self.chains.counts,
        )
        about = points - (sums(points) / counts[:, None])[owner]
        chord = points[starts + counts - 1] - points[starts]
        direction = (chord / np.maximum(np.hypot(*chord.T), 1e-12)[:, None])[owner]
        along = np.sum(about * direction, axis=1)
        across = about[:, 0] * direction[:, 1] - about[:, 1] * direction[:, 0]
        length = np.maximum.reduceat(along, starts) - np.minimum.reduceat(along, starts)
        t = along / np.maximum(length / 2, 1e-9)[owner]  # from -1 to 1
        # Normal equations of across = c0 + c1 t + c2 t², all tracks at once: from the chord the middle is off by -c2.
        design = np.stack([np.ones_like(t), t, t**2], axis=1)
        inverse = np.linalg.pinv(sums(design[:, :, None] * design[:, None, :]), hermitian=True)
        terms = np.einsum("nij,nj->ni", inverse, sums(design * across[:, None]))
        residuals = across - np.sum(design * terms[owner], axis=1)
        rms = np.sqrt(sums(residuals**2) / np.maximum(counts - 3, 1))
        return _Bows(
            -terms[:, 2], np.sqrt(np.maximum(inverse[:, 2, 2], 0.0)), rms, np.maximum(length, 2e-9)
        )

    def bows_under(self, k: float) -> Array:
        """Return their bows (n,) px once a lens of that k is undone."""
        return self.bows(_division(k, self._size).undistorted_from_raw(self.chains.pixels)).px

    def gain(self, k: float) -> Array:
        """Return ∂bow/∂k (n,) px at that k."""
        return (self.bows_under(k + K_STEP) - self.bows_under(k - K_STEP)) / (2 * K_STEP)


def _pooled_noise(own: Array, counts: Indices) -> Array:
    """Return each roll's noise, px, drawn towards that of all: a short roll hardly knows its own."""
    freedom = np.maximum(counts - 3.0, 1.0)
    everyone = float(np.median(own))
    return (
        np.sqrt((freedom * own**2 + SHARED_FREEDOM * everyone**2) / (freedom + SHARED_FREEDOM))
        + 1e-3
    )


@dataclass(frozen=True, eq=False)
class _DivisionFit:
    """k of all rolls; sideways acceleration px/s²; ∂bow/∂k and weight of each roll (n,), as of the last round."""

    k: float
    sideways: float
    gain: Array
    weight: Array


def _fit_k(tracks: _Tracks, sigma: Array, push: Array, sideways: float) -> _DivisionFit:
    """Find the k under which the bows vanish, by Gauss and Newton's steps, and how far rolls swerve by themselves.

    sigma (n,) px: of each bow, by noise. push (n,) s²: bow per sideways acceleration. sideways: where the rolls are
    too few to tell.
    """
    k, weight, gain = 0.0, np.ones(len(sigma)), np.ones(len(sigma))
    for _ in range(ROUNDS):
        bow, gain = tracks.bows_under(k), tracks.gain(k)
        spread = np.hypot(sigma, sideways * push)
        huber = np.minimum(1.0, MAX_FULL_WEIGHT_SIGMAS * spread / np.maximum(np.abs(bow), 1e-12))
        weight = huber / spread**2
        slope = np.sum(weight * gain * bow) + k / PRIOR_K_SIGMA**2
        move = -float(slope / (np.sum(weight * gain**2) + 1 / PRIOR_K_SIGMA**2))
        k = float(np.clip(k + np.clip(move, -MAX_K_MOVE, MAX_K_MOVE), -MAX_K, MAX_K))
        if len(sigma) >= MIN_FOR_SIDEWAYS:
            sideways = _sideways(tracks.bows_under(k), sigma, push)
    return _DivisionFit(k, sideways, gain, weight)


def _sideways(left: Array, sigma: Array, push: Array) -> float:
    """Return px/s² so that the bows that are left are as large as they should be; a few large ones do not count.

    The median of what each roll would need: its bow, as σ of a normal distribution and corrected for the k that was
    fitted to the same bows, without the part that noise explains.
    """
    variance = left**2 / MEDIAN_PER_SIGMA**2 * len(left) / (len(left) - 1)
    return float(np.median(np.sqrt(np.maximum(variance - sigma**2, 0.0)) / push))


def _k_sigma(fit: _DivisionFit, left: Array) -> float:
    """Return σ of k: by the rolls' spread, or by a jackknife over rolls where that is more. left (n,) px: the bows."""
    count, weight = len(left), fit.weight
    information = weight * fit.gain**2
    # Rolls that disagree by more than that can explain make the answer as much less sure (R. Birge, 1932).
    birge = np.sqrt(np.sum(weight * left**2) / max(count - 1, 1))
    few = np.sqrt(1 + 2 / count)  # σ that was itself estimated from a few rolls
    by_spread = float(few * max(1.0, birge) / np.sqrt(information.sum() + 1 / PRIOR_K_SIGMA**2))
    # One roll that carries the answer alone may have been a hand: what it would be without each (linear jackknife).
    of_others = np.maximum(information.sum() - information + 1 / PRIOR_K_SIGMA**2, 1e-12)
    moves = weight * fit.gain * left / of_others
    return max(by_spread, float(np.sqrt((count - 1) / count * np.sum(moves**2))))


def _roll(
    number: int,
    points: Points,
    size: ImageSize,
    *,
    sag_px: float,
    length_px: float,
    rms_px: float,
    sigma_px: float,
    spread_px: float,
    used: bool,
) -> Roll:
    chord = points[-1] - points[0]
    left = np.array([chord[1], -chord[0]])  # of its way, as y points down
    inwards = 1.0 if (np.array(size.centre) - points.mean(axis=0)) @ left > 0 else -1.0
    middle = (points[0] + points[-1]) / 2
    column, row = (
        int(v) for v in np.clip(middle / (size.width, size.height) * ZONES, 0, ZONES - 1)
    )
    pct = 100 / length_px
    return Roll(
        number,
        length_px,
        sag_px,
        pct * sag_px * inwards,
        pct * sigma_px,
        pct * spread_px,
        rms_px,
        (column, row),
        used,
    )


@dataclass(frozen=True, eq=False)
class RecordedRoll:
    """One straight roll. points (n, 2) raw px, in order; from_s: when it began; rms_px about its arc, straight_px
    about a straight line; times_s (n,): of its points since it began, None where it was saved without."""

    points: Points
    from_s: float
    to_s: float
    rms_px: float
    straight_px: float
    times_s: Array | None = None

    @property
    def seconds(self) -> float:
        """Return its duration."""
        return self.to_s - self.from_s

    def to_json(self) -> JsonObject:
        """Return plain JSON; points to a hundredth of a pixel."""
        return {
            "from_s": self.from_s,
            "to_s": self.to_s,
            "points": self.points.round(2).tolist(),
            "rms_px": self.rms_px,
            "straight_px": self.straight_px,
            "times": [] if self.times_s is None else self.times_s.round(6).tolist(),
        }


def check_times(times: Sequence[float], points: Sequence[object]) -> None:
    """Raise ValueError unless there is a time for each of these points, finite and increasing, or none at all."""
    if times and not (
        len(times) == len(points) and np.isfinite(times).all() and np.all(np.diff(times) > 0)
    ):
        raise ValueError("Send one time for each point, in s, increasing.")


def roll_report(
    rolls: Sequence[RecordedRoll],
    size: ImageSize,
    model: CameraModel | None = None,
    name: str | None = None,
) -> JsonObject:
    """Report on rolls as plain JSON; `corrected` where a model was given, called by that name."""
    seconds = [roll.seconds for roll in rolls]
    raw = _view_json(analyse_rolls([roll.points for roll in rolls], seconds, size), RAW)
    corrected = None
    if model is not None:
        corrected = _view_json(
            analyse_rolls(
                [model.corrected_from_raw(roll.points) for roll in rolls],
                seconds,
                model.corrected_size,
            ),
            CORRECTED,
        )
    return stated(
        {
            "image_size": [size.width, size.height],
            "rolls": len(rolls),
            "raw": raw,
            "corrected": corrected,
            "model": name,
            "sentence": (corrected or raw)["sentence"],
        }
    )


def _view_json(analysis: RollAnalysis, where: Sentence) -> JsonObject:
    """Return an analysis with a sentence, each roll's verdict, and its number among those that were given."""
    report = stated({**analysis.to_json(), "sentence": _conclusion(analysis, where)})
    for one, roll in zip(report["rolls"], analysis.rolls, strict=True):
        level, words = _roll_verdict(roll)
        one |= stated({"number": roll.number, "level": level, "words": words})
    return report


def _conclusion(analysis: RollAnalysis, where: Sentence) -> Sentence:
    """Describe in a sentence what all rolls together show."""
    if not analysis.rolls:
        return say(
            "rolls.none",
            "No straight roll was long enough. Roll a ball quickly across the field, preferably "
            "near its borders.",
        )
    count = (
        say("rolls.one", "One roll")
        if len(analysis.rolls) == 1
        else say("rolls.several", "{n} rolls", n=len(analysis.rolls))
    )
    pct = f"{analysis.border_pct:+.2f} ± {analysis.border_sigma_pct:.2f} %".replace("-", "−")
    if not analysis.is_free:
        return say(
            "rolls.not-free",
            "{rolls} in {image} followed irregular curves: the object was driven or pushed. "
            "Roll a single ball freely, with no other movement on the field.",
            rolls=count,
            image=where,
        )
    if analysis.border_sigma_pct > STANDARD_LENS_PCT:
        return say(
            "rolls.inconclusive",
            "{rolls} in {image}: {pct}. This is inconclusive. Roll more balls, quickly "
            "and near the borders.",
            rolls=count,
            image=where,
            pct=pct,
        )
    if abs(analysis.border_pct) <= MIN_SEEN_SIGMAS * analysis.border_sigma_pct:
        return say(
            "rolls.straight",
            "{rolls} in {image}: no significant distortion, {pct} along the edge.",
            rolls=count,
            image=where,
            pct=pct,
        )
    values = {
        "rolls": count,
        "image": where,
        "kind": _kind(analysis.border_pct),
        "pct": pct,
        "typical_pct": STANDARD_LENS_PCT,
    }
    if abs(analysis.border_pct) <= STANDARD_LENS_PCT:
        return say(
            "rolls.within",
            "{rolls} in {image}: {kind} of {pct} along the edge, within the ±{typical_pct:g} % "
            "of a typical lens.",
            **values,
        )
    return say(
        "rolls.above",
        "{rolls} in {image}: {kind} of {pct} along the edge, above the ±{typical_pct:g} % of a "
        "typical lens.",
        **values,
    )


def _roll_verdict(roll: Roll) -> tuple[str, Sentence]:
    """Judge one roll by itself: good, fair or poor (of the picture, not of the roll), and why, in words."""
    if not roll.used:
        return "left-out", say(
            "roll.left-out",
            "Excluded: it does not agree with the other rolls (pushed, spinning or not free).",
        )
    if roll.spread_pct > STANDARD_LENS_PCT:
        return "unknown", say("roll.inconclusive", "Too short or too slow to be conclusive.")
    if abs(roll.sag_pct) <= MIN_SEEN_SIGMAS * roll.spread_pct:
        return "good", say("roll.straight", "Straight within the uncertainty.")
    values = {"kind": _kind(roll.sag_pct), "typical_pct": STANDARD_LENS_PCT}
    if abs(roll.sag_pct) <= STANDARD_LENS_PCT:
        return "fair", say(
            "roll.within", "A {kind}, within the ±{typical_pct:g} % of a typical lens.", **values
        )
    return "poor", say(
        "roll.above", "A {kind}, above the ±{typical_pct:g} % of a typical lens.", **values
    )


def _kind(pct: float) -> Sentence:
    return say("kind.barrel", "barrel") if pct < 0 else say("kind.pincushion", "pincushion")
