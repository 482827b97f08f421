"""Registers a knocked camera's pose again: the lens is kept, and the field's lines give the new pose.

    summary, made = reregister(calibration, frame)     a new version, child of the one before, not yet stored

A model with rays keeps its lens, as well as that was known, and gets a pose. One without rays has no separate lens:
the points that it rests on are moved along with the picture, and fitted again.
"""

from contextlib import suppress
from typing import Any

import numpy as np

from touchline.core.errors import Conflict, FitFailed, TouchlineError
from touchline.core.field import Field, Region
from touchline.core.field_json import field_from_json
from touchline.core.geometry import Array, ImageSize, Points, root_mean_square
from touchline.core.jobs import Progress, no_progress, subprogress
from touchline.core.records import Calibration, Frame, Observation, Observations, observations_from_json
from touchline.core.sentences import DETECTING_FIELD_LINES, SET_RESOLUTION, other_image_size
from touchline.core.statements import join, say, stated
from touchline.evaluate.drift.line_tracking import SIGMA_PX, TrackedLines, track_lines
from touchline.evaluate.drift.orientation import FIX as ORIENTATION_FIX
from touchline.evaluate.drift.orientation import SAID as ORIENTATION
from touchline.evaluate.drift.orientation import OrientationReference
from touchline.fitting.image_motion import estimate_motion
from touchline.fitting.ray_camera.lens_prior import camera_intrinsics
from touchline.images import ImageDecoder
from touchline.models import CameraModel, RayModel, Restored, field_from_raw, parameters_json, raw_from_field
from touchline.models.ray_camera import RayCamera
from touchline.store.files import read_checked
from touchline.vision.ridges import with_bright_lines
from touchline.workflows import calibration as workflow
from touchline.workflows.calibration import CalibrationResult
from touchline.workflows.calibration_request import CalibrationRequest
from touchline.workflows.kept_lens import UNKNOWN, ZoomCheck

MIN_LINES, MIN_MARKING_POINTS = 3, 3  # and points on each
# Times, and px of 1280, that lines may lie off than before: else it is another lens. Ordinary knocks leave 0.02 to 0.2.
WORSE, WORSE_PX = 3.0, 0.5
# Of the lines' places: where whole lines are missing, the others were taken for their neighbours, half a metre beside.
MAX_MISSING = 0.15
AFRESH = say("pose.calibrate-again", "Calibrate the camera again: detect the field lines, or mark points.")
# Options that the kept lens replaces; everything else was the operator's choice.
OWN_OPTIONS = ("lens", "lens_sigma", "terms", "leanings", "start", "click_sigma_px", "height_mm", "centre_sigma_px")


def reregister(calibration: Calibration, frame: Frame, progress: Progress = no_progress, before: Frame | None = None,
               snapshot: str | None = None, note: str = "") -> tuple[dict[str, Any], Calibration]:
    """Return a summary and the new version. FitFailed where lines do not suffice; Conflict for another size.

    before: the picture that the calibration came from, where it is stored.
    """
    if frame.size != calibration.image_size:
        raise Conflict(other_image_size(frame.size, calibration.image_size), SET_RESOLUTION, reason="size-mismatch")
    model, field, region = Restored.of(calibration)
    progress(0.0, DETECTING_FIELD_LINES)
    then = None if before is None else with_bright_lines(before.pixels)
    found = track_lines(with_bright_lines(frame.pixels), model, field, then)
    observations = () if found is None else _observed(found, found.points, field, region)
    if found is None or len(observations) < MIN_LINES:
        raise FitFailed(say("pose.too-few-lines", "Too few field lines were detected near their previous positions."),
                        join(say("pose.uncover-lines", "Uncover the lines and switch the lamps on, then try again."),
                             AFRESH),
                        reason="lines-not-found")
    if found.missing > MAX_MISSING:
        raise FitFailed(say("pose.lines-missing", "Whole field lines were not detected where the others put them "
                            "({share:.0f} % of their length). The pose would be a guess.", share=100 * found.missing),
                        join(say("pose.uncover-lines", "Uncover the lines and switch the lamps on, then try again."),
                             AFRESH),
                        reason="lines-not-found")
    size, part = frame.size, subprogress(progress, 0.3, 1.0)
    field = field_from_json(calibration.field)  # where its lines lie is found again
    options = {name: value for name, value in calibration.options.items() if name not in OWN_OPTIONS}
    zoom = None
    if isinstance(model, RayModel):
        lens = camera_intrinsics(model, calibration.covariance) if isinstance(model, RayCamera) else None
        options |= {"lens": calibration.lens_option(), "lens_sigma": "own" if lens and lens.estimated else "0"}
        started = {**options, "start": parameters_json(model)}
        done = workflow.calibrate(observations, field, region, size, calibration.model_name, started, part)
        if lens is not None:
            earlier = () if before is None else _observed(found, found.places, field, region)
            zoom = ZoomCheck.of(lens, earlier, observations, field, region, started)
    else:
        options = dict(calibration.options)
        observations = _moved_along(calibration, found, size)
        done = workflow.calibrate(observations, field, region, size, calibration.model_name, options, part)
    if before is not None:
        was = OrientationReference.of(before.pixels, model, region)
        if (way := was.compare(frame.pixels, done.model).way) is not None:
            raise FitFailed(ORIENTATION[way], ORIENTATION_FIX, reason=way)
    off_px = _off_px(done.model, found, field.as_painted(done.report, region))
    before_px = float(calibration.report.get("rms_px") or 0.0)
    if off_px > max(WORSE * before_px, WORSE_PX * max(size.width / 1280, 0.5)):
        if isinstance(model, RayModel):
            raise FitFailed(say("pose.lens-changed", "With the same lens, the lines are {px:.1f} px off. The lens, "
                                "the focus or the field has changed.", px=off_px), AFRESH, reason="lens-changed")
        raise FitFailed(say("pose.moved-too-far", "After shifting the points with the image, the lines are {px:.1f} px "
                            "off. This is too far for {model}, which does not separate the lens from the camera pose.",
                            px=off_px, model=model.TITLE.lower()), AFRESH, reason="moved-too-far")
    if zoom and zoom.state == "refuted":
        raise FitFailed(zoom.changed, AFRESH, reason="lens-changed")
    request = CalibrationRequest(observations, field, region, size, calibration.model_name, options, calibration.camera,
                                 snapshot, frame.sha256 or None, note)
    return _summary(calibration, model, done, found, off_px, zoom), request.record(done, parent=calibration.id)


def _observed(found: TrackedLines, points: Points, field: Field, region: Region) -> Observations:
    observations = []
    for number, marking in enumerate(found.pattern.markings):
        of = found.marking == number
        if of.sum() >= MIN_MARKING_POINTS:
            observations.append(Observation(field.observed_name(marking.name, region), "line", points[of]))
    return tuple(observations)


def _moved_along(calibration: Calibration, found: TrackedLines, size: ImageSize) -> Observations:
    """The points that a model without rays rests on, moved as the picture was; a tilt moves it as a homography does."""
    before = observations_from_json(list(calibration.observations))
    if not before:
        raise FitFailed(say("pose.no-points", "This calibration was imported and has no points, so its pose cannot "
                            "be updated."), AFRESH, reason="no-observations")
    across = np.einsum("ni,nik->nk", found.normals, _bending(found.places, size))
    off = np.sum((found.points - found.places) * found.normals, axis=1)
    q = estimate_motion(across, off, np.full(len(off), SIGMA_PX)).q
    moved = []
    for one in before:
        points = one.points + _bending(one.points, size) @ q
        inside = ((points >= -1) & (points <= np.array(tuple(size)))).all(axis=1)
        if inside.any():
            moved.append(Observation(one.feature, one.kind, points[inside], one.z_mm))
    return tuple(moved)


def _bending(places: Points, size: ImageSize) -> Array:
    """(n, 2, 8) px: shift, turn, growth and shear, and the tilt of a plane, each strongest at the picture's corner."""
    x, y = ((places - np.array(size.centre)) / (np.hypot(*size) / 2)).T
    one, none = np.ones_like(x), np.zeros_like(x)
    return np.stack([np.stack([one, none, x, y, none, none, x * x, x * y], axis=-1),
                     np.stack([none, one, none, none, x, y, x * y, y * y], axis=-1)], axis=1)


def _off_px(model: CameraModel, found: TrackedLines, field: Field) -> float:
    """How far the lines lie from where the model has them, px: rms without the furthest tenth."""
    markings = [field.markings[int(number)] for number in found.marking]
    on_field = field_from_raw(model, found.points)
    feet = np.stack([marking.nearest(point) for marking, point in zip(markings, on_field, strict=True)])
    off = np.linalg.norm(raw_from_field(model, feet) - found.points, axis=1)
    off = np.sort(off[np.isfinite(off)])
    return root_mean_square(off[:max(1, int(0.9 * len(off)))]) if len(off) else np.inf


def _summary(calibration: Calibration, before: CameraModel, done: CalibrationResult, found: TrackedLines,
             off_px: float, zoom: ZoomCheck | None) -> dict[str, Any]:
    summary = {"parent": calibration.id, "points": len(found.points), "lines": len(set(found.marking.tolist())),
               "seen_share": round(found.share, 3), "lines_px": round(off_px, 3),
               "picture_px": round(found.moved_px, 2), "turned_deg": None, "moved_mm": None,
               "verdict": done.report["verdict"], "zoom": zoom and zoom.to_json()}
    if isinstance(before, RayCamera) and isinstance(done.model, RayCamera):
        turn = np.array(done.model.camera_from_field) @ np.array(before.camera_from_field).T
        summary["turned_deg"] = round(float(np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1)))), 4)
        summary["moved_mm"] = round(float(np.linalg.norm(np.subtract(done.model.position_mm, before.position_mm))), 1)
    values = {"points": summary["points"], "lines": summary["lines"], "px": off_px}
    if not isinstance(before, RayModel):
        fits = say("pose.points-shifted", "With the points shifted, {points} points on {lines} lines fit within "
                   "{px:.2f} px.", **values)
    elif zoom is not None and zoom.state == "held":
        fits = join(say("pose.same-lens", "With the same lens, {points} points on {lines} lines fit within {px:.2f} "
                        "px.", **values), zoom.resolution)
    else:
        fits = join(say("pose.kept-lens", "With the lens as it was, {points} points on {lines} lines fit within "
                        "{px:.2f} px.", **values), (zoom or ZoomCheck(UNKNOWN, UNKNOWN)).untested)
    return stated({**summary, "sentence": join(
        say("pose.image-moved", "The image had moved by {px:.1f} px.", px=found.moved_px), fits)})


def run_register(spec: Any, progress: Progress) -> dict[str, Any]:
    """A job: {"calibration": whole, "snapshot", "note", "picture", "before": {"name", "path", "sha256"} or null}."""
    with ImageDecoder(workers=1) as decoder:
        frame = decoder.frame_from_bytes(read_checked(**spec["picture"]))
        before = None
        with suppress(TouchlineError):  # gone or damaged: then the model itself says where lines were
            before = decoder.frame_from_bytes(read_checked(**spec["before"])) if spec["before"] else None
    summary, made = reregister(Calibration.from_json(spec["calibration"]), frame, subprogress(progress, 0.1, 1.0),
                               before, spec["snapshot"], spec["note"])
    return {"told": summary, "made": made.to_json()}
