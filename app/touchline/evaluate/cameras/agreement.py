"""How far two calibrated cameras are apart over the part of the carpet that both see, there and at hat height.

On the carpet it is |d(p)|, as far as it is known (offsets.py); at hat height see robot_tops.py. Two cameras of a rig
were each fitted to the points that they share, so what these tell ends near them: beyond, each lens is a guess of its
own, and nothing is claimed.
"""

import numpy as np
from typing_extensions import TypedDict

from touchline.core.errors import FitFailed
from touchline.core.field import Field
from touchline.core.geometry import Array, ImageSize, root_mean_square
from touchline.core.json_values import PointJson
from touchline.evaluate.cameras.evidence import OffsetMeasurements
from touchline.evaluate.cameras.offsets import OffsetField, fit_offset_field
from touchline.evaluate.cameras.robot_tops import ExpectedAt, HatFrom, HatUnknown, apart_at_tops, carried_mm
from touchline.evaluate.cameras.shared_area import AreaMap, SharedArea, shared_area
from touchline.evaluate.fit.residuals import rms
from touchline.evaluate.fit.verdict import FAIR_MM
from touchline.models import CameraModel

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


class MeasuredDifference(TypedDict):
    """How far two cameras put the things apart that were measured: a match, a landmark, a place on a line.

    outliers: those more than FAIR_MM beside all others, a match by its number from 0. where: the place of the largest.
    """

    outliers: list[int]
    median_mm: float
    rms_mm: float
    max_mm: float
    where: PointJson


class RigAgreement(MeasuredDifference):
    """Of two cameras, by n measurements, two of a match; covered: of the area both see, the share near one of them.

    noise_mm: rms of the measurements beside the smooth difference, whose degree that is; shift_mm: from a to b, mean.
    hat_from: what hat's figures rest on; hat_unknown: why there are none.
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
    hat: PlaneDifference | None
    hat_from: HatFrom | None
    hat_unknown: HatUnknown | None


def agreement(a: CameraModel, size_a: ImageSize, b: CameraModel, size_b: ImageSize, field: Field,
              evidence: OffsetMeasurements, found: OffsetField | None = None,
              expected: tuple[ExpectedAt | None, ExpectedAt | None] | None = None) -> RigAgreement:
    """found: the field of offsets, where it is fitted already.

    expected: at hat height, of two cameras of a rig, each None where it is not known; without, a and b are one camera
    before and now, whose own errors are the same in both.
    """
    shared = shared_area(a, size_a, b, size_b, field)
    found = found or fit_offset_field(evidence)
    places = np.where(shared.both[..., None], shared.places, np.nan)
    carpet, directions = found.known_mm(places)
    if not np.isfinite(carpet).any():
        raise _not_known()
    near = np.min([np.linalg.norm(places - place, axis=-1) for place in evidence.places[found.good]], axis=0,
                  initial=np.inf) <= NEAR_MM
    known = np.isfinite(carpet)
    share = float((near & known).sum() / max(shared.both.sum(), 1))
    if expected is not None:
        places = np.where((near & known)[..., None], places, np.nan)
        carpet, directions = found.known_mm(places)
        known = np.isfinite(carpet)
        if not known.any():
            raise _not_known()
    carried = carried_mm(a, size_a, b, size_b, field.hat_height_mm, places, found)
    hat, hat_from, hat_unknown = apart_at_tops(a, b, field.hat_height_mm, places, carried, evidence, expected)
    return {**_measured(evidence, found), "n": len(evidence), "believed": int(found.good.sum()),
            "noise_mm": found.residual_mm,
            "degree": found.degree, "both_directions": bool(np.median(directions[known]) == TWO),
            "overlap_m2": shared.area_m2, "covered": share,
            "own_mm": {"a": rms(evidence.own_a_mm[found.good]), "b": rms(evidence.own_b_mm[found.good])},
            "shift_mm": [float(v) for v in np.mean(found.at(evidence.places)[0], axis=0)],
            "carpet": _map_json(shared, carpet, 0.0),
            "hat": None if hat is None else _map_json(shared, hat, field.hat_height_mm), "hat_from": hat_from,
            "hat_unknown": hat_unknown}


def _measured(evidence: OffsetMeasurements, found: OffsetField) -> MeasuredDifference:
    things, apart = evidence.by_thing(evidence.offset_mm)
    beside = evidence.offset_mm - np.sum(found.at(evidence.places)[0] * evidence.normals, axis=1)
    is_doubted = evidence.by_thing((~found.good).astype(float))[1] > 0
    worst = int(np.argmax(apart))
    return {"outliers": things[is_doubted & (evidence.by_thing(beside)[1] > FAIR_MM)].tolist(),
            "median_mm": float(np.median(apart)), "rms_mm": root_mean_square(apart), "max_mm": float(apart[worst]),
            "where": evidence.places[evidence.thing == things[worst]][0].tolist()}


def _not_known() -> FitFailed:
    return FitFailed("The shared lines and points do not determine the difference between the cameras.",
                     "Add lines or matches all over the shared area.", reason="not-known")


def _map_json(shared: SharedArea, mm: Array, z_mm: float) -> PlaneDifference:
    worst = np.unravel_index(np.nanargmax(mm), mm.shape)
    values = mm[np.isfinite(mm)]
    return {"z_mm": z_mm, "mean_mm": float(values.mean()), "p95_mm": float(np.percentile(values, 95)),
            "max_mm": float(values.max()), "where": [float(shared.x[worst[1]]), float(shared.y[worst[0]])],
            "map": shared.map_json(mm)}
