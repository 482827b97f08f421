"""What straight rolls of a ball or robot say about distortion: Eq. (9) of each, of zones of the picture, of the lens.

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
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.evaluate.distortion import bow_pct
from app.geometry import ImageSize, Points
from app.models.plumb_line import PlumbLens

SIDEWAYS = 1e-3  # of the picture's diagonal per s²: before rolls can be compared; slow balls on a pool table do 2e-3
LEAST_FOR_SIDEWAYS = 4  # rolls
MOST_SIDEWAYS = 8e-3  # of the diagonal per s²: more, and it is driven, or pushed; balls on a pool table do 1e-3 to 2e-3
HUBER = 2.0
SHAPE = 0.05  # of its bow that a lens of another kind may bow a line otherwise: no reason to leave a roll out
LEAST_PX = 0.1  # nor is this: a ball's middle is seen so well, but a pixel at a time
STEP = 1e-4
ROUNDS = 12
ANY_K = 0.4  # one standard deviation over all lenses there are
MOST_K = 0.9
LEAST_POINTS = 5
ZONES = 3  # to a side
ALONG = np.linspace(0, 1, 65)[:, None]


@dataclass(frozen=True)
class Roll:
    """One roll, by its number among those given. bow_pct: Eq. (9), signed about the picture's middle.

    sigma_pct: from its points' noise; spread_pct: also as far as spin and slope may have pushed it aside. used: it
    agrees with the others.
    """

    number: int
    length_px: float
    bow_px: float
    bow_pct: float
    sigma_pct: float
    spread_pct: float
    rms_px: float
    zone: tuple[int, int]
    used: bool


@dataclass(frozen=True, eq=False)
class Rolls:
    """What all of them say. border_pct ± border_sigma_pct: Eq. (9) along the picture's edge; lens: what undoes it."""

    rolls: tuple[Roll, ...]
    lens: PlumbLens
    k_sigma: float
    border_pct: float
    border_sigma_pct: float
    sideways_px: float  # per s²

    @property
    def is_free(self) -> bool:
        """Whether these were things that rolled by themselves: robots and hands go curves of their own."""
        size = self.lens.image_size
        return self.sideways_px <= MOST_SIDEWAYS * float(np.hypot(size.width, size.height))

    def to_json(self) -> dict[str, Any]:
        """Plain JSON; null where nothing is known."""
        return {"border_pct": _plain(self.border_pct), "border_sigma_pct": _plain(self.border_sigma_pct),
                "k": self.lens.terms[0], "k_sigma": _plain(self.k_sigma), "sideways_px": self.sideways_px,
                "free": self.is_free, "lens": self.lens.to_json(), "zones": zones(self.rolls),
                "rolls": [{"length_px": r.length_px, "bow_px": r.bow_px, "bow_pct": r.bow_pct,
                           "sigma_pct": r.sigma_pct, "spread_pct": r.spread_pct, "rms_px": r.rms_px,
                           "zone": list(r.zone), "used": r.used} for r in self.rolls]}


def rolls_of(points: Sequence[Points], seconds: Sequence[float], size: ImageSize) -> Rolls:
    """points: of each roll (n, 2) px, in order along it, of a picture of that size, raw or corrected; seconds it took.

    Without a roll σ is infinite. Rolls with fewer than five finite points are left out.
    """
    finite = [(p[np.isfinite(p).all(axis=1)], t) for p, t in zip(points, seconds, strict=True)]
    numbers = [i for i, (p, _) in enumerate(finite) if len(p) >= LEAST_POINTS and np.ptp(p, axis=0).max() > 1]
    usable = [finite[i] for i in numbers]
    sideways = SIDEWAYS * float(np.hypot(size.width, size.height))
    if not usable:
        return Rolls((), _lens(0.0, size), np.inf, 0.0, np.inf, sideways)
    tracks = [p for p, _ in usable]
    push = np.array([t for _, t in usable]) ** 2 / 8
    own = [_bow(p) for p in tracks]
    sigma = _pooled([b.rms_px for b in own], [len(p) for p in tracks]) * np.array([b.per_px for b in own])
    k, weight, gain = 0.0, np.ones(len(tracks)), np.ones(len(tracks))
    for _ in range(ROUNDS):
        bow = _bows(tracks, k, size)
        gain = (_bows(tracks, k + STEP, size) - _bows(tracks, k - STEP, size)) / (2 * STEP)
        spread = np.hypot(sigma, sideways * push)
        weight = np.minimum(1.0, HUBER * spread / np.maximum(np.abs(bow), 1e-12)) / spread**2
        move = -float((np.sum(weight * gain * bow) + k / ANY_K**2) / (np.sum(weight * gain**2) + 1 / ANY_K**2))
        k = float(np.clip(k + np.clip(move, -0.2, 0.2), -MOST_K, MOST_K))
        if len(tracks) >= LEAST_FOR_SIDEWAYS:
            sideways = _sideways(_bows(tracks, k, size), sigma, push)
    left, spread = _bows(tracks, k, size), np.hypot(sigma, sideways * push)
    # Rolls that disagree by more than that can explain make the answer as much less sure (R. Birge, 1932).
    birge = np.sqrt(np.sum(weight * left**2) / max(len(tracks) - 1, 1))
    few = np.sqrt(1 + 2 / len(tracks))  # σ that was itself told by a few rolls
    told = weight * gain**2
    k_sigma = float(few * max(1.0, birge) / np.sqrt(told.sum() + 1 / ANY_K**2))
    # One roll that carries the answer alone may have been a hand: what it would be without each (linear jackknife).
    without = weight * gain * left / np.maximum(told.sum() - told + 1 / ANY_K**2, 1e-12)
    k_sigma = max(k_sigma, float(np.sqrt((len(tracks) - 1) / len(tracks) * np.sum(without**2))))
    agrees = np.abs(left) <= 3 * np.sqrt(spread**2 + (SHAPE * gain * k) ** 2 + LEAST_PX**2)
    rolls = tuple(_roll(*each, size, bool(used)) for *each, used in
                  zip(numbers, tracks, own, sigma, spread, agrees, strict=True))
    by_k = (border_pct(k + STEP, size) - border_pct(k - STEP, size)) / (2 * STEP)
    return Rolls(rolls, _lens(k, size), k_sigma, border_pct(k, size), abs(by_k) * k_sigma, sideways)


def border_pct(k: float, size: ImageSize) -> float:
    """Eq. (9) of the straight line along the picture's long edge, as a lens of that k shows it."""
    lens, along_x = _lens(k, size), size.width >= size.height
    ends = np.array([[0.0, 0.0], [size.width - 1, 0.0] if along_x else [0.0, size.height - 1]])
    straight = lens.straight_from_raw(ends)
    raw = lens.raw_from_straight(straight[:1] * (1 - ALONG) + straight[1:] * ALONG)
    return bow_pct(raw, np.array(size.centre))


def zones(rolls: Sequence[Roll]) -> list[list[dict[str, float] | None]]:
    """Eq. (9) by the ninth of the picture in which a roll's middle lies, weighted; None where nothing rolled."""
    def told(row: int, column: int) -> dict[str, float] | None:
        here = [r for r in rolls if r.zone == (column, row) and r.used]
        if not here:
            return None
        weight = np.array([1 / max(r.spread_pct, 1e-6) ** 2 for r in here])
        return {"pct": float(np.average([r.bow_pct for r in here], weights=weight)),
                "sigma_pct": float(1 / np.sqrt(weight.sum())), "rolls": len(here)}
    return [[told(row, column) for column in range(ZONES)] for row in range(ZONES)]


def _lens(k: float, size: ImageSize) -> PlumbLens:
    return PlumbLens("division", (k,), size.centre, size)


def _bows(tracks: Sequence[Points], k: float, size: ImageSize) -> NDArray[np.float64]:
    lens = _lens(k, size)
    return np.array([_bow(lens.straight_from_raw(p)).px for p in tracks])


@dataclass(frozen=True)
class _Bow:
    """Of a parabola across a roll's chord: its height; that height's σ for noise of 1 px; rms about it; length."""

    px: float
    per_px: float
    rms_px: float
    length_px: float


def _bow(points: Points) -> _Bow:
    about = points - points.mean(axis=0)
    direction = points[-1] - points[0]
    direction = direction / max(float(np.hypot(*direction)), 1e-12)
    u, v = about @ direction, about @ np.array([direction[1], -direction[0]])
    half = max(float(np.ptp(u)) / 2, 1e-9)
    design = np.stack([np.ones_like(u), u / half, (u / half) ** 2], axis=1)
    terms = np.linalg.lstsq(design, v, rcond=None)[0]
    rms = float(np.sqrt(np.sum((v - design @ terms) ** 2) / max(len(v) - 3, 1)))
    sigma = float(np.sqrt(np.linalg.pinv(design.T @ design)[2, 2]))
    return _Bow(-float(terms[2]), sigma, rms, 2 * half)


def _pooled(rms: Sequence[float], counts: Sequence[int]) -> NDArray[np.float64]:
    """Each roll's noise, px, drawn towards that of all: a short roll hardly knows its own."""
    own, freedom = np.array(rms), np.maximum(np.array(counts) - 3.0, 1.0)
    everyone = float(np.median(own))
    return np.sqrt((freedom * own**2 + 10 * everyone**2) / (freedom + 10)) + 1e-3


def _sideways(left: NDArray, sigma: NDArray, push: NDArray) -> float:
    """px/s² so that the bows that are left are as large as they should be; by medians, so that a few do not count."""
    each = np.sqrt(np.maximum(left**2 / 0.6745**2 * len(left) / (len(left) - 1) - sigma**2, 0.0)) / push
    return float(np.median(each))


def _roll(number: int, points: Points, bow: _Bow, sigma: float, spread: float, size: ImageSize, used: bool) -> Roll:
    chord = points[-1] - points[0]
    left = np.array([chord[1], -chord[0]])  # of its way, as y points down
    inwards = 1.0 if (np.array(size.centre) - points.mean(axis=0)) @ left > 0 else -1.0
    middle = (points[0] + points[-1]) / 2
    zone = tuple(int(v) for v in np.clip(middle / (size.width, size.height) * ZONES, 0, ZONES - 1))
    pct = 100 / bow.length_px
    return Roll(number, bow.length_px, bow.px, pct * bow.px * inwards, pct * sigma, pct * spread, bow.rms_px,
                (zone[0], zone[1]), used)


def _plain(value: float) -> float | None:
    return value if np.isfinite(value) else None
