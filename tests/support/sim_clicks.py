"""Clicks of a simulated operator: true points along borders and on a grid, exact or with noise."""

import numpy as np
from numpy.typing import NDArray

from touchline.core.field import BORDERS, Line, Region
from touchline.core.geometry import Points
from touchline.core.records import Observation, Observations
from touchline.sources.sim.camera import SimCamera


def line_clicks(
    camera: SimCamera,
    line: Line,
    n: int,
    noise_px: float = 0.0,
    rng: np.random.Generator | None = None,
    anywhere: bool = False,
) -> tuple[Points, Points]:
    """n clicks along a line in raw pixels, and the field mm that they mean.

    They go from end to end in even steps of mm, or `anywhere` at random. Those outside the picture are left out.
    """
    rng = rng or np.random.default_rng(0)
    t = np.sort(rng.uniform(size=n)) if anywhere else np.linspace(0, 1, n)
    field = np.asarray(line.start) * (1 - t[:, None]) + np.asarray(line.end) * t[:, None]
    raw = camera.raw_from_field(field)
    raw = raw + rng.normal(0, noise_px, raw.shape) if noise_px else raw
    seen = camera.sees(raw)
    return raw[seen], field[seen]


def border_clicks(
    camera: SimCamera,
    region: Region,
    n: int,
    noise_px: float = 0.0,
    rng: np.random.Generator | None = None,
    anywhere: bool = False,
) -> dict[str, Points]:
    """n clicks (n, 2) px on each of the region's left, right, top and bottom."""
    rng = rng or np.random.default_rng(0)
    return {
        name: line_clicks(camera, region.border(name), n, noise_px, rng, anywhere)[0]
        for name in BORDERS
    }


def border_observations(
    camera: SimCamera,
    region: Region,
    n: int,
    noise_px: float = 0.0,
    rng: np.random.Generator | None = None,
    anywhere: bool = False,
) -> Observations:
    """The same as observations, ready for a fit."""
    clicks = border_clicks(camera, region, n, noise_px, rng, anywhere)
    return tuple(Observation(name, "line", points) for name, points in clicks.items())


def known_grid(
    camera: SimCamera, region: Region, nx: int, ny: int, z_mm: float = 0.0
) -> tuple[Points, Points]:
    """The region's nx × ny grid, corners included: raw px (ny, nx, 2) and field mm (ny, nx, 2)."""
    x, y = np.meshgrid(np.linspace(*region.x_mm, nx), np.linspace(*region.y_mm, ny))
    field = np.stack([x, y], axis=-1)
    raw = camera.raw_from_field(np.concatenate([field, np.full((*x.shape, 1), z_mm)], axis=-1))
    return raw, field


def landmark_observations(
    raw: Points,
    field: Points,
    noise_px: float = 0.0,
    rng: np.random.Generator | None = None,
    z_mm: float = 0.0,
) -> Observations:
    """A grid of known spots as observations, one landmark each."""
    rng = rng or np.random.default_rng(0)
    raw, field = raw.reshape(-1, 2), field.reshape(-1, 2)
    clicked = raw + rng.normal(0, noise_px, raw.shape) if noise_px else raw
    return tuple(
        Observation((float(x), float(y)), "landmark", point[None], z_mm)
        for (x, y), point in zip(field, clicked, strict=True)
    )


def rms_mm(found: NDArray, truth: NDArray) -> float:
    """Root mean square of the distances per point; NaN if any point is NaN, for it was not found."""
    return float(np.sqrt(((found - truth) ** 2).sum(axis=-1).mean()))
