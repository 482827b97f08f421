"""How a picture is lit: what is burnt out or drowned, how bright it is, how evenly the carpet is lit.

The carpet's brightness in a zone is the median of the pixels that have the carpet's colour: lines, robots and people
are few beside it and of other colours. Grey levels are taken as the picture has them; a camera that bends them (gamma)
shows less of a difference than there is.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from typing_extensions import TypedDict

from touchline.core.statements import say
from touchline.vision.zones import (
    MIDDLE,
    WHOLE,
    ZONES,
    Advice,
    field_mask,
    first_capital,
    message,
    zone_names,
    zone_slices,
)

LOW, HIGH = 2, 253  # grey levels at and beyond which nothing is told apart any more
CLIPPED_HIGH, CLIPPED_LOW = 0.005, 0.02  # shares from which on it is said
MUCH_CLIPPED = 0.05
DIM = 0.75  # of the brightest zone: below it a zone is called darker
DARK = 90.0  # grey level that the brightest thing on a field, its lines, should pass by far
BRIGHT = 200.0  # there is no more room above it
_WIDE = 160  # px: the carpet is looked at in a picture this wide
_ALIKE = 0.05  # in share of blue or red, to count as carpet
_NEUTRAL = 0.04  # a carpet this close to grey is told from a grey floor by its brightness alone
_SHARE = 0.1  # of a zone must be carpet
_DIGITS = 4


class LightJson(TypedDict):
    mean: float
    bright: float
    clipped_low: float
    clipped_high: float
    evenness: float | None
    carpet: list[float | None]
    burnt: list[float]


@dataclass(frozen=True)
class Light:
    """clipped_low, clipped_high: shares of the field's pixels. mean, bright: grey levels; bright is what only one pixel
    in 200 passes. carpet: median grey level of the carpet in each of the nine ZONES, None where there is none.
    burnt: share of burnt-out pixels in each zone. evenness: dimmest zone over brightest; None with fewer than two.
    """

    mean: float
    bright: float
    clipped_low: float
    clipped_high: float
    evenness: float | None
    carpet: tuple[float | None, ...]
    burnt: tuple[float, ...]

    def to_json(self) -> LightJson:
        return {
            "mean": self.mean,
            "bright": self.bright,
            "clipped_low": self.clipped_low,
            "clipped_high": self.clipped_high,
            "evenness": self.evenness,
            "carpet": list(self.carpet),
            "burnt": list(self.burnt),
        }


def measure_light(picture: NDArray[np.uint8], field: NDArray | None = None) -> Light:
    """Measure a picture (height, width, 3) BGR, within the field where its mask or polygon is known."""
    height, width = picture.shape[:2]
    mask = field_mask(field, height, width)
    if mask is not None and not mask.any():
        mask = None
    blue, green, red = cv2.split(picture)
    grey, top = (
        cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY),
        np.asarray(cv2.max(cv2.max(blue, green), red), np.uint8),
    )
    inside = None if mask is None else mask.astype(np.uint8)
    counts = cv2.calcHist([grey], [0], inside, [256], [0, 256]).ravel()
    tops = cv2.calcHist([top], [0], inside, [256], [0, 256]).ravel()
    total = float(counts.sum())
    carpet = _carpet(picture, mask)
    levels = [level for level in carpet if level is not None]
    return Light(
        round(float(counts @ np.arange(256)) / total, 2),
        float(np.searchsorted(np.cumsum(counts), 0.995 * total)),
        round(float(tops[: LOW + 1].sum()) / total, _DIGITS),
        round(float(tops[HIGH:].sum()) / total, _DIGITS),
        round(min(levels) / max(max(levels), 1.0), 3) if len(levels) > 1 else None,
        carpet,
        _burnt(top, mask),
    )


def _burnt(top: NDArray[np.uint8], mask: NDArray[np.bool_] | None) -> tuple[float, ...]:
    mask = np.ones(top.shape, bool) if mask is None else mask
    burnt = (top >= HIGH) & mask
    return tuple(
        round(
            int(np.count_nonzero(burnt[zone])) / max(int(np.count_nonzero(mask[zone])), 1), _DIGITS
        )
        for zone in zone_slices(*top.shape)
    )


def _carpet(picture: NDArray[np.uint8], mask: NDArray[np.bool_] | None) -> tuple[float | None, ...]:
    height, width = picture.shape[:2]
    size = (min(_WIDE, width), max(3, round(height * min(_WIDE, width) / width)))
    small = cv2.resize(picture, size, interpolation=cv2.INTER_AREA).astype(np.float32) + 1
    level = small.mean(axis=2)
    blue, red = small[..., 0] / (3 * level), small[..., 2] / (3 * level)
    if mask is None:
        h, w = level.shape
        usual = np.zeros(level.shape, bool)
        usual[h // 4 : -(-3 * h // 4), w // 4 : -(-3 * w // 4)] = (
            True  # a camera looks at its field
        )
        allowed = np.ones(level.shape, bool)
    else:
        allowed = usual = (
            cv2.resize(mask.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST) > 0
        )
        if not usual.any():
            return (None,) * 9
    b, r, usual_level = (float(np.median(plane[usual])) for plane in (blue, red, level))
    alike = allowed & (np.abs(blue - b) < _ALIKE) & (np.abs(red - r) < _ALIKE)
    if mask is None and abs(b - 1 / 3) < _NEUTRAL and abs(r - 1 / 3) < _NEUTRAL:
        alike &= (level > 0.45 * usual_level) & (level < 2.2 * usual_level)
    found = []
    for zone in zone_slices(*level.shape):
        part = level[zone][alike[zone]]
        room = np.count_nonzero(allowed[zone])
        enough = part.size >= max(_SHARE * level[zone].size, 0.3 * room, 4)
        found.append(round(float(np.median(part)) - 1, 1) if enough else None)
    return tuple(found)


def advice(light: Light) -> list[Advice]:
    """Return advice on the light, worst first."""
    messages = []
    if light.clipped_high >= CLIPPED_HIGH:
        where = [
            i
            for i, share in enumerate(light.burnt)
            if share >= max(0.3 * max(light.burnt), CLIPPED_HIGH)
        ]
        places, share = zone_names(where), _percent(light.clipped_high)
        text = (
            say(
                "light.overexposed",
                "Image overexposed everywhere: {share} of the pixels are saturated.",
                share=share,
            )
            if places == [WHOLE]
            else say(
                "light.zones-overexposed",
                "Image overexposed at {zones}: {share} of the pixels are saturated.",
                zones=places,
                share=share,
            )
        )
        messages.append(
            message(
                text,
                say(
                    "light.shorten-exposure",
                    "Shorten the exposure, lower the gain or close the "
                    "iris. Move a lamp that causes reflections.",
                ),
                light.clipped_high >= MUCH_CLIPPED,
            )
        )
    if light.clipped_low >= CLIPPED_LOW:
        # Beside bright lines, black is most often a black carpet.
        messages.append(
            message(
                say(
                    "light.underexposed",
                    "Image underexposed: {share} of the pixels are black.",
                    share=_percent(light.clipped_low),
                ),
                say(
                    "light.lengthen-exposure",
                    "Lengthen the exposure, open the iris, or light the field.",
                ),
                light.clipped_low >= MUCH_CLIPPED and light.bright < BRIGHT,
            )
        )
    if light.bright < DARK:
        messages.append(
            message(
                say(
                    "light.dark",
                    "Image dark: the brightest pixels are at grey level {level:.0f} of 255.",
                    level=light.bright,
                ),
                say(
                    "light.add-light",
                    "Add light or lengthen the exposure. Raise the gain last, "
                    "because it adds noise.",
                ),
                light.bright < DARK / 2,
            )
        )
    messages += _unevenness(light)
    return sorted(messages, key=lambda s: s["severity"] != "warning")


def _unevenness(light: Light) -> list[Advice]:
    known = {i: level for i, level in enumerate(light.carpet) if level is not None}
    if light.evenness is None or light.evenness >= DIM:
        return []
    best = max(known.values())
    # The middle is what people compare with, wherever it is nearly as bright as the brightest.
    beside = MIDDLE if known.get(MIDDLE, 0) >= 0.9 * best else max(known, key=known.__getitem__)
    dim = [i for i, level in known.items() if level < DIM * known[beside]]
    if not dim:
        return []
    least = 1 - min(known[i] for i in dim) / known[beside]
    values = {
        "zones": first_capital(zone_names(dim, known)),
        "percent": 100 * least,
        "beside": ZONES[beside],
    }
    text = (
        say(
            "light.zones-darker",
            "{zones} up to {percent:.0f} % darker than the {beside}.",
            **values,
        )
        if len(dim) > 1
        else say("light.zone-darker", "{zones} {percent:.0f} % darker than the {beside}.", **values)
    )
    return [
        message(
            text,
            say(
                "light.add-lamp",
                "Move or add a lamp there. If the lens darkens the corners, close its "
                "iris a little.",
            ),
            light.evenness < 0.5,
        )
    ]


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if share >= 0.1 else f"{100 * share:.1f} %"
