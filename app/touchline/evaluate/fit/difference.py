"""How far two calibrations of one picture are apart: over the picture in mm, over the field in px."""

import numpy as np
from typing_extensions import TypedDict

from touchline.core.field import Region
from touchline.core.geometry import Points
from touchline.core.json_values import PointJson, nullable
from touchline.evaluate.fit.residuals import largest, rms
from touchline.evaluate.fit.uncertainty import grid_over
from touchline.fitting.ray_camera.lens_prior import camera_intrinsics
from touchline.models import CameraModel, field_from_raw, raw_from_field
from touchline.models.intrinsics import lens_difference
from touchline.models.ray_camera import RayCamera

GRID = (25, 19)  # columns, rows over the region


class DifferenceGrid(TypedDict):
    """By rows and columns: places in field mm, and how far apart the two have them, None out of reach."""

    places: list[list[PointJson]]
    mm: list[list[float | None]]
    mm_vector: list[list[list[float | None]]]
    px: list[list[float | None]]


class LensDifference(TypedDict):
    """The ratio of focal lengths, and how far pixels move where either lens may be turned."""

    focal_ratio: float
    max_px: float | None


class Difference(TypedDict):
    rms_mm: float | None
    median_mm: float | None
    max_mm: float | None
    worst_place: PointJson | None
    rms_px: float | None
    max_px: float | None
    grid: DifferenceGrid | None  # None where neither reaches what the other sees
    lens: LensDifference | None  # None without two lenses


def difference_vectors(one: CameraModel, other: CameraModel, region: Region) -> tuple[Points, Points, np.ndarray]:
    """Over the region: places and differences (rows, columns, 2) mm, and distances in raw px; NaN out of reach.

    A place on the carpet goes through `one` to its pixel and through `other` back: mm. The same place through both to
    pixels: px.
    """
    places = grid_over(region, *GRID)
    pixels = raw_from_field(one, places)
    return (places, field_from_raw(other, pixels) - places,
            np.linalg.norm(raw_from_field(other, places) - pixels, axis=-1))


def difference_mm(one: CameraModel, other: CameraModel, region: Region) -> tuple[Points, np.ndarray, np.ndarray]:
    """The same with distances (rows, columns) in mm."""
    places, vectors, px = difference_vectors(one, other, region)
    return places, np.linalg.norm(vectors, axis=-1), px


def difference_report(one: CameraModel, other: CameraModel, region: Region) -> Difference:
    """Return the map with its rms, median, largest, and where that is; and how the lenses themselves differ."""
    places, vectors, px = difference_vectors(one, other, region)
    mm, lens = np.linalg.norm(vectors, axis=-1), _lens_json(one, other)
    if not np.isfinite(mm).any():
        return {"rms_mm": None, "median_mm": None, "max_mm": None, "worst_place": None, "rms_px": None, "max_px": None,
                "grid": None, "lens": lens}
    worst = np.unravel_index(np.nanargmax(mm), mm.shape)
    return {"rms_mm": rms(mm.ravel()), "median_mm": float(np.nanmedian(mm)), "max_mm": float(mm[worst]),
            "worst_place": places[worst].tolist(), "rms_px": rms(px.ravel()), "max_px": largest(px),
            "grid": {"places": places.tolist(), "mm": nullable(mm), "mm_vector": nullable(vectors), "px": nullable(px)},
            "lens": lens}


def _lens_json(one: CameraModel, other: CameraModel) -> LensDifference | None:
    if not (isinstance(one, RayCamera) and isinstance(other, RayCamera)):
        return None
    px = np.linalg.norm(lens_difference(camera_intrinsics(one), camera_intrinsics(other)), axis=-1)
    return {"focal_ratio": other.focal_px / one.focal_px,
            "max_px": float(np.nanmax(px)) if np.isfinite(px).any() else None}
