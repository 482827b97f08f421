"""A colour profile from a few clicks or boxes.

Around a click the patch of like pixels is one sample: its mean, and how much its chroma varies. What a picture mostly
consists of, away from the clicked colours, is the background: its own clusters, so that the carpet need not be clicked.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.colour_profile import MAX_SAMPLES, NAMES, Bgr, ColourProfile, ColourSample
from touchline.core.errors import BadInput
from touchline.vision.colour.table import as_bgr, distances, features

Picture = NDArray[np.uint8]
Click = tuple[float, float]
Box = tuple[float, float, float, float]  # x0, y0, x1, y1 px
BACKGROUND = "background"
_ALIKE = 22  # grey levels from the clicked pixel, each channel
_REACH_PX = 12  # a click's patch goes no further
_MIN_ALIKE = 5  # pixels; else the click's own 3 × 3
_CLUSTERS, _STRIDE_PIXELS, _MIN_SHARE = 10, 20_000, 0.01
OUTSIDE_REACH = 2.0  # spreads: nearer to a clicked colour, a cluster is that colour


def learn_profile(name: str, clicks: Sequence[tuple[Picture, Mapping[str, Sequence[Click | Box]]]],
                  onto: ColourProfile | None = None) -> ColourProfile:
    """A profile from clicks (x, y) and boxes (x0, y0, x1, y1), by colour, in one picture or several.

    BACKGROUND as a colour: what is none, such as a floor that is nearly orange. onto: a profile that keeps its other
    colours; a colour that is clicked again gets these samples in addition.
    """
    clicked_background: list[ColourSample] = []
    colours: dict[str, list[ColourSample]] = {c: list(s) for c, s in onto.colours.items()} if onto else {}
    for pixels, given in clicks:
        for colour, places in given.items():
            if colour == BACKGROUND:
                clicked_background.extend(sample_at(pixels, place) for place in places)
                continue
            if colour not in NAMES:
                raise BadInput(f"Unknown colour: {str(colour)[:40]!r}.",
                               f"Use one of: {', '.join(NAMES)}.", reason="unknown-colour")
            colours.setdefault(colour, []).extend(sample_at(pixels, place) for place in places)
    if not colours:
        raise BadInput("There are no colour samples.", "Click the ball and each team's colour.", reason="no-colours")
    named = {c: tuple(samples) for c, samples in colours.items() if samples}
    pictures = [pixels for pixels, _ in clicks]
    common = [sample for picture in pictures[:4] for sample in clusters(picture)]
    background = (*clicked_background, *background_samples(common, named), *(onto.background if onto else ()))
    made = ColourProfile(name, named, background[:MAX_SAMPLES], mean_light(pictures[0]) if pictures else None)
    return replace(made, reach=onto.reach, margin=onto.margin) if onto else made


def sample_at(pixels: Picture, place: Click | Box) -> ColourSample:
    """Take a sample of the patch around a click, or of a box."""
    height, width = pixels.shape[:2]
    if len(place) == 4:
        x0, y0, x1, y1 = (round(v) for v in place)
        inside = pixels[max(y0, 0):max(y1 + 1, 0), max(x0, 0):max(x1 + 1, 0)].reshape(-1, 3)
        if len(inside) == 0:
            raise _outside(place)
        return sample_of(inside)
    x, y = (round(v) for v in place)
    if not (0 <= x < width and 0 <= y < height):
        raise _outside(place)
    left, top = max(x - _REACH_PX, 0), max(y - _REACH_PX, 0)
    window = np.ascontiguousarray(pixels[top:y + _REACH_PX + 1, left:x + _REACH_PX + 1])
    mask = np.zeros((window.shape[0] + 2, window.shape[1] + 2), np.uint8)
    flags = 4 | cv2.FLOODFILL_MASK_ONLY | cv2.FLOODFILL_FIXED_RANGE | 255 << 8
    cv2.floodFill(window.copy(), mask, (x - left, y - top), (0, 0, 0), (_ALIKE,) * 3, (_ALIKE,) * 3, flags)
    alike = mask[1:-1, 1:-1] > 0
    if alike.sum() < _MIN_ALIKE:
        alike[max(y - top - 1, 0):y - top + 2, max(x - left - 1, 0):x - left + 2] = True
    return sample_of(window[alike])


def sample_of(pixels: NDArray[np.uint8]) -> ColourSample:
    """The median and a spread that a few pixels of something else do not move."""
    chroma = features(pixels)[:, :2]
    spread = 1.48 * np.median(np.abs(chroma - np.median(chroma, axis=0)))
    return ColourSample(as_bgr(np.median(pixels, axis=0)), float(min(spread, 0.1)))


def _outside(place: Sequence[float]) -> BadInput:
    return BadInput(f"The sample at ({place[0]:g}, {place[1]:g}) is outside the image.", "Click inside the image.",
                    reason="click-outside")


def mean_light(pixels: Picture) -> Bgr:
    """Mean BGR of the middle half of the pixels, by brightness: neither what is burnt out nor what is black."""
    sampled = _thinned(pixels).astype(np.float32)
    order = np.argsort(sampled.sum(axis=1))
    return as_bgr(sampled[order[len(order) // 4:3 * len(order) // 4 + 1]].mean(axis=0))


def background_samples(samples: Sequence[ColourSample],
                       colours: Mapping[str, Sequence[ColourSample]]) -> tuple[ColourSample, ...]:
    """The samples that are none of the colours."""
    return tuple(s for s in samples if all(distances(features(np.array([s.bgr])), c, burnt=False)[0] > OUTSIDE_REACH
                                           for c in colours.values()))


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
    return [sample_of(sampled[number == i]) for i in np.argsort(-counts) if counts[i] >= _MIN_SHARE * len(sampled)]


def _thinned(pixels: Picture) -> NDArray[np.uint8]:
    flat = pixels.reshape(-1, 3)
    return flat[::max(1, len(flat) // _STRIDE_PIXELS)]
