"""Fitting: from observations to a camera model, and the table of fitters, by the model's name in models.MODELS.

A fitter (contract.Fitter) takes observations, a field, a region and options, and returns a Fit: the model, which points
it rests on, warnings, and the covariance of its parameters. To add one for a model with a lens: a subclass of RayFitter
in ray_camera/fit.py and a line here; any other model: a file here with its own Fitter.

Beside the fitters: image_motion (a bumped camera).
"""

from collections.abc import Mapping
from typing import Any

from touchline.core.registry import Registry
from touchline.fitting.contract import Fitter, Sensitivity
from touchline.models import CameraModel

__all__ = ["FITTERS", "Fitter", "Sensitivity", "known_options", "sensitivity_of"]

FITTERS: Registry[type[Fitter]] = Registry(
    "camera model",
    {
        # four border curves, then the relation to mm
        "polynomial": "touchline.fitting.polynomial:PolynomialFitter",
        # normalised DLT, then distances in pixels
        "homography": "touchline.fitting.homography:HomographyFitter",
        # ray cameras: linear start, robust refinement
        "division": "touchline.fitting.ray_camera.fit:DivisionFitter",
        "brown-conrady": "touchline.fitting.ray_camera.fit:BrownConradyFitter",
        "fisheye": "touchline.fitting.ray_camera.fit:FisheyeFitter",
        "ssl": "touchline.fitting.ray_camera.fit:SslFitter",
    },
)


def sensitivity_of(model: CameraModel) -> Sensitivity | None:
    """Return how the model's view moves with its parameters; None where it has no common ones, or is fitted no more."""
    fitter = FITTERS.find(model.NAME)
    return None if fitter is None else fitter.sensitivity(model)


def known_options(name: str, options: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return those of the options that a model's fitter has."""
    known = {option.name for option in FITTERS[name].OPTIONS}
    return {key: value for key, value in (options or {}).items() if key in known}
