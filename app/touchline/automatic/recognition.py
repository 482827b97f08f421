"""A calibration from one picture of which nobody said what field it shows, or which part of it, or how it is turned.

The fields compete for the lines of the picture. Where one explains them clearly better than all others, and only one
of its parts can be what the picture shows, it is calibrated as if it had been chosen. Otherwise the answer names the
choices: a half of a field that looks alike from both ends is one of two, and no line says which.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from dataclasses import field as member
from typing import Any, NotRequired, Self

from typing_extensions import TypedDict

from touchline.automatic import assignment
from touchline.automatic.assignment import DetectedLines
from touchline.automatic.matching import CameraCandidate, PosePrior
from touchline.automatic.request import (
    AutomaticAnswer,
    AutomaticRequest,
    pose_prior_from_json,
    without_camera,
)
from touchline.automatic.search import RecognisedField, SearchResult, recognise
from touchline.core.errors import BadInput, FitFailed, ProblemJson
from touchline.core.field import Field, Region
from touchline.core.field_json import field_from_json
from touchline.core.geometry import ImageSize, Points, with_z
from touchline.core.jobs import Progress, no_progress, subprogress
from touchline.core.json_values import JsonObject
from touchline.core.records import Calibration, Frame
from touchline.core.sentences import DETECTING_LINES, area_name
from touchline.core.statements import Stated, say, stated
from touchline.evaluate.areas import AreaJson, SeenArea, seen_area
from touchline.fitting.field_pattern import is_half_turn_symmetric
from touchline.fitting.ray_camera.parameters import RayCameraParameters
from touchline.workflows.job_pictures import Pictures, job_pictures, median_frame

AUTO = "auto"
MIN_VALUE = 0.55  # of a field that may be the one
NOT_ALL_SEEN = {"lines-missing", "lines-unexplained", "loose"}
CONVINCING = 0.8  # of a field of which some lines are hidden, or painted elsewhere
MIN_ALIKE = 0.93  # of the best one's value: then the lines do not decide between two fields
# of its value the next best may have, where the best one is not convincing by itself
MAX_NEXT_VALUE = 0.8
MIN_AREA_SHARE = 0.2  # of a field that nobody chose: the area to look for
MAX_CHOICES = 3
MAX_TURN_OFF_DEG = 90  # between a given rotation and the seen one


class FieldChoice(AreaJson):
    """A field, and a part of it as it stands in the picture."""

    field: str
    title: str


class RunnerUp(TypedDict):
    """The next best field. share: how well it explains the picture, of how well the best one does."""

    field: str
    title: str
    share: float


class Recognition(Stated):
    """choices: what the picture may show, the best first; empty where it shows no known field. value: how well the best
    one explains the picture, 0 to 1."""

    choices: list[FieldChoice]
    value: float | None
    runner_up: RunnerUp | None
    sentence: str


class RecognisedAnswer(AutomaticAnswer):
    """recognised: what was not given, as the picture shows it."""

    recognised: NotRequired[Recognition]


@dataclass(frozen=True, eq=False)
class _Choice:
    """A part of a field that a picture may show. candidates: the cameras, the best first, over the field as it lies."""

    field: Field
    area: SeenArea
    candidates: tuple[CameraCandidate, ...]

    @property
    def value(self) -> float:
        return self.candidates[0].value

    def doubts(self, lines: DetectedLines, is_chosen: bool) -> set[str]:
        """Return by what the measured lines contradict the best camera. is_chosen: see Verification.doubts()."""
        found = assignment.points_on_lines(
            lines, self.field, self.area.region, SearchResult(self.candidates)
        )
        if found is None:
            return {"no-match"}
        return {
            doubt["reason"]
            for doubt in assignment.verify(found, lines, self.area.region).doubts(is_chosen)
        }


@dataclass(frozen=True, eq=False)
class RecognitionRequest:
    """The fields that a picture may show; region, rotate: None where the picture is to tell.

    given: what else AutomaticRequest takes, by name.
    """

    fields: tuple[Field, ...]
    region: str | None = None
    rotate: int | None = None
    given: Mapping[str, Any] = member(default_factory=dict)

    def __post_init__(self) -> None:
        known = [field for field in self.fields if self._regions(field)]
        if not known:
            self.fields[0].region(str(self.region))  # says which there are
        AutomaticRequest(
            known[0], known[0].region(next(iter(known[0].regions)), self.rotate), **self.given
        )

    def to_json(self) -> JsonObject:
        return {
            **self.given,
            "fields": [field.to_json() for field in self.fields],
            "region": self.region,
            "rotate": self.rotate,
        }

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> Self:
        given = dict(value)
        fields, region, rotate = (given.pop(name) for name in ("fields", "region", "rotate"))
        return cls(tuple(map(field_from_json, fields)), region, rotate, given)

    def answer(
        self,
        frame: Frame,
        progress: Progress = no_progress,
        series: Pictures = (),
    ) -> tuple[RecognisedAnswer, Calibration | None]:
        """Return what was found, and the calibration where it is clear what the picture shows and no doubt remains."""
        progress(0.0, DETECTING_LINES)
        lines = assignment.detect_lines(frame.pixels)
        prior = pose_prior_from_json(self.given.get("rough", {}))
        found = recognise(
            lines.seen,
            [(field, regions) for field in self.fields if (regions := self._regions(field))],
            replace(prior, turn_deg=None),
            subprogress(progress, 0.1, 0.6),
        )
        choices = [
            choice for seen in _alike(found) for choice in self._choices(seen, lines.size, prior)
        ]
        if (
            len(found) > 1
            and _value(found[0]) < CONVINCING
            and _value(found[1]) > MAX_NEXT_VALUE * _value(found[0])
        ):
            choices = []  # not much better than another: it is neither
        if len(choices) > 1:
            choices = self._convincing(choices, lines)[:MAX_CHOICES]
        recognised = _recognition(found, choices)
        if len(choices) != 1:
            return self._undecided(lines, recognised), None
        (only,) = choices
        request = AutomaticRequest(
            only.field,
            only.area.region,
            **self.given,
            is_chosen=self._is_chosen,
            is_area_seen=self.region is None,
        )
        searched = SearchResult(only.candidates, tuple(lines.seen.lines))
        summary, calibration = request.answer_of(
            lines, searched, frame, subprogress(progress, 0.6, 1.0), series
        )
        return {**summary, "recognised": recognised}, calibration

    @property
    def _is_chosen(self) -> bool:
        return len(self.fields) == 1

    def _regions(self, field: Field) -> list[Region]:
        """Return the areas to look for.

        Where any field may be seen: none of one without lines, and no eighth, whose few lines many fields have.
        """
        if not field.markings and not self._is_chosen:
            return []
        small_mm2 = (
            0.0
            if self.region or self._is_chosen
            else MIN_AREA_SHARE * field.length_mm * field.width_mm
        )
        return [
            region
            for name, region in field.regions.items()
            if self.region in (None, name) and region.width_mm * region.height_mm >= small_mm2
        ]

    def _choices(self, seen: RecognisedField, size: ImageSize, prior: PosePrior) -> list[_Choice]:
        """Return the parts of a field that the picture may show, but for those that contradict what was given."""
        found = []
        for is_turned in (False, True) if is_half_turn_symmetric(seen.field) else (False,):
            candidates = (
                [assignment.half_turned(one) for one in seen.candidates]
                if is_turned
                else seen.candidates
            )
            state = candidates[0].refined.state
            area = seen_area(_projection(state), seen.field, size, self._regions(seen.field))
            if area is None:
                continue
            chosen = seen.field.region(area.region.name, self.rotate)
            if self.rotate is not None:
                area = replace(area, region=chosen)
            is_wrong_way = (
                self.rotate is not None
                and abs(assignment.turn_deg(state, chosen)) > MAX_TURN_OFF_DEG
            )
            if not is_wrong_way and prior.allows_turn(assignment.turn_deg(state, chosen)):
                found.append(
                    _Choice(
                        seen.field,
                        area,
                        tuple(
                            replace(
                                one, turn_deg=assignment.turn_deg(one.refined.state, area.region)
                            )
                            for one in candidates
                        ),
                    )
                )
        found.sort(key=lambda choice: choice.area.region.rotate_deg)
        is_one = len({choice.area.region.x_mm + choice.area.region.y_mm for choice in found}) == 1
        return found[:1] if is_one else found

    def _convincing(self, choices: list[_Choice], lines: DetectedLines) -> list[_Choice]:
        """Return those of several choices that the measured lines do not contradict, or which score well all the same.

        Two ends of one field are the same to the lines: they are measured once.
        """
        doubts = {
            choice.field.name: choice.doubts(lines, self._is_chosen)
            for choice in {choice.field.name: choice for choice in choices}.values()
        }
        return [
            choice
            for choice in choices
            if not doubts[choice.field.name]
            or (
                len(doubts) == 1
                and choice.value >= CONVINCING
                and doubts[choice.field.name] <= NOT_ALL_SEEN
            )
        ]

    def _undecided(self, lines: DetectedLines, recognised: Recognition) -> RecognisedAnswer:
        """Return the answer where there are several choices, or none."""
        choices = recognised["choices"]
        if choices:
            doubt = stated(
                ProblemJson(
                    reason="several-choices",
                    what=recognised["sentence"],
                    fix=say("recognition.choose", "Choose which one it is."),
                )
            )
        elif len(lines.seen.lines) < assignment.MIN_LINES:
            doubt = assignment.no_match_error(SearchResult((), tuple(lines.seen.lines))).to_json()
        else:
            doubt = FitFailed(
                say(
                    "recognition.none",
                    "{lines} lines were detected, but they match none of the {count} known fields.",
                    lines=len(lines.seen.lines),
                    count=len(self.fields),
                ),
                say(
                    "recognition.none.fix", "Choose the field and the covered area, or mark points."
                ),
                reason="no-known-field",
            ).to_json()
        return {
            "field": choices[0]["field"] if choices else None,
            "region": None,
            "rotate": None,
            "model": self.given.get("model", AUTO),
            "image_size": list(lines.size),
            "candidates": [],
            "lines": lines.polylines(),
            **without_camera([doubt]),
            "recognised": recognised,
        }


def request_for(
    known: Mapping[str, Field],
    field: str,
    region: str,
    rotate: int | None,
    **given: Any,
) -> AutomaticRequest | RecognitionRequest:
    """Return the request for a field and an area by name, either of which may be "auto"."""
    if AUTO not in (field, region):
        chosen = known[field]
        return AutomaticRequest(chosen, chosen.region(region, rotate), **given)
    if "corners" in given.get("rough", {}):
        raise BadInput(
            say("corners.no-area", "Corners are those of a covered area, and none is chosen."),
            say("corners.no-area.fix", "Choose the field and the covered area as well."),
            reason="bad-corners",
        )
    fields = tuple(known.values()) if field == AUTO else (known[field],)
    return RecognitionRequest(fields, None if region == AUTO else region, rotate, given)


def run_auto(spec: Any, progress: Progress) -> JsonObject:
    """A job: {"task", "pictures": [{"name", "path", "sha256"}, …], "keep"}; pictures are untrusted."""
    kind = RecognitionRequest if "fields" in spec["task"] else AutomaticRequest
    request = kind.from_json(spec["task"])
    with job_pictures(spec["pictures"]) as pictures:
        frame = median_frame(pictures, subprogress(progress, 0.0, 0.1))
        summary, calibration = request.answer(frame, subprogress(progress, 0.1, 1.0), pictures)
    return {
        "told": summary,
        "made": calibration.to_json() if calibration is not None and spec["keep"] else None,
    }


def _alike(found: Sequence[RecognisedField]) -> list[RecognisedField]:
    """Return the fields between which the picture does not decide; one where it does."""
    return [seen for seen in found if _value(seen) >= max(MIN_VALUE, MIN_ALIKE * _value(found[0]))]


def _value(seen: RecognisedField) -> float:
    return seen.candidates[0].value


def _recognition(found: Sequence[RecognisedField], choices: Sequence[_Choice]) -> Recognition:
    chosen = {choice.field.name for choice in choices}
    runner_up = next((seen for seen in found if chosen and seen.field.name not in chosen), None)
    value = _value(found[0]) if found else None
    named = [
        say(
            "recognition.part",
            "{field} ({area}, rotated by {degrees}°)",
            field=choice.field.title,
            area=area_name(choice.area.region.name),
            degrees=choice.area.region.rotate_deg,
        )
        for choice in choices
    ]
    sentence = (
        say("recognition.nothing", "The image shows no known field.")
        if not named
        else say("recognition.one", "Recognised: {choice}.", choice=named[0])
        if len(named) == 1
        else say("recognition.several", "The lines match: {choices}.", choices=named)
    )
    return stated(
        Recognition(
            choices=[
                {"field": choice.field.name, "title": choice.field.title, **choice.area.to_json()}
                for choice in choices
            ],
            value=value,
            sentence=sentence,
            runner_up=None
            if runner_up is None or not value
            else {
                "field": runner_up.field.name,
                "title": runner_up.field.title,
                "share": _value(runner_up) / value,
            },
        )
    )


def _projection(state: RayCameraParameters) -> Callable[[Points], Points]:
    return lambda points: state.project(with_z(points))
