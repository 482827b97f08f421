"""How far two calibrations of one picture are apart: over the picture in mm, over the field in px."""

from typing import Any

import numpy as np

from app.core.field import Region
from app.core.geometry import Points
from app.core.json_values import nullable
from app.evaluate.fit.residuals import rms
from app.evaluate.fit.uncertainty import grid_over
from app.models import CameraModel, field_from_raw, raw_from_field

GRID = (25, 19)  # columns, rows over the region


def difference_mm(one: CameraModel, other: CameraModel, region: Region) -> tuple[Points, np.ndarray, np.ndarray]:
    """Over the region: places (rows, columns, 2) mm, and there the difference in mm and in raw px; NaN out of reach.

    A place on the carpet goes through `one` to its pixel and through `other` back: mm. The same place through both to
    pixels: px.
    """
    places = grid_over(region, *GRID)
    pixels = raw_from_field(one, places)
    return (places, np.linalg.norm(field_from_raw(other, pixels) - places, axis=-1),
            np.linalg.norm(raw_from_field(other, places) - pixels, axis=-1))


def difference_report(one: CameraModel, other: CameraModel, region: Region) -> dict[str, Any]:
    """The map as plain JSON, with its rms, median, largest, and where that is."""
    places, mm, px = difference_mm(one, other, region)
    if not np.isfinite(mm).any():
        return {"rms_mm": None, "median_mm": None, "max_mm": None, "worst_place": None, "rms_px": None, "max_px": None,
                "grid": None}
    worst = np.unravel_index(np.nanargmax(mm), mm.shape)
    return {"rms_mm": rms(mm.ravel()), "median_mm": float(np.nanmedian(mm)), "max_mm": float(mm[worst]),
            "worst_place": places[worst].tolist(), "rms_px": rms(px.ravel()), "max_px": float(np.nanmax(px)),
            "grid": {"places": places.tolist(), "mm": nullable(mm), "px": nullable(px)}}
