"""A request for a calibration without clicks, and what came of it; routes, jobs and commands share it."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from dataclasses import field as member
from itertools import chain
from typing import Any, Self

import numpy as np
from typing_extensions import TypedDict

from touchline.automatic import assignment
from touchline.automatic.assignment import DetectedLines, LineAssignment
from touchline.automatic.hypotheses import check_corners
from touchline.automatic.matching import PosePrior, is_near_height
from touchline.automatic.search import SearchResult, recognise, search
from touchline.core.errors import FitFailed, ProblemJson
from touchline.core.field import Field, Region
from touchline.core.field_json import field_from_json
from touchline.core.geometry import Pixels, with_z
from touchline.core.jobs import Progress, no_progress, subprogress
from touchline.core.json_values import JsonObject, SizeJson, read
from touchline.core.records import Calibration, Frame, ObservationJson
from touchline.core.sentences import DETECTING_LINES, SERIES_MOVED, SERIES_MOVED_FIX, marking_name
from touchline.core.statements import Sentence, say, stated
from touchline.evaluate.areas import (
    FITS_OVERLAP,
    NEAR_OVERLAP,
    NOT_IN_IMAGE,
    AreaJson,
    SeenArea,
    area_sentences,
    better_areas,
    smaller_areas,
)
from touchline.evaluate.field_lines.measurement import line_deviations, measure_single_markings
from touchline.evaluate.field_lines.motion import LineReference
from touchline.evaluate.report_types import FitReport
from touchline.evaluate.verification import (
    MISSING_SHOWN,
    AutomaticVerdict,
    Proof,
    Verification,
    verdict_of,
)
from touchline.fitting import FITTERS
from touchline.fitting.field_pattern import is_half_turn_symmetric
from touchline.fitting.ray_camera.parameters import RayCameraParameters
from touchline.models import CameraModel
from touchline.models.ray_camera import RayCamera
from touchline.workflows.calibration_request import CalibrationRequest
from touchline.workflows.job_pictures import Pictures
from touchline.workflows.model_choice import AUTO, LADDER

MAX_SERIES_CHECKED = 5  # pictures of a series: a camera that sways is elsewhere in one of them
MIN_ELSEWHERE_SHARE = 0.6  # of a marking, seen in one course
# times the field's own σ of a line; what is nearer is paint
MIN_ELSEWHERE_SIGMAS, MIN_ELSEWHERE_MM = 3.0, 5.0
OF_OTHER_PAINT = {"lines-missing", "lines-unexplained"}  # doubts that such lines give


def pose_prior_from_json(value: Mapping[str, Any]) -> PosePrior:
    """Read {"height_mm", "turn_deg", "corners"}, each where it is known; BadInput for other keys and values."""
    prior = read(
        PosePrior,
        value,
        "The approximate pose",
        "Use height_mm from 100 to 100000, turn_deg from -360 to 360, and four pixels as corners.",
        "bad-rough",
    )
    if prior.corners is not None:
        check_corners(np.array(prior.corners))
    return prior


class LineElsewhere(TypedDict):
    """A marking, and how far beside its place it is painted, mm."""

    feature: str
    mm: float


class FoundCamera(TypedDict):
    """proof, report: None where none was found. elsewhere: markings that are painted beside where the field has them.
    areas: what the picture shows in place of the chosen area; empty where that is right, or nothing else fits.
    """

    observations: list[ObservationJson]
    proof: Proof | None
    report: FitReport | None
    areas: list[AreaJson]
    elsewhere: list[LineElsewhere]
    doubts: list[ProblemJson]
    verdict: AutomaticVerdict


class AutomaticAnswer(FoundCamera):
    """What was found without clicks. field, region, rotate: None where it is not clear what the picture shows.

    lines: the detected ones, raw px.
    """

    field: str | None
    region: str | None
    rotate: int | None
    model: str
    image_size: SizeJson
    candidates: list[JsonObject]
    lines: list[list[list[float]]]


@dataclass(frozen=True, eq=False)
class AutomaticRequest:
    """The field and region to find, the model to fit, and what is known of the pose.

    is_chosen: whether somebody chose the field; see Verification.doubts(). is_area_seen: whether the area was chosen as
    the one that the picture shows: then none within it is looked for.
    """

    field: Field
    region: Region
    model: str = AUTO
    options: Mapping[str, Any] = member(default_factory=dict)
    rough: Mapping[str, Any] = member(default_factory=dict)
    camera: str | None = None
    snapshot: str | None = None
    note: str = ""
    is_chosen: bool = True
    is_area_seen: bool = False

    def __post_init__(self) -> None:
        for name in chain(*self.models):
            FITTERS[name]
        pose_prior_from_json(self.rough)

    @property
    def models(self) -> tuple[tuple[str, ...], ...]:
        return LADDER if self.model == AUTO else ((self.model,),)

    def to_json(self) -> JsonObject:
        return {
            "field": self.field.to_json(),
            "region": self.region.name,
            "rotate": self.region.rotate_deg,
            "model": self.model,
            "options": dict(self.options),
            "rough": dict(self.rough),
            "camera": self.camera,
            "snapshot": self.snapshot,
            "note": self.note,
        }

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> Self:
        field = field_from_json(value["field"])
        return cls(
            field,
            field.region(value["region"], value["rotate"]),
            value["model"],
            value["options"],
            value["rough"],
            value["camera"],
            value["snapshot"],
            value["note"],
        )

    def answer(
        self,
        frame: Frame,
        progress: Progress = no_progress,
        series: Pictures = (),
    ) -> tuple[AutomaticAnswer, Calibration | None]:
        """Return what was found, and the calibration where no doubt remains.

        series: the pictures of which the frame is the median; its lines must lie alike in all of them.
        A picture without a match is an answer as well: the detected lines and why none matched.
        """
        progress(0.0, DETECTING_LINES)
        lines = assignment.detect_lines(frame.pixels)
        searched = search(
            lines.seen,
            self.field,
            self.region,
            pose_prior_from_json(self.rough),
            subprogress(progress, 0.15, 0.6),
        )
        return self.answer_of(lines, searched, frame, subprogress(progress, 0.6, 1.0), series)

    def answer_of(
        self,
        lines: DetectedLines,
        searched: SearchResult,
        frame: Frame,
        progress: Progress = no_progress,
        series: Pictures = (),
    ) -> tuple[AutomaticAnswer, Calibration | None]:
        """Return the same of cameras that were searched for already."""
        progress(0.0, say("progress.measuring-the-lines", "Measuring the lines"))
        found = assignment.points_on_lines(lines, self.field, self.region, searched)
        summary: AutomaticAnswer = {
            "field": self.field.name,
            "region": self.region.name,
            "rotate": self.region.rotate_deg,
            "model": self.model,
            "image_size": list(frame.size),
            "candidates": assignment.candidates_json(searched, self.region),
            "lines": lines.polylines(),
            **without_camera([assignment.no_match_error(searched).to_json()]),
        }
        proof = None if found is None else assignment.verify(found, lines, self.region)
        areas: tuple[SeenArea, ...] = ()
        calibration = None
        if found is not None and proof is not None and not proof.doubts(self.is_chosen):
            areas = self._better_areas(found.state, frame)
        if found is not None and not areas:
            proof, calibration = self._fitted(
                found, lines, frame, series, summary, subprogress(progress, 0.1, 0.6)
            )
        is_weak = calibration is None or calibration.report["verdict"]["level"] == "poor"
        if (
            is_weak
            and not areas
            and not self.is_area_seen
            and len(searched.lines) >= assignment.MIN_LINES
        ):
            areas = self._areas_within(found, proof, lines, frame, subprogress(progress, 0.6, 1.0))
        if areas:  # points on another area are of no use
            what, fix = area_sentences(areas)
            problem = stated(ProblemJson(reason=NOT_IN_IMAGE, what=what, fix=fix))
            summary = {**summary, **without_camera([problem], areas)}
            calibration = None
        return summary, calibration

    def _fitted(
        self,
        found: LineAssignment,
        lines: DetectedLines,
        frame: Frame,
        series: Pictures,
        summary: AutomaticAnswer,
        progress: Progress,
    ) -> tuple[Verification, Calibration | None]:
        """Fit the points and write what came of it into the summary; the calibration where no doubt remains."""
        result, refused = None, []
        for names in self.models:
            try:
                result, found = assignment.calibrate(
                    found, lines, self.field, self.region, names, self.options, progress
                )
                summary["model"] = result.model.NAME
                break
            except FitFailed as refusal:
                refused.append(refusal.to_json())
        report = None if result is None else result.report
        proof = assignment.verify(found, lines, self.region)
        elsewhere = (
            []
            if result is None or not proof.missing
            else lines_elsewhere(result.model, lines.gray, self.field, self.region, proof.missing)
        )
        doubts = _with_elsewhere(proof.doubts(self.is_chosen), elsewhere)
        if result is None:
            doubts += refused[:1]
        else:
            doubts[:0] = self._doubts_of_model(result.model, frame, series)
        summary |= {
            "observations": [o.to_json() for o in found.observations],
            "proof": proof.to_json(),
            "report": report,
            "doubts": doubts,
            "elsewhere": elsewhere,
            "verdict": verdict_of(
                doubts,
                proof,
                report and report["verdict"],
                _elsewhere_sentence(elsewhere) if elsewhere else "",
            ),
        }
        if result is None or doubts:
            return proof, None
        request = CalibrationRequest(
            found.observations,
            self.field,
            self.region,
            frame.size,
            summary["model"],
            self.options,
            self.camera,
            self.snapshot,
            frame.sha256 or None,
            self.note,
        )
        return proof, request.record(result)

    def _doubts_of_model(
        self, model: CameraModel, frame: Frame, series: Pictures
    ) -> list[ProblemJson]:
        """Return what contradicts the fitted model beside the lines: the other pictures, and the given height."""
        doubts = []
        if _has_moved(model, self.field, self.region, frame, series):
            doubts.append(
                stated(ProblemJson(reason="series-moved", what=SERIES_MOVED, fix=SERIES_MOVED_FIX))
            )
        if (doubt := self._other_height(model)) is not None:
            doubts.append(doubt)
        return doubts

    def _other_height(self, model: CameraModel) -> ProblemJson | None:
        """Return the doubt where the lines put the camera at another height than was given; None where they do not."""
        given_mm = pose_prior_from_json(self.rough).height_mm
        if (
            given_mm is None
            or not isinstance(model, RayCamera)
            or is_near_height(model.position_mm[2], given_mm)
        ):
            return None
        return stated(
            ProblemJson(
                reason="other-height",
                what=say(
                    "automatic.other-height",
                    "By its lines, the camera is {height:.1f} m above the carpet, not {given:.1f} m.",
                    height=model.position_mm[2] / 1000,
                    given=given_mm / 1000,
                ),
                fix=say("automatic.other-height.fix", "Check the approximate camera height."),
            )
        )

    def _better_areas(
        self,
        state: RayCameraParameters,
        frame: Frame,
        least_overlap: float = FITS_OVERLAP,
    ) -> tuple[SeenArea, ...]:
        return better_areas(
            lambda points: state.project(with_z(points)),
            self.field,
            self.region,
            frame.size,
            is_half_turn_symmetric(self.field),
            least_overlap,
        )

    def _areas_within(
        self,
        found: LineAssignment | None,
        proof: Verification | None,
        lines: DetectedLines,
        frame: Frame,
        progress: Progress,
    ) -> tuple[SeenArea, ...]:
        """Look for areas within the chosen one: too little of that may be in the picture for a match, or a right one.

        found, proof: what there is with the chosen one; another must explain the picture better.
        """
        is_sure = proof is not None and proof.share >= assignment.MIN_SURE_SHARE
        areas = () if is_sure else smaller_areas(self.field, self.region)
        prior = replace(pose_prior_from_json(self.rough), turn_deg=None)
        for seen in recognise(lines.seen, [(self.field, areas)], prior, progress) if areas else ():
            within = assignment.points_on_lines(
                lines, self.field, self.region, SearchResult(seen.candidates)
            )
            if within is not None and assignment.verify(within, lines, self.region).is_better_than(
                proof
            ):
                return self._better_areas(within.state, frame, NEAR_OVERLAP)
        if found is None or proof is None or proof.doubts(self.is_chosen):
            return ()
        return self._better_areas(found.state, frame, NEAR_OVERLAP)


def without_camera(doubts: list[ProblemJson], areas: Sequence[SeenArea] = ()) -> FoundCamera:
    """Return the part of an answer that found none."""
    return {
        "observations": [],
        "proof": None,
        "report": None,
        "areas": [area.to_json() for area in areas],
        "elsewhere": [],
        "doubts": doubts,
        "verdict": verdict_of(doubts, None, None),
    }


def lines_elsewhere(
    model: CameraModel,
    gray: Pixels,
    field: Field,
    region: Region,
    missing: Collection[str],
) -> list[LineElsewhere]:
    """Return which of the missing lines are painted elsewhere than the field has them, the farthest first.

    model: a camera that the field's other lines give. gray (h, w): with its lines bright.
    """
    min_mm = max(MIN_ELSEWHERE_SIGMAS * field.line_sigma_mm, MIN_ELSEWHERE_MM)
    found: list[LineElsewhere] = [
        {"feature": line["feature"], "mm": abs(line["mean_mm"])}
        for line in line_deviations(measure_single_markings(model, gray, field, region, missing))
        if line["mean_mm"] is not None
        and abs(line["mean_mm"]) > min_mm
        and line["found_share"] >= MIN_ELSEWHERE_SHARE
    ]
    return sorted(found, key=lambda line: -line["mm"])


def _elsewhere_sentence(lines: Sequence[LineElsewhere]) -> Sentence:
    named = [
        say(
            "lines.elsewhere.one",
            "{line} by {mm:.0f} mm",
            line=marking_name(line["feature"]),
            mm=line["mm"],
        )
        for line in lines[:MISSING_SHOWN]
    ]
    return say(
        "lines.elsewhere", "Lines of this field are painted elsewhere: {lines}.", lines=named
    )


def _with_elsewhere(
    doubts: Sequence[ProblemJson], lines: Sequence[LineElsewhere]
) -> list[ProblemJson]:
    """Return the doubts; in place of those that come of lines painted elsewhere, these lines."""
    others = [doubt for doubt in doubts if doubt["reason"] not in OF_OTHER_PAINT]
    if not lines or len(others) == len(doubts):
        return list(doubts)
    return [
        stated(
            ProblemJson(
                reason="painted-elsewhere",
                what=_elsewhere_sentence(lines),
                fix=say(
                    "lines.elsewhere.fix",
                    "Edit a copy of this field with these distances, then detect again.",
                ),
            )
        ),
        *others,
    ]


def _has_moved(
    model: CameraModel, field: Field, region: Region, frame: Frame, series: Pictures
) -> bool:
    """Return whether the lines of the median lie elsewhere in one of its pictures: some, evenly spread."""
    if (
        len(series) < 2
        or (reference := LineReference.of([frame.pixels], model, field, region)) is None
    ):
        return False
    checked = sorted(
        set(np.linspace(0, len(series) - 1, MAX_SERIES_CHECKED).round().astype(int).tolist())
    )
    return any(reference.look(series[number][1]().pixels).has_moved() for number in checked)
