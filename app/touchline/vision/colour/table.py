"""Which colour a pixel is, as a lookup table over all pixels: 5 bits of blue, 6 of green, 5 of red.

A pixel is classified by its chroma, which is the same in light and in shade, and less by its brightness:

    s = b + g + r + 3 c        u = (r - g) / s        v = (r + g - 2 b) / (2 s)        L = ln s

The distance to a sample is d² = (Δu² + Δv²) / σ² + (ΔL / λ)², where σ² = (usual + spread)² + (grain / s)²: what is
dark is known less well. A pixel is of the colour of the nearest sample if that is within reach, and nearer by a margin
than any sample of another colour or of the background.
"""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from touchline.core.colour_profile import Bgr, ColourProfile, ColourSample

CODES = 1 << 16
Table = NDArray[np.uint8]  # (65536,) the number of a colour, from 1; 0 is none
_DARK = 12.0  # c: grey levels that a sensor shows of black, so that noise in the dark has no colour
_CHROMA = 0.045  # how much chroma varies over a patch, by lamps and by the sensor
_GRAIN = 4.0  # grey levels, of noise and of the table's own steps
_BRIGHTNESS = 0.5  # λ: half as bright is 1.4 spreads
_DARKER, _BRIGHTER = -1.25, 0.8  # ln: no colour is less than 0.29 or more than 2.2 times as bright as its sample
_GUESSED = 2.0  # spreads²: a predicted colour gives way to a sampled one
_CLIPPED = 1.5  # what is this much brighter than its sample may be burnt out in a channel


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


def distances(chroma: NDArray[np.float32], samples: Sequence[ColourSample], burnt: bool = True) -> NDArray[np.float32]:
    """(n,) of features (n, 4) to the nearest of the samples; infinite where the brightness is out of the question.

    burnt: samples stand as well for what they look like in light too bright for the sensor.
    """
    nearest = np.full(len(chroma), np.inf, np.float32)
    for sample in samples:
        for worse, seen in enumerate(_burnt(sample.bgr) if burnt else [sample.bgr]):
            u, v, light, s = features(np.array(seen))
            spread = (_CHROMA + sample.spread) ** 2 + (_GRAIN / chroma[:, 3]) ** 2 + (_GRAIN / s) ** 2
            away = ((chroma[:, 0] - u) ** 2 + (chroma[:, 1] - v) ** 2) / spread
            change = chroma[:, 2] - light
            away += (change / _BRIGHTNESS) ** 2 + worse * _GUESSED
            np.minimum(nearest, away, out=nearest, where=(change > _DARKER) & (change < _BRIGHTER))
    return np.sqrt(nearest)


def _burnt(bgr: Bgr) -> list[Bgr]:
    """A colour, and as it looks where the light is brighter than the sensor can tell."""
    return [bgr, as_bgr(min(v * _CLIPPED, 255.0) for v in bgr)] if max(bgr) * _CLIPPED > 280 else [bgr]


def as_bgr(values: Iterable[float]) -> Bgr:
    """Return three numbers as a colour."""
    b, g, r = map(float, values)
    return b, g, r


def table_of(profile: ColourProfile) -> tuple[Table, tuple[str, ...]]:
    """The table, and the names that its numbers count from 1."""
    names = tuple(profile.colours)
    ranked = np.stack([distances(_CELLS, profile.colours[name]) for name in names]
                      + [distances(_CELLS, profile.background)])
    order = np.argsort(ranked, axis=0)
    best, next_best = (np.take_along_axis(ranked, order[i:i + 1], axis=0)[0] for i in (0, 1))
    with np.errstate(invalid="ignore"):
        sure = (best < profile.reach) & (next_best - best > profile.margin)
    numbers = order[0] + 1
    return np.where(sure & (order[0] < len(names)), numbers, 0).astype(np.uint8), names


def in_light(table: Table, gain: Bgr) -> Table:
    """The table for light so many times as bright in blue, green and red: each cell looks where it would have been."""
    steps = [np.clip(np.rint((np.arange(n) + 0.5) / k - 0.5), 0, n - 1).astype(int)
             for n, k in zip((32, 64, 32), gain, strict=True)]
    cube = table.reshape(32, 64, 32)  # red, green, blue
    return np.ascontiguousarray(cube[np.ix_(steps[2], steps[1], steps[0])]).reshape(-1)
