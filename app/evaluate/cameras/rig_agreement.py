"""How far two calibrated cameras are apart over the part of the carpet that both see, there and at hat height.

On the carpet it is |d(p)|, as far as it is known (offsets.py). At a height the disagreement is carried: camera b
sees a hat in the direction of the spot of carpet behind it, shows that spot d beside where it expects it, and so puts
the hat where that ray meets the height. Exact for a camera that was turned; one moved by t is told a share
height / camera height too small.
"""

import numpy as np
from typing_extensions import TypedDict

from app.core.errors import FitFailed
from app.core.field import Field
from app.core.geometry import Array, ImageSize, inside_picture, with_z
from app.core.json_values import PointJson
from app.evaluate.cameras.evidence import OffsetMeasurements
from app.evaluate.cameras.offsets import OffsetField, fit_offset_field
from app.evaluate.cameras.shared_area import AreaMap, SharedArea, shared_area
from app.evaluate.fit.residuals import rms
from app.models import CameraModel, RayModel, field_from_raw, raw_from_field

NEAR_MM = 400.0  # so far from a measure the map rests on it
TWO = 2  # directions of the carpet


class PlaneDifference(TypedDict):
    """How far two cameras are apart in the plane at z_mm; where: the place of the largest difference."""

    z_mm: float
    mean_mm: float
    p95_mm: float
    max_mm: float
    where: PointJson
    map: AreaMap


class OwnErrors(TypedDict):
    """How far each camera alone is from the field's lines, rms mm."""

    a: float | None
    b: float | None


class RigAgreement(TypedDict):
    """Of two cameras, by n measurements; covered: of the area both see, the share that is near one of them.

    noise_mm: rms of the measurements beside the smooth difference, whose degree that is; shift_mm: from a to b, mean.
    """

    n: int
    believed: int
    noise_mm: float
    degree: int
    both_directions: bool
    overlap_m2: float
    covered: float
    own_mm: OwnErrors
    shift_mm: PointJson
    carpet: PlaneDifference
    hat: PlaneDifference | None  # None without rays


def agreement(a: CameraModel, size_a: ImageSize, b: CameraModel, size_b: ImageSize, field: Field,
              evidence: OffsetMeasurements, found: OffsetField | None = None) -> RigAgreement:
    """found: the field of offsets, where it is fitted already."""
    shared = shared_area(a, size_a, b, size_b, field)
    found = found or fit_offset_field(evidence)
    places = np.where(shared.both[..., None], shared.places, np.nan)
    carpet, directions = found.known_mm(places)
    if not np.isfinite(carpet).any():
        raise FitFailed("The shared lines and points do not determine the difference between the cameras.",
                        "Add lines or matches all over the shared area.", reason="not-known")
    near = np.min([np.linalg.norm(places - place, axis=-1) for place in evidence.places[found.good]], axis=0,
                  initial=np.inf) <= NEAR_MM
    known = np.isfinite(carpet)
    return {"n": len(evidence), "believed": int(found.good.sum()), "noise_mm": found.residual_mm,
            "degree": found.degree, "both_directions": bool(np.median(directions[known]) == TWO),
            "overlap_m2": shared.area_m2, "covered": float((near & known).sum() / max(shared.both.sum(), 1)),
            "own_mm": {"a": rms(evidence.own_a_mm[found.good]), "b": rms(evidence.own_b_mm[found.good])},
            "shift_mm": [float(v) for v in np.mean(found.at(evidence.places)[0], axis=0)],
            "carpet": _map_json(shared, carpet, 0.0),
            "hat": _hat(a, size_a, b, size_b, field.hat_height_mm, shared, found)}


def _hat(a: CameraModel, size_a: ImageSize, b: CameraModel, size_b: ImageSize, z_mm: float, shared: SharedArea,
         found: OffsetField) -> PlaneDifference | None:
    if not (isinstance(a, RayModel) and isinstance(b, RayModel)):
        return None
    hats = with_z(shared.places, z_mm)
    raw_a, raw_b = a.project(hats), b.project(hats)
    both = inside_picture(raw_a, size_a) & inside_picture(raw_b, size_b)
    behind = field_from_raw(b, raw_b)  # the spot of carpet that the hat hides
    shift, _ = found.at(behind)
    known = np.isfinite(found.known_mm(behind)[0])
    apart = np.linalg.norm(b.unproject(raw_from_field(b, behind + shift), z_mm) - shared.places, axis=-1)
    apart = np.where(both & known, apart, np.nan)
    return _map_json(shared, apart, z_mm) if np.isfinite(apart).any() else None


def _map_json(shared: SharedArea, mm: Array, z_mm: float) -> PlaneDifference:
    worst = np.unravel_index(np.nanargmax(mm), mm.shape)
    values = mm[np.isfinite(mm)]
    return {"z_mm": z_mm, "mean_mm": float(values.mean()), "p95_mm": float(np.percentile(values, 95)),
            "max_mm": float(values.max()), "where": [float(shared.x[worst[1]]), float(shared.y[worst[0]])],
            "map": shared.map_json(mm)}
