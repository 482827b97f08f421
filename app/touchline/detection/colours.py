"""The colours of a venue: which one a pixel has, learnt from clicks or from the picture alone; how well they differ.

**Lookup table** over all pixels: 5 bits of blue, 6 of green, 5 of red. A pixel is classified by its chroma, which is
the same in light and in shade, and less by its brightness:

    s = b + g + r + 3 c        u = (r - g) / s        v = (r + g - 2 b) / (2 s)        L = ln s

The distance to a sample is d² = (Δu² + Δv²) / σ² + (ΔL / λ)², where σ² = (usual + spread)² + (grain / s)²: what is
dark is known less well. A pixel is of the colour of the nearest sample if that is within reach, and nearer by a margin
than any sample of another colour or of the background.

**From clicks or boxes.** Around a click the patch of like pixels is one sample: its mean, and how much its chroma
varies. What a picture mostly consists of, away from the clicked colours, is the background: its own clusters, so that
the carpet need not be clicked.

**From the picture alone.** Each colour is its densest chroma near where the leagues have it. The ball and the teams'
colours are looked for among all that is no background; pink and green on the hulls only, around what has a team's
colour: a carpet is green as well.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import BadInput
from touchline.core.statements import Sentence, capitalised, say, stated
from touchline.detection.blobs import Blobs, runs_of
from touchline.detection.profile import (
    MAX_SAMPLES,
    NAMES,
    Bgr,
    ColourProfile,
    ColourSample,
    colour_name,
)

CODES = 1 << 16
Table = NDArray[np.uint8]  # (65536,) the number of a colour, from 1; 0 is none
_DARK = 12.0  # c: grey levels that a sensor shows of black, so that noise in the dark has no colour
_CHROMA = 0.045  # how much chroma varies over a patch, by lamps and by the sensor
_GRAIN = 4.0  # grey levels, of noise and of the table's own steps
_BRIGHTNESS = 0.5  # λ: half as bright is 1.4 spreads
# ln: no colour is less than 0.29 or more than 2.2 times as bright as its sample
_DARKER, _BRIGHTER = -1.25, 0.8
_GUESSED = 2.0  # spreads²: a predicted colour gives way to a sampled one
_CLIPPED = 1.5  # what is this much brighter than its sample may be burnt out in a channel

Picture = NDArray[np.uint8]
Click = tuple[float, float]
Box = tuple[float, float, float, float]  # x0, y0, x1, y1 px
BACKGROUND = "background"
_ALIKE = 22  # grey levels from the clicked pixel, each channel
_REACH_PX = 12  # a click's patch goes no further
_MIN_ALIKE = 5  # pixels; else the click's own 3 × 3
_CLUSTERS, _STRIDE_PIXELS, _MIN_SHARE = 10, 20_000, 0.01
OUTSIDE_REACH = 2.0  # spreads: nearer to a clicked colour, a cluster is that colour

_TEAMS, _ON_HULLS = ("yellow", "blue"), ("pink", "green")
_STEPS = 12  # of the search for a mode
_BAND, _NEAR = 0.05, 0.06  # chroma: how far a pixel weighs, and what belongs to a mode
_SEARCH = 0.15  # how far from its usual chroma a colour is looked for
_MIN_PIXELS = 12
_MAX_PIXELS = 3_000_000
_VIVID = 0.12  # chroma; less is grey
_RARE = 2.5  # spreads from everything common
_HULL = (1.4, 3.3)  # radii of a team's dot: where the other dots are
_MIN_DOT, _MAX_DOT = 12, 20_000  # px

_THE_BACKGROUND = "the background"  # its name beside the colours
_APART, _CLOSE = 4.0, 2.0  # spreads between two colours


def features(bgr: NDArray) -> NDArray[np.float32]:
    """(..., 3) BGR to (..., 4): u, v, L, s."""
    b, g, r = np.moveaxis(np.asarray(bgr, np.float32), -1, 0)
    s = b + g + r + np.float32(3 * _DARK)
    return np.stack([(r - g) / s, (r + g - 2 * b) / (2 * s), np.log(s), s], axis=-1)


def cells() -> NDArray[np.float32]:
    """(65536, 3) BGR in the middle of each cell, in the order of OpenCV's BGR565."""
    code = np.arange(CODES)
    b, g, r = code & 31, code >> 5 & 63, code >> 11
    return np.stack([b * 8 + 3.5, g * 4 + 1.5, r * 8 + 3.5], axis=-1).astype(np.float32)


_CELLS = features(cells())


def distances(
    chroma: NDArray[np.float32], samples: Sequence[ColourSample], burnt: bool = True
) -> NDArray[np.float32]:
    """(n,) of features (n, 4) to the nearest of the samples; infinite where the brightness is out of the question.

    burnt: samples stand as well for what they look like in light too bright for the sensor.
    """
    nearest = np.full(len(chroma), np.inf, np.float32)
    for sample in samples:
        for worse, seen in enumerate(_burnt(sample.bgr) if burnt else [sample.bgr]):
            u, v, light, s = features(np.array(seen))
            spread = (
                (_CHROMA + sample.spread) ** 2 + (_GRAIN / chroma[:, 3]) ** 2 + (_GRAIN / s) ** 2
            )
            away = ((chroma[:, 0] - u) ** 2 + (chroma[:, 1] - v) ** 2) / spread
            change = chroma[:, 2] - light
            away += (change / _BRIGHTNESS) ** 2 + worse * _GUESSED
            np.minimum(nearest, away, out=nearest, where=(change > _DARKER) & (change < _BRIGHTER))
    return np.sqrt(nearest)


def _burnt(bgr: Bgr) -> list[Bgr]:
    """A colour, and as it looks where the light is brighter than the sensor can tell."""
    return (
        [bgr, as_bgr(min(v * _CLIPPED, 255.0) for v in bgr)] if max(bgr) * _CLIPPED > 280 else [bgr]
    )


def as_bgr(values: Iterable[float]) -> Bgr:
    """Return three numbers as a colour."""
    b, g, r = map(float, values)
    return b, g, r


def table_of(profile: ColourProfile) -> tuple[Table, tuple[str, ...]]:
    """The table, and the names that its numbers count from 1."""
    names = tuple(profile.colours)
    ranked = np.stack(
        [distances(_CELLS, profile.colours[name]) for name in names]
        + [distances(_CELLS, profile.background)]
    )
    order = np.argsort(ranked, axis=0)
    best, next_best = (np.take_along_axis(ranked, order[i : i + 1], axis=0)[0] for i in (0, 1))
    with np.errstate(invalid="ignore"):
        sure = (best < profile.reach) & (next_best - best > profile.margin)
    numbers = order[0] + 1
    return np.where(sure & (order[0] < len(names)), numbers, 0).astype(np.uint8), names


def in_light(table: Table, gain: Bgr) -> Table:
    """The table for light so many times as bright in blue, green and red: each cell looks where it would have been."""
    steps = [
        np.clip(np.rint((np.arange(n) + 0.5) / k - 0.5), 0, n - 1).astype(int)
        for n, k in zip((32, 64, 32), gain, strict=True)
    ]
    cube = table.reshape(32, 64, 32)  # red, green, blue
    return np.ascontiguousarray(cube[np.ix_(steps[2], steps[1], steps[0])]).reshape(-1)


def learn_profile(
    name: str,
    clicks: Sequence[tuple[Picture, Mapping[str, Sequence[Click | Box]]]],
    onto: ColourProfile | None = None,
) -> ColourProfile:
    """A profile from clicks (x, y) and boxes (x0, y0, x1, y1), by colour, in one picture or several.

    BACKGROUND as a colour: what is none, such as a floor that is nearly orange. onto: a profile that keeps its other
    colours; a colour that is clicked again gets these samples in addition.
    """
    clicked_background: list[ColourSample] = []
    colours: dict[str, list[ColourSample]] = (
        {c: list(s) for c, s in onto.colours.items()} if onto else {}
    )
    for pixels, given in clicks:
        for colour, places in given.items():
            if colour == BACKGROUND:
                clicked_background.extend(sample_at(pixels, place) for place in places)
                continue
            if colour not in NAMES:
                raise BadInput(
                    f"Unknown colour: {str(colour)[:40]!r}.",
                    f"Use one of: {', '.join(NAMES)}.",
                    reason="unknown-colour",
                )
            colours.setdefault(colour, []).extend(sample_at(pixels, place) for place in places)
    if not colours:
        raise BadInput(
            "There are no colour samples.",
            "Click the ball and each team's colour.",
            reason="no-colours",
        )
    named = {c: tuple(samples) for c, samples in colours.items() if samples}
    pictures = [pixels for pixels, _ in clicks]
    common = [sample for picture in pictures[:4] for sample in clusters(picture)]
    background = (
        *clicked_background,
        *background_samples(common, named),
        *(onto.background if onto else ()),
    )
    profile = ColourProfile(
        name, named, background[:MAX_SAMPLES], mean_light(pictures[0]) if pictures else None
    )
    return replace(profile, reach=onto.reach, margin=onto.margin) if onto else profile


def sample_at(pixels: Picture, place: Click | Box) -> ColourSample:
    """Take a sample of the patch around a click, or of a box."""
    height, width = pixels.shape[:2]
    if len(place) == 4:
        x0, y0, x1, y1 = (round(v) for v in place)
        inside = pixels[max(y0, 0) : max(y1 + 1, 0), max(x0, 0) : max(x1 + 1, 0)].reshape(-1, 3)
        if len(inside) == 0:
            raise _outside(place)
        return sample_of(inside)
    x, y = (round(v) for v in place)
    if not (0 <= x < width and 0 <= y < height):
        raise _outside(place)
    left, top = max(x - _REACH_PX, 0), max(y - _REACH_PX, 0)
    window = np.ascontiguousarray(pixels[top : y + _REACH_PX + 1, left : x + _REACH_PX + 1])
    mask = np.zeros((window.shape[0] + 2, window.shape[1] + 2), np.uint8)
    flags = 4 | cv2.FLOODFILL_MASK_ONLY | cv2.FLOODFILL_FIXED_RANGE | 255 << 8
    cv2.floodFill(
        window.copy(), mask, (x - left, y - top), (0, 0, 0), (_ALIKE,) * 3, (_ALIKE,) * 3, flags
    )
    alike = mask[1:-1, 1:-1] > 0
    if alike.sum() < _MIN_ALIKE:
        alike[max(y - top - 1, 0) : y - top + 2, max(x - left - 1, 0) : x - left + 2] = True
    return sample_of(window[alike])


def sample_of(pixels: NDArray[np.uint8]) -> ColourSample:
    """The median and a spread that a few pixels of something else do not move."""
    chroma = features(pixels)[:, :2]
    spread = 1.48 * np.median(np.abs(chroma - np.median(chroma, axis=0)))
    return ColourSample(as_bgr(np.median(pixels, axis=0)), float(min(spread, 0.1)))


def _outside(place: Sequence[float]) -> BadInput:
    return BadInput(
        f"The sample at ({place[0]:g}, {place[1]:g}) is outside the image.",
        "Click inside the image.",
        reason="click-outside",
    )


def mean_light(pixels: Picture) -> Bgr:
    """Mean BGR of the middle half of the pixels, by brightness: neither what is burnt out nor what is black."""
    sampled = _thinned(pixels).astype(np.float32)
    order = np.argsort(sampled.sum(axis=1))
    return as_bgr(sampled[order[len(order) // 4 : 3 * len(order) // 4 + 1]].mean(axis=0))


def background_samples(
    samples: Sequence[ColourSample], colours: Mapping[str, Sequence[ColourSample]]
) -> tuple[ColourSample, ...]:
    """The samples that are none of the colours."""
    return tuple(
        s
        for s in samples
        if all(
            distances(features(np.array([s.bgr])), c, burnt=False)[0] > OUTSIDE_REACH
            for c in colours.values()
        )
    )


def clusters(pixels: Picture) -> list[ColourSample]:
    """What the picture mostly consists of: the middle of each cluster, the larger first."""
    sampled = _thinned(pixels)
    chroma = features(sampled)
    space = np.stack([chroma[:, 0] * 6, chroma[:, 1] * 6, chroma[:, 2]], axis=-1).astype(np.float32)
    cv2.setRNGSeed(1)  # the same picture, the same clusters
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 20, 0.01)
    number = np.zeros(len(space), np.int32)
    cv2.kmeans(space, min(_CLUSTERS, len(space)), number, stop, 2, cv2.KMEANS_PP_CENTERS)
    counts = np.bincount(number)
    return [
        sample_of(sampled[number == i])
        for i in np.argsort(-counts)
        if counts[i] >= _MIN_SHARE * len(sampled)
    ]


def _thinned(pixels: Picture) -> NDArray[np.uint8]:
    flat = pixels.reshape(-1, 3)
    return flat[:: max(1, len(flat) // _STRIDE_PIXELS)]


def automatic_profile(
    name: str,
    pixels: Picture,
    wanted: Sequence[str] = ("orange", "yellow", "blue", "pink", "green"),
    usual: ColourProfile | None = None,
) -> ColourProfile:
    """usual: what the colours looked like elsewhere; without it, as the leagues have them.

    A colour that is not in the picture keeps its usual sample, and a note says so.
    """
    sampled = pixels.reshape(-1, 3)[:: -(-pixels.shape[0] * pixels.shape[1] // _MAX_PIXELS)]
    vivid = _vivid(sampled)
    sampled = sampled[vivid]
    chroma = features(sampled)
    common = clusters(pixels)
    rare = distances(chroma, common) > _RARE if common else np.ones(len(sampled), bool)
    colours: dict[str, tuple[ColourSample, ...]] = {}
    notes = []
    for colour in sorted(wanted, key=lambda colour: colour in _ON_HULLS):
        start = (
            usual.colours[colour][0]
            if usual and colour in usual.colours
            else ColourSample(NAMES[colour], 0.02)
        )
        among = _on_hulls(pixels, colours) if colour in _ON_HULLS else None
        found = (
            _mode(sampled[rare], chroma[rare], start)
            if among is None
            else _mode(among, features(among), start)
        )
        if found is None:
            notes.append(
                say(
                    "note.colour-not-detected",
                    "No {colour} detected. The default {colour} is used.",
                    colour=colour_name(colour),
                )
            )
        colours[colour] = (found or start,)
    return ColourProfile(
        name,
        {c: colours[c] for c in wanted},
        background_samples(common, colours),
        mean_light(pixels),
        notes=tuple(notes),
    )


def _vivid(bgr: Picture) -> NDArray[np.bool_]:
    chroma = features(bgr)
    return np.hypot(chroma[:, 0], chroma[:, 1]) > _VIVID


def _on_hulls(pixels: Picture, colours: dict[str, tuple[ColourSample, ...]]) -> Picture | None:
    """(n, 3) vivid pixels around patches of the teams' colours; None where there are no such patches."""
    teams = {c: colours[c] for c in _TEAMS if c in colours}
    if not teams:
        return None
    codes = cv2.cvtColor(pixels, cv2.COLOR_BGR2BGR565).view(np.uint16).reshape(pixels.shape[:2])
    blobs = Blobs.of(runs_of(table_of(ColourProfile("teams", teams))[0][codes]))
    blobs = blobs.only(
        (blobs.area >= _MIN_DOT) & (blobs.area <= _MAX_DOT) & (blobs.roundness > 0.6)
    )
    if not len(blobs):
        return None
    hull = np.zeros(pixels.shape[:2], np.uint8)
    for (x, y), radius in zip(blobs.middle, np.sqrt(blobs.area / np.pi), strict=True):
        cv2.circle(hull, (round(x), round(y)), round(_HULL[1] * radius), 255, -1)
    for (x, y), radius in zip(blobs.middle, np.sqrt(blobs.area / np.pi), strict=True):
        cv2.circle(hull, (round(x), round(y)), round(_HULL[0] * radius), 0, -1)
    on_hulls = pixels[hull > 0]
    return on_hulls[_vivid(on_hulls)]


def _mode(bgr: Picture, chroma: NDArray[np.float32], start: ColourSample) -> ColourSample | None:
    """From the usual chroma to where pixels are densest nearby."""
    origin = features(np.array([start.bgr]))[0, :2]
    within = ((chroma[:, :2] - origin) ** 2).sum(axis=1) < (2 * _SEARCH) ** 2
    bgr, chroma = bgr[within], chroma[within]
    at = origin.copy()
    for _ in range(_STEPS):
        weight = np.exp(-((chroma[:, :2] - at) ** 2).sum(axis=1) / (2 * _BAND**2))
        if weight.sum() < 1:
            return None
        at = (weight[:, None] * chroma[:, :2]).sum(axis=0) / weight.sum()
    near = ((chroma[:, :2] - at) ** 2).sum(axis=1) < _NEAR**2
    if near.sum() < _MIN_PIXELS or np.hypot(*(at - origin)) > _SEARCH:
        return None
    # The rim of a patch is darker than the patch.
    return sample_of(bgr[near & (chroma[:, 2] > np.quantile(chroma[near, 2], 0.4))])


@dataclass(frozen=True)
class ColourSeparation:
    """One colour beside the nearest other. gap: in spreads; infinite where nothing is near."""

    colour: str
    nearest: str | None
    gap: float
    level: str  # "good", "close" or "mixed"
    sentence: str

    def to_json(self) -> dict:
        return stated({**vars(self), "gap": self.gap if np.isfinite(self.gap) else None})


def colour_health(profile: ColourProfile) -> tuple[ColourSeparation, ...]:
    others = {**profile.colours, _THE_BACKGROUND: profile.background}
    found = []
    for colour, samples in profile.colours.items():
        chroma = features(np.array([s.bgr for s in samples]))
        gaps = {
            name: float(distances(chroma, rest, burnt=False).min())
            for name, rest in others.items()
            if name != colour and rest
        }
        nearest = min(gaps, key=gaps.__getitem__, default=None)
        gap = gaps[nearest] if nearest else float("inf")
        level = "good" if gap >= _APART else "close" if gap >= _CLOSE else "mixed"
        found.append(
            ColourSeparation(
                colour,
                nearest if np.isfinite(gap) else None,
                gap,
                level,
                _sentence(level, colour, nearest),
            )
        )
    return tuple(found)


def health_json(profile: Mapping[str, Any] | None) -> list[dict[str, Any]]:
    """Return how well each colour is separated from the others; margin: in spreads, null where nothing is near."""
    if profile is None:
        return []
    entries = [health.to_json() for health in colour_health(ColourProfile.from_json(profile))]
    return [
        stated(
            {
                "colour": entry["colour"],
                "margin": entry["gap"],
                "words": entry["sentence"],
                "level": entry["level"],
                "nearest": entry["nearest"],
            }
        )
        for entry in entries
    ]


def _sentence(level: str, colour: str, nearest: str | None) -> Sentence:
    first = capitalised(_name(colour))
    if level == "good" or nearest is None:
        return say("colour-separation.good", "{colour} is well separated.", colour=first)
    if level == "close":
        return say(
            "colour-separation.close",
            "{colour} is close to {nearest}. Add samples of both where the light differs.",
            colour=first,
            nearest=_name(nearest),
        )
    return say(
        "colour-separation.mixed",
        "{colour} overlaps with {nearest}. Change the light, the white balance or the paper.",
        colour=first,
        nearest=_name(nearest),
    )


def _name(colour: str) -> str:
    """Return what a colour or the background is called within a sentence."""
    return (
        say("colour.background", _THE_BACKGROUND)
        if colour == _THE_BACKGROUND
        else colour_name(colour)
    )
