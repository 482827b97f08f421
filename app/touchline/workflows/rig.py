"""A rig of cameras that share a field: status of its calibrations, their agreement, and refits.

A rig here is plain JSON, {"name", "title", "field": a whole field, "rectangles": given ones, "cameras": [{"camera",
"title", "region", "rotate", "calibration": whole or None, "picture": {"name", "path", "sha256"} or None}, …]}: what a
job in another process needs; the command line makes the same of files.
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from touchline.core.common_sentences import CALIBRATE_AGAIN_FOR_SIZE, camera_not_calibrated
from touchline.core.errors import BadInput, Conflict, FitFailed
from touchline.core.field_changes import FIELD_CHANGED_FIX, changes_in_words, field_changes
from touchline.core.field_json import field_from_json
from touchline.core.geometry import ImageSize, Pixels
from touchline.core.progress import Progress, no_progress, subprogress
from touchline.core.records import Calibration, observations_from_json
from touchline.core.statements import Sentence, join, say, stated
from touchline.evaluate.cameras import rig_verdict
from touchline.evaluate.cameras.epipolar_check import geometry
from touchline.evaluate.cameras.evidence import OffsetMeasurements, from_clicks, from_matches
from touchline.evaluate.cameras.image_evidence import from_pictures
from touchline.evaluate.cameras.own_accuracy import own_accuracy
from touchline.evaluate.cameras.rectangles import Rectangles, most_common
from touchline.evaluate.cameras.rig_agreement import agreement
from touchline.evaluate.cameras.rig_verdict import RigTrouble, Source
from touchline.evaluate.cameras.robot_tops import expected_at_tops
from touchline.evaluate.drift.checked import verdict_in
from touchline.evaluate.fit.report_types import Level
from touchline.images import ImageDecoder
from touchline.models import CameraModel
from touchline.models.restored import model_of
from touchline.store.files import read_checked
from touchline.workflows.pair import evaluate_pair, ray_cameras
from touchline.workflows.pair_types import PairReport
from touchline.workflows.rig_types import CameraOfRig, RigCheck, RigPair, RigReport, RigStatus, UselessMatches

READING = 0.2  # of a check with pictures
MIN_MEASURES = 6  # measures in pictures: fewer are chance
MAX_CAMERAS = 16


def run_check(spec: Any, progress: Progress) -> RigReport:
    """A job: {"rig", "missing": cameras without a picture, "matches": [{"a", "b", "points_a", "points_b", "z_mm"}]}.

    Pictures are untrusted, decoded in a child.
    """
    rig, pictures = spec["rig"], {}
    wanted = [c for c in rig["cameras"] if c["picture"] is not None]
    if wanted:
        with ImageDecoder(workers=1) as decoder:
            for number, camera in enumerate(wanted):
                progress(READING * number / len(wanted),
                         say("progress.reading-camera", "Reading the image from {camera}", camera=camera["title"]))
                pictures[camera["camera"]] = decoder.frame_from_bytes(read_checked(**camera["picture"])).pixels
    found = check(rig, pictures, spec["matches"], subprogress(progress, READING if wanted else 0.0, 1.0))
    return {**found, "missing": spec["missing"]}


def check(rig: Mapping[str, Any], pictures: Mapping[str, Pixels], matches: Sequence[Mapping[str, Any]] = (),
          progress: Progress = no_progress) -> RigCheck:
    """Return each camera's status in the rig, and how far each two are apart that see a common part."""
    status = rig_status(rig)
    calibrations = {c["camera"]: Calibration.from_json(c["calibration"]) for c in rig["cameras"]
                    if c["calibration"] is not None and not _is_of_other_field(rig, c["calibration"])}
    _refuse_unknown(matches, {c["camera"] for c in rig["cameras"]})
    titles = {c["camera"]: c["title"] for c in rig["cameras"]}
    couples = list(combinations(calibrations, 2))
    pairs: list[RigPair] = []
    for number, (a, b) in enumerate(couples):
        part = subprogress(progress, number / len(couples), (number + 1) / len(couples),
                           say("progress.pair", "{a} and {b}:", a=titles[a], b=titles[b]))
        part(0.0, say("progress.comparing", "Comparing"))
        pairs.append(_pair(rig, titles, (a, b), calibrations, pictures, _matches_of(matches, a, b), part))
    for camera in status["cameras"]:
        name = camera["camera"]
        if name in calibrations:
            camera["troubles"] += _of_accuracy(camera, calibrations[name], pictures.get(name))
    troubles = [trouble for camera in status["cameras"] for trouble in camera["troubles"]]
    return {**status, "pairs": pairs, "verdict": rig_verdict.of_rig(pairs, troubles, titles)}


def _of_accuracy(camera: CameraOfRig, calibration: Calibration, pixels: Pixels | None) -> Iterator[RigTrouble]:
    """Yield what its report and the lines in its picture say against a calibration, also where no other looks."""
    own = own_accuracy(camera["title"], calibration.report)
    if own is not None:
        yield camera_trouble(camera["camera"], own.reason, own.text, own.fix, own.level)
    if pixels is None or (pixels.shape[1], pixels.shape[0]) != tuple(calibration.image_size):
        return
    found = verdict_in(pixels, calibration)
    if found["lines_level"] == "poor":
        where = say("rig.in-image-from", "In the image from {camera}:", camera=camera["title"])
        yield camera_trouble(camera["camera"], "lines-misplaced", join(where, found["sentence"]), found["fix"], "poor")


def _pair(rig: Mapping[str, Any], titles: Mapping[str, str], names: tuple[str, str],
          calibrations: Mapping[str, Calibration], pictures: Mapping[str, Pixels],
          given: Mapping[str, Any] | None, progress: Progress) -> RigPair:
    a, b = (calibrations[name] for name in names)
    models = model_of(a), model_of(b)
    cameras = ray_cameras(*models)
    answer: RigPair = {"a": names[0], "b": names[1], "fundamental": None if cameras is None else geometry(*cameras),
                       "matches": None if given is None else _crosscheck(a, b, given), "agreement": None, "from": None,
                       "verdict": None, "notes": [], "failed": None}
    try:
        evidence, source, notes = _evidence(rig, names, (a, b), models, pictures, given, progress)
        found = agreement(models[0], a.image_size, models[1], b.image_size, field_from_json(rig["field"]), evidence,
                          expected=(expected_at_tops(a), expected_at_tops(b)))
    except FitFailed as refusal:
        return {**answer, "failed": refusal.to_json()}
    verdict = rig_verdict.of_pair(titles[names[0]], titles[names[1]], found, source)
    return {**answer, "agreement": found, "from": source, "notes": notes, "verdict": verdict}


def _crosscheck(a: Calibration, b: Calibration, given: Mapping[str, Any]) -> PairReport | UselessMatches:
    """Evaluate the matches by themselves and against the calibrations, as POST /pairs does."""
    try:
        return evaluate_pair(given["points_a"], given["points_b"], a, b, given["z_mm"])
    except FitFailed as refusal:
        return {"failed": [{**refusal.to_json(), "part": "all"}]}


def _evidence(rig: Mapping[str, Any], names: tuple[str, str], both: tuple[Calibration, Calibration],
              models: tuple[CameraModel, CameraModel], pictures: Mapping[str, Pixels],
              given: Mapping[str, Any] | None, progress: Progress) -> tuple[OffsetMeasurements, Source, list[str]]:
    """Return the best evidence there is: matches, else pictures, else the clicks of the calibrations."""
    field, (a, b) = field_from_json(rig["field"]), both
    if given is not None:
        z = given["z_mm"]
        heights = np.array([np.nan if v is None else v for v in z], float) if isinstance(z, (list, tuple)) else float(z)
        complete = [i for i, (p, q) in enumerate(zip(given["points_a"], given["points_b"], strict=True)) if p and q]
        in_a, in_b = (np.array([given[key][i] for i in complete], np.float64) for key in ("points_a", "points_b"))
        if isinstance(heights, np.ndarray):
            heights = heights[complete]
        return OffsetMeasurements.together([from_matches(*models, in_a, in_b, heights)]), "matches", []
    notes: list[str] = []
    pixels_a, pixels_b = (pictures.get(name) for name in names)
    if pixels_a is not None and pixels_b is not None and all(
            (pixels.shape[1], pixels.shape[0]) == tuple(calibration.image_size)
            for pixels, calibration in ((pixels_a, a), (pixels_b, b))):
        evidence = from_pictures(models[0], pixels_a, models[1], pixels_b, field, progress)
        if len(evidence) >= MIN_MEASURES:
            return evidence, "pictures", notes
        notes.append("The images show too few lines in the area that both cameras cover.")
    return from_clicks(models[0], observations_from_json(a.observations), field.region(a.region, a.rotate), models[1],
                       observations_from_json(b.observations), field.region(b.region, b.rotate), field), "clicks", notes


def rig_status(rig: Mapping[str, Any]) -> RigStatus:
    given, cameras = Rectangles.of_rig(rig["rectangles"]), rig["cameras"]
    own = {c["camera"]: Rectangles.of_parameters(c["calibration"]["model"]["parameters"]) for c in cameras
           if c["calibration"] is not None}
    wanted = given or most_common([one for one in own.values() if one is not None])
    status: list[CameraOfRig] = []
    for camera in cameras:
        mine = own.get(camera["camera"])
        status.append({"camera": camera["camera"], "title": camera["title"], "region": camera["region"],
                       "rotate": camera["rotate"],
                       "calibration": camera["calibration"] and camera["calibration"]["id"],
                       "version": camera["calibration"] and camera["calibration"]["version"],
                       "model": camera["calibration"] and camera["calibration"]["model"]["name"],
                       "rectangles": mine.options() if mine else None,
                       "troubles": list(_troubles(rig, camera, mine, wanted))})
    return {"rectangles": wanted.options() if wanted else None,
            "rectangles_from": "rig" if given else "cameras" if wanted else None, "cameras": status}


def _troubles(rig: Mapping[str, Any], camera: Mapping[str, Any], mine: Rectangles | None,
              wanted: Rectangles | None) -> Iterator[RigTrouble]:
    calibration, title = camera["calibration"], camera["title"]

    def trouble(reason: str, text: str, fix: str) -> RigTrouble:
        return camera_trouble(camera["camera"], reason, text, fix)

    if calibration is None:
        yield trouble("not-calibrated", camera_not_calibrated(title),
                      say("rig.calibrate-camera", "Calibrate {camera}, and activate it.", camera=title))
        return
    if calibration["field"] != rig["field"]["name"]:
        name = rig["field"]["name"]
        yield trouble("other-field", say("rig.other-field", "{camera} is calibrated on the field {field}; the field of "
                                         "the rig is {wanted}.", camera=title, field=calibration["field"], wanted=name),
                      say("rig.calibrate-on-field", "Calibrate {camera} on {field}.", camera=title, field=name))
        return
    if changes := _changes(rig, calibration):
        yield trouble("field-changed", say("rig.field-changed", "{camera} was calibrated before the field was "
                                           "changed: {changes}.", camera=title, changes=changes_in_words(changes)),
                      FIELD_CHANGED_FIX)
    if camera["region"] is not None and calibration["region"] != camera["region"]:
        yield trouble("other-region", say("rig.other-area", "{camera} is calibrated on {area}; its covered area in "
                                          "the rig is {wanted}.", camera=title, area=calibration["region"],
                                          wanted=camera["region"]),
                      say("rig.calibrate-on-area", "Calibrate {camera} on {area}, or change the rig.", camera=title,
                          area=camera["region"]))
    if mine is not None and wanted is not None and not mine.same_as(wanted):
        yield trouble("other-rectangles", say("rig.other-grid", "{camera} is calibrated with {grid}; the rig has "
                                              "{wanted}. Corrected pixels of the two cameras differ in scale.",
                                              camera=title, grid=_grid(mine), wanted=_grid(wanted)),
                      say("rig.fit-with-grid", "Fit {camera} again with the shared calibration grid of the rig, then "
                          "activate the new version.", camera=title))


def camera_trouble(camera: str, reason: str, text: str, fix: str, level: Level | None = None) -> RigTrouble:
    return stated(RigTrouble(camera=camera, reason=reason, text=text, fix=fix, level=level))


def _grid(rectangles: Rectangles) -> Sentence:
    return say("rig.grid", "{n_x} × {n_y} rectangles of {width_px:.4g} × {height_px:.4g} px", n_x=rectangles.n_x,
               n_y=rectangles.n_y, width_px=rectangles.w_max_px, height_px=rectangles.h_max_px)


def _changes(rig: Mapping[str, Any], calibration: Mapping[str, Any]) -> tuple[str, ...]:
    observed = (o["feature"] for o in calibration["observations"])
    return field_changes(calibration["field_definition"], rig["field"], calibration["region"], observed)


def _is_of_other_field(rig: Mapping[str, Any], calibration: Mapping[str, Any]) -> bool:
    """Tell whether it says nothing of the rig's field: made over another one, or before this one was changed."""
    return calibration["field"] != rig["field"]["name"] or bool(_changes(rig, calibration))


def refuse_other_sizes(rig: Mapping[str, Any], pictures: Mapping[str, Pixels]) -> None:
    """Conflict for a picture of another size than its camera's calibration."""
    for camera in rig["cameras"]:
        pixels, calibration = pictures.get(camera["camera"]), camera["calibration"]
        if pixels is None or calibration is None:
            continue
        size, wanted = ImageSize(pixels.shape[1], pixels.shape[0]), ImageSize.of(calibration["image_size"])
        if size != wanted:
            raise Conflict(say("rig.other-image-size", "The image from {camera} is {size}; its calibration is for "
                               "{wanted}.", camera=camera["title"], size=size, wanted=wanted), CALIBRATE_AGAIN_FOR_SIZE,
                           reason="size-mismatch")


def _matches_of(matches: Sequence[Mapping[str, Any]], a: str, b: str) -> Mapping[str, Any] | None:
    """Those of a pair, whichever way round they were given."""
    for one in matches:
        if (one["a"], one["b"]) == (a, b):
            return one
        if (one["a"], one["b"]) == (b, a):
            return {**one, "a": a, "b": b, "points_a": one["points_b"], "points_b": one["points_a"]}
    return None


def _refuse_unknown(matches: Sequence[Mapping[str, Any]], known: set[str]) -> None:
    for one in matches:
        for name in (one["a"], one["b"]):
            if name not in known:
                raise BadInput(f"Matches name a camera {name!r} that is not in this rig.",
                               f"Use two of: {', '.join(sorted(known))}.", reason="unknown-camera")
        if len(one["points_a"]) != len(one["points_b"]):
            raise BadInput("The matches do not have the same number of points in both images.",
                           "Send the same number of points for each image.", reason="bad-matches")
