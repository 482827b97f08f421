"""The fundamental matrix of two calibrated cameras, as their calibrations predict it.

    (x', y', 1) F (x, y, 1)ᵀ = 0   in ideal pixels: where a pinhole of the same focal length and middle would see

Lenses bend epipolar lines, so there is no such matrix of raw pixels; for a lens without terms both are the same.
"""

import numpy as np
from typing_extensions import TypedDict

from touchline.core.geometry import Array
from touchline.fitting.two_view.relative_pose import RelativePoseParameters, pose_between
from touchline.models.ray_camera import RayCamera

APART_MM = 1.0  # nearer, two cameras stand at one place and there is no such geometry


class PredictedGeometry(TypedDict):
    """The fundamental matrix in ideal pixels, the distance of the cameras, and by how much one is turned."""

    matrix: list[list[float]]
    baseline_mm: float
    angle_deg: float


def geometry(a: RayCamera, b: RayCamera) -> PredictedGeometry | None:
    """Predict it by two calibrations; None for two cameras at one place."""
    rotation, centre = pose_between(a, b)
    baseline = float(np.linalg.norm(centre))
    if not baseline > APART_MM:
        return None
    pose = RelativePoseParameters(rotation, centre / baseline, a.focal_px, b.focal_px)
    matrix = _about_corner(b).T @ pose.fundamental() @ _about_corner(a)
    angle = float(np.degrees(np.arccos(np.clip((np.trace(rotation) - 1) / 2, -1, 1))))
    return {"matrix": (matrix / np.linalg.norm(matrix)).tolist(), "baseline_mm": baseline, "angle_deg": angle}


def _about_corner(camera: RayCamera) -> Array:
    """From pixels of the picture to pixels about the principal point."""
    x, y = camera.centre_px
    return np.array([[1.0, 0, -x], [0, 1, -y], [0, 0, 1]])
