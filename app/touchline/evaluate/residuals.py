"""How far each observed point lies from the line, arc or landmark it was seen on, in pixels and mm, and as vectors.

A vector ends at the nearest place of the point's line or arc, or at its landmark, as the model sees it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from typing_extensions import TypedDict

from touchline.core.field import Field, Region
from touchline.core.geometry import Array, Points, root_mean_square, with_z
from touchline.core.json_values import PointJson, nullable, nullable_points
from touchline.core.records import Observation, Observations
from touchline.evaluate.report_types import ResidualRow
from touchline.models import CameraModel, RayModel, field_from_raw, raw_from_field

MIN_PX = 1e-6  # a smaller residual is rounding, and its direction chance


@dataclass(frozen=True, eq=False)
class FeatureResiduals:
    """One observation's residuals, point by point; NaN where the model does not reach.

    foot: (n, 2) raw px, where the nearest place of the feature is seen. to_place_mm: (n, 2) field mm, from where the
    model puts the point, place_mm (n, 2), to that place. px, mm: (n,) the distances.
    """

    observation: Observation
    foot: Points
    to_place_mm: Points
    place_mm: Points

    @property
    def px(self) -> NDArray[np.float64]:
        return np.linalg.norm(self.observation.points - self.foot, axis=-1)

    @property
    def mm(self) -> NDArray[np.float64]:
        return np.linalg.norm(self.to_place_mm, axis=-1)


def feature_residuals(
    model: CameraModel, observation: Observation, field: Field, region: Region
) -> FeatureResiduals:
    """Carry the points to the field, drop a perpendicular on the feature, and look at the foot through the camera.

    Per point, not per axis: OpenCV's convention, √2 times what tools report that count x and y apart. Points
    above the carpet cannot be judged by a model without rays: NaN.
    """
    place, nearest = _carried(model, observation, field, region)
    return FeatureResiduals(
        observation, _seen(model, nearest, observation.z_mm), nearest - place, place
    )


def feature_residuals_mm(
    model: CameraModel, observation: Observation, field: Field, region: Region
) -> Array:
    """Return only how far (n,) mm the points are from the feature, on the field."""
    place, nearest = _carried(model, observation, field, region)
    return np.linalg.norm(nearest - place, axis=-1)


def _carried(
    model: CameraModel, observation: Observation, field: Field, region: Region
) -> tuple[Points, Points]:
    """Return the points' places (n, 2) mm on the field, and the feature's places nearest to them."""
    feature, z_mm = field.feature(observation.feature, region), observation.z_mm
    if z_mm == 0:
        place = field_from_raw(model, observation.points)
    elif isinstance(model, RayModel):
        place = model.unproject(observation.points, z_mm)
    else:
        place = np.full(observation.points.shape, np.nan)
    return place, feature.nearest(place)


def _seen(model: CameraModel, places: Points, z_mm: float) -> Points:
    """Field mm (n, 2) in the plane at z_mm to raw pixels."""
    if z_mm == 0 or not isinstance(model, RayModel):
        return raw_from_field(model, places)
    return model.project(with_z(places, z_mm))


def residual_rows(
    residuals: FeatureResiduals, start: Points, foot: Points, px: Array, outliers: NDArray[np.bool_]
) -> list[ResidualRow]:
    """Each point's residual as plain JSON, null out of reach; start, foot (n, 2) and px (n,) in the picture shown."""
    columns = (
        nullable_points(start),
        nullable_points(foot),
        nullable(px),
        nullable(residuals.mm),
        nullable_points(residuals.to_place_mm),
        outliers.tolist(),
    )
    return [
        {"point": point, "foot": foot, "px": px, "mm": mm, "mm_vector": vector, "outlier": outlier}
        for point, foot, px, mm, vector, outlier in zip(*columns, strict=True)
    ]


def mm_per_px(px: NDArray[np.float64], mm: NDArray[np.float64]) -> float | None:
    """What a pixel of residual (n,) is worth on the field, median; None where there is none to tell it from."""
    known = np.isfinite(mm) & (px > MIN_PX)
    return float(np.median(mm[known] / px[known])) if known.any() else None


def largest(values: NDArray[np.float64]) -> float | None:
    """Largest of the finite values; None when there are none."""
    finite = values[np.isfinite(values)]
    return float(finite.max()) if finite.size else None


def rms(values: NDArray[np.float64]) -> float | None:
    """Root mean square of the finite values; None when there are none."""
    finite = values[np.isfinite(values)]
    return root_mean_square(finite) if finite.size else None


class Arrow(ResidualRow):
    feature: str | PointJson
    index: int


class ResidualVectors(TypedDict):
    """mm_per_px: what a pixel is worth at the points, median."""

    mm_per_px: float | None
    arrows: list[Arrow]


def residual_vectors(
    model: CameraModel,
    observations: Observations,
    field: Field,
    region: Region,
    strays: Sequence[NDArray[np.bool_]],
    seen: Callable[[Points], Points],
) -> ResidualVectors:
    """Return every point's arrow, None where the model does not reach.

    strays: for each observation, which of its points (n,) the fit left out. seen: raw pixels (n, 2) to those of the
    picture that is drawn on. px: an arrow's length there. mm_vector: the same in field mm.
    """
    arrows: list[Arrow] = []
    px, mm = [], []
    for observation, out in zip(observations, strays, strict=True):
        residuals = feature_residuals(model, observation, field, region)
        start, end = seen(observation.points), seen(residuals.foot)
        length = np.linalg.norm(end - start, axis=-1)
        px.append(length[~out])
        mm.append(residuals.mm[~out])
        arrows += [
            {"feature": observation.feature_json, "index": index, **row}
            for index, row in enumerate(residual_rows(residuals, start, end, length, out))
        ]
    return {
        "mm_per_px": mm_per_px(*(np.concatenate([np.empty(0), *parts]) for parts in (px, mm))),
        "arrows": arrows,
    }
