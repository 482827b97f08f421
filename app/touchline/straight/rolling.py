"""From frames of a still camera to straight rolls, and from rolls to a report, a lens, or a refined calibration.

    recorder = RollRecorder()
    for seconds, pixels in frames: new = recorder.add(seconds, pixels)      each a straight roll that has just ended
    recorder.report(model)          Eq. (9) per roll, zone and lens: raw, and as far as the model leaves it

What is made from rolls (a film's, stored ones, or a script's):

    report    how far rolls bow, raw and as far as a calibration leaves it
    lens      the same rolls as plumb lines: a lens that a later fit can fix
    refined   a calibration fitted anew to its own clicks and to the rolls together
"""

from collections.abc import Mapping, Sequence
from contextlib import closing
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import BadInput, Conflict, FitFailed
from touchline.core.geometry import ImageSize
from touchline.core.jobs import Progress, no_progress, subprogress
from touchline.core.json_values import JsonObject
from touchline.core.records import Calibration
from touchline.core.sentences import PROGRESS_DONE, SECURE_CAMERA
from touchline.core.statements import say, stated
from touchline.fitting.ray_camera.lens_prior import DistortionEstimate
from touchline.installation import __version__
from touchline.models import CameraModel, model_of
from touchline.models.distortion import LINE_LENSES, Distortion
from touchline.sources.video import read_video
from touchline.straight.deceleration import deceleration_json
from touchline.straight.rolls import RecordedRoll, roll_report
from touchline.straight.straightness import check_choice, straightness
from touchline.straight.tracks import MotionDetector, StraightRun, Track, Tracker, straight_runs
from touchline.workflows.calibration_request import CalibrationRequest

MAX_UPSET_SHARE = 0.1  # of the frames in which nearly all changed: the camera is not still
MAX_LIGHT_CHANGES = 2  # besides: times that light may be switched
MIN_FOR_LENS = 3  # rolls
CUT_EVERY = 8  # frames, at what is still being followed
SETTLED_FRAMES = 6  # after its end until a roll is reported: until then it may still go on
# points of a track that are looked at before it has ended: what stands and shakes has no end
MAX_OPEN_POINTS = 240
MIN_STEP_S = 1e-5  # between frames: less is no clock of theirs
MAX_KNOWN_FRAMES = 4096  # whose times are remembered; tracks are shorter
PRODUCTS = ("report", "lens", "refined")
MAX_FRAMES = 100_000
PROGRESS_EVERY = 10  # frames
TRACKING_SHARE = 0.7  # of the work, where there is a film
MAX_DRAWN_POINTS = 33  # points of a roll that a page needs


class RollRecorder:
    """Tracks what moves, cuts tracks into straight rolls, and collects them. One thread at a time.

    live: report a roll soon after its end, while its track is still open.
    """

    def __init__(self, live: bool = False) -> None:
        self._motion, self._tracker = MotionDetector(), Tracker()
        self._live = live
        self._times: dict[int, float] = {}
        self._first_s = self._last_s = 0.0
        self._size: ImageSize | None = None
        self.frames = 0
        self.rolls: list[RecordedRoll] = []

    def add(
        self, seconds: float, pixels: NDArray[np.uint8], number: int | None = None
    ) -> list[RecordedRoll]:
        """Add a frame (h, w, 3), when it was taken, and its number where some were missed; return the rolls just ended.

        BadInput for another size.
        """
        size = ImageSize(pixels.shape[1], pixels.shape[0])
        if self._size is not None and size != self._size:
            raise BadInput(
                say("rolls.frames-differ", "The frames have different sizes."),
                say("rolls.one-resolution", "Use one camera at one resolution."),
                reason="size-mismatch",
            )
        self._size = size
        number = self.frames if number is None else number
        self._first_s = float(seconds) if not self.frames else self._first_s
        self._last_s = self._times[number] = float(seconds)
        if len(self._times) > MAX_KNOWN_FRAMES:
            del self._times[next(iter(self._times))]
        self.frames += 1
        ended = self._cut(self._tracker.add(number, self._motion.add(pixels)))
        return ended + (
            self._settled(number) if self._live and self.frames % CUT_EVERY == 0 else []
        )

    def end(self) -> list[RecordedRoll]:
        """End all tracks; return their rolls."""
        return self._cut(self._tracker.end())

    @property
    def open_tracks(self) -> list[Track]:
        """Return the tracks of what is still followed."""
        return self._tracker.now

    @property
    def is_still(self) -> bool:
        """Whether the camera stands still: not where nearly the whole picture changes again and again."""
        return self._motion.upset <= MAX_UPSET_SHARE * self.frames + MAX_LIGHT_CHANGES

    @property
    def size(self) -> ImageSize:
        """Return the frames' size; BadInput before the first one."""
        if self._size is None:
            raise BadInput(
                say("rolls.no-frames", "There are no frames."),
                say("rolls.use-video", "Use a video, or wait for the camera."),
                reason="nothing-given",
            )
        return self._size

    def report(self, model: CameraModel | None = None, name: str | None = None) -> JsonObject:
        """Return all figures as plain JSON; `corrected` where a model was given, `lens` where three rolls give one."""
        figures = roll_report(self.rolls, self.size, model, name)
        if not self.is_still:
            raise BadInput(
                say(
                    "rolls.not-still",
                    "Nearly the whole image changes repeatedly: the camera or its "
                    "light is not steady.",
                ),
                SECURE_CAMERA,
                reason="camera-not-still",
            )
        return {
            **figures,
            "frames": self.frames,
            "seconds": self._last_s - self._first_s,
            "runs": [roll.to_json() for roll in self.rolls],
            "lens": straightness_or_none(self.rolls, figures, self.size),
        }

    def _cut(self, tracks: Sequence[Track]) -> list[RecordedRoll]:
        new = [self._recorded(run) for track in tracks for run in self._runs(track)]
        self.rolls += new
        return new

    def _settled(self, now: int) -> list[RecordedRoll]:
        """Return rolls that have ended within open tracks; a ball that is kicked again and again is one track."""
        new: list[RecordedRoll] = []
        for track in self._tracker.now:
            runs = self._runs(track)
            done = [run for run in runs if run.frames[-1] <= now - SETTLED_FRAMES]
            new += [self._recorded(run) for run in done]
            if done:
                self._tracker.forget(track.number, int(done[-1].frames[-1]))
            elif not runs and len(track.points) > MAX_OPEN_POINTS:
                self._tracker.forget(track.number, int(track.frames[MAX_OPEN_POINTS // 2]))
        self.rolls += new
        return new

    def _runs(self, track: Track) -> list[StraightRun]:
        return straight_runs(
            track.frames, track.points, float(np.hypot(self.size.width, self.size.height))
        )

    def _recorded(self, run: StraightRun) -> RecordedRoll:
        times_s = np.array([self._times[int(frame)] for frame in run.frames])
        return RecordedRoll(
            run.points,
            float(times_s[0]),
            float(times_s[-1]),
            run.rms_px,
            run.straight_px,
            times_s - times_s[0] if np.all(np.diff(times_s) > MIN_STEP_S) else None,
        )


def straightness_or_none(
    rolls: Sequence[RecordedRoll], figures: JsonObject, size: ImageSize
) -> JsonObject | None:
    """Fit the rolls as plumb lines, as edges are; None where they give no lens. figures: their report."""
    agreeing = agreeing_rolls(rolls, figures)
    if len(agreeing) < MIN_FOR_LENS:
        return None
    try:
        return straightness((), [roll.points for roll in agreeing], size)
    except FitFailed:
        return None


def agreeing_rolls(rolls: Sequence[RecordedRoll], figures: JsonObject) -> list[RecordedRoll]:
    """Return those that agree with the others, by their report."""
    return [rolls[roll["number"]] for roll in figures["raw"]["rolls"] if roll["used"]]


def run_motion(spec: Any, progress: Progress) -> JsonObject:
    """A job: {"film": path | None, "rolls": as stored, "image_size", "calibration": JSON | None, "make", "lens",
    "centre_sigma_px", "note", "camera"} to {"report", "lens": a record | None, "calibration": JSON | None}."""
    calibration = (
        None if spec["calibration"] is None else Calibration.from_json(spec["calibration"])
    )
    if spec["film"] is not None:
        recorder = track_film(spec["film"], subprogress(progress, 0.0, TRACKING_SHARE), calibration)
        rolls, size = recorder.rolls, recorder.size
        model, name = model_for_size(calibration, size)
        report = recorder.report(model, name)
    else:
        rolls, size = (
            [roll_from_json(one) for one in spec["rolls"]],
            ImageSize.of(spec["image_size"]),
        )
        model, name = model_for_size(calibration, size)
        report = roll_report(rolls, size, model, name)
        report = {**report, "runs": [roll.to_json() for roll in rolls]}
    agreeing, is_free = agreeing_rolls(rolls, report), report["raw"]["free"]
    report["deceleration"] = deceleration_json(agreeing, model, size, is_free)
    lens = refined = None
    if spec["make"] != "report":
        progress(TRACKING_SHARE, say("progress.straightening-rolls", "Straightening the rolls"))
        kind, centre_sigma_px = spec["lens"], spec["centre_sigma_px"]
        before = check_refinable(calibration) if spec["make"] == "refined" else None
        if before is not None:
            kind, centre_sigma_px = (
                before.model_name,
                float(before.options.get("centre_sigma_px") or 0.0),
            )
        lens = lens_record(rolls, size, kind, centre_sigma_px, spec["note"], spec["camera"])
        if before is not None:
            refined = refine(before, lens, spec["note"], subprogress(progress, 0.8, 1.0)).to_json()
    progress(1.0, PROGRESS_DONE)
    return {"report": report, "lens": lens, "calibration": refined}


def track_film(
    film: str, progress: Progress = no_progress, calibration: Calibration | None = None
) -> RollRecorder:
    """Record the rolls of a film, which is read once. calibration: refused early where its picture size differs."""
    recorder = RollRecorder()
    with closing(read_video(film)) as frames:
        for number, (moment_s, frame) in enumerate(islice(frames, MAX_FRAMES)):
            if number == 0:
                model_for_size(calibration, frame.size)
            recorder.add(moment_s, frame.pixels)
            if number % PROGRESS_EVERY == 0:
                progress(
                    number / (number + 200),
                    say(
                        "progress.tracking",
                        "Tracking motion: {seconds:.1f} s, {rolls} rolls",
                        seconds=moment_s,
                        rolls=len(recorder.rolls),
                    ),
                )
    recorder.end()
    return recorder


def stored_rolls_json(
    stored: Sequence[Mapping[str, Any]], calibration: Calibration | None
) -> JsonObject:
    """Return stored rolls, oldest first, with the figures of each and of all: {"items", "report", "deceleration"}.

    Only those of the newest one's picture size count; the report is None without any.
    """
    if not stored:
        return {"items": [], "report": None, "deceleration": None}
    size = ImageSize.of(stored[-1]["image_size"])
    counting = [
        one for one in stored if ImageSize.of(one["image_size"]) == size and not one["left_out"]
    ]
    model = name = None
    if calibration is not None and calibration.image_size == size:
        model, name = model_of(calibration), calibration.id
    rolls = [roll_from_json(one) for one in counting]
    report = roll_report(rolls, size, model, name)
    is_free = report["raw"]["free"]
    agreeing = agreeing_rolls(rolls, report)
    by_id: dict[str, JsonObject] = {one["id"]: {"raw": None, "corrected": None} for one in stored}
    for view in ("raw", "corrected"):
        figures = report[view]
        for one in figures.pop("rolls") if figures else ():
            by_id[counting[one["number"]]["id"]][view] = one
    items = []
    for one in stored:
        drawn = np.unique(
            np.linspace(0, len(one["points"]) - 1, MAX_DRAWN_POINTS).round().astype(int)
        )
        items.append(
            {
                "id": one["id"],
                "at": one["at"],
                "seconds": one["seconds"],
                "left_out": one["left_out"],
                "counts": ImageSize.of(one["image_size"]) == size,
                "points": [one["points"][i] for i in drawn],
                **by_id[one["id"]],
            }
        )
    deceleration = deceleration_json(agreeing, model, size, is_free)
    return {"items": items, "report": report, "deceleration": deceleration}


def roll_from_json(one: Mapping[str, Any]) -> RecordedRoll:
    """Read a roll as it is stored or sent: {"points", "seconds"}, perhaps "at", "rms_px", "straight_px" and "times"."""
    end_s = float(one.get("at") or one["seconds"])
    return RecordedRoll(
        np.array(one["points"], float),
        end_s - one["seconds"],
        end_s,
        one.get("rms_px", 0.0),
        one.get("straight_px", 0.0),
        np.array(one["times"], float) if one.get("times") else None,
    )


def lens_record(
    rolls: Sequence[RecordedRoll],
    size: ImageSize,
    kind: str = "auto",
    centre_sigma_px: float | None = 0.0,
    note: str = "",
    camera: str | None = None,
) -> JsonObject:
    """Return a lens from rolls as plumb lines, as GET /lenses has it; FitFailed where they give none.

    Its covariance is that of plumb lines, but never less than rolls allow, which spin and slope push aside.
    """
    figures = roll_report(rolls, size)
    used = agreeing_rolls(rolls, figures)
    if not figures["raw"]["free"]:
        raise FitFailed(
            say(
                "rolls.driven", "These are not free rolls. The moving object was driven or pushed."
            ),
            say("rolls.roll-one-ball", "Delete them, and roll one ball while nothing else moves."),
            reason="not-free",
        )
    if len(used) < MIN_FOR_LENS:
        raise FitFailed(
            say(
                "rolls.too-few",
                "{agreeing} rolls agree with each other. A lens needs {needed}.",
                agreeing=len(used),
                needed=MIN_FOR_LENS,
            ),
            say(
                "rolls.roll-more",
                "Roll the ball more often, fast, in several directions, near the "
                "edges of the image.",
            ),
            reason="too-few-rolls",
        )
    found = straightness(
        (), [roll.points for roll in used], size, lens=kind, centre_sigma_px=centre_sigma_px
    )
    border = found["bow"]["border"]
    by_lines, by_rolls = (
        100 * border["sigma_px"] / border["length_px"],
        figures["raw"]["border_sigma_pct"],
    )
    widening = max(1.0, by_rolls / max(by_lines, 1e-9))
    lens = DistortionEstimate(
        Distortion.from_json(found["lens"]),
        tuple(found["names"]),
        widening**2 * np.array(found["covariance"]),
    )
    level = {
        "significant": "good",
        "none": "good",
        "unknown": "poor" if found["edges_bow"] else "fair",
    }[found["distortion"]]
    return {
        "camera": camera,
        "note": note or f"From {len(used)} rolls",
        "model": lens.distortion.name,
        "lens": lens.to_json(),
        "board": None,
        "image_size": list(size),
        "snapshots": None,
        "software": f"touchline {__version__}",
        "report": {
            "rms_px": found["straightness_px"]["after"],
            "views": [],
            "warnings": [],
            "verdict": stated({"level": level, "sentence": found["sentence"]}),
            "rolls": len(used),
            "straightness_px": found["straightness_px"],
            "bow": found["bow"],
            "sigma": {
                name: float(np.sqrt(lens.covariance[i, i])) for i, name in enumerate(lens.names)
            },
        },
    }


def check_refinable(calibration: Calibration | None) -> Calibration:
    """Return the calibration; Conflict where there is none or rolls cannot refine it."""
    if calibration is None:
        raise Conflict(
            say("rolls.nothing-to-refine", "There is no calibration to refine."),
            say("rolls.select-calibration", "Activate or select a calibration."),
            reason="not-calibrated",
        )
    if calibration.model_name not in LINE_LENSES:
        raise Conflict(
            say(
                "rolls.model-not-refinable",
                "Straight rolls cannot refine {model}, because they determine none of its terms.",
                model=calibration.model_name,
            ),
            say(
                "rolls.fit-one-of",
                "Fit one of {models}, or fit a lens to the rolls.",
                models=list(LINE_LENSES),
            ),
            reason="not-refinable",
        )
    if calibration.options.get("lens"):
        raise Conflict(
            say(
                "rolls.lens-from-elsewhere",
                "This calibration uses a lens from elsewhere, which would be replaced.",
            ),
            say(
                "rolls.refine-own-lens",
                "Refine a calibration whose lens was fitted to its own points, "
                "or fit a lens to the rolls.",
            ),
            reason="not-refinable",
        )
    if not calibration.observations:
        raise Conflict(
            say("rolls.no-points", "This calibration was imported and has no points."),
            say("rolls.calibrate-first", "Calibrate from an image first."),
            reason="not-refinable",
        )
    return calibration


def refine(
    calibration: Calibration,
    lens: Mapping[str, Any],
    note: str = "",
    progress: Progress = no_progress,
) -> Calibration:
    """Fit the calibration's own clicks again, with the distortion of that lens record as a prior."""
    check_refinable(calibration)
    options = {
        **calibration.options,
        "lens": {"name": lens["model"], "lens": lens["lens"]},
        "lens_sigma": "own",
    }
    request = CalibrationRequest.of(
        calibration,
        options,
        note or f"Version {calibration.version}, lens refined with {lens['report']['rolls']} rolls",
    )
    return request.record(request.run(progress), parent=calibration.id)


def check_product(make: str, lens: str, centre_sigma_px: float | None) -> None:
    """Refuse what can be refused before a film is read."""
    if make not in PRODUCTS:
        raise BadInput(
            f"Rolls cannot be used for {make!r}.",
            f"Use one of: {', '.join(PRODUCTS)}.",
            reason="bad-option",
        )
    check_choice(lens, centre_sigma_px)


def model_for_size(
    calibration: Calibration | None, size: ImageSize
) -> tuple[CameraModel | None, str | None]:
    """Return the calibration's model and id; Conflict where it is of pictures of another size."""
    if calibration is None:
        return None, None
    wanted = calibration.image_size
    if wanted != size:
        raise Conflict(
            say(
                "rolls.other-image-size",
                "The rolls are from images of {size}; the calibration is for {wanted}.",
                size=size,
                wanted=wanted,
            ),
            say(
                "rolls.calibrated-resolution",
                "Use rolls recorded at the resolution that was calibrated.",
            ),
            reason="size-mismatch",
        )
    return model_of(calibration), calibration.id
