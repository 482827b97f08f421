"""A request for a calibration without clicks, and what came of it; routes, jobs and commands share it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from dataclasses import field as member
from itertools import chain
from typing import Any, Self

import numpy as np
from typing_extensions import TypedDict

from touchline.core.errors import FitFailed, ProblemJson
from touchline.core.field import Field, Region
from touchline.core.field_json import field_from_json
from touchline.core.geometry import with_z
from touchline.core.jobs import Progress, no_progress, subprogress
from touchline.core.json_values import SizeJson, read
from touchline.core.records import Calibration, Frame, ObservationJson
from touchline.core.sentences import DETECTING_LINES, SERIES_MOVED, SERIES_MOVED_FIX
from touchline.core.statements import say, stated
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
from touchline.evaluate.field_lines.motion import LineReference
from touchline.evaluate.report_types import FitReport
from touchline.evaluate.verification import AutomaticVerdict, Proof, Verification, verdict_of
from touchline.fitting import FITTERS
from touchline.fitting.field_lines.given_corners import check_corners
from touchline.fitting.field_lines.recognition import recognise
from touchline.fitting.field_lines.search import PosePrior, SearchResult, is_near_height, search
from touchline.fitting.field_pattern import is_half_turn_symmetric
from touchline.fitting.ray_camera.parameters import RayCameraParameters
from touchline.models import CameraModel
from touchline.models.ray_camera import RayCamera
from touchline.workflows import automatic
from touchline.workflows.calibration_request import CalibrationRequest
from touchline.workflows.elsewhere import LineElsewhere, elsewhere_sentence, lines_elsewhere, told_by
from touchline.workflows.job_pictures import Pictures
from touchline.workflows.model_choice import AUTO, LADDER

LOOKED_AT = 5  # pictures of a series: a camera that sways is elsewhere in one of them


def pose_prior_from_json(value: Mapping[str, Any]) -> PosePrior:
    """Read {"height_mm", "turn_deg", "corners"}, each where it is known; BadInput for other keys and values."""
    prior = read(PosePrior, value, "The approximate pose",
                 "Use height_mm from 100 to 100000, turn_deg from -360 to 360, and four pixels as corners.",
                 "bad-rough")
    if prior.corners is not None:
        check_corners(np.array(prior.corners))
    return prior


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
    candidates: list[dict[str, Any]]
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

    def to_json(self) -> dict[str, Any]:
        return {"field": self.field.to_json(), "region": self.region.name, "rotate": self.region.rotate_deg,
                "model": self.model, "options": dict(self.options), "rough": dict(self.rough), "camera": self.camera,
                "snapshot": self.snapshot, "note": self.note}

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> Self:
        field = field_from_json(value["field"])
        return cls(field, field.region(value["region"], value["rotate"]), value["model"], value["options"],
                   value["rough"], value["camera"], value["snapshot"], value["note"])

    def answer(self, frame: Frame, progress: Progress = no_progress, series: Pictures = (),
               ) -> tuple[AutomaticAnswer, Calibration | None]:
        """Return what was found, and the calibration where no doubt remains.

        series: the pictures of which the frame is the median; its lines must lie alike in all of them.
        A picture without a match is an answer as well: the detected lines and why none matched.
        """
        progress(0.0, DETECTING_LINES)
        lines = automatic.detect_lines(frame.pixels)
        searched = search(lines.seen, self.field, self.region, pose_prior_from_json(self.rough),
                                    subprogress(progress, 0.15, 0.6))
        return self.answer_of(lines, searched, frame, subprogress(progress, 0.6, 1.0), series)

    def answer_of(self, lines: automatic.DetectedLines, searched: SearchResult, frame: Frame,
                  progress: Progress = no_progress, series: Pictures = (),
                  ) -> tuple[AutomaticAnswer, Calibration | None]:
        """Return the same of cameras that were searched for already."""
        progress(0.0, say("progress.measuring-the-lines", "Measuring the lines"))
        found = automatic.points_on_lines(lines, self.field, self.region, searched)
        summary: AutomaticAnswer = {
            "field": self.field.name, "region": self.region.name, "rotate": self.region.rotate_deg,
            "model": self.model, "image_size": list(frame.size),
            "candidates": automatic.candidates_json(searched, self.region), "lines": lines.polylines(),
            **without_camera([automatic.no_match_error(lines, searched).to_json()])}
        proof = None if found is None else automatic.verify(found, lines, self.region)
        areas: tuple[SeenArea, ...] = ()
        made = None
        if found is not None and proof is not None and not proof.doubts(self.is_chosen):
            areas = self._better_areas(found.state, frame)
        if found is not None and not areas:
            proof, made = self._fitted(found, lines, frame, series, summary, subprogress(progress, 0.1, 0.6))
        is_weak = made is None or made.report["verdict"]["level"] == "poor"
        if is_weak and not areas and not self.is_area_seen and len(searched.lines) >= automatic.MIN_LINES:
            areas = self._areas_within(found, proof, lines, frame, subprogress(progress, 0.6, 1.0))
        if areas:  # points on another area are of no use
            what, fix = area_sentences(areas)
            summary |= without_camera([stated(ProblemJson(reason=NOT_IN_IMAGE, what=what, fix=fix))], areas)
            made = None
        return summary, made

    def _fitted(self, found: automatic.LineAssignment, lines: automatic.DetectedLines, frame: Frame, series: Pictures,
                summary: AutomaticAnswer, progress: Progress) -> tuple[Verification, Calibration | None]:
        """Fit the points and write what came of it into the summary; the calibration where no doubt remains."""
        done, refused = None, []
        for names in self.models:
            try:
                done, found = automatic.calibrate(found, lines, self.field, self.region, names, self.options, progress)
                summary["model"] = done.model.NAME
                break
            except FitFailed as refusal:
                refused.append(refusal.to_json())
        report = None if done is None else done.report
        proof = automatic.verify(found, lines, self.region)
        elsewhere = [] if done is None or not proof.missing else lines_elsewhere(
            done.model, lines.gray, self.field, self.region, proof.missing)
        doubts = [*told_by(proof.doubts(self.is_chosen), elsewhere), *(refused[:1] if done is None else [])]
        if done is not None and (told := self._other_height(done.model)):
            doubts.insert(0, told)
        if done is not None and _has_moved(done.model, self.field, self.region, frame, series):
            doubts.insert(0, stated(ProblemJson(
                reason="series-moved", what=SERIES_MOVED, fix=SERIES_MOVED_FIX)))
        summary |= {"observations": [o.to_json() for o in found.observations], "proof": proof.to_json(),
                    "report": report, "doubts": doubts, "elsewhere": elsewhere,
                    "verdict": verdict_of(doubts, proof, report and report["verdict"],
                                          elsewhere_sentence(elsewhere) if elsewhere else "")}
        if done is None or doubts:
            return proof, None
        request = CalibrationRequest(found.observations, self.field, self.region, frame.size, summary["model"],
                                     self.options, self.camera, self.snapshot, frame.sha256 or None, self.note)
        return proof, request.record(done)

    def _other_height(self, model: CameraModel) -> ProblemJson | None:
        """Return the doubt where the lines put the camera at another height than was given; None where they do not."""
        given_mm = pose_prior_from_json(self.rough).height_mm
        if given_mm is None or not isinstance(model, RayCamera) or is_near_height(model.position_mm[2], given_mm):
            return None
        return stated(ProblemJson(reason="other-height", what=say(
            "automatic.other-height", "By its lines, the camera is {height:.1f} m above the carpet, not {given:.1f} m.",
            height=model.position_mm[2] / 1000, given=given_mm / 1000), fix=say(
            "automatic.other-height.fix", "Check the approximate camera height.")))

    def _better_areas(self, state: RayCameraParameters, frame: Frame, least_overlap: float = FITS_OVERLAP,
                      ) -> tuple[SeenArea, ...]:
        return better_areas(lambda points: state.project(with_z(points)), self.field, self.region, frame.size,
                            is_half_turn_symmetric(self.field), least_overlap)

    def _areas_within(self, found: automatic.LineAssignment | None, proof: Verification | None,
                      lines: automatic.DetectedLines, frame: Frame, progress: Progress) -> tuple[SeenArea, ...]:
        """Look for areas within the chosen one: too little of that may be in the picture for a match, or a right one.

        found, proof: what there is with the chosen one; another must explain the picture better.
        """
        is_sure = proof is not None and proof.share >= automatic.SURELY_FOUND
        areas = () if is_sure else smaller_areas(self.field, self.region)
        prior = replace(pose_prior_from_json(self.rough), turn_deg=None)
        for seen in recognise(lines.seen, [(self.field, areas)], prior, progress) if areas else ():
            within = automatic.points_on_lines(lines, self.field, self.region, SearchResult(seen.candidates))
            if within is not None and automatic.verify(within, lines, self.region).is_better_than(proof):
                return self._better_areas(within.state, frame, NEAR_OVERLAP)
        if found is None or proof is None or proof.doubts(self.is_chosen):
            return ()
        return self._better_areas(found.state, frame, NEAR_OVERLAP)


def without_camera(doubts: list[ProblemJson], areas: Sequence[SeenArea] = ()) -> FoundCamera:
    """Return the part of an answer that found none."""
    return {"observations": [], "proof": None, "report": None, "areas": [area.to_json() for area in areas],
            "elsewhere": [], "doubts": doubts, "verdict": verdict_of(doubts, None, None)}


def _has_moved(model: CameraModel, field: Field, region: Region, frame: Frame, series: Pictures) -> bool:
    """Return whether the lines of the median lie elsewhere in one of its pictures: some, evenly spread."""
    if len(series) < 2 or (reference := LineReference.of([frame.pixels], model, field, region)) is None:
        return False
    looked_at = sorted(set(np.linspace(0, len(series) - 1, LOOKED_AT).round().astype(int).tolist()))
    return any(reference.look(series[number][1]().pixels).has_moved() for number in looked_at)

