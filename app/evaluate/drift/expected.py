"""Where a calibration expects the field's lines in the picture: places along them, for all that measures drift."""

import numpy as np
from numpy.typing import NDArray

from app.core.field import Region
from app.core.geometry import Array, ImageSize, Points
from app.fitting.field_lines.line_samples import LineSamples, sample_lines_evenly
from app.fitting.field_lines.pattern import FieldPattern
from app.models import CameraModel, raw_from_field

EDGE_MM = 20.0  # about a region: its borders belong to it


def expected_lines(model: CameraModel, pattern: FieldPattern, size: ImageSize, count: int, apart_px: float,
                   clear_px: float, region: Region | None = None) -> LineSamples:
    """Return about `count` clear places on the lines, at least apart_px apart; only those of the region if given."""
    def project(points: Array) -> Points:
        raw = raw_from_field(model, points[:, :2])
        return raw if region is None else np.where(_of_region(points, region)[:, None], raw, np.nan)

    return sample_lines_evenly(project, pattern, size, count, apart_px, clear_px)


def _of_region(points: Array, region: Region) -> NDArray[np.bool_]:
    (left, right), (low, high) = region.x_mm, region.y_mm
    return ((points[:, 0] >= left - EDGE_MM) & (points[:, 0] <= right + EDGE_MM)
            & (points[:, 1] >= low - EDGE_MM) & (points[:, 1] <= high + EDGE_MM))
