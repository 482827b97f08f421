"""Register a knocked camera's pose again: the lens is kept, and the field's lines give the new pose.

    summary, version = reregister(calibration, frame)     a new version, child of the one before, not yet stored

A model with rays keeps its lens, as well as that was known, and gets a pose. One without rays has no separate lens:
the points that it rests on are moved along with the picture, and fitted again.
"""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

import numpy as np

from touchline.core.errors import Conflict, FitFailed, TouchlineError
from touchline.core.field import Field, Region
from touchline.core.field_json import field_from_json
from touchline.core.geometry import Array, ImageSize, Points, root_mean_square
from touchline.core.jobs import Progress, no_progress, subprogress
from touchline.core.json_values import JsonObject
from touchline.core.records import (
    Calibration,
    Frame,
    Observation,
    Observations,
    observations_from_json,
)
from touchline.core.sentences import DETECTING_FIELD_LINES, SET_RESOLUTION, other_image_size
from touchline.core.statements import Sentence, join, say, stated
from touchline.drift.tracking import LINE_SIGMA_PX, TrackedLines, track_lines
from touchline.evaluate.field_lines import orientation
from touchline.evaluate.field_lines.orientation import OrientationReference
from touchline.fitting import FITTERS
from touchline.fitting.image_motion import estimate_motion
from touchline.fitting.ray_camera.lens_prior import camera_intrinsics
from touchline.models import (
    CameraModel,
    RayModel,
    Restored,
    field_from_raw,
    parameters_json,
    raw_from_field,
)
from touchline.models.intrinsics import Intrinsics
from touchline.models.ray_camera import RayCamera
from touchline.vision.ridges import with_bright_lines
from touchline.workflows import calibration as workflow
from touchline.workflows.calibration import CalibrationResult
from touchline.workflows.calibration_request import CalibrationRequest
from touchline.workflows.job_pictures import job_pictures

MIN_LINES, MIN_MARKING_POINTS = 3, 3  # and points on each
# How much further off lines may lie than before, as a factor and in px of a picture 1280 wide: more is another lens.
# After ordinary knocks they lie 0.02 to 0.2 px further off.
MAX_WORSE_FACTOR, MAX_OFF_PX = 3.0, 0.5
# a small picture's lines may lie off as in one of so much of it
REFERENCE_WIDTH_PX, MIN_WIDTH_RATIO = 1280, 0.5
# Of the lines' places: where whole lines are missing, the others were taken for their neighbours, half a metre beside.
MAX_MISSING = 0.15
BEST_SHARE = 0.9  # of the lines' points: the furthest tenth may be robots
# Options that do not hold for the new pose, or that the kept lens replaces: its terms, a height that the knock has
# changed, the noise of clicks, where points are measured now. Everything else was the operator's choice.
LENS_OPTIONS = (
    "lens",
    "lens_sigma",
    "terms",
    "leanings",
    "start",
    "click_sigma_px",
    "height_mm",
    "centre_sigma_px",
)
FREE_SIGMA = 0.1  # of the logarithm of a focal length that is free
MIN_SIGMAS = 5.0
# a smaller one moves the field by few millimetres, and lines beside their places make as much
MIN_ZOOM = 0.005
MAX_UNSEEN_ZOOM = 0.02  # a zoom so large must show, or else the lens was not tested
CALIBRATE_AGAIN = say(
    "pose.calibrate-again", "Calibrate the camera again: detect the field lines, or mark points."
)
UNCOVER_LINES = join(
    say("pose.uncover-lines", "Uncover the lines and switch the lamps on, then try again."),
    CALIBRATE_AGAIN,
)


def reregister(
    calibration: Calibration,
    frame: Frame,
    progress: Progress = no_progress,
    before: Frame | None = None,
    snapshot: str | None = None,
    note: str = "",
) -> tuple[JsonObject, Calibration]:
    """Return a summary and the new version. FitFailed where lines do not suffice; Conflict for another size.

    before: the picture that the calibration came from, where it is stored.
    """
    if frame.size != calibration.image_size:
        raise Conflict(
            other_image_size(frame.size, calibration.image_size),
            SET_RESOLUTION,
            reason="size-mismatch",
        )
    model, painted_field, region = Restored.of(calibration)
    progress(0.0, DETECTING_FIELD_LINES)
    tracked, observations = _track(model, painted_field, region, frame, before)
    # As it is in its file: how far its lines lie elsewhere is estimated again, by the new points.
    field = field_from_json(calibration.field)
    part = subprogress(progress, 0.3, 1.0)
    if isinstance(model, RayModel):
        fit = _fit_pose(
            calibration, model, tracked, observations, field, region, before is not None, part
        )
    else:
        fit = _fit_moved_points(calibration, tracked, field, region, part)
    fitted = fit.result.model
    if before is not None:
        reference = OrientationReference.of(before.pixels, model, region)
        if (way := reference.compare(frame.pixels, fitted).way) is not None:
            raise FitFailed(orientation.SENTENCES[way], orientation.FIX, reason=way)
    off_px = _off_px(fitted, tracked, field.as_painted(fit.result.report, region))
    _refuse_other_lens(calibration, model, off_px, frame.size, fit.zoom)
    request = CalibrationRequest(
        fit.observations,
        field,
        region,
        frame.size,
        calibration.model_name,
        fit.options,
        calibration.camera,
        snapshot,
        frame.sha256 or None,
        note,
    )
    return (
        _summary(calibration, model, fit.result, tracked, off_px, fit.zoom),
        request.record(fit.result, parent=calibration.id),
    )


def _track(
    model: CameraModel,
    field: Field,
    region: Region,
    frame: Frame,
    before: Frame | None,
) -> tuple[TrackedLines, Observations]:
    """Find the lines again, also as observations; FitFailed where too few are found, or whole ones are missing."""
    then = None if before is None else with_bright_lines(before.pixels)
    tracked = track_lines(with_bright_lines(frame.pixels), model, field, then)
    observations = () if tracked is None else _observed(tracked, tracked.points, field, region)
    if tracked is None or len(observations) < MIN_LINES:
        raise FitFailed(
            say(
                "pose.too-few-lines",
                "Too few field lines were detected near their previous positions.",
            ),
            UNCOVER_LINES,
            reason="lines-not-found",
        )
    if tracked.missing > MAX_MISSING:
        raise FitFailed(
            say(
                "pose.lines-missing",
                "Whole field lines were not detected where the others put them "
                "({share:.0f} % of their length). The pose would be a guess.",
                share=100 * tracked.missing,
            ),
            UNCOVER_LINES,
            reason="lines-not-found",
        )
    return tracked, observations


class _Fit(NamedTuple):
    """What was fitted to what, and with which options; zoom: None where the model has no lens that can be tested."""

    result: CalibrationResult
    observations: Observations
    options: JsonObject
    zoom: "ZoomCheck | None"


def _fit_pose(
    calibration: Calibration,
    model: RayModel,
    tracked: TrackedLines,
    observations: Observations,
    field: Field,
    region: Region,
    is_seen_before: bool,
    progress: Progress,
) -> _Fit:
    """Fit the pose to the lines. is_seen_before: whether the calibration's own picture shows where they were."""
    lens = (
        camera_intrinsics(model, calibration.covariance) if isinstance(model, RayCamera) else None
    )
    chosen = {key: value for key, value in calibration.options.items() if key not in LENS_OPTIONS}
    options = {
        **chosen,
        "lens": {"id": calibration.id, **calibration.lens_option()},
        "lens_sigma": "own" if lens and lens.estimated else "0",
    }
    started = {**options, "start": parameters_json(model)}
    result = workflow.calibrate(
        observations,
        field,
        region,
        calibration.image_size,
        calibration.model_name,
        started,
        progress,
    )
    zoom = None
    if lens is not None:
        earlier = _observed(tracked, tracked.places, field, region) if is_seen_before else ()
        zoom = ZoomCheck.of(lens, earlier, observations, field, region, started)
    return _Fit(result, observations, options, zoom)


def _fit_moved_points(
    calibration: Calibration,
    tracked: TrackedLines,
    field: Field,
    region: Region,
    progress: Progress,
) -> _Fit:
    """Fit a model without rays to its points, moved along with the picture."""
    moved = _moved_along(calibration, tracked)
    options = dict(calibration.options)
    return _Fit(
        workflow.calibrate(
            moved, field, region, calibration.image_size, calibration.model_name, options, progress
        ),
        moved,
        options,
        None,
    )


def _refuse_other_lens(
    calibration: Calibration,
    model: CameraModel,
    off_px: float,
    size: ImageSize,
    zoom: "ZoomCheck | None",
) -> None:
    """FitFailed where the lines do not fit the lens that was kept. off_px: see _off_px()."""
    before_px = float(calibration.report.get("rms_px") or 0.0)
    width_ratio = max(size.width / REFERENCE_WIDTH_PX, MIN_WIDTH_RATIO)
    if off_px > max(MAX_WORSE_FACTOR * before_px, MAX_OFF_PX * width_ratio):
        if isinstance(model, RayModel):
            raise FitFailed(
                say(
                    "pose.lens-changed",
                    "With the same lens, the lines are {px:px} px off. The lens, "
                    "the focus or the field has changed.",
                    px=off_px,
                ),
                CALIBRATE_AGAIN,
                reason="lens-changed",
            )
        raise FitFailed(
            say(
                "pose.moved-too-far",
                "After shifting the points with the image, the lines are {px:px} px "
                "off. This is too far for {model}, which does not separate the lens from the camera pose.",
                px=off_px,
                model=model.TITLE.lower(),
            ),
            CALIBRATE_AGAIN,
            reason="moved-too-far",
        )
    if zoom and zoom.state == "refuted":
        raise FitFailed(zoom.changed, CALIBRATE_AGAIN, reason="lens-changed")


def _observed(tracked: TrackedLines, points: Points, field: Field, region: Region) -> Observations:
    """Return points (n, 2) px of the tracked lines as observations of the markings that have enough of them."""
    observations = []
    for number, marking in enumerate(tracked.pattern.markings):
        of = tracked.marking == number
        if of.sum() >= MIN_MARKING_POINTS:
            observations.append(
                Observation(field.observed_name(marking.name, region), "line", points[of])
            )
    return tuple(observations)


def _moved_along(calibration: Calibration, tracked: TrackedLines) -> Observations:
    """Return the points that a model without rays rests on, moved as the picture was.

    A tilt moves it as a homography does; see _plane_motion().
    """
    before, size = observations_from_json(list(calibration.observations)), calibration.image_size
    if not before:
        raise FitFailed(
            say(
                "pose.no-points",
                "This calibration was imported and has no points, so its pose cannot be updated.",
            ),
            CALIBRATE_AGAIN,
            reason="no-observations",
        )
    across = np.einsum("ni,nik->nk", tracked.normals, _plane_motion(tracked.places, size))
    off_px = np.sum((tracked.points - tracked.places) * tracked.normals, axis=1)
    q = estimate_motion(across, off_px, np.full(len(off_px), LINE_SIGMA_PX)).q
    moved = []
    for one in before:
        points = one.points + _plane_motion(one.points, size) @ q
        is_inside = ((points >= -1) & (points <= np.array(tuple(size)))).all(axis=1)
        if is_inside.any():
            moved.append(Observation(one.feature, one.kind, points[is_inside], one.z_mm))
    return tuple(moved)


def _plane_motion(places: Points, size: ImageSize) -> Array:
    """Return (n, 2, 8) px: shift, turn, growth and shear, and the tilt of a plane, each strongest at the corners.

    A homography's first order in its eight numbers: the motion of a plane's picture in any small motion of its camera.
    """
    x, y = ((places - np.array(size.centre)) / (np.hypot(*size) / 2)).T
    one, none = np.ones_like(x), np.zeros_like(x)
    return np.stack(
        [
            np.stack([one, none, x, y, none, none, x * x, x * y], axis=-1),
            np.stack([none, one, none, none, x, y, x * y, y * y], axis=-1),
        ],
        axis=1,
    )


def _off_px(model: CameraModel, tracked: TrackedLines, field: Field) -> float:
    """Return how far the lines lie from where the model has them, px: rms without the furthest tenth."""
    markings = [field.markings[int(number)] for number in tracked.marking]
    on_field = field_from_raw(model, tracked.points)
    feet = np.stack(
        [marking.nearest(point) for marking, point in zip(markings, on_field, strict=True)]
    )
    off_px = np.linalg.norm(raw_from_field(model, feet) - tracked.points, axis=1)
    off_px = np.sort(off_px[np.isfinite(off_px)])
    return (
        root_mean_square(off_px[: max(1, int(BEST_SHARE * len(off_px)))]) if len(off_px) else np.inf
    )


def _summary(
    calibration: Calibration,
    before: CameraModel,
    result: CalibrationResult,
    tracked: TrackedLines,
    off_px: float,
    zoom: "ZoomCheck | None",
) -> JsonObject:
    line_count = len(set(tracked.marking.tolist()))
    turned_deg, moved_mm = None, None
    if isinstance(before, RayCamera) and isinstance(result.model, RayCamera):
        turn = np.array(result.model.camera_from_field) @ np.array(before.camera_from_field).T
        turned_deg = round(
            float(np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1)))), 4
        )
        moved_mm = round(
            float(np.linalg.norm(np.subtract(result.model.position_mm, before.position_mm))), 1
        )
    sentence = join(
        say("pose.image-moved", "The image had moved by {px:px} px.", px=tracked.moved_px),
        _fit_sentence(before, zoom, len(tracked.points), line_count, off_px),
    )
    return stated(
        {
            "parent": calibration.id,
            "points": len(tracked.points),
            "lines": line_count,
            "seen_share": round(tracked.share, 3),
            "lines_px": round(off_px, 3),
            "picture_px": round(tracked.moved_px, 2),
            "turned_deg": turned_deg,
            "moved_mm": moved_mm,
            "verdict": result.report["verdict"],
            "zoom": zoom and zoom.to_json(),
            "sentence": sentence,
        }
    )


def _fit_sentence(
    before: CameraModel, zoom: "ZoomCheck | None", points: int, lines: int, px: float
) -> Sentence:
    values = {"points": points, "lines": lines, "px": px}
    if not isinstance(before, RayModel):
        return say(
            "pose.points-shifted",
            "With the points shifted, {points} points on {lines} lines fit within {px:px} px.",
            **values,
        )
    if zoom is not None and zoom.state == "held":
        return join(
            say(
                "pose.same-lens",
                "With the same lens, {points} points on {lines} lines fit within {px:px} px.",
                **values,
            ),
            zoom.resolution,
        )
    return join(
        say(
            "pose.kept-lens",
            "With the lens as it was, {points} points on {lines} lines fit within {px:px} px.",
            **values,
        ),
        (zoom or ZoomCheck(np.nan, np.nan)).untested,
    )


@dataclass(frozen=True)
class ZoomCheck:
    """Whether the lens that a new pose keeps is still the camera's: a zoom would hide in the camera's height.

    zoom: by which share the focal length is longer than before, as the lines have it, and its σ; NaN: no fit tells.

    The lines are fitted again with the focal length free and everything else of the lens as before; those of the
    picture that the calibration came from likewise, where it is stored: what is wrong with the lens or the paint is in
    both. A zoom bends the picture otherwise than a lower camera does: by its distortion and, where the view is tilted,
    by its perspective. Where neither is enough, σ is large, and it cannot be told.
    """

    zoom: float
    sigma: float

    @classmethod
    def of(
        cls,
        lens: Intrinsics,
        earlier: Observations,
        now: Observations,
        field: Field,
        region: Region,
        options: Mapping[str, Any],
    ) -> "ZoomCheck":
        """Compare the focal lengths that both sets of lines ask for.

        lens: as it was, with its covariance. earlier: lines of the calibration's own picture; none where it is gone,
        then the lens's own focal length counts. options: of the fit of the pose.
        """
        try:
            then = _focal(lens, earlier, field, region, options) if earlier else _own_focal(lens)
            after = _focal(lens, now, field, region, options)
        except FitFailed:
            return cls(np.nan, np.nan)
        return cls(after[0] - then[0], float(np.hypot(after[1], then[1])))

    @property
    def state(self) -> Literal["held", "refuted", "not-tested"]:
        if abs(self.zoom) > max(MIN_SIGMAS * self.sigma, MIN_ZOOM):
            return "refuted"
        return "held" if MIN_SIGMAS * self.sigma < MAX_UNSEEN_ZOOM else "not-tested"

    @property
    def changed(self) -> Sentence:
        return say(
            "pose.zoomed",
            "The zoom or focus has changed: the focal length is {zoom:+.1f} ± {sigma:.1f} % off.",
            zoom=100 * self.zoom,
            sigma=100 * self.sigma,
        )

    @property
    def resolution(self) -> Sentence:
        return say(
            "pose.zoom-held",
            "A change of zoom by {pct:percent} % would have been detected.",
            pct=100 * max(MIN_SIGMAS * self.sigma, MIN_ZOOM),
        )

    @property
    def untested(self) -> Sentence:
        if not np.isfinite(self.sigma):
            return say("pose.zoom-unknown", "A change of zoom cannot be ruled out.")
        return say(
            "pose.zoom-untested",
            "A change of zoom cannot be ruled out: these lines show only changes above {pct:.0f} %.",
            pct=100 * min(MIN_SIGMAS * self.sigma, 1.0),
        )

    def to_json(self) -> JsonObject:
        pct, sigma = (
            round(100 * share, 3) if np.isfinite(share) else None
            for share in (self.zoom, self.sigma)
        )
        return {"state": self.state, "pct": pct, "sigma_pct": sigma}


def _own_focal(lens: Intrinsics) -> tuple[float, float]:
    return float(np.log(lens.focal_px)), lens.sigma.get("log_focal", np.nan)


def _focal(
    lens: Intrinsics, lines: Observations, field: Field, region: Region, options: Mapping[str, Any]
) -> tuple[float, float]:
    """Return the logarithm of the focal length that the lines ask for, and its σ."""
    names = lens.estimated if "log_focal" in lens.estimated else ("log_focal", *lens.estimated)
    own = [names.index(name) for name in lens.estimated]
    covariance = np.zeros((len(names), len(names)))
    covariance[np.ix_(own, own)] = np.reshape(lens.covariance, (len(own), len(own)))
    covariance[names.index("log_focal"), names.index("log_focal")] += FREE_SIGMA**2
    free = replace(
        lens, estimated=names, covariance=tuple(tuple(row) for row in covariance.tolist())
    )
    fit = FITTERS[lens.model].fit(
        lines,
        field,
        region,
        lens.image_size,
        {**options, "lens": {"name": lens.model, "lens": free.to_json()}, "lens_sigma": "own"},
    )
    assert isinstance(fit.model, RayCamera) and fit.covariance is not None
    found = camera_intrinsics(
        fit.model, {"names": fit.parameter_names, "matrix": fit.covariance.tolist()}
    )
    return _own_focal(found)


def run_register(spec: Any, progress: Progress) -> JsonObject:
    """Run a job: {"calibration": whole, "snapshot", "note", "picture": {"name", "path", "sha256"}, "before": likewise
    or null}."""
    own = [spec["before"]] if spec["before"] else []
    before = None
    with job_pictures([spec["picture"], *own]) as pictures:
        frame = pictures[0][1]()
        # gone or damaged: then the model itself says where lines were
        with suppress(TouchlineError):
            before = pictures[1][1]() if own else None
    summary, version = reregister(
        Calibration.from_json(spec["calibration"]),
        frame,
        subprogress(progress, 0.1, 1.0),
        before,
        spec["snapshot"],
        spec["note"],
    )
    return {"told": summary, "made": version.to_json()}
