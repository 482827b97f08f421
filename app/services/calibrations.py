"""What routes need of a saved calibration: its model, its field, its residuals."""

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from app.core.errors import Conflict
from app.core.field import Field, Region
from app.core.field_json import field_from_json
from app.core.geometry import ImageSize, Points
from app.core.records import Calibration, observations_from_json
from app.imaging.correction import CorrectedView
from app.models import CameraModel, model_from_json
from app.workflows import calibration as workflow


def model_of(calibration: Calibration) -> CameraModel:
    return model_from_json(calibration.model_name, calibration.model_parameters)


def field_and_region(calibration: Calibration) -> tuple[Field, Region]:
    field = field_from_json(calibration.field)
    return field, field.region(calibration.region, calibration.rotate)


def check_size(calibration: Calibration, size: ImageSize | None) -> None:
    """Refuse points of a picture of another size: a calibration holds for one size only."""
    if size is not None and size != calibration.image_size:
        raise Conflict(f"The picture is {size.width} × {size.height} px; the calibration was made for "
                       f"{calibration.image_size.width} × {calibration.image_size.height} px.",
                       "Use a picture of that size, or calibrate this one.", reason="size-mismatch")


def residual_vectors(calibration: Calibration, frame: Literal["raw", "corrected"],
                     view: CorrectedView) -> dict[str, Any]:
    """Return the vector from each clicked point to where the model puts it."""
    field, region = field_and_region(calibration)
    observations = observations_from_json(calibration.observations)
    outliers = [_outliers(calibration.report, i, len(o.points)) for i, o in enumerate(observations)]
    return workflow.residual_vectors(model_of(calibration), observations, field, region, outliers, frame, view)


def _outliers(report: Mapping[str, Any], index: int, count: int) -> NDArray[np.bool_]:
    """Return which points of an observation the fit left out; none where an imported report does not say."""
    try:
        outliers = [bool(point["outlier"]) for point in report["per_feature"][index]["residuals"]]
    except (KeyError, IndexError, TypeError):
        outliers = []
    return np.array(outliers if len(outliers) == count else [False] * count, bool)


def points_json(points: Points) -> list[list[float] | None]:
    """Return (n, 2) points as JSON, unreachable ones as null."""
    reachable = np.isfinite(points).all(axis=-1)
    return [point if ok else None for point, ok in zip(points.tolist(), reachable.tolist(), strict=True)]
