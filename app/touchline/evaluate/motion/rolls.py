"""Distortion from straight rolls of a ball or robot: Eq. (9) of each, of zones of the picture, of the lens.

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

from touchline.core.geometry import Array, ImageSize, Indices, Points
from touchline.core.json_values import nullable
from touchline.evaluate.fit.distortion import sag_pct
from touchline.fitting.plumb_line.problem import Chains
from touchline.models.distortion import Distortion

SIDEWAYS = 1e-3  # of the picture's diagonal per s²: before rolls can be compared; slow balls on a pool table do 2e-3
MIN_FOR_SIDEWAYS = 4  # rolls
MAX_SIDEWAYS = 8e-3  # of the diagonal per s²: more, and it is driven, or pushed; balls on a pool table do 1e-3 to 2e-3
HUBER = 2.0
SHAPE = 0.05  # of its bow that a lens of another kind may bow a line otherwise: no reason to leave a roll out
MIN_PX = 0.1  # nor is this: a ball's middle is seen so well, but a pixel at a time
STEP = 1e-4
ROUNDS = 12
ANY_K = 0.4  # one standard deviation over all lenses there are
MAX_K = 0.9
MIN_POINTS = 5
ZONES = 3  # to a side
ALONG = np.linspace(0, 1, 65)[:, None]


@dataclass(frozen=True)
class Roll:
    """One roll, by its number among those given. sag_pct: Eq. (9), signed about the picture's middle.

    sigma_pct: from its points' noise; spread_pct: also as far as spin and slope may have pushed it aside. used: it
    agrees with the others.
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
    """Result of all rolls. border_pct ± border_sigma_pct: Eq. (9) along the picture's edge; lens: what undoes it."""

    rolls: tuple[Roll, ...]
    lens: Distortion
    k_sigma: float
    border_pct: float
    border_sigma_pct: float
    sideways_px: float  # per s²

    @property
    def is_free(self) -> bool:
        """Whether these were things that rolled by themselves: robots and hands go curves of their own."""
        size = self.lens.image_size
        return self.sideways_px <= MAX_SIDEWAYS * float(np.hypot(size.width, size.height))

    def to_json(self) -> dict[str, Any]:
        """Plain JSON; null where nothing is known."""
        return {"border_pct": nullable(self.border_pct), "border_sigma_pct": nullable(self.border_sigma_pct),
                "k": self.lens.terms[0], "k_sigma": nullable(self.k_sigma), "sideways_px": self.sideways_px,
                "free": self.is_free, "lens": self.lens.to_json(), "zones": zones(self.rolls),
                "rolls": [{"length_px": r.length_px, "bow_px": r.sag_px, "bow_pct": r.sag_pct,
                           "sigma_pct": r.sigma_pct, "spread_pct": r.spread_pct, "rms_px": r.rms_px,
                           "zone": list(r.zone), "used": r.used} for r in self.rolls]}


def analyse_rolls(points: Sequence[Points], seconds: Sequence[float], size: ImageSize) -> RollAnalysis:
    """points: of each roll (n, 2) px, in order along it, of a picture of that size, raw or corrected; seconds it took.

    Without a roll σ is infinite. Rolls with fewer than five finite points are left out.
    """
    finite = [(p[np.isfinite(p).all(axis=1)], t) for p, t in zip(points, seconds, strict=True)]
    numbers = [i for i, (p, _) in enumerate(finite) if len(p) >= MIN_POINTS and np.ptp(p, axis=0).max() > 1]
    usable = [finite[i] for i in numbers]
    sideways = SIDEWAYS * float(np.hypot(size.width, size.height))
    if not usable:
        return RollAnalysis((), _lens(0.0, size), np.inf, 0.0, np.inf, sideways)
    tracks = [p for p, _ in usable]
    push = np.array([t for _, t in usable]) ** 2 / 8
    all_of = _Tracks(tracks)
    own = all_of.bows(all_of.chains.pixels)
    sigma = _pooled(own.rms_px, all_of.counts) * own.per_px
    k, weight, gain = 0.0, np.ones(len(tracks)), np.ones(len(tracks))
    for _ in range(ROUNDS):
        bow = all_of.under(k, size)
        gain = (all_of.under(k + STEP, size) - all_of.under(k - STEP, size)) / (2 * STEP)
        spread = np.hypot(sigma, sideways * push)
        weight = np.minimum(1.0, HUBER * spread / np.maximum(np.abs(bow), 1e-12)) / spread**2
        move = -float((np.sum(weight * gain * bow) + k / ANY_K**2) / (np.sum(weight * gain**2) + 1 / ANY_K**2))
        k = float(np.clip(k + np.clip(move, -0.2, 0.2), -MAX_K, MAX_K))
        if len(tracks) >= MIN_FOR_SIDEWAYS:
            sideways = _sideways(all_of.under(k, size), sigma, push)
    left, spread = all_of.under(k, size), np.hypot(sigma, sideways * push)
    # Rolls that disagree by more than that can explain make the answer as much less sure (R. Birge, 1932).
    birge = np.sqrt(np.sum(weight * left**2) / max(len(tracks) - 1, 1))
    few = np.sqrt(1 + 2 / len(tracks))  # σ that was itself told by a few rolls
    information = weight * gain**2
    k_sigma = float(few * max(1.0, birge) / np.sqrt(information.sum() + 1 / ANY_K**2))
    # One roll that carries the answer alone may have been a hand: what it would be without each (linear jackknife).
    without = weight * gain * left / np.maximum(information.sum() - information + 1 / ANY_K**2, 1e-12)
    k_sigma = max(k_sigma, float(np.sqrt((len(tracks) - 1) / len(tracks) * np.sum(without**2))))
    agrees = np.abs(left) <= 3 * np.sqrt(spread**2 + (SHAPE * gain * k) ** 2 + MIN_PX**2)
    rolls = tuple(_roll(number, tracks[i], (own.px[i], own.length_px[i], own.rms_px[i], sigma[i], spread[i]), size,
                        bool(agrees[i])) for i, number in enumerate(numbers))
    by_k = (border_pct(k + STEP, size) - border_pct(k - STEP, size)) / (2 * STEP)
    return RollAnalysis(rolls, _lens(k, size), k_sigma, border_pct(k, size), abs(by_k) * k_sigma, sideways)


def border_pct(k: float, size: ImageSize) -> float:
    """Eq. (9) of the straight line along the picture's long edge, as a lens of that k shows it."""
    lens, along_x = _lens(k, size), size.width >= size.height
    ends = np.array([[0.0, 0.0], [size.width - 1, 0.0] if along_x else [0.0, size.height - 1]])
    straight = lens.undistorted_from_raw(ends)
    raw = lens.raw_from_undistorted(straight[:1] * (1 - ALONG) + straight[1:] * ALONG)
    return sag_pct(raw, np.array(size.centre))


def zones(rolls: Sequence[Roll]) -> list[list[dict[str, float] | None]]:
    """Eq. (9) by the ninth of the picture in which a roll's middle lies, weighted; None where nothing rolled."""
    def zone(row: int, column: int) -> dict[str, float] | None:
        here = [r for r in rolls if r.zone == (column, row) and r.used]
        if not here:
            return None
        weight = np.array([1 / max(r.spread_pct, 1e-6) ** 2 for r in here])
        return {"pct": float(np.average([r.sag_pct for r in here], weights=weight)),
                "sigma_pct": float(1 / np.sqrt(weight.sum())), "rolls": len(here)}
    return [[zone(row, column) for column in range(ZONES)] for row in range(ZONES)]


def _lens(k: float, size: ImageSize) -> Distortion:
    return Distortion("division", (k,), size.centre, size)


class _Tracks:
    """Several tracks, one after the other, so that one look measures the bows of all."""

    def __init__(self, tracks: Sequence[Points]) -> None:
        self.chains = Chains.of(tracks)
        self.counts = self.chains.counts

    def bows(self, points: Points) -> "_Bows":
        """Of the tracks with their points there instead, (n, 2) px."""
        owner, starts, sums = self.chains.owner, self.chains.starts, self.chains.sums
        about = points - (sums(points) / self.counts[:, None])[owner]
        chord = points[starts + self.counts - 1] - points[starts]
        way = (chord / np.maximum(np.hypot(*chord.T), 1e-12)[:, None])[owner]
        u, v = np.sum(about * way, axis=1), about[:, 0] * way[:, 1] - about[:, 1] * way[:, 0]
        length = np.maximum.reduceat(u, starts) - np.minimum.reduceat(u, starts)
        t = u / np.maximum(length / 2, 1e-9)[owner]
        design = np.stack([np.ones_like(t), t, t**2], axis=1)
        inverse = np.linalg.pinv(sums(design[:, :, None] * design[:, None, :]), hermitian=True)
        terms = np.einsum("nij,nj->ni", inverse, sums(design * v[:, None]))
        off = v - np.sum(design * terms[owner], axis=1)
        rms = np.sqrt(sums(off**2) / np.maximum(self.counts - 3, 1))
        return _Bows(-terms[:, 2], np.sqrt(np.maximum(inverse[:, 2, 2], 0.0)), rms, np.maximum(length, 2e-9))

    def under(self, k: float, size: ImageSize) -> Array:
        """Their bows, px, once a lens of that k is undone."""
        return self.bows(_lens(k, size).undistorted_from_raw(self.chains.pixels)).px


@dataclass(frozen=True, eq=False)
class _Bows:
    """Of a parabola across each chord, (n,): its height; that height's σ for noise of 1 px; rms about it; length."""

    px: Array
    per_px: Array
    rms_px: Array
    length_px: Array


def _pooled(own: Array, counts: Indices) -> Array:
    """Each roll's noise, px, drawn towards that of all: a short roll hardly knows its own."""
    freedom = np.maximum(counts - 3.0, 1.0)
    everyone = float(np.median(own))
    return np.sqrt((freedom * own**2 + 10 * everyone**2) / (freedom + 10)) + 1e-3


def _sideways(left: Array, sigma: Array, push: Array) -> float:
    """px/s² so that the bows that are left are as large as they should be; by medians, so that a few do not count."""
    each = np.sqrt(np.maximum(left**2 / 0.6745**2 * len(left) / (len(left) - 1) - sigma**2, 0.0)) / push
    return float(np.median(each))


def _roll(number: int, points: Points, information: tuple[float, ...], size: ImageSize, used: bool) -> Roll:
    """information: its bow, length, rms, σ by noise and by all, px."""
    px, length, rms, sigma, spread = map(float, information)
    chord = points[-1] - points[0]
    left = np.array([chord[1], -chord[0]])  # of its way, as y points down
    inwards = 1.0 if (np.array(size.centre) - points.mean(axis=0)) @ left > 0 else -1.0
    middle = (points[0] + points[-1]) / 2
    zone = tuple(int(v) for v in np.clip(middle / (size.width, size.height) * ZONES, 0, ZONES - 1))
    pct = 100 / length
    return Roll(number, length, px, pct * px * inwards, pct * sigma, pct * spread, rms, (zone[0], zone[1]), used)
