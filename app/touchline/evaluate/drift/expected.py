"""Where a calibration expects the field's lines in the picture: places along them, for all that measures drift."""

import numpy as np

from touchline.core.field import Region
from touchline.core.geometry import Array, ImageSize, Points
from touchline.fitting.field_pattern import FieldPattern, LineSamples, sample_lines_evenly
from touchline.models import CameraModel, raw_from_field

EDGE_MM = 20.0  # about a region: its borders belong to it


def expected_lines(model: CameraModel, pattern: FieldPattern, size: ImageSize, count: int, apart_px: float,
                   clear_px: float, region: Region | None = None) -> LineSamples:
    """Return about `count` clear places on the lines, at least apart_px apart; only those of the region if given."""
    def project(points: Array) -> Points:
        raw = raw_from_field(model, points[:, :2])
        if region is None:
            return raw
        low, high = np.transpose([region.x_mm, region.y_mm])
        of_region = ((points[:, :2] >= low - EDGE_MM) & (points[:, :2] <= high + EDGE_MM)).all(axis=1)
        return np.where(of_region[:, None], raw, np.nan)

    return sample_lines_evenly(project, pattern, size, count, apart_px, clear_px)
