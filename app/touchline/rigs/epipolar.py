"""Epipolar geometry of two views: where a point of one view can lie in the other, and how far matches are from it.

    straight:  (x', y', 1) F (x, y, 1)ᵀ = 0, cut to the picture
    bent:      the plane through both cameras and the one's ray, as the other sees it

Lenses bend epipolar lines, so two calibrations predict F only in ideal pixels: those that a pinhole of the same focal
length and middle would see. For a lens without terms both are the same.

The bent line is walked in even angles about the camera that looks, so that no lens makes its steps long: from the
other camera's own place by way of the ray, and on past where the ray ends, or it would stop amid the picture.

First-order distance after P. Sampson (1982).
"""

import numpy as np
from typing_extensions import TypedDict

from touchline.core.errors import FitFailed
from touchline.core.geometry import Array, ImageSize, Points, as_matches, homogeneous, inside_picture
from touchline.models.ray_camera import RayCamera
from touchline.models.rotation import cross_matrix

COARSE, FINE = 181, 65  # steps of a degree at most find the part in the picture, which is then walked finely
AHEAD_MM = 1000.0  # how far along a direction it is looked at; any length gives the same pixel
APART_MM = 1.0  # nearer, two cameras stand at one place and there is no such geometry


class PredictedGeometry(TypedDict):
    """The fundamental matrix in ideal pixels, the distance of the cameras, and by how much one is turned."""

    matrix: list[list[float]]
    baseline_mm: float
    angle_deg: float


def sampson_px(fundamental: Array, a: Points, b: Points) -> Array:
    """Return the signed first-order distance, px, of matches (n, 2) from fundamental (…, 3, 3): (…, n)."""
    xa, xb = homogeneous(a), homogeneous(b)
    in_b = xa @ np.swapaxes(fundamental, -1, -2)  # (…, n, 3): the line of each a in view b
    in_a = xb @ fundamental
    with np.errstate(all="ignore"):
        steep = in_b[..., 0] ** 2 + in_b[..., 1] ** 2 + in_a[..., 0] ** 2 + in_a[..., 1] ** 2
        return np.sum(xb * in_b, axis=-1) / np.sqrt(steep)


def epipolar_px(fundamental: Array, a: Points, b: Points) -> Array:
    """Return (n,) px: the rms of a match's distances from its two epipolar lines."""
    in_b, in_a = homogeneous(a) @ fundamental.T, homogeneous(b) @ fundamental
    with np.errstate(all="ignore"):
        miss = np.sum(homogeneous(b) * in_b, axis=1) ** 2
        return np.sqrt((miss / np.sum(in_b[:, :2] ** 2, axis=1) + miss / np.sum(in_a[:, :2] ** 2, axis=1)) / 2)


def geometry(a: RayCamera, b: RayCamera) -> PredictedGeometry | None:
    """Predict it by two calibrations; None for two cameras at one place."""
    rotation, centre = pose_between(a, b)
    if not np.linalg.norm(centre) > APART_MM:
        return None
    matrix = _about_corner(b).T @ _fundamental(a, b) @ _about_corner(a)
    angle = float(np.degrees(np.arccos(np.clip((np.trace(rotation) - 1) / 2, -1, 1))))
    return {"matrix": (matrix / np.linalg.norm(matrix)).tolist(), "baseline_mm": float(np.linalg.norm(centre)),
            "angle_deg": angle}


def calibrated_epipolar_px(camera_a: RayCamera, camera_b: RayCamera, a: Points, b: Points) -> Array:
    """Return (n,) ideal px: how far matches (n, 2) raw px are from the epipolar lines of two calibrations.

    It sees only errors across those lines: two cameras that err alike, or along them, pass. NaN beyond a lens.
    Raises FitFailed no-baseline where both cameras stand at the same place.
    """
    a, b = as_matches(a, b)
    if not np.linalg.norm(pose_between(camera_a, camera_b)[1]) > APART_MM:
        raise FitFailed("Both calibrations have the same camera position.", "Compare two different cameras.",
                        reason="no-baseline")
    return epipolar_px(_fundamental(camera_a, camera_b), ideal_px(camera_a, a), ideal_px(camera_b, b))


def _fundamental(a: RayCamera, b: RayCamera) -> Array:
    """Return F (3, 3) of ideal pixels about the principal points: E = [t]× R between the inverse focal lengths."""
    rotation, centre = pose_between(a, b)
    essential = cross_matrix(centre / np.linalg.norm(centre)) @ rotation
    f = np.diag([1 / b.focal_px, 1 / b.focal_px, 1]) @ essential @ np.diag([1 / a.focal_px, 1 / a.focal_px, 1])
    return f / np.linalg.norm(f)


def pose_between(camera_a: RayCamera, camera_b: RayCamera) -> tuple[Array, Array]:
    """Return b_from_a (3, 3) and camera a's centre in b's frame, mm, from their calibrations."""
    b_from_a = camera_b.camera_from_field @ camera_a.camera_from_field.T
    return b_from_a, camera_b.camera_from_field @ (np.array(camera_a.position_mm) - np.array(camera_b.position_mm))


def ideal_px(camera: RayCamera, raw: Points) -> Points:
    """Map raw px (n, 2) to the pixels of a pinhole of the same focal length, about its centre; NaN out of reach."""
    rays = camera.rays(raw)
    with np.errstate(all="ignore"):
        return camera.focal_px * rays[..., :2] / np.where(rays[..., 2:] > 0, rays[..., 2:], np.nan)


def _about_corner(camera: RayCamera) -> Array:
    """From pixels of the picture to pixels about the principal point."""
    x, y = camera.centre_px
    return np.array([[1.0, 0, -x], [0, 1, -y], [0, 0, 1]])


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
