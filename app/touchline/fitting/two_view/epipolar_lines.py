"""Epipolar lines as they are drawn: straight by a matrix, curved by lenses.

    straight:  (x', y', 1) F (x, y, 1)ᵀ = 0, cut to the picture
    bent:      the plane through both cameras and the one's ray, as the other sees it

The bent line is walked in even angles about the camera that looks, so that no lens makes its steps long: from the
other camera's own place by way of the ray, and on past where the ray ends, or it would stop amid the picture.
"""

import numpy as np

from touchline.core.geometry import Array, ImageSize, Points, homogeneous, inside_picture
from touchline.models.ray_camera import RayCamera

COARSE, FINE = 181, 65  # steps of a degree at most find the part in the picture, which is then walked finely
AHEAD_MM = 1000.0  # how far along a direction it is looked at; any length gives the same pixel


def epipolar_segments(fundamental: Array, points_a: Points, size_b: ImageSize) -> Array:
    """Return (n, 2, 2) px: where the lines of points_a (n, 2) enter and leave picture b; NaN for one that misses it.

    For lines in picture a give the transposed matrix and points of b.
    """
    low, high = np.full(2, -0.5), np.array(tuple(size_b)) - 0.5
    middle = (low + high) / 2
    with np.errstate(all="ignore"):
        lines = homogeneous(points_a) @ np.asarray(fundamental, float).T
        lines = lines / np.linalg.norm(lines[:, :2], axis=1, keepdims=True)
        normal = lines[:, :2]
        foot = middle - (normal @ middle + lines[:, 2])[:, None] * normal
        along = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
        # a side that the line runs along bounds nothing, or everything
        to = np.where(along[:, :, None] == 0, np.where((foot >= low) & (foot <= high), np.inf, np.nan)[:, :, None]
                      * np.array([-1, 1]), (np.stack([low, high], axis=1) - foot[:, :, None]) / along[:, :, None])
        first, last = to.min(axis=2).max(axis=1), to.max(axis=2).min(axis=1)
        ends = foot[:, None] + np.stack([first, last], axis=1)[:, :, None] * along[:, None]
        return np.where((first < last)[:, None, None], ends, np.nan)


def epipolar_curves(camera_a: RayCamera, camera_b: RayCamera, points_a: Points) -> Array:
    """Return (n, FINE, 2) px: where picture b can show what is at points_a (n, 2) raw px; NaN beyond the lens.

    The ends lie a step outside the picture where the line goes on; a line that is nowhere in it is all NaN.
    """
    start = np.array(camera_a.position_mm) - np.array(camera_b.position_mm)
    with np.errstate(all="ignore"):
        start = start / np.linalg.norm(start)
        away = directions(camera_a, points_a)
        across = away - (away @ start)[:, None] * start
        across = across / np.linalg.norm(across, axis=1, keepdims=True)

        def seen(share: Array) -> Array:
            turn = np.pi * share[..., None]
            ahead = np.cos(turn) * start + np.sin(turn) * across[:, None]
            return camera_b.project(np.array(camera_b.position_mm) + AHEAD_MM * ahead)

        share = np.broadcast_to(np.linspace(0, 1, COARSE), (len(away), COARSE))
        inside = inside_picture(seen(share), camera_b.image_size)
        first = np.maximum(inside.argmax(axis=1) - 1, 0)
        last = np.minimum(COARSE - inside[:, ::-1].argmax(axis=1), COARSE - 1)
        fine = (first[:, None] + np.linspace(0, 1, FINE) * (last - first)[:, None]) / (COARSE - 1)
        return np.where(np.any(inside, axis=1)[:, None, None], seen(fine), np.nan)


def directions(camera: RayCamera, raw: Points) -> Array:
    """Return unit rays (n, 3) of raw px (n, 2) in the field frame; NaN beyond the lens."""
    with np.errstate(all="ignore"):
        rays = camera.rays(raw) @ camera.camera_from_field
        return rays / np.linalg.norm(rays, axis=1, keepdims=True)
