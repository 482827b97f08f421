"""Films of balls that roll over a carpet, seen through a known lens: for the tests of what moves."""

import cv2
import numpy as np

from touchline.core.geometry import ImageSize, Points
from touchline.models.distortion import Distortion

SIZE = ImageSize(640, 480)
FPS = 30.0


def lens_of(k: float, size: ImageSize = SIZE) -> Distortion:
    return Distortion("division", (k,), size.centre, size)


def path(lens: Distortion, start, end, count: int) -> np.ndarray:
    """A straight roll from pixel to pixel of the raw picture, (count, 2), at even speed over the carpet."""
    ends = lens.undistorted_from_raw(np.array([start, end], float))
    t = np.linspace(0, 1, count)[:, None]
    return lens.raw_from_undistorted(ends[:1] * (1 - t) + ends[1:] * t)


def carpet(seed: int, size: ImageSize = SIZE) -> np.ndarray:
    rng = np.random.default_rng(seed)
    rough = cv2.GaussianBlur(
        rng.normal(0, 12, (size.height, size.width, 1)).astype(np.float32), (0, 0), 3
    )[..., None]
    ground = np.array([50, 110, 60], np.float32) + rough
    cv2.line(ground, (20, 20), (size.width - 20, 30), (230, 230, 230), 4, cv2.LINE_AA)
    return ground


def frame(ground: np.ndarray, balls, noise: np.ndarray, radius_px: float = 7.0) -> np.ndarray:
    """A picture with balls at their sub-pixel places, and noise."""
    picture = ground.copy()
    for x, y in balls:
        left, top = int(x - 2 * radius_px), int(y - 2 * radius_px)
        part = picture[
            max(top, 0) : top + int(4 * radius_px) + 1, max(left, 0) : left + int(4 * radius_px) + 1
        ]
        yy, xx = np.mgrid[
            max(top, 0) : max(top, 0) + part.shape[0], max(left, 0) : max(left, 0) + part.shape[1]
        ]
        share = np.clip(radius_px + 0.5 - np.hypot(xx - x, yy - y), 0, 1)[..., None]
        part[:] = part * (1 - share) + np.array([20, 120, 240], np.float32) * share
    return np.clip(picture + noise, 0, 255).astype(np.uint8)


def film(lens: Distortion, rolls, seed: int = 0, still: int = 3):
    """Each frame as (seconds, pixels). rolls: (start, end, frames) one after the other, or a list of such at once.

    The noise of two grey levels is cut at random places out of one larger picture of it: a draw a pixel would cost more
    than all that is done with the film.
    """
    rng, ground = np.random.default_rng(seed), carpet(seed)
    noise = rng.normal(0, 2, np.add(ground.shape, (97, 89, 0))).astype(np.float32)
    places: list[list[Points]] = [[] for _ in range(still)]
    for together in rolls:
        paths = [
            path(lens, *roll) for roll in (together if isinstance(together, list) else [together])
        ]
        places += [
            [p[step] for p in paths if step < len(p)] for step in range(max(len(p) for p in paths))
        ]
    for number, balls in enumerate(places):
        top, left = rng.integers(0, (98, 90))
        yield (
            number / FPS,
            frame(ground, balls, noise[top : top + SIZE.height, left : left + SIZE.width]),
        )


def chords(rng: np.random.Generator, lens: Distortion, count: int, noise_px: float = 0.25):
    """Random rolls as points with noise, and the seconds each took."""
    tracks: list[Points] = []
    seconds, size = [], lens.image_size
    while len(tracks) < count:
        start = rng.uniform(40, [size.width - 40, size.height - 40])
        angle, length = (
            rng.uniform(0, 2 * np.pi),
            rng.uniform(0.12, 0.5) * np.hypot(size.width, size.height),
        )
        end = start + length * np.array([np.cos(angle), np.sin(angle)])
        if (end < 20).any() or end[0] > size.width - 20 or end[1] > size.height - 20:
            continue
        points = path(lens, start, end, int(rng.integers(10, 60)))
        if np.isfinite(points).all():
            tracks.append(points + rng.normal(0, noise_px, points.shape))
            seconds.append(len(points) / FPS)
    return tracks, seconds
