"""Straight edges of a made-up world behind a known lens: what tests and benchmarks of straight lines look at."""

import numpy as np

from touchline.core.geometry import ImageSize, Points
from touchline.models.distortion import LINE_LENSES, Distortion

SIZE = ImageSize(1280, 1024)
FLOOR_PX = 0.309  # noise of the points; no fit leaves less by much


def lens_of(name="brown-conrady", terms=(-0.28, 0.09), centre=(0.0, 0.0), size=SIZE):
    """terms per half diagonal; centre in px beside the picture's."""
    full = np.zeros(len(LINE_LENSES[name][0].TERMS))
    full[: len(terms)] = terms
    x, y = size.centre
    return Distortion(name, tuple(full.tolist()), (x + centre[0], y + centre[1]), size)


def lines_seen(lens, seed, lines=14, points=40, noise_px=FLOOR_PX):
    """Chains (points, 2) px of lines all over the picture, each at least 0.3 of its width long."""
    rng = np.random.default_rng(seed)
    chains: list[Points] = []
    width, height = lens.image_size
    while len(chains) < lines:
        ends = lens.undistorted_from_raw(rng.uniform((0, 0), (width - 1, height - 1), (2, 2)))
        along = np.linspace(0, 1, points)[:, None]
        raw = lens.raw_from_undistorted(ends[0] * (1 - along) + ends[1] * along)
        if np.linalg.norm(raw[-1] - raw[0]) > 0.3 * width:
            chains.append(raw + rng.normal(0, noise_px, raw.shape))
    return chains


def level_lines(lens, seed, *, sag=0.0, lines=10, reach=(0.06, 0.94), points=40, noise_px=FLOOR_PX):
    """Chains from the left to the right of the picture, up to 9° oblique, at heights within reach of it.

    sag: by how much of its length the middle of each hangs below its ends in the world, in a picture without a lens.
    """
    rng = np.random.default_rng(seed)
    width, height = lens.image_size
    along, chains = np.linspace(0, 1, points)[:, None], []
    for y in np.linspace(reach[0], reach[1], lines) * height:
        xs = np.array([rng.uniform(0.03, 0.23), rng.uniform(0.77, 0.97)]) * width
        ys = np.clip(y + rng.uniform(-0.15, 0.15) * (xs - xs.mean()), 15, height - 15)
        ends = lens.undistorted_from_raw(np.stack([xs, ys], axis=1))
        hanging = (
            4 * along * (1 - along) * sag * np.linalg.norm(ends[1] - ends[0]) * np.array([0, 1])
        )
        chains.append(
            lens.raw_from_undistorted(ends[0] * (1 - along) + ends[1] * along + hanging)
            + rng.normal(0, noise_px, (points, 2))
        )
    return chains


def arc(centre, radius, start, turn, points=40):
    """Points of a circle: an edge that no lens should make straight."""
    angle = start + np.linspace(0, turn, points)
    return np.array(centre) + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
