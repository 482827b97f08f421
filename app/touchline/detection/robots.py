"""Robots by the pattern that they wear: four dots around a team's dot, or patches of their own beside the team's.

**Small Size League.** Around each dot of a team's colour a ring is read for pink and green at the height of the robots'
tops; the turn at which four dots fit best is refined by their middles, and each dot's colour gives a digit of the
number. How much of the two colours is in a pixel:

    p = a · first + b · second + k · grey        three channels, three unknowns: shade and hull go into k

All robots of a frame are measured together: leading axis n.

**Small leagues.** The direction from the team's patch to the robot's own patches gives the front, and their colours,
counted from the left as the robot looks, the number.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from touchline.core.geometry import Array, Points
from touchline.core.options import Option
from touchline.core.ssl_pattern import (
    DOT_ANGLES,
    DOT_MM,
    DOTS_AT_MM,
    DOTS_MM,
    NUMBER_OF,
    TEAM_DOT_MM,
)
from touchline.detection.blobs import Blobs
from touchline.detection.colours import as_bgr
from touchline.detection.profile import NAMES, Bgr
from touchline.detection.records import Detection
from touchline.detection.stages import FrameState, Stage, StageContext

_ANGLES = 72  # around the ring
_TURNS = 360  # orientations that are tried
_RINGS_MM = (53.0, 59.0, 65.0, 71.0, 77.0)
_AROUND_MM = 27.0  # a dot and its rim; the next dot's rim begins at 50
_MAX_HALF_PX = 16  # finer pictures are thinned
_DOT_AREA_MM2 = np.pi * (DOT_MM / 2) ** 2
_TEAM_WEIGHT = 1.5  # of the middle dot in the fit: it is larger


@dataclass(frozen=True, eq=False)
class Patterns:
    """n patterns. middle (n, 2) mm beside the place that was given. turn (n,) rad. rest_mm (n,): rms of five dots.

    green (n, 4) which dots are of the second colour. sure (n, 4): 0…1. cover (n, 4): a whole dot is 1.
    """

    middle: Points
    turn: Array
    rest_mm: Array
    green: NDArray[np.bool_]
    sure: Array
    cover: Array


def unmixing(first: Bgr, second: Bgr, light: Bgr = (1.0, 1.0, 1.0)) -> Array:
    """(2, 3): the shares a and b of a pixel's BGR. light: by which the colours, and grey, have changed since."""
    mixed = np.stack([first, second, (128.0,) * 3], axis=-1) * np.array(light)[:, None]
    return np.linalg.inv(mixed)[:2].astype(np.float32)


def patterns_at(
    pixels: NDArray[np.uint8], middles: Points, mm_per_px: Array, unmix: Array
) -> Patterns:
    """Of robots whose team's dots are at middles (n, 2) px; mm_per_px (n, 2, 2) there."""
    px_per_mm = np.asarray(np.linalg.inv(mm_per_px), np.float64)
    shares = _ring(pixels, middles, px_per_mm, unmix)
    turn = _turned(shares.sum(axis=-1))
    dots, totals, scale = _dots(pixels, middles, mm_per_px, px_per_mm, turn, unmix)
    middle, turn, rest = _fitted(dots, totals.sum(axis=-1) > 0)
    whole = totals.sum(axis=-1)
    first, second = totals[..., 0], totals[..., 1]
    # of the four dots' area
    present = np.minimum(np.median(whole, axis=1) * scale / (0.35 * _DOT_AREA_MM2), 1)
    return Patterns(
        middle,
        turn,
        rest,
        second > first,
        np.abs(second - first) / np.maximum(whole, 1e-9),
        whole / np.maximum(np.median(whole, axis=1), 1e-9)[:, None] * present[:, None],
    )


def _sample(pixels: NDArray[np.uint8], at: Points, unmix: Array) -> Array:
    """Shares (..., 2), not below 0, of the pixels next to (..., 2) px."""
    h, w = pixels.shape[:2]
    x, y = (np.rint(at[..., i]).astype(np.int32) for i in (0, 1))
    inside = (x >= 0) & (x < w) & (y >= 0) & (y < h)
    sampled = pixels.reshape(-1, 3)[np.where(inside, y * w + x, 0)].astype(np.float32)
    return np.maximum(sampled @ unmix.T, 0) * inside[..., None]


def _ring(pixels: NDArray[np.uint8], middles: Points, px_per_mm: Array, unmix: Array) -> Array:
    """(n, angles, 2) mean shares at each angle."""
    angle = np.arange(_ANGLES) * (2 * np.pi / _ANGLES)
    away = np.stack([np.cos(angle), np.sin(angle)], -1)[:, None] * np.array(_RINGS_MM)[:, None]
    at = middles[:, None] + (away.reshape(-1, 2) @ px_per_mm.transpose(0, 2, 1))
    return _sample(pixels, at, unmix).reshape(len(middles), _ANGLES, len(_RINGS_MM), 2).mean(axis=2)


def _template() -> Array:
    """(angles, turns): where dots are for each turn, without its mean, so that no brightness wins."""
    angle = np.arange(_ANGLES)[:, None] * (2 * np.pi / _ANGLES)
    turn = np.arange(_TURNS) * (2 * np.pi / _TURNS)
    half = np.arcsin(DOT_MM / 2 / DOTS_AT_MM)
    near = np.zeros((_ANGLES, _TURNS))
    for dot in DOT_ANGLES:
        off = np.abs((angle - turn - dot + np.pi) % (2 * np.pi) - np.pi)
        near = np.maximum(near, np.sqrt(np.clip(1 - (off / half) ** 2, 0, None)))
    return near - near.mean(axis=0)


_TEMPLATE = _template()


def _turned(cover: Array) -> Array:
    """(n,) the turn at which four dots fit the ring's shares (n, angles) best."""
    # A dot that is twice as bright is no more of a dot.
    level = np.minimum(cover / np.maximum(np.quantile(cover, 0.8, axis=1), 1e-6)[:, None], 1.2)
    return np.argmax(level @ _TEMPLATE, axis=1) * (2 * np.pi / _TURNS)


def _dots(
    pixels: NDArray[np.uint8],
    middles: Points,
    mm_per_px: Array,
    px_per_mm: Array,
    turn: Array,
    unmix: Array,
) -> tuple[Points, Array, Array]:
    """Middles of the four dots, (n, 4, 2) mm beside the place; shares of each, (n, 4, 2); mm² a sample, (n,)."""
    c, s = np.cos(turn)[:, None], np.sin(turn)[:, None]
    ahead, left = np.array(DOTS_MM).T
    expected = np.stack([c * ahead - s * left, s * ahead + c * left], axis=-1)  # (n, 4, 2) mm
    at = np.rint(middles[:, None] + expected @ px_per_mm.transpose(0, 2, 1))
    scale = np.sqrt(np.abs(np.linalg.det(mm_per_px)))
    half = int(np.ceil(_AROUND_MM / max(float(np.median(scale)), 1e-3))) + 1
    step = max(1, -(-half // _MAX_HALF_PX))
    offsets = np.arange(-half, half + 1, step)
    grid = np.stack(np.meshgrid(offsets, offsets), -1).reshape(-1, 2)
    grid = grid[(grid**2).sum(axis=1) <= (half + 0.5) ** 2]
    # (n, 4, k, 2), of whole pixels
    share = _sample(pixels, (at[:, :, None] + grid).astype(np.float32), unmix)
    # A place is the window's middle and a step from there: two small products in place of one for each pixel.
    base = (at - middles[:, None]) @ mm_per_px.transpose(0, 2, 1)
    away = (grid @ mm_per_px.transpose(0, 2, 1)).astype(np.float32)[:, None]  # (n, 1, k, 2)
    off = (base - expected).astype(np.float32)[:, :, None]
    near = ((away + off) ** 2).sum(axis=-1) <= _AROUND_MM**2
    share *= near[..., None]
    weight = share.sum(axis=-1)
    # Grain on the hull weighs a little everywhere, and would pull each middle to the window's.
    weight = np.maximum(weight - 0.25 * weight.max(axis=-1, keepdims=True), 0)
    total = weight.sum(axis=-1, keepdims=True)
    found = base + np.matmul(weight[..., None, :], np.broadcast_to(away, (*weight.shape, 2)))[
        ..., 0, :
    ] / np.maximum(total, 1e-9)
    return np.where(total > 1e-6, found, expected), share.sum(axis=2), scale**2 * step**2


def _fitted(dots: Points, there: NDArray[np.bool_]) -> tuple[Points, Array, Array]:
    """The turn and the middle that bring the pattern onto the dots; rms of what is left, mm."""
    n = len(dots)
    model = np.concatenate([np.array(DOTS_MM), np.zeros((1, 2))])
    observed = np.concatenate([dots, np.zeros((n, 1, 2))], axis=1)
    weight = np.concatenate([there.astype(float), np.full((n, 1), _TEAM_WEIGHT)], axis=1)
    total = weight.sum(axis=1)
    from_model = np.einsum("nd,di->ni", weight, model) / total[:, None]
    from_seen = np.einsum("nd,ndi->ni", weight, observed) / total[:, None]
    a, b = model - from_model[:, None], observed - from_seen[:, None]
    dot = (weight * (a * b).sum(-1)).sum(-1)
    cross = (weight * (a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])).sum(-1)
    turn = np.arctan2(cross, dot)
    c, s = np.cos(turn), np.sin(turn)
    spin = np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], axis=-2)
    middle = from_seen - np.einsum("nij,nj->ni", spin, from_model)
    rest = observed - middle[:, None] - np.einsum("nij,dj->ndi", spin, model)
    return middle, turn, np.sqrt((weight * (rest**2).sum(-1)).sum(-1) / total)


TEAMS = ("yellow", "blue")
_TEAM_DOT_MM2 = np.pi * (TEAM_DOT_MM / 2) ** 2
_APART_MM = 120.0  # two robots are never nearer than 180
_HALF_THERE = 0.35  # of a dot's usual share: less is hidden
_MAX_ROBOTS = 64


class SslRobots(Stage):
    NAME: ClassVar = "butterfly"
    TITLE: ClassVar = "Butterfly patterns"
    HELP: ClassVar = (
        "Detects robots by the five dots of the Small Size League, with number and orientation."
    )
    OPTIONS: ClassVar = (
        Option(
            "least_size",
            "float",
            0.3,
            "Smallest area of a team's dot, as a share of its expected area.",
            (0.05, 1),
        ),
        Option(
            "most_size",
            "float",
            2.0,
            "Largest area of a team's dot, as a share of its expected area.",
            (1, 10),
        ),
        Option(
            "rest_mm",
            "float",
            9.0,
            "Largest distance of the dots from their expected positions, rms.",
            (1, 40),
            "mm",
        ),
        Option(
            "sure",
            "float",
            0.25,
            "A dot is classified as pink or green if one exceeds the other by this share.",
            (0, 1),
        ),
    )

    def __init__(self, options: Mapping[str, Any], context: StageContext) -> None:
        super().__init__(options, context)
        self._pink, self._green = (_usual(context, name) for name in ("pink", "green"))

    def run(self, state: FrameState) -> FrameState:
        teams = {state.colours.index(name) + 1: name for name in TEAMS if name in state.colours}
        blobs = state.blobs.only(np.isin(state.blobs.colour, list(teams)))
        if not len(blobs):
            return state
        tops_mm = self._context.robot_tops_mm(teams[colour] for colour in blobs.colour.tolist())
        places, mm_per_px = self._context.view.spread(blobs.middle, tops_mm)
        area_mm2 = blobs.area * np.abs(np.linalg.det(np.nan_to_num(mm_per_px)))
        low, high = (self._options[name] * _TEAM_DOT_MM2 for name in ("least_size", "most_size"))
        fits = np.isfinite(places).all(axis=1) & (area_mm2 >= low) & (area_mm2 <= high)
        fits[np.flatnonzero(fits)[_MAX_ROBOTS * 4 :]] = False
        if not fits.any():
            return state
        blobs, places, mm_per_px, tops_mm = (
            blobs.only(fits),
            places[fits],
            mm_per_px[fits],
            tops_mm[fits],
        )
        found = patterns_at(
            state.clean, blobs.middle, mm_per_px, unmixing(self._pink, self._green, state.light)
        )
        chosen = self._without_overlaps(found, places)
        px_per_mm = np.linalg.inv(mm_per_px)
        middles = blobs.middle + np.einsum("nij,nj->ni", px_per_mm, found.middle)
        return state.with_found(
            *(
                self._robot(
                    found, i, teams[int(blobs.colour[i])], middles[i], blobs, float(tops_mm[i])
                )
                for i in chosen
            )
        )

    def _without_overlaps(self, found: Patterns, places: np.ndarray) -> list[int]:
        """Return the patterns with three dots or more where they belong; of two that would overlap, the better."""
        there = (found.cover > _HALF_THERE).sum(axis=1)
        good = np.flatnonzero((there >= 3) & (found.rest_mm <= self._options["rest_mm"]))
        at = places + found.middle
        chosen: list[int] = []
        for i in good[np.argsort(found.rest_mm[good])]:
            if all(np.hypot(*(at[i] - at[j])) > _APART_MM for j in chosen):
                chosen.append(int(i))
        return chosen[:_MAX_ROBOTS]

    def _robot(
        self, found: Patterns, i: int, team: str, middle: np.ndarray, blobs: Blobs, z_mm: float
    ) -> Detection:
        readable = bool(
            (found.cover[i] > _HALF_THERE).all() and found.sure[i].min() >= self._options["sure"]
        )
        number = NUMBER_OF[tuple(bool(g) for g in found.green[i])] if readable else None
        fit = float(np.exp(-((found.rest_mm[i] / self._options["rest_mm"]) ** 2)))
        confidence = fit * float(np.clip(found.sure[i].min(), 0, 1)) if readable else 0.5 * fit
        # Five dots, each off by what is left on average, at 65 mm from the middle.
        sigma = max(float(found.rest_mm[i]), 0.5) / (np.sqrt(4) * 65)
        turn = float((found.turn[i] + np.pi) % (2 * np.pi) - np.pi)
        return Detection(
            "robot",
            (float(middle[0]), float(middle[1])),
            team,
            number,
            z_mm=z_mm,
            orientation_rad=turn,
            confidence=confidence,
            orientation_sigma_rad=float(sigma),
            area_px=float(blobs.area[i]),
        )


def _usual(context: StageContext, name: str) -> Bgr:
    """A colour's middle sample, or how it usually looks."""
    samples = context.profile.colours.get(name)
    return as_bgr(np.mean([s.bgr for s in samples], axis=0)) if samples else NAMES[name]


OWN = tuple(name for name in NAMES if name not in ("orange", "yellow", "blue"))
_TURNED_RAD = 0.012  # a tenth of a pixel at each end of a tag of a dozen pixels


class PatchRobots(Stage):
    NAME: ClassVar = "tags"
    TITLE: ClassVar = "Two-colour tags"
    HELP: ClassVar = (
        "Detects small robots by a team's patch and the robot's own colours next to it."
    )
    OPTIONS: ClassVar = (
        Option("teams", "names", ("yellow", "blue"), "The teams' colours.", choices=tuple(NAMES)),
        Option(
            "numbers",
            "names",
            ("green", "pink", "cyan", "purple", "red"),
            "The robot's own colours in the order of the numbers from 0. With two own patches, the number is first "
            "· count + second.",
            choices=OWN,
        ),
        Option(
            "patches",
            "choice",
            "1",
            "Number of patches of its own that a robot has.",
            choices=("1", "2"),
        ),
        Option(
            "apart_mm",
            "float",
            37.0,
            "Distance from the centre of the team's patch to the centre of the robot's own patch.",
            (5, 200),
            "mm",
        ),
        Option("slack", "float", 0.45, "Tolerance of that distance, as a share.", (0.05, 1)),
        Option(
            "front_deg",
            "float",
            90.0,
            "Direction of the front, counter-clockwise from the direction to the "
            "robot's own patch.",
            (-180, 180),
            "°",
        ),
    )

    def run(self, state: FrameState) -> FrameState:
        z_mm, blobs = self._context.robot_z_mm, state.blobs
        if not len(blobs):
            return state
        places, mm_per_px = self._context.view.spread(blobs.middle, z_mm)
        team = _numbers_of(state, self._options["teams"])
        own = _numbers_of(state, self._options["numbers"])
        teams = [i for i in range(len(blobs)) if int(blobs.colour[i]) in team]
        others = np.array([i for i in range(len(blobs)) if int(blobs.colour[i]) in own], np.intp)
        found, taken = [], set()
        # The surest first: where robots touch, a patch belongs to the nearer one.
        for i in sorted(teams, key=lambda i: self._misfit(places, i, others)):
            free = np.array([j for j in others if j not in taken], np.intp)
            mine = self._own(places, i, free)
            if mine is None:
                continue
            taken.update(mine)
            found.append(self._robot(state, blobs, places, mm_per_px, i, mine, own))
        return state.with_found(*found)

    def _misfit(self, places: np.ndarray, i: int, others: np.ndarray) -> float:
        return float(
            np.min(np.abs(_away(places, i, others) - self._options["apart_mm"]), initial=np.inf)
        )

    def _own(self, places: np.ndarray, i: int, free: np.ndarray) -> list[int] | None:
        """The patches at the right distance, or None."""
        apart, slack, count = (
            self._options["apart_mm"],
            self._options["slack"],
            int(self._options["patches"]),
        )
        off = np.abs(_away(places, i, free) - apart)
        near = [
            int(j)
            for j in free[np.argsort(off)][:count]
            if abs(_away(places, i, j) - apart) <= slack * apart
        ]
        return near if len(near) == count else None

    def _robot(
        self,
        state: FrameState,
        blobs: Blobs,
        places: np.ndarray,
        mm_per_px: np.ndarray,
        i: int,
        mine: list[int],
        own: dict[int, int],
    ) -> Detection:
        way = places[mine].mean(axis=0) - places[i]
        turn = np.arctan2(way[1], way[0]) + np.radians(self._options["front_deg"])
        # From the robot's left to its right.
        left = np.array([-np.sin(turn), np.cos(turn)])
        ordered = sorted(mine, key=lambda j: -float((places[j] - places[i]) @ left))
        number = 0
        for j in ordered:
            number = number * len(self._options["numbers"]) + own[int(blobs.colour[j])]
        middle = (blobs.middle[i] + blobs.middle[mine].mean(axis=0)) / 2
        fit = 1 - abs(np.hypot(*way) - self._options["apart_mm"]) / self._options["apart_mm"]
        scale = float(np.sqrt(abs(np.linalg.det(mm_per_px[i]))))
        return Detection(
            "robot",
            (float(middle[0]), float(middle[1])),
            state.colours[int(blobs.colour[i]) - 1],
            int(number),
            z_mm=self._context.robot_z_mm,
            orientation_rad=float((turn + np.pi) % (2 * np.pi) - np.pi),
            confidence=float(np.clip(fit, 0, 1)),
            orientation_sigma_rad=float(
                np.hypot(_TURNED_RAD, 0.15 * scale / self._options["apart_mm"])
            ),
            area_px=float(blobs.area[[i, *mine]].sum()),
        )


def _numbers_of(state: FrameState, names: tuple[str, ...]) -> dict[int, int]:
    """Which place among the names each of the table's numbers has."""
    return {
        state.colours.index(name) + 1: place
        for place, name in enumerate(names)
        if name in state.colours
    }


def _away(places: np.ndarray, i: int, others: Any) -> np.ndarray:
    return np.linalg.norm(places[others] - places[i], axis=-1)
