"""How far two calibrated cameras are apart where both see the carpet, there and at robot height.

Lines and points on the carpet tell how the two differ there. Camera b sees a hat in the direction of the spot of carpet
behind it, shows that spot d beside where it expects it, and so puts the hat where that ray meets the height: d carried.
What the carpet cannot tell is that a camera stands higher or elsewhere than its calibration has it: each then puts all
hats aside along its own rays, though both agree on the carpet. Only its fit knows how large that may be, so

    apart² = |d carried|² + σ_a² + σ_b²        σ: the expected error at robot-top height (uncertainty.py)

and where a calibration came without a covariance, nothing is stated.

On the carpet it is |d(p)|, as far as it is known (offsets.py). Two cameras of a rig
were each fitted to the points that they share, so what these tell ends near them: beyond, each lens is a guess of its
own, and nothing is claimed.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from typing_extensions import TypedDict

from touchline.core.errors import FitFailed, TouchlineError
from touchline.core.field import Field
from touchline.core.field_json import field_from_json
from touchline.core.geometry import (
    Array,
    ImageSize,
    Mask,
    Points,
    inside_picture,
    root_mean_square,
    with_z,
)
from touchline.core.json_values import PointJson, nullable
from touchline.core.records import Calibration
from touchline.evaluate.offsets import OffsetField, OffsetMeasurements, fit_offset_field
from touchline.evaluate.residuals import rms
from touchline.evaluate.uncertainty import expected_error, fit_from_json
from touchline.evaluate.verdict import FAIR_MM
from touchline.models import CameraModel, RayModel, field_from_raw, model_of, raw_from_field

COARSE, FINE = 96, 40  # cells along the longer side: to find the shared part, and to draw it
MIN_AT_HEIGHT = 10  # measures, two of a match: a shift, a turn and a scale with something left over

NEAR_MM = 400.0  # so far from a measure the map rests on it
TWO = 2  # directions of the carpet


class AreaMap(TypedDict):
    """x (columns,), y (rows,) mm; mm (rows, columns): a length at each place, null where it is not known."""

    x: list[float]
    y: list[float]
    mm: list[list[float | None]]


@dataclass(frozen=True, eq=False)
class SharedArea:
    """x (w,), y (h,) mm; both (h, w) bool: where both cameras see the carpet."""

    x: Array
    y: Array
    both: Mask

    @property
    def places(self) -> Points:
        return np.stack(np.meshgrid(self.x, self.y), axis=-1)

    @property
    def cell(self) -> Array:
        return np.array([self.x[1] - self.x[0], self.y[1] - self.y[0]])

    @property
    def area_m2(self) -> float:
        return float(self.both.sum() * self.cell[0] * self.cell[1]) / 1e6

    def map_json(self, mm: Array) -> AreaMap:
        return {"x": self.x.tolist(), "y": self.y.tolist(), "mm": nullable(mm)}


def shared_area(
    a: CameraModel, size_a: ImageSize, b: CameraModel, size_b: ImageSize, field: Field
) -> SharedArea:
    """Grid the part of the field that both see, finely. FitFailed no-overlap where there is none."""
    half = np.array([field.length_mm, field.width_mm]) / 2
    coarse = _seen_by_both(a, size_a, b, size_b, -half, half, COARSE)
    if not coarse.both.any():
        raise FitFailed(
            "The areas of the two cameras do not overlap.",
            "Choose cameras whose images overlap.",
            reason="no-overlap",
        )
    spans = [
        (axis[seen][0], axis[seen][-1])
        for axis, seen in ((coarse.x, coarse.both.any(axis=0)), (coarse.y, coarse.both.any(axis=1)))
    ]
    low, high = np.transpose(spans)
    return _seen_by_both(
        a, size_a, b, size_b, low - coarse.cell / 2, high + coarse.cell / 2, FINE, 4
    )


def _seen_by_both(
    a: CameraModel,
    size_a: ImageSize,
    b: CameraModel,
    size_b: ImageSize,
    low: Array,
    high: Array,
    cells: int,
    least: int = 2,
) -> SharedArea:
    sides = high - low
    counts = np.maximum(least, np.round(cells * sides / sides.max())).astype(int)
    x, y = (
        start + (np.arange(n) + 0.5) / n * side
        for start, n, side in zip(low, counts, sides, strict=True)
    )
    places = np.stack(np.meshgrid(x, y), axis=-1)
    both = inside_picture(raw_from_field(a, places), size_a) & inside_picture(
        raw_from_field(b, places), size_b
    )
    return SharedArea(x, y, both)


# of places (…, 2) mm at robot-top height: the error to expect there (…,) mm
ExpectedAt = Callable[[Points], Array]
HatFrom = Literal["carpet", "matches", "expected"]
HatUnknown = Literal["no-rays", "no-covariance", "not-seen"]


def expected_at_tops(calibration: Calibration) -> ExpectedAt | None:
    """Return the expected error at robot-top height of a calibration; None where it does not know it."""
    field = field_from_json(calibration.field)
    region = field.region(calibration.region, calibration.rotate)
    try:
        fit, stand_in = fit_from_json(calibration.covariance, model_of(calibration))
    except TouchlineError:
        return None
    return lambda places: (
        expected_error(fit, region, field.hat_height_mm, places, stand_in=stand_in).sigma_mm
    )


def carried_mm(
    a: CameraModel,
    size_a: ImageSize,
    b: CameraModel,
    size_b: ImageSize,
    z_mm: float,
    places: Points,
    found: OffsetField,
) -> Array:
    """Return how far the disagreement on the carpet, carried to z_mm, sets the cameras apart at places (…, 2) mm.

    NaN where it is not known or one of them does not see the place.
    """
    if not (isinstance(a, RayModel) and isinstance(b, RayModel)):
        return np.full(places.shape[:-1], np.nan)
    robot_tops = with_z(places, z_mm)
    raw_a, raw_b = a.project(robot_tops), b.project(robot_tops)
    behind = field_from_raw(b, raw_b)  # the spot of carpet that the hat hides
    shift, _ = found.at(behind)
    apart = np.linalg.norm(b.unproject(raw_from_field(b, behind + shift), z_mm) - places, axis=-1)
    seen = inside_picture(raw_a, size_a) & inside_picture(raw_b, size_b)
    return np.where(seen & np.isfinite(found.known_mm(behind)[0]), apart, np.nan)


def apart_at_tops(
    a: CameraModel,
    b: CameraModel,
    z_mm: float,
    places: Points,
    carried: Array,
    evidence: OffsetMeasurements,
    expected: tuple[ExpectedAt | None, ExpectedAt | None] | None,
) -> tuple[Array | None, HatFrom | None, HatUnknown | None]:
    """Return how far the cameras are apart at places (…, 2) mm of the height z_mm, by what, and why nothing is known.

    carried: by carried_mm(); expected: None for one camera before and now.
    """
    if not (isinstance(a, RayModel) and isinstance(b, RayModel)):
        return None, None, "no-rays"
    seen = np.isfinite(carried)
    if not seen.any():
        return None, None, "not-seen"
    if expected is None:
        return carried, "carpet", None
    at_height = evidence.at_height(z_mm)
    if len(at_height) >= MIN_AT_HEIGHT:
        measured = np.where(seen, fit_offset_field(at_height).known_mm(places)[0], np.nan)
        if np.isfinite(measured).any():
            return measured, "matches", None
    one, other = expected
    if one is None or other is None:
        return None, None, "no-covariance"
    return np.sqrt(carried**2 + one(places) ** 2 + other(places) ** 2), "expected", None


class PlaneDifference(TypedDict):
    """How far two cameras are apart in the plane at z_mm; where: the place of the largest difference."""

    z_mm: float
    mean_mm: float
    median_mm: float
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


def agreement(
    a: CameraModel,
    size_a: ImageSize,
    b: CameraModel,
    size_b: ImageSize,
    field: Field,
    evidence: OffsetMeasurements,
    found: OffsetField | None = None,
    expected: tuple[ExpectedAt | None, ExpectedAt | None] | None = None,
) -> RigAgreement:
    """found: the field of offsets, where it is fitted already.

    expected: at robot-top height, of two cameras of a rig, each None where it is not known; without, a and b are one
    camera before and now, whose own errors are the same in both.
    """
    shared = shared_area(a, size_a, b, size_b, field)
    found = found or fit_offset_field(evidence)
    places = np.where(shared.both[..., None], shared.places, np.nan)
    carpet, directions = found.known_mm(places)
    if not np.isfinite(carpet).any():
        raise _not_known()
    near = (
        np.min(
            [np.linalg.norm(places - place, axis=-1) for place in evidence.places[found.good]],
            axis=0,
            initial=np.inf,
        )
        <= NEAR_MM
    )
    known = np.isfinite(carpet)
    share = float((near & known).sum() / max(shared.both.sum(), 1))
    if expected is not None:
        places = np.where((near & known)[..., None], places, np.nan)
        carpet, directions = found.known_mm(places)
        known = np.isfinite(carpet)
        if not known.any():
            raise _not_known()
    carried = carried_mm(a, size_a, b, size_b, field.hat_height_mm, places, found)
    hat, hat_from, hat_unknown = apart_at_tops(
        a, b, field.hat_height_mm, places, carried, evidence, expected
    )
    return {
        **_measured(evidence, found),
        "n": len(evidence),
        "believed": int(found.good.sum()),
        "noise_mm": found.residual_mm,
        "degree": found.degree,
        "both_directions": bool(np.median(directions[known]) == TWO),
        "overlap_m2": shared.area_m2,
        "covered": share,
        "own_mm": {
            "a": rms(evidence.own_a_mm[found.good]),
            "b": rms(evidence.own_b_mm[found.good]),
        },
        "shift_mm": [float(v) for v in np.mean(found.at(evidence.places)[0], axis=0)],
        "carpet": _map_json(shared, carpet, 0.0),
        "hat": None if hat is None else _map_json(shared, hat, field.hat_height_mm),
        "hat_from": hat_from,
        "hat_unknown": hat_unknown,
    }


def _measured(evidence: OffsetMeasurements, found: OffsetField) -> MeasuredDifference:
    things, apart = evidence.by_thing(evidence.offset_mm)
    beside = evidence.offset_mm - np.sum(found.at(evidence.places)[0] * evidence.normals, axis=1)
    is_doubted = evidence.by_thing((~found.good).astype(float))[1] > 0
    worst = int(np.argmax(apart))
    return {
        "outliers": things[is_doubted & (evidence.by_thing(beside)[1] > FAIR_MM)].tolist(),
        "median_mm": float(np.median(apart)),
        "rms_mm": root_mean_square(apart),
        "max_mm": float(apart[worst]),
        "where": evidence.places[evidence.thing == things[worst]][0].tolist(),
    }


def _not_known() -> FitFailed:
    return FitFailed(
        "The shared lines and points do not determine the difference between the cameras.",
        "Add lines or matches all over the shared area.",
        reason="not-known",
    )


def _map_json(shared: SharedArea, mm: Array, z_mm: float) -> PlaneDifference:
    worst = np.unravel_index(np.nanargmax(mm), mm.shape)
    values = mm[np.isfinite(mm)]
    return {
        "z_mm": z_mm,
        "mean_mm": float(values.mean()),
        "median_mm": float(np.median(values)),
        "p95_mm": float(np.percentile(values, 95)),
        "max_mm": float(values.max()),
        "where": [float(shared.x[worst[1]]), float(shared.y[worst[0]])],
        "map": shared.map_json(mm),
    }
