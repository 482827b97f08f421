"""Where the search for a ray camera begins: linear methods and two stages, several candidates, best first."""

from collections.abc import Callable

import numpy as np

from touchline.core.errors import FitFailed
from touchline.core.geometry import Array, ImageSize
from touchline.fitting.linear import (
    Incidences,
    focal_from_vanishing_points,
    homography_from_lines,
    pose_from_homography,
    tsai_two_stage,
)
from touchline.fitting.ray_camera.parameters import RayCameraParameters
from touchline.fitting.ray_camera.problem import ClickResiduals
from touchline.models.lenses import Lens

FOCAL_GUESSES = (0.55, 0.8, 1.1, 1.6)  # of the picture's width: what field cameras have
PLAUSIBLE_FOCAL = (0.2, 20.0)  # of the picture's width


def start_states(lens: type[Lens], start_terms: Callable[[float, float], Array], problem: ClickResiduals,
                 incidences: Incidences, image_size: ImageSize, height_mm: float | None) -> list[RayCameraParameters]:
    """Return candidates for the refinement. Raises FitFailed where no linear method sees a camera."""
    centre, offsets_mm = np.array(image_size.centre), np.zeros(len(problem.offset_names))

    half_diagonal_px = float(np.hypot(*image_size)) / 2

    def state(focal: float, k1: float, rotation: Array, position: Array) -> RayCameraParameters:
        return RayCameraParameters(lens, float(np.log(focal)), 1.0, centre,
                                   start_terms(k1, half_diagonal_px / focal), rotation, position, offsets_mm)

    found = homography_from_lines(incidences, centre)
    plane_from_field = np.asarray(np.linalg.inv(found.field_from_plane), np.float64)
    states = [state(focal, float(np.clip(found.bend * focal**2, -1.0, 0.5)),
                    *pose_from_homography(plane_from_field, focal))
              for focal in _focals(plane_from_field, image_size, height_mm)]
    flat = problem.marks[:, 2] == 0
    if flat.sum() >= 6:  # landmarks alone allow Tsai's two stages as well
        spots = problem.pixels[problem.curves:][flat]
        try:
            rotation, position, focal, k1 = tsai_two_stage(spots - centre, problem.marks[flat, :2])
            if PLAUSIBLE_FOCAL[0] < focal / image_size.width < PLAUSIBLE_FOCAL[1] and position[2] > 0:
                states.append(state(focal, float(np.clip(k1, -0.5, 0.5)), rotation, position))
        except FitFailed:
            pass  # the linear candidates remain
    return states


def _focals(plane_from_field: Array, image_size: ImageSize, height_mm: float | None) -> list[float]:
    estimate = focal_from_vanishing_points(plane_from_field)
    focals = [f * image_size.width for f in FOCAL_GUESSES]
    if estimate is not None and PLAUSIBLE_FOCAL[0] < estimate / image_size.width < PLAUSIBLE_FOCAL[1]:
        focals.insert(0, estimate)
    if height_mm is not None:  # the focal length under which the pose comes out at the taped height
        trial = np.geomspace(*PLAUSIBLE_FOCAL, 60) * image_size.width
        _, positions_mm = pose_from_homography(plane_from_field, trial)
        focals.insert(0, float(trial[np.argmin(np.abs(positions_mm[:, 2] - height_mm))]))
    return focals
