"""A colour profile from the picture alone: each colour's densest chroma near where the leagues have it.

The ball and the teams' colours are looked for among all that is no background. Pink and green are looked for on the
hulls only, around what has a team's colour: a carpet is green as well.
"""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.colour_profile import NAMES, ColourProfile, ColourSample, colour_name
from touchline.core.statements import say
from touchline.vision.blobs.features import Blobs
from touchline.vision.blobs.runs import runs_of
from touchline.vision.colour.learning import background_samples, clusters, mean_light, sample_of
from touchline.vision.colour.table import distances, features, table_of

Picture = NDArray[np.uint8]
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


def automatic_profile(name: str, pixels: Picture, wanted: Sequence[str] = ("orange", "yellow", "blue", "pink", "green"),
                      usual: ColourProfile | None = None) -> ColourProfile:
    """usual: what the colours looked like elsewhere; without it, as the leagues have them.

    A colour that is not in the picture keeps its usual sample, and a note says so.
    """
    sampled = pixels.reshape(-1, 3)[::-(-pixels.shape[0] * pixels.shape[1] // _MAX_PIXELS)]
    vivid = _vivid(sampled)
    sampled = sampled[vivid]
    chroma = features(sampled)
    common = clusters(pixels)
    rare = distances(chroma, common) > _RARE if common else np.ones(len(sampled), bool)
    colours: dict[str, tuple[ColourSample, ...]] = {}
    notes = []
    for colour in sorted(wanted, key=lambda colour: colour in _ON_HULLS):
        start = usual.colours[colour][0] if usual and colour in usual.colours else ColourSample(NAMES[colour], 0.02)
        among = _on_hulls(pixels, colours) if colour in _ON_HULLS else None
        found = _mode(sampled[rare], chroma[rare], start) if among is None else _mode(among, features(among), start)
        if found is None:
            notes.append(say("note.colour-not-detected", "No {colour} detected. The default {colour} is used.",
                             colour=colour_name(colour)))
        colours[colour] = (found or start,)
    return ColourProfile(name, {c: colours[c] for c in wanted}, background_samples(common, colours), mean_light(pixels),
                         notes=tuple(notes))


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
    blobs = blobs.only((blobs.area >= _MIN_DOT) & (blobs.area <= _MAX_DOT) & (blobs.roundness > 0.6))
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
