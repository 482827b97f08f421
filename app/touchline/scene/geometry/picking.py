"""Picking: where a ray meets the carpet, the place's pixel in every camera, and the expected error there."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from touchline.core.errors import TouchlineError
from touchline.core.geometry import Points, inside_picture
from touchline.evaluate.fit.covariance_json import fit_from_json
from touchline.evaluate.fit.uncertainty import expected_error
from touchline.fitting import sensitivity_of
from touchline.models import raw_from_field
from touchline.scene.geometry.scene_camera import SceneCamera


def carpet_intersection(origin_mm: ArrayLike, direction: ArrayLike) -> Points | None:
    """Return where a ray meets the carpet, field mm (2,); None where it points away."""
    origin, ahead = np.asarray(origin_mm, np.float64), np.asarray(direction, np.float64)
    if not (np.isfinite(origin).all() and np.isfinite(ahead).all()) or origin[2] * ahead[2] >= 0:
        return None
    return origin[:2] - ahead[:2] * (origin[2] / ahead[2])


def describe_place(place_mm: ArrayLike, cameras: Sequence[SceneCamera]) -> dict[str, Any]:
    """Describe a place as JSON.

    {"place_mm", "cameras": [{"key", "pixel", "inside", "hat_pixel", "sigma_mm", "hat_sigma_mm"}, …]}.

    null for what a camera does not see or a model does not know.
    """
    place = np.asarray(place_mm, np.float64)
    return {"place_mm": place.tolist(), "cameras": [_in_camera(place, camera) for camera in cameras]}


def _in_camera(place: Points, camera: SceneCamera) -> dict[str, Any]:
    pixel, hat_mm = raw_from_field(camera.model, place), camera.field.hat_height_mm
    hat = camera.frustum.model.project(np.array([*place, hat_mm])) if camera.frustum else np.full(2, np.nan)
    return {"key": camera.key, "title": camera.title, "calibration": camera.calibration.id,
            "snapshot": camera.calibration.snapshot, "pixel": pixel.tolist() if np.isfinite(pixel).all() else None,
            "inside": bool(inside_picture(pixel, camera.model.image_size)),
            "hat_pixel": hat.tolist() if np.isfinite(hat).all() else None,
            "sigma_mm": _sigma(camera, place, 0.0), "hat_sigma_mm": _sigma(camera, place, hat_mm)}


def _sigma(camera: SceneCamera, place: Points, z_mm: float) -> float | None:
    model = camera.model
    covariance = camera.calibration.covariance
    if covariance is None or sensitivity_of(model) is None or (z_mm and camera.frustum is None):
        return None
    try:
        fit, stand_in = fit_from_json(covariance, model)
        return float(expected_error(fit, camera.region, z_mm, place.reshape(1, 1, 2), stand_in=stand_in).sigma_mm[0, 0])
    except TouchlineError:  # the model does not see the place, or its covariance is another's
        return None
