"""How far each observed point lies from the line, arc or landmark it was seen on, in pixels and millimetres."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.field import Field, Region
from app.geometry import Points
from app.models import CameraModel, field_from_raw, raw_from_field
from app.records import Observation


@dataclass(frozen=True, eq=False)
class FeatureResiduals:
    """One observation's residuals, point by point; NaN where the model does not reach.

    foot: (n, 2) raw px, where the nearest place of the feature is seen. px, mm: (n,) distances to it.
    """

    observation: Observation
    foot: Points
    px: NDArray[np.float64]
    mm: NDArray[np.float64]


def feature_residuals(model: CameraModel, observation: Observation, field: Field, region: Region) -> FeatureResiduals:
    """Carry the points to the carpet, drop a perpendicular on the feature, and look at the foot through the camera.

    Per point, not per axis: OpenCV's convention, √2 times what tools report that count x and y apart. Points
    above the carpet cannot be judged by a model without rays: NaN.
    """
    feature = field.feature(observation.feature, region)
    if observation.z_mm != 0:
        nothing = np.full(len(observation.points), np.nan)
        return FeatureResiduals(observation, np.full(observation.points.shape, np.nan), nothing, nothing)
    place = field_from_raw(model, observation.points)
    nearest = feature.nearest(place)
    foot = raw_from_field(model, nearest)
    return FeatureResiduals(observation, foot, np.linalg.norm(observation.points - foot, axis=-1),
                            np.linalg.norm(place - nearest, axis=-1))


def rms(values: NDArray[np.float64]) -> float | None:
    """Root mean square of the finite values; None when there are none."""
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if finite.size else None
