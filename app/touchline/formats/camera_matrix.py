"""Cameras in OpenCV's numbers, which ROS, mrcal, Kalibr and PhotonVision follow: matrix, k1 k2 p1 p2 k3 … and pose."""

from typing import Any

import numpy as np

from touchline.core.geometry import Array
from touchline.formats.metadata import CameraPose, checked_pose
from touchline.formats.numbers import format_error, matrix, number
from touchline.models.lenses.brown_conrady import TERMS
from touchline.models.lenses.kannala_brandt import TERMS as FISHEYE_TERMS
from touchline.models.ray_camera import RayCamera
from touchline.models.rotation import matrix_from_vector

LENSES = {"brown-conrady": TERMS}
LENSES_WITH_FISHEYE = {**LENSES, "fisheye": FISHEYE_TERMS}


def intrinsics_of(camera: RayCamera) -> tuple[float, float, float, float]:
    """Return fx, fy, cx, cy in px."""
    return camera.focal_px, camera.focal_px * camera.aspect, *camera.centre_px


def matrix_of(camera: RayCamera) -> tuple[float, ...]:
    """Return the camera matrix, row by row."""
    fx, fy, cx, cy = intrinsics_of(camera)
    return fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0


def read_intrinsics(value: Any, at: str) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return focal lengths and centre, px, of a camera matrix {rows, cols, data} without skew."""
    fx, skew, cx, zero, fy, cy, *last = matrix(value, at, 3, 3)
    if abs(skew) > 1e-9 * abs(fx) or zero != 0 or last != [0, 0, 1]:
        raise format_error(f"{at} is not a camera matrix without skew.", "Use [fx, 0, cx, 0, fy, cy, 0, 0, 1].")
    return (fx, fy), (cx, cy)


def translation_of(camera: RayCamera) -> Array:
    """Return the translation in mm that, with the rotation, takes field coordinates to the camera."""
    return np.asarray(-matrix_from_vector(np.array(camera.rotation)) @ np.array(camera.position_mm), np.float64)


def pose_from_field(rotation: tuple[float, ...], translation_mm: Array) -> CameraPose:
    """Return the pose of rotation and translation from field coordinates to the camera."""
    number(float(np.linalg.norm(rotation)), "The camera's rotation", 0, 10)
    return checked_pose(rotation, -matrix_from_vector(np.array(rotation)).T @ translation_mm)


def lens_terms(camera: RayCamera) -> tuple[float, ...]:
    """Return the four terms of a fisheye, else the first five or eight that leave out zeros alone."""
    return camera.lens_terms if camera.NAME == "fisheye" else trim_terms(camera.lens_terms)


def trim_terms(terms: tuple[float, ...], counts: tuple[int, ...] = (5, 8)) -> tuple[float, ...]:
    """Return the fewest terms, one of `counts`, that leave out zeros alone."""
    return next(terms[:n] for n in counts if not any(terms[n:]))


def lens_from_terms(terms: tuple[float, ...], at: str, fisheye: bool = False) -> tuple[str, tuple[float, ...]]:
    """Return the model's name and all its terms; BadInput for terms that our lens lacks, such as thin prism."""
    if fisheye:
        return "fisheye", terms
    if any(terms[len(TERMS):]):
        raise format_error(f"{at} has terms beyond k6 (thin prism or tilt), which are not supported.",
                           "Calibrate with at most eight terms.")
    return "brown-conrady", (*terms[:len(TERMS)], *(0.0,) * (len(TERMS) - len(terms)))
