"""How two lenses differ over the picture, in pixels, once each may be turned: a camera's pose takes up any rotation.

A pixel goes out through the first lens as a ray, is turned by the one rotation that brings both lenses closest over
the whole picture, and comes back through the second. (The same measure as D. Kogan's mrcal uses, for far points.)
"""

import numpy as np

from touchline.core.geometry import Array, ImageSize
from touchline.models.intrinsics import Intrinsics
from touchline.models.rotation import matrix_from_vector

GRID = (24, 18)
TURN_STEPS = 8
STEP_RAD = 1e-6


def picture_grid(size: ImageSize, columns: int = GRID[0], rows: int = GRID[1]) -> Array:
    """(rows, columns, 2) px, the middles of equal cells."""
    x = (np.arange(columns) + 0.5) * size.width / columns - 0.5
    y = (np.arange(rows) + 0.5) * size.height / rows - 0.5
    return np.stack(np.meshgrid(x, y), axis=-1)


def lens_difference(first: Intrinsics, second: Intrinsics, pixels: Array | None = None) -> Array:
    """Vectors (…, 2) px at the given pixels of the first, or its grid; NaN where either lens sees nothing."""
    pixels = picture_grid(first.image_size) if pixels is None else pixels
    rays = first.rays(pixels)
    rotation = np.eye(3)
    for _ in range(TURN_STEPS):
        projected = second.project(rays @ rotation.T)
        fine = np.isfinite(projected).all(axis=-1)
        if fine.sum() < 3:
            break
        by = np.stack([(second.project(rays @ (turn @ rotation).T) - projected)[fine].ravel() / STEP_RAD
                       for turn in matrix_from_vector(np.eye(3) * STEP_RAD)], axis=1)
        error = (projected - pixels)[fine].ravel()
        known = np.isfinite(by).all(axis=1)
        step = np.linalg.lstsq(by[known], -error[known], rcond=None)[0]
        rotation = matrix_from_vector(np.clip(step, -0.5, 0.5)) @ rotation
        if np.linalg.norm(step) < 1e-12:
            break
    return second.project(rays @ rotation.T) - pixels
