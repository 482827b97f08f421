"""Two cameras that see the same: the geometry between their pictures, and whether they agree in millimetres.

Each part stands by itself: things that all lie on the carpet tell no geometry, and yet whether two calibrations agree
there. A part that cannot be had is named under "failed", with its cure.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Self, TypeVar

import numpy as np

from touchline.core.errors import BadInput, Conflict, FitFailed
from touchline.core.field_json import field_from_json
from touchline.core.geometry import (
    Array,
    ImageSize,
    Indices,
    Mask,
    Points,
    as_matches,
    inside_picture,
    root_mean_square,
)
from touchline.core.json_values import PointsJson, nullable, nullable_points
from touchline.core.progress import Progress, no_progress
from touchline.core.records import Calibration, observations_from_json
from touchline.core.statements import say
from touchline.evaluate.cameras import pair_verdict
from touchline.evaluate.cameras.own_accuracy import own_accuracy
from touchline.evaluate.cameras.pair_agreement import CELLS, from_matches, from_observations
from touchline.evaluate.cameras.shared_area import overlap
from touchline.fitting.two_view.epipolar_lines import epipolar_curves, epipolar_segments
from touchline.fitting.two_view.fundamental_matrix import fundamental_matrix
from touchline.fitting.two_view.relative_pose import calibrated_epipolar_px, pose_between, relative_pose
from touchline.models import CameraModel, field_from_raw, raw_from_field
from touchline.models.ray_camera import RayCamera
from touchline.models.restored import model_of
from touchline.models.rotation import vector_from_matrix
from touchline.workflows.pair_types import (
    CalibratedJson,
    FailedPart,
    FundamentalJson,
    PairAgreement,
    PairLines,
    PairReport,
    PartName,
    PoseJson,
    Turn,
)

Part = TypeVar("Part")


def run_pair(spec: Any, progress: Progress) -> PairReport:
    """A job: {"points_a", "points_b", "calibration_a", "calibration_b" (whole, as JSON; or None), "z_mm"}."""
    a, b = (None if spec[k] is None else Calibration.from_json(spec[k]) for k in ("calibration_a", "calibration_b"))
    return evaluate_pair(spec["points_a"], spec["points_b"], a, b, spec["z_mm"], progress)


def evaluate_pair(points_a: Any, points_b: Any, a: Calibration | None = None, b: Calibration | None = None,
                  z_mm: float | Sequence[float | None] = 0.0, progress: Progress = no_progress) -> PairReport:
    """Evaluate a pair.

    points_a, points_b (n, 2) raw px: the same things in both pictures; None for one that is not clicked yet, and such a
    match counts only in the numbering. z_mm above the carpet: all of them, or each its own, None for one whose height
    is not known; agreement does without those. Without points, or without any height,
    two calibrations are judged by the lines and landmarks that both were clicked on.
    """
    if (points_a is None) != (points_b is None) or (a is None) != (b is None):
        raise BadInput("Points or calibrations are given for one camera only.",
                       "Send points for both images, and both calibrations or none.",
                       reason="one-sided")
    if points_a is None and a is None:
        raise BadInput("There is nothing to compare.", "Send matched points, or two calibrations.",
                       reason="nothing-given")
    _refuse_different_fields(a, b)
    matches = None if points_a is None else _Matches.of(points_a, points_b, z_mm)
    models = None if a is None or b is None else (model_of(a), model_of(b))
    cameras = None if models is None else ray_cameras(*models)
    attempts = _Attempts((matches is not None) * (1 if cameras is None else 3) + (models is not None), progress)
    report: PairReport = {
        "fundamental": None if matches is None else attempts.make("fundamental", lambda: _fundamental(matches)),
        "pose": None if matches is None or cameras is None else attempts.make(
            "pose", lambda: _pose(*cameras, matches)),
        "calibrated": None if matches is None or cameras is None else attempts.make(
            "calibrated", lambda: _calibrated(*cameras, matches)),
        "agreement": None if a is None or b is None or models is None else attempts.make(
            "agreement", lambda: _agreement(a, b, *models, matches)),
        "matches": 0 if matches is None else len(matches.a), "failed": attempts.failed}
    if attempts.refusal is not None and len(attempts.failed) == attempts.count:
        raise attempts.refusal
    return report


class _Attempts:
    """Make parts, of which some may fail: those are listed, and the first refusal is kept."""

    def __init__(self, count: int, progress: Progress) -> None:
        self.count, self._progress, self._begun = count, progress, 0
        self.failed: list[FailedPart] = []
        self.refusal: FitFailed | None = None

    def make(self, name: PartName, part: Callable[[], Part]) -> Part | None:
        self._progress(self._begun / self.count,
                       say("progress.evaluating-pair", "Evaluating the pair: {part}", part=name))
        self._begun += 1
        try:
            return part()
        except FitFailed as refusal:
            self.failed.append({**refusal.to_json(), "part": name})
            self.refusal = self.refusal or refusal
            return None


@dataclass(frozen=True, eq=False)
class _Matches:
    """a, b (n, 2) raw px, heights_mm (n,), NaN where not known; which (n,): their place among the count given."""

    a: Points
    b: Points
    heights_mm: Array
    which: Indices
    count: int

    @classmethod
    def of(cls, points_a: Any, points_b: Any, z_mm: float | Sequence[float | None]) -> Self:
        count = len(points_a)
        which = np.arange(count)
        if isinstance(points_a, list) and isinstance(points_b, list) and len(points_b) == count:
            pairs = zip(points_a, points_b, strict=True)
            which = np.array([i for i, (p, q) in enumerate(pairs) if p is not None and q is not None], np.intp)
            points_a, points_b = ([points[i] for i in which] for points in (points_a, points_b))
        return cls(*as_matches(points_a, points_b), _heights(z_mm, count)[which], which, count)

    def in_given_order(self, values: Array) -> list[float | None]:
        """Put a value of each into the order in which the matches were given."""
        all_values = np.full(self.count, np.nan)
        all_values[self.which] = values
        return nullable(all_values)

    def numbers(self, chosen: Mask) -> list[int]:
        return self.which[chosen].tolist()


def _refuse_different_fields(a: Calibration | None, b: Calibration | None) -> None:
    if a is not None and b is not None and a.field != b.field:
        raise Conflict(say("pair.other-fields", "The two calibrations are for different fields."),
                       say("pair.same-field", "Choose two cameras above the same field."), reason="different-fields")


def ray_cameras(a: CameraModel, b: CameraModel) -> tuple[RayCamera, RayCamera] | None:
    """Return both where both have rays."""
    return (a, b) if isinstance(a, RayCamera) and isinstance(b, RayCamera) else None


def _heights(z_mm: float | Sequence[float | None], count: int) -> Array:
    """(count,) mm, NaN where it is not known."""
    if not isinstance(z_mm, Sequence):
        return np.full(count, float(z_mm))
    if len(z_mm) != count:
        raise BadInput(f"There are {len(z_mm)} heights for {count} matches.",
                       "Send one height for all, or one for each match (null if it is unknown).", reason="bad-matches")
    return np.array([np.nan if z is None else float(z) for z in z_mm])


def _fundamental(matches: _Matches) -> FundamentalJson:
    found = fundamental_matrix(matches.a, matches.b)
    return {"matrix": found.fundamental.tolist(), "rms_px": found.rms_px, "sigma_px": found.sigma_px,
            "epipolar_px": matches.in_given_order(found.epipolar_px), "outliers": matches.numbers(~found.good),
            "epipoles": [e.tolist() for e in found.epipoles],
            "verdict": pair_verdict.of_fundamental(found.epipolar_px, found.good, matches.which)}


def _pose(model_a: RayCamera, model_b: RayCamera, matches: _Matches) -> PoseJson:
    """Relative pose from matches and lenses alone, and how far it is from the pose by the two calibrations."""
    found = relative_pose(model_a, model_b, matches.a, matches.b)
    good = found.epipolar_px[found.good]
    rotation, centre = pose_between(model_a, model_b)
    apart_deg = _degrees(vector_from_matrix(found.b_from_a @ rotation.T))
    length = float(np.linalg.norm(centre))
    cosine = float(found.direction @ centre / length) if length > 1.0 else None  # mm
    return {"rotation": vector_from_matrix(found.b_from_a).tolist(), "direction": found.direction.tolist(),
            **_turn(found.b_from_a), "rotation_sigma_deg": found.rotation_sigma_deg,
            "direction_sigma_deg": found.direction_sigma_deg,
            "from_calibrations_deg": {"rotation": apart_deg, "direction": None if cosine is None else float(
                np.degrees(np.arccos(np.clip(cosine, -1, 1))))},
            "essential": found.essential.tolist(), "rms_px": root_mean_square(good),
            "epipolar_px": matches.in_given_order(found.epipolar_px), "outliers": matches.numbers(~found.good),
            "verdict": pair_verdict.of_pose(apart_deg, found.rotation_sigma_deg)}


def _turn(b_from_a: Array) -> Turn:
    vector = vector_from_matrix(b_from_a)
    return {"rotation_deg": np.degrees(vector).tolist(), "angle_deg": _degrees(vector)}


def _degrees(vector: Array) -> float:
    return float(np.degrees(np.linalg.norm(vector)))


def _calibrated(model_a: RayCamera, model_b: RayCamera, matches: _Matches) -> CalibratedJson:
    found = calibrated_epipolar_px(model_a, model_b, matches.a, matches.b)
    seen = found[np.isfinite(found)]
    if not seen.size:
        raise FitFailed(say("pair.nothing-shared", "None of the matches is within the range of both lenses."),
                        say("pair.check-points", "Check that the points belong to these cameras."),
                        reason="nothing-shared")
    rotation, centre = pose_between(model_a, model_b)
    return {"median_px": float(np.median(seen)), "rms_px": root_mean_square(seen),
            "epipolar_px": matches.in_given_order(found), **_turn(rotation), "translation_mm": centre.tolist(),
            "distance_mm": float(np.linalg.norm(centre)), "verdict": pair_verdict.of_calibrated(found, matches.which)}


def _agreement(a: Calibration, b: Calibration, model_a: CameraModel, model_b: CameraModel,
               matches: _Matches | None) -> PairAgreement:
    field = field_from_json(a.field)
    shared = overlap(model_a, a.image_size, model_b, b.image_size, field, CELLS)
    apart = None
    if matches is not None and np.isfinite(matches.heights_mm).any():
        found = from_matches(model_a, model_b, matches.a, matches.b, matches.heights_mm)
        placed = np.full(len(matches.a), np.nan)
        placed[found.which] = found.apart_mm
        apart = matches.in_given_order(placed)
    else:
        seen = [observations_from_json(c.observations) for c in (a, b)]
        found = from_observations(model_a, seen[0], field.region(a.region, a.rotate), model_b, seen[1],
                                  field.region(b.region, b.rotate), field)
    result = found.to_json(shared)
    against = [own for own in (own_accuracy(a.camera or "The first camera", a.report),
                               own_accuracy(b.camera or "The second camera", b.report)) if own is not None]
    return {**result, "from": "clicks" if apart is None else "matches", "apart_mm": apart,
            "verdict": pair_verdict.of_agreement(found, result["covered"], against)}


def lines_by_matrix(matrix: Any, points_a: Any, points_b: Any, size_a: ImageSize, size_b: ImageSize) -> PairLines:
    """Epipolar lines from a fundamental matrix."""
    fundamental, (a, b) = np.array(matrix, float), (np.array(p, float).reshape(-1, 2) for p in (points_a, points_b))
    return {"in_b": _drawn(epipolar_segments(fundamental, a, size_b)),
            "in_a": _drawn(epipolar_segments(fundamental.T, b, size_a)), "place_in_b": None, "place_in_a": None}


def lines_by_calibrations(a: Calibration, b: Calibration, points_a: Any, points_b: Any,
                          z_mm: float | None = 0.0) -> PairLines:
    """The same predicted by two calibrations, bent as the lenses bend; None for models without rays."""
    _refuse_different_fields(a, b)
    models = model_of(a), model_of(b)
    ends = [np.array(p, float).reshape(-1, 2) for p in (points_a, points_b)]
    in_a, in_b = (None if cameras is None else _drawn(epipolar_curves(*cameras, points))
                  for cameras, points in ((ray_cameras(*models[::-1]), ends[1]), (ray_cameras(*models), ends[0])))
    return {"in_a": in_a, "in_b": in_b, "place_in_a": _place(*models[::-1], ends[1], z_mm, a.image_size),
            "place_in_b": _place(*models, ends[0], z_mm, b.image_size)}


def _place(here: CameraModel, there: CameraModel, points: Points, z_mm: float | None,
           size: ImageSize) -> PointsJson | None:
    if z_mm is None:
        return None
    if z_mm == 0:
        found = raw_from_field(there, field_from_raw(here, points))
    elif (cameras := ray_cameras(here, there)) is not None:
        places = cameras[0].unproject(points, z_mm)
        found = cameras[1].project(np.column_stack([places, np.full(len(places), z_mm)]))
    else:
        return None
    return nullable_points(np.where(inside_picture(found, size)[:, None], found, np.nan))


def _drawn(lines: Array) -> list[PointsJson | None]:
    """Each line's points, None where it is out of reach; None for one that is nowhere in the picture."""
    reached = np.isfinite(lines).all(axis=2).sum(axis=1)
    return [nullable_points(line) if count >= 2 else None for line, count in zip(lines, reached, strict=True)]
