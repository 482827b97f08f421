"""Reads a covariance from an imported report, refusing one that cannot be that model's.

Read as it is, a matrix with a negative variance would promise an error of 0 mm, and one of names that the model does
not have would promise that nothing moves.
"""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import Conflict, TouchlineError
from touchline.core.records import Fit
from touchline.fitting import sensitivity_of
from touchline.models import CameraModel, model_from_json
from touchline.models.ray_camera import RayCamera

LINE = re.compile(r"line_\d{1,6}")  # a line's own offset, which moves no ray
MAX_VARIANCE = 1e18  # a σ of 10⁹ px, mm or rad: a larger one overflows in products
ASYMMETRY = 1e-6  # of the correlations; rounding leaves 1e-12
NEGATIVE = -1e-6  # of the correlations' least value, likewise


def covariance_from_json(value: Any, model: CameraModel) -> tuple[tuple[str, ...], NDArray[np.float64]]:
    """Names and their matrix (n, n) from a report's "covariance"; Conflict where it is not that model's."""
    try:
        if not isinstance(value, Mapping) or not isinstance(value["names"], (list, tuple)):
            raise ValueError("no covariance")
        names, matrix = tuple(value["names"]), np.array(value["matrix"], float)
        if not (_named(names, model) and matrix.shape == (len(names), len(names)) and _is_covariance(matrix)):
            raise ValueError("no covariance of this model")
    except (TypeError, ValueError, KeyError, OverflowError, np.linalg.LinAlgError):
        raise _foreign() from None
    return names, matrix


def fit_from_json(value: Any, model: CameraModel) -> tuple[Fit, RayCamera | None]:
    """Return the fit that tells the model's error, and the model where that is another's: it only stands in for it.

    value: a report's "covariance"; Conflict where it is not that model's.
    """
    names, matrix = covariance_from_json(value, model)
    freer = value.get("freer")
    if not isinstance(freer, Mapping) or not isinstance(model, RayCamera):
        return Fit(model, (), (), covariance=matrix, parameter_names=names), None
    try:
        other = model_from_json(freer["model"], freer["parameters"])
    except (TouchlineError, KeyError, TypeError) as error:
        raise _foreign() from error
    if not isinstance(other, RayCamera):
        raise _foreign()
    names, matrix = covariance_from_json(freer, other)
    return Fit(other, (), (), covariance=matrix, parameter_names=names), model


def _foreign() -> Conflict:
    return Conflict("The covariance in the calibration does not belong to its lens model. The expected error is "
                    "unknown.", "Calibrate again with its points.", reason="foreign-covariance")


def _named(names: tuple[Any, ...], model: CameraModel) -> bool:
    """Each once, all the model's, and not only of lines' offsets."""
    sensitivity = sensitivity_of(model)
    own = set(sensitivity.names) if sensitivity else set()
    return (all(isinstance(name, str) and (name in own or LINE.fullmatch(name)) for name in names)
            and len(set(names)) == len(names) and any(name in own for name in names))


def _is_covariance(matrix: NDArray[np.float64]) -> bool:
    """Finite, symmetric, and no combination of parameters with a negative variance."""
    variance = np.diag(matrix)
    if not np.isfinite(matrix).all() or np.abs(matrix).max() > MAX_VARIANCE or (variance < 0).any():
        return False
    scale = np.sqrt(np.where(variance > 0, variance, 1.0))
    correlation = matrix / np.outer(scale, scale)
    symmetric = bool(np.abs(correlation - correlation.T).max() <= ASYMMETRY)
    return symmetric and bool(np.linalg.eigvalsh((correlation + correlation.T) / 2)[0] >= NEGATIVE)
