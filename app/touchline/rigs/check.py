"""How far the cameras of a rig agree, two by two; and two calibrations alone, as a rig of two.

Each part stands by itself: things that all lie on the carpet tell no geometry, and yet whether two calibrations agree
there. A part that cannot be had is named under "failed", with its cure.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, Literal, TypeVar, final

import numpy as np
from typing_extensions import TypedDict

from touchline.core.errors import BadInput, Conflict, FitFailed, ProblemJson
from touchline.core.field import Field
from touchline.core.field_json import field_from_json
from touchline.core.geometry import (
    Array,
    ImageSize,
    Pixels,
    Points,
    inside_picture,
    root_mean_square,
)
from touchline.core.jobs import Progress, no_progress, subprogress
from touchline.core.json_values import PointsJson, nullable_points
from touchline.core.records import Calibration
from touchline.core.statements import join, say
from touchline.drift.check import verdict_in
from touchline.evaluate.agreement import AreaMap, RigAgreement, agreement, expected_at_tops
from touchline.models import CameraModel, field_from_raw, model_of, raw_from_field
from touchline.models.ray_camera import RayCamera
from touchline.models.rotation import vector_from_matrix
from touchline.rigs import verdict as verdicts
from touchline.rigs.evidence import (
    Matches,
    PredictedGeometry,
    best_evidence,
    calibrated_epipolar_px,
    epipolar_curves,
    epipolar_segments,
    geometry,
    pose_between,
)
from touchline.rigs.fundamental_matrix import fundamental_matrix
from touchline.rigs.rig import Rig, RigMember, RigStatus, rig_status
from touchline.rigs.verdict import ComparedPair, PairVerdict, RigTrouble, RigVerdict, Source
from touchline.workflows.job_pictures import job_pictures

READING = 0.2  # of a check with pictures
Part = TypeVar("Part")
PartName = Literal["fundamental", "calibrated", "agreement"]


class FundamentalJson(TypedDict):
    """From matches alone. epipoles: homogeneous, in picture a and in b."""

    matrix: list[list[float]]
    rms_px: float
    sigma_px: float
    epipolar_px: list[float | None]
    outliers: list[int]
    epipoles: list[list[float]]
    verdict: PairVerdict


class CalibratedJson(TypedDict):
    """How far matches are from the epipolar lines by two calibrations, px; camera a in camera b's frame, mm.

    rotation_deg: about camera b's axes (right, down, ahead); angle_deg: altogether.
    """

    rotation_deg: list[float]
    angle_deg: float
    median_px: float
    rms_px: float
    epipolar_px: list[float | None]
    translation_mm: list[float]
    distance_mm: float
    verdict: PairVerdict


_AgreementSource = TypedDict("_AgreementSource", {"from": Source})


class PairAgreement(RigAgreement, _AgreementSource):
    """By n things that both see; apart_mm: of each match, null where it has no height; map: that of the carpet."""

    apart_mm: list[float | None] | None
    map: AreaMap
    verdict: PairVerdict


class FailedPart(ProblemJson):
    part: PartName


class PairReport(TypedDict):
    """Each part is null where it was not asked for, or could not be had; lists have one value for each match."""

    fundamental: FundamentalJson | None
    calibrated: CalibratedJson | None
    agreement: PairAgreement | None
    matches: int
    failed: list[FailedPart]


class PairLines(TypedDict):
    """Epipolar lines in picture a of the points in b, and the reverse, null where nowhere in the picture or without
    rays; place_in_b: where picture b shows what picture a shows at its points, if that is at the height."""

    in_a: list[PointsJson | None] | None
    in_b: list[PointsJson | None] | None
    place_in_a: PointsJson | None
    place_in_b: PointsJson | None


class FailedMatches(ProblemJson):
    part: Literal["all"]


@final
class UselessMatches(TypedDict):
    failed: list[FailedMatches]


_PairSource = TypedDict("_PairSource", {"from": Source | None})


class RigPair(ComparedPair, _PairSource):
    """fundamental: predicted by the calibrations, in ideal pixels; matches: evaluated by themselves."""

    fundamental: PredictedGeometry | None
    matches: PairReport | UselessMatches | None
    notes: list[str]
    failed: ProblemJson | None


class ComparedRig(RigStatus):
    pairs: list[RigPair]
    verdict: RigVerdict


class RigReport(ComparedRig):
    """missing: cameras that delivered no image."""

    missing: list[RigTrouble]


@dataclass(frozen=True, eq=False)
class Compared:
    """Two calibrations over one field, by things, so many, of the best evidence there is.

    apart_mm: of each match, in the order given.
    """

    titles: tuple[str, str]
    agreement: RigAgreement
    things: int
    source: Source
    notes: list[str]
    apart_mm: list[float | None] | None
    verdict: PairVerdict


def run_check(spec: Any, progress: Progress) -> RigReport:
    """A job: {"rig", "missing": cameras without a picture, "matches": [{"a", "b", "points_a", "points_b", "z_mm"}]}."""
    rig = Rig.from_json(spec["rig"])
    wanted = [camera for camera in rig.cameras if camera.picture is not None]
    pictures = dict(_read(wanted, progress)) if wanted else {}
    found = check(
        rig, pictures, spec["matches"], subprogress(progress, READING if wanted else 0.0, 1.0)
    )
    return {**found, "missing": spec["missing"]}


def _read(cameras: Sequence[RigMember], progress: Progress) -> Iterator[tuple[str, Pixels]]:
    with job_pictures(
        camera.picture for camera in cameras if camera.picture is not None
    ) as pictures:
        for number, (camera, (_, read)) in enumerate(zip(cameras, pictures, strict=True)):
            progress(
                READING * number / len(cameras),
                say(
                    "progress.reading-camera",
                    "Reading the image from {camera}",
                    camera=camera.title,
                ),
            )
            yield camera.camera, read().pixels


def check(
    rig: Rig,
    pictures: Mapping[str, Pixels],
    matches: Sequence[Mapping[str, Any]] = (),
    progress: Progress = no_progress,
) -> ComparedRig:
    """Return each camera's status in the rig, and how far each two are apart that see a common part."""
    _refuse_unknown(matches, rig.titles)
    status, calibrations = rig_status(rig), rig.compared()
    usable = {
        camera.camera: pixels
        for camera in rig.cameras
        if (pixels := pictures.get(camera.camera)) is not None and camera.has_size(pixels)
    }
    couples = list(combinations(calibrations, 2))
    pairs: list[RigPair] = []
    for number, (a, b) in enumerate(couples):
        part = subprogress(
            progress,
            number / len(couples),
            (number + 1) / len(couples),
            say("progress.pair", "{a} and {b}:", a=rig.titles[a], b=rig.titles[b]),
        )
        part(0.0, say("progress.comparing", "Comparing"))
        pairs.append(
            _pair(
                rig,
                (a, b),
                (calibrations[a], calibrations[b]),
                usable,
                _matches_of(matches, a, b),
                part,
            )
        )
    for camera in status["cameras"]:
        name = camera["camera"]
        if name in calibrations:
            camera["troubles"] += [
                *verdicts.of_report(name, camera["title"], calibrations[name].report),
                *_in_picture(name, camera["title"], calibrations[name], usable.get(name)),
            ]
    troubles = [trouble for camera in status["cameras"] for trouble in camera["troubles"]]
    return {**status, "pairs": pairs, "verdict": verdicts.of_rig(pairs, troubles, rig.titles)}


def _in_picture(
    camera: str, title: str, calibration: Calibration, pixels: Pixels | None
) -> Iterator[RigTrouble]:
    """Yield what the lines in its picture say against a calibration, also where no other camera looks."""
    if pixels is None:
        return
    found = verdict_in(pixels, calibration)
    if found["lines_level"] == "poor":
        where = say("rig.in-image-from", "In the image from {camera}:", camera=title)
        yield verdicts.camera_trouble(
            camera, "lines-misplaced", join(where, found["sentence"]), found["fix"], "poor"
        )


def _pair(
    rig: Rig,
    names: tuple[str, str],
    both: tuple[Calibration, Calibration],
    pictures: Mapping[str, Pixels],
    given: Mapping[str, Any] | None,
    progress: Progress,
) -> RigPair:
    a, b = names
    cameras = ray_cameras(model_of(both[0]), model_of(both[1]))
    matches = (
        None if given is None else Matches.of(given["points_a"], given["points_b"], given["z_mm"])
    )
    answer: RigPair = {
        "a": a,
        "b": b,
        "fundamental": None if cameras is None else geometry(*cameras),
        "matches": None,
        "agreement": None,
        "from": None,
        "verdict": None,
        "notes": [],
        "failed": None,
    }
    found: Compared | FitFailed
    try:
        found = compare(
            *both,
            rig.field,
            (rig.titles[a], rig.titles[b]),
            matches,
            (pictures.get(a), pictures.get(b)),
            progress,
        )
        answer = {
            **answer,
            "agreement": found.agreement,
            "from": found.source,
            "notes": found.notes,
            "verdict": found.verdict,
        }
    except FitFailed as refusal:
        found, answer = refusal, {**answer, "failed": refusal.to_json()}
    if matches is not None:
        answer["matches"] = _crosscheck(matches, both, found)
    return answer


def _crosscheck(
    matches: Matches, both: tuple[Calibration, Calibration], found: Compared | FitFailed
) -> PairReport | UselessMatches:
    """Evaluate the matches by themselves and against the calibrations, as POST /pairs does."""

    def compared() -> Compared:
        if isinstance(found, FitFailed):
            raise found
        return found

    try:
        return _report(matches, both, compared)
    except FitFailed as refusal:
        return {"failed": [{**refusal.to_json(), "part": "all"}]}


def compare(
    a: Calibration,
    b: Calibration,
    field: Field,
    titles: tuple[str, str],
    matches: Matches | None = None,
    pictures: tuple[Pixels | None, Pixels | None] = (None, None),
    progress: Progress = no_progress,
) -> Compared:
    """Return how far two calibrations over a field are apart, by the best evidence there is.

    titles: of the two cameras; pictures: of the size that each calibration is for. FitFailed where they share nothing,
    or what they share does not tell.
    """
    models = model_of(a), model_of(b)
    evidence, source, notes = best_evidence((a, b), models, field, matches, pictures, progress)
    found = agreement(
        models[0],
        a.image_size,
        models[1],
        b.image_size,
        field,
        evidence,
        expected=(expected_at_tops(a), expected_at_tops(b)),
    )
    things, apart = evidence.by_thing(evidence.offset_mm)
    apart_mm = None
    if source == "matches" and matches is not None:  # they come first, lines after them
        is_match = things < len(matches.a)
        things, apart = things[is_match], apart[is_match]
        found["outliers"] = matches.numbers(
            [number for number in found["outliers"] if number < len(matches.a)]
        )
        placed = np.full(len(matches.a), np.nan)
        placed[things] = apart
        apart_mm = matches.in_given_order(placed)
    verdict = verdicts.of_pair(*titles, found, len(things), source)
    return Compared(titles, found, len(things), source, notes, apart_mm, verdict)


def _matches_of(matches: Sequence[Mapping[str, Any]], a: str, b: str) -> Mapping[str, Any] | None:
    """Those of a pair, whichever way round they were given."""
    for one in matches:
        if (one["a"], one["b"]) == (a, b):
            return one
        if (one["a"], one["b"]) == (b, a):
            return {**one, "a": a, "b": b, "points_a": one["points_b"], "points_b": one["points_a"]}
    return None


def _refuse_unknown(matches: Sequence[Mapping[str, Any]], known: Mapping[str, str]) -> None:
    for one in matches:
        for name in (one["a"], one["b"]):
            if name not in known:
                raise BadInput(
                    f"Matches name a camera {name!r} that is not in this rig.",
                    f"Use two of: {', '.join(sorted(known))}.",
                    reason="unknown-camera",
                )
        if len(one["points_a"]) != len(one["points_b"]):
            raise BadInput(
                "The matches do not have the same number of points in both images.",
                "Send the same number of points for each image.",
                reason="bad-matches",
            )


def run_pair(spec: Any, progress: Progress) -> PairReport:
    """A job: {"points_a", "points_b", "calibration_a", "calibration_b" (whole, as JSON; or None), "z_mm"}."""
    a, b = (
        None if spec[k] is None else Calibration.from_json(spec[k])
        for k in ("calibration_a", "calibration_b")
    )
    return evaluate_pair(spec["points_a"], spec["points_b"], a, b, spec["z_mm"], progress)


def evaluate_pair(
    points_a: Any,
    points_b: Any,
    a: Calibration | None = None,
    b: Calibration | None = None,
    z_mm: float | Sequence[float | None] = 0.0,
    progress: Progress = no_progress,
) -> PairReport:
    """Evaluate a pair.

    points_a, points_b (n, 2) raw px: the same things in both pictures, and z_mm: as Matches.of reads them. Without
    points, or without any height, two calibrations are judged by the lines and landmarks that both were clicked on.
    """
    if (points_a is None) != (points_b is None) or (a is None) != (b is None):
        raise BadInput(
            "Points or calibrations are given for one camera only.",
            "Send points for both images, and both calibrations or none.",
            reason="one-sided",
        )
    if points_a is None and a is None:
        raise BadInput(
            "There is nothing to compare.",
            "Send matched points, or two calibrations.",
            reason="nothing-given",
        )
    matches = None if points_a is None else Matches.of(points_a, points_b, z_mm)
    if a is None or b is None:
        return _report(matches, None, None, progress)
    _refuse_different_fields(a, b)
    titles = a.camera or "The first camera", b.camera or "The second camera"
    return _report(
        matches, (a, b), lambda: compare(a, b, field_from_json(a.field), titles, matches), progress
    )


def _report(
    matches: Matches | None,
    both: tuple[Calibration, Calibration] | None,
    compared: Callable[[], Compared] | None,
    progress: Progress = no_progress,
) -> PairReport:
    """Make every part that can be had; the first refusal where that is none."""
    cameras = None if both is None else ray_cameras(model_of(both[0]), model_of(both[1]))
    attempts = _Attempts(
        (matches is not None) * (1 if cameras is None else 2) + (both is not None), progress
    )
    report: PairReport = {
        "fundamental": None
        if matches is None
        else attempts.make("fundamental", lambda: _fundamental(matches)),
        "calibrated": None
        if matches is None or cameras is None
        else attempts.make("calibrated", lambda: _calibrated(*cameras, matches)),
        "agreement": None
        if both is None or compared is None
        else attempts.make("agreement", lambda: _agreement(both, compared())),
        "matches": 0 if matches is None else len(matches.a),
        "failed": attempts.failed,
    }
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
        self._progress(
            self._begun / self.count,
            say("progress.evaluating-pair", "Evaluating the pair: {part}", part=name),
        )
        self._begun += 1
        try:
            return part()
        except FitFailed as refusal:
            self.failed.append({**refusal.to_json(), "part": name})
            self.refusal = self.refusal or refusal
            return None


def _refuse_different_fields(a: Calibration | None, b: Calibration | None) -> None:
    if a is not None and b is not None and a.field != b.field:
        raise Conflict(
            say("pair.other-fields", "The two calibrations are for different fields."),
            say("pair.same-field", "Choose two cameras above the same field."),
            reason="different-fields",
        )


def ray_cameras(a: CameraModel, b: CameraModel) -> tuple[RayCamera, RayCamera] | None:
    """Return both where both have rays."""
    return (a, b) if isinstance(a, RayCamera) and isinstance(b, RayCamera) else None


def _fundamental(matches: Matches) -> FundamentalJson:
    found = fundamental_matrix(matches.a, matches.b)
    return {
        "matrix": found.fundamental.tolist(),
        "rms_px": found.rms_px,
        "sigma_px": found.sigma_px,
        "epipolar_px": matches.in_given_order(found.epipolar_px),
        "outliers": matches.numbers(~found.good),
        "epipoles": [e.tolist() for e in found.epipoles],
        "verdict": verdicts.of_fundamental(found.epipolar_px, found.good, matches.which),
    }


def _calibrated(model_a: RayCamera, model_b: RayCamera, matches: Matches) -> CalibratedJson:
    found = calibrated_epipolar_px(model_a, model_b, matches.a, matches.b)
    seen = found[np.isfinite(found)]
    if not seen.size:
        raise FitFailed(
            say("pair.nothing-shared", "None of the matches is within the range of both lenses."),
            say("pair.check-points", "Check that the points belong to these cameras."),
            reason="nothing-shared",
        )
    b_from_a, centre = pose_between(model_a, model_b)
    rotation_deg = np.degrees(vector_from_matrix(b_from_a))
    return {
        "median_px": float(np.median(seen)),
        "rms_px": root_mean_square(seen),
        "epipolar_px": matches.in_given_order(found),
        "rotation_deg": rotation_deg.tolist(),
        "angle_deg": float(np.linalg.norm(rotation_deg)),
        "translation_mm": centre.tolist(),
        "distance_mm": float(np.linalg.norm(centre)),
        "verdict": verdicts.of_calibrated(found, matches.which),
    }


def _agreement(both: tuple[Calibration, Calibration], found: Compared) -> PairAgreement:
    troubles = [
        one
        for title, each in zip(found.titles, both, strict=True)
        for one in verdicts.of_report(title, title, each.report)
    ]
    return {
        **found.agreement,
        "n": found.things,
        "from": found.source,
        "apart_mm": found.apart_mm,
        "map": found.agreement["carpet"]["map"],
        "verdict": verdicts.capped(found.verdict, troubles),
    }


def lines_by_matrix(
    matrix: Any, points_a: Any, points_b: Any, size_a: ImageSize, size_b: ImageSize
) -> PairLines:
    """Epipolar lines from a fundamental matrix."""
    fundamental, (a, b) = (
        np.array(matrix, float),
        (np.array(p, float).reshape(-1, 2) for p in (points_a, points_b)),
    )
    return {
        "in_b": _drawn(epipolar_segments(fundamental, a, size_b)),
        "in_a": _drawn(epipolar_segments(fundamental.T, b, size_a)),
        "place_in_b": None,
        "place_in_a": None,
    }


def lines_by_calibrations(
    a: Calibration, b: Calibration, points_a: Any, points_b: Any, z_mm: float | None = 0.0
) -> PairLines:
    """The same predicted by two calibrations, bent as the lenses bend; None for models without rays."""
    _refuse_different_fields(a, b)
    models = model_of(a), model_of(b)
    ends = [np.array(p, float).reshape(-1, 2) for p in (points_a, points_b)]
    in_a, in_b = (
        None if cameras is None else _drawn(epipolar_curves(*cameras, points))
        for cameras, points in (
            (ray_cameras(*models[::-1]), ends[1]),
            (ray_cameras(*models), ends[0]),
        )
    )
    return {
        "in_a": in_a,
        "in_b": in_b,
        "place_in_a": _place(*models[::-1], ends[1], z_mm, a.image_size),
        "place_in_b": _place(*models, ends[0], z_mm, b.image_size),
    }


def _place(
    here: CameraModel, there: CameraModel, points: Points, z_mm: float | None, size: ImageSize
) -> PointsJson | None:
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
    return [
        nullable_points(line) if count >= 2 else None
        for line, count in zip(lines, reached, strict=True)
    ]
