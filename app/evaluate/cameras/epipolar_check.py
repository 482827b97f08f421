"""The fundamental matrix of two calibrated cameras, as their calibrations predict it, and from matches.

    (x', y', 1) F (x, y, 1)ᵀ = 0   in ideal pixels: where a pinhole of the same focal length and middle would see

Lenses bend epipolar lines, so there is no such matrix of raw pixels; for a lens without terms both are the same.
"""

from typing import Any

import numpy as np

from app.core.geometry import Array, Points
from app.fitting.two_view.fundamental_matrix import fundamental_matrix
from app.fitting.two_view.relative_pose import RelativePoseParameters, ideal_px, pose_between
from app.models.ray_camera import RayCamera

APART_MM = 1.0  # nearer, two cameras stand at one place and there is no such geometry


def geometry(a: RayCamera, b: RayCamera) -> dict[str, Any] | None:
    """{"matrix", "baseline_mm", "angle_deg"}; None for two cameras at one place."""
    rotation, centre = pose_between(a, b)
    baseline = float(np.linalg.norm(centre))
    if not baseline > APART_MM:
        return None
    matrix = _about_corner(b).T @ RelativePoseParameters(rotation, centre / baseline, a.focal_px,
                                            b.focal_px).fundamental() @ _about_corner(a)
    angle = float(np.degrees(np.arccos(np.clip((np.trace(rotation) - 1) / 2, -1, 1))))
    return {"matrix": (matrix / np.linalg.norm(matrix)).tolist(), "baseline_mm": baseline, "angle_deg": angle}


def matrix_from_matches(a: RayCamera, b: RayCamera, pixels_a: Points, pixels_b: Points) -> Array:
    """The same matrix from matches alone, (n, 2) raw px; FitFailed where they do not tell it."""
    ideal = [ideal_px(camera, np.asarray(pixels, float)) + np.array(camera.centre_px)
             for camera, pixels in ((a, pixels_a), (b, pixels_b))]
    seen = np.isfinite(ideal[0]).all(axis=1) & np.isfinite(ideal[1]).all(axis=1)
    return fundamental_matrix(ideal[0][seen], ideal[1][seen]).fundamental


def _about_corner(camera: RayCamera) -> Array:
    """From pixels of the picture to pixels about the principal point."""
    x, y = camera.centre_px
    return np.array([[1.0, 0, -x], [0, 1, -y], [0, 0, 1]])
