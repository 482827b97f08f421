"""Requests about rolls: a report on a film or on stored rolls, a lens from them, a calibration refined by them.

    report    how far rolls bow, raw and as far as a calibration leaves it
    lens      the same rolls as plumb lines: a lens that a later fit can fix
    refined   a calibration fitted anew to its own clicks and to the rolls together
"""

from collections.abc import Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from touchline.core.common_sentences import PROGRESS_DONE
from touchline.core.errors import BadInput, Conflict, FitFailed, NotFound, Unavailable
from touchline.core.geometry import ImageSize
from touchline.core.progress import Progress, no_progress, subprogress
from touchline.core.records import Calibration
from touchline.core.statements import say, stated
from touchline.evaluate.motion.roll_report import RecordedRoll, roll_report
from touchline.fitting.ray_camera.distortion_prior import DistortionEstimate
from touchline.images import frame_from_bytes
from touchline.installation import __version__
from touchline.models import CameraModel
from touchline.models.distortion import LINE_LENSES, Distortion
from touchline.models.restored import model_of
from touchline.sources import SourceContext
from touchline.sources.local.video import VideoSource
from touchline.workflows.calibration_request import CalibrationRequest
from touchline.workflows.rolling import MIN_FOR_LENS, RollRecorder, agreeing_rolls
from touchline.workflows.straight_lines import check_choice, straightness

MAKE = ("report", "lens", "refined")
MAX_FRAMES = 100_000
PROGRESS_EVERY = 10  # frames
FOLLOWING = 0.7  # of the work, where there is a film
DRAWN = 33  # points of a roll that a page needs
OPTIONS = {"loop": False, "pace": "fast", "start_s": 0.0, "fps": None}


def run_motion(spec: Any, progress: Progress) -> dict[str, Any]:
    """A job: {"film": path | None, "rolls": as stored, "image_size", "calibration": JSON | None, "make", "lens",
    "centre_sigma_px", "note", "camera"} to {"report", "lens": a record | None, "calibration": JSON | None}."""
    given = spec["calibration"]
    calibration = None if given is None else Calibration.from_json(given)
    if spec["film"] is not None:
        rolling = track_film(Path(spec["film"]), subprogress(progress, 0.0, FOLLOWING), calibration)
        rolls, size, report = rolling.rolls, rolling.size, rolling.report(*model_for_size(calibration, rolling.size))
    else:
        rolls, size = [roll_from_json(one) for one in spec["rolls"]], ImageSize.of(spec["image_size"])
        report = roll_report(rolls, size, *model_for_size(calibration, size))
        report = {**report, "runs": [roll.to_json() for roll in rolls]}
    lens = made = None
    if spec["make"] != "report":
        progress(FOLLOWING, say("progress.straightening-rolls", "Straightening the rolls"))
        kind, held = spec["lens"], spec["centre_sigma_px"]
        refined = check_refinable(calibration) if spec["make"] == "refined" else None
        if refined is not None:
            kind, held = refined.model_name, float(refined.options.get("centre_sigma_px") or 0.0)
        lens = lens_record(rolls, size, kind, held, spec["note"], spec["camera"])
        if refined is not None:
            made = refine(refined, lens, spec["note"], subprogress(progress, 0.8, 1.0)).to_json()
    progress(1.0, PROGRESS_DONE)
    return {"report": report, "lens": lens, "calibration": made}


def track_film(path: Path, progress: Progress = no_progress, calibration: Calibration | None = None) -> RollRecorder:
    """Record the rolls of a film, which is read once. calibration: refused early where its picture size differs."""
    if not path.is_file():
        raise NotFound(say("rolls.unknown-video", "There is no video {name!r}.", name=path.name),
                       say("rolls.check-path", "Check the path."), reason="unknown-video")
    rolling = RollRecorder()
    with closing(VideoSource.open(path.name, OPTIONS, SourceContext(decode=frame_from_bytes,
                                                                    pictures=path.parent))) as film:
        for number in range(MAX_FRAMES):
            try:
                frame = film.read()
            except Unavailable as error:
                if error.reason != "source-ended":
                    raise
                break
            if number == 0:
                model_for_size(calibration, frame.size)
            rolling.add(film.moment_s, frame.pixels)
            if number % PROGRESS_EVERY == 0:
                progress(number / (number + 200),
                         say("progress.tracking", "Tracking motion: {seconds:.1f} s, {rolls} rolls",
                             seconds=film.moment_s, rolls=len(rolling.rolls)))
    rolling.end()
    return rolling


def stored_rolls_json(stored: Sequence[Mapping[str, Any]], calibration: Calibration | None) -> dict[str, Any]:
    """Stored rolls, oldest first, with the figures of each and of all: {"items", "report"}.

    Only those of the newest one's picture size count; the report is None without any.
    """
    if not stored:
        return {"items": [], "report": None}
    size = ImageSize.of(stored[-1]["image_size"])
    here = [one for one in stored if ImageSize.of(one["image_size"]) == size and not one["left_out"]]
    model = name = None
    if calibration is not None and calibration.image_size == size:
        model, name = model_of(calibration), calibration.id
    report = roll_report([roll_from_json(one) for one in here], size, model, name)
    by_id: dict[str, dict[str, Any]] = {one["id"]: {"raw": None, "corrected": None} for one in stored}
    for view in ("raw", "corrected"):
        figures = report[view]
        for one in figures.pop("rolls") if figures else ():
            by_id[here[one["number"]]["id"]][view] = one
    items = []
    for one in stored:
        few = np.unique(np.linspace(0, len(one["points"]) - 1, DRAWN).round().astype(int))
        items.append({"id": one["id"], "at": one["at"], "seconds": one["seconds"], "left_out": one["left_out"],
                      "counts": ImageSize.of(one["image_size"]) == size, "points": [one["points"][i] for i in few],
                      **by_id[one["id"]]})
    return {"items": items, "report": report}


def roll_from_json(one: Mapping[str, Any]) -> RecordedRoll:
    """Read a roll as it is stored or sent: {"points", "seconds"}, perhaps "at", "rms_px" and "straight_px"."""
    end = float(one.get("at") or one["seconds"])
    return RecordedRoll(np.array(one["points"], float), end - one["seconds"], end, one.get("rms_px", 0.0),
                        one.get("straight_px", 0.0))


def lens_record(rolls: Sequence[RecordedRoll], size: ImageSize, kind: str = "auto", centre_sigma_px: float | None = 0.0,
                note: str = "", camera: str | None = None) -> dict[str, Any]:
    """Return a lens from rolls as plumb lines, as GET /lenses has it; FitFailed where they give none.

    Its covariance is that of plumb lines, but never less than rolls allow, which spin and slope push aside.
    """
    figures = roll_report(rolls, size)
    used = agreeing_rolls(rolls, figures)
    if not figures["raw"]["free"]:
        raise FitFailed(say("rolls.driven", "These are not free rolls. The moving object was driven or pushed."),
                        say("rolls.roll-one-ball", "Delete them, and roll one ball while nothing else moves."),
                        reason="not-free")
    if len(used) < MIN_FOR_LENS:
        raise FitFailed(say("rolls.too-few", "{agreeing} rolls agree with each other. A lens needs {needed}.",
                            agreeing=len(used), needed=MIN_FOR_LENS),
                        say("rolls.roll-more", "Roll the ball more often, fast, in several directions, near the "
                            "edges of the image."), reason="too-few-rolls")
    found = straightness((), [roll.points for roll in used], size, lens=kind, centre_sigma_px=centre_sigma_px)
    border = found["bow"]["border"]
    by_lines, by_rolls = 100 * border["sigma_px"] / border["length_px"], figures["raw"]["border_sigma_pct"]
    wider = max(1.0, by_rolls / max(by_lines, 1e-9))
    lens = DistortionEstimate(Distortion.from_json(found["lens"]), tuple(found["names"]),
                              wider**2 * np.array(found["covariance"]))
    level = {"significant": "good", "none": "good", "unknown": "poor" if found["edges_bow"] else "fair"}[
        found["distortion"]]
    return {"camera": camera, "note": note or f"From {len(used)} rolls", "model": lens.distortion.name,
            "lens": lens.to_json(), "board": None, "image_size": list(size), "snapshots": None,
            "software": f"touchline {__version__}",
            "report": {"rms_px": found["straightness_px"]["after"], "views": [], "warnings": [],
                       "verdict": stated({"level": level, "sentence": found["sentence"]}), "rolls": len(used),
                       "straightness_px": found["straightness_px"], "bow": found["bow"],
                       "sigma": {name: float(np.sqrt(lens.covariance[i, i])) for i, name in enumerate(lens.names)}}}


def check_refinable(calibration: Calibration | None) -> Calibration:
    """Return the calibration; Conflict where there is none or rolls cannot refine it."""
    if calibration is None:
        raise Conflict(say("rolls.nothing-to-refine", "There is no calibration to refine."),
                       say("rolls.select-calibration", "Activate or select a calibration."), reason="not-calibrated")
    if calibration.model_name not in LINE_LENSES:
        raise Conflict(say("rolls.model-not-refinable", "Straight rolls cannot refine {model}, because they determine "
                           "none of its terms.", model=calibration.model_name),
                       say("rolls.fit-one-of", "Fit one of {models}, or fit a lens to the rolls.",
                           models=list(LINE_LENSES)), reason="not-refinable")
    if calibration.options.get("lens"):
        raise Conflict(say("rolls.lens-from-elsewhere", "This calibration uses a lens from elsewhere, which would be "
                           "replaced."),
                       say("rolls.refine-own-lens", "Refine a calibration whose lens was fitted to its own points, "
                           "or fit a lens to the rolls."), reason="not-refinable")
    if not calibration.observations:
        raise Conflict(say("rolls.no-points", "This calibration was imported and has no points."),
                       say("rolls.calibrate-first", "Calibrate from an image first."), reason="not-refinable")
    return calibration


def refine(calibration: Calibration, lens: Mapping[str, Any], note: str = "",
           progress: Progress = no_progress) -> Calibration:
    """Fit the calibration's own clicks again, with the distortion of that lens record as a prior."""
    check_refinable(calibration)
    options = {**calibration.options, "lens": {"name": lens["model"], "lens": lens["lens"]}, "lens_sigma": "own"}
    request = CalibrationRequest.of(calibration, options, note or f"Version {calibration.version}, lens refined with "
                                                                  f"{lens['report']['rolls']} rolls")
    return request.record(request.run(progress), parent=calibration.id)


def check(make: str, lens: str, centre_sigma_px: float | None) -> None:
    """Refuse what can be refused before a film is read."""
    if make not in MAKE:
        raise BadInput(f"Rolls cannot be used for {make!r}.", f"Use one of: {', '.join(MAKE)}.", reason="bad-option")
    check_choice(lens, centre_sigma_px)


def model_for_size(calibration: Calibration | None, size: ImageSize) -> tuple[CameraModel | None, str | None]:
    """Return the calibration's model and id; Conflict where it is of pictures of another size."""
    if calibration is None:
        return None, None
    wanted = calibration.image_size
    if wanted != size:
        raise Conflict(say("rolls.other-image-size", "The rolls are from images of {size}; the calibration is for "
                           "{wanted}.", size=size, wanted=wanted),
                       say("rolls.calibrated-resolution", "Use rolls recorded at the resolution that was calibrated."),
                       reason="size-mismatch")
    return model_of(calibration), calibration.id
