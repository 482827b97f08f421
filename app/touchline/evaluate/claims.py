"""A claim: what the program says of a calibration or a site, what came of trying to refute it; and those of a report.

A claim is held only where something was tried that would have refuted it. What was not tried, or could not be, is not
tested: it is neither right nor wrong, and nothing that rests on it is ready.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from typing_extensions import TypedDict

from touchline.core.field_json import FIELD_CHANGED_FIX, changes_in_words
from touchline.core.json_values import number
from touchline.core.records import Calibration
from touchline.core.sentences import area_name
from touchline.core.statements import Sentence, Stated, join, say, sentence_in, stated
from touchline.evaluate.report_types import Level
from touchline.evaluate.verdict import LEVELS, level_likely, tops_are_known
from touchline.models import MODELS

State = Literal["held", "refuted", "not-tested"]
Gate = Literal["ready", "not-tested", "problems"]
Cure = Literal[
    "points", "model", "camera", "versions", "pair", "drift", "images", "rig", "publishing", ""
]

# two fits of one lens to other points differ by about a pixel near the image's corners
LENS_SAME_PX = 2.0
MIN_LENS_PX, MIN_LENS_SHARE = 0.1, 0.01  # no figure is better than that
SAME_MM = 1.0  # less than what two calibrations from two images of one camera differ by

FIT = ("residuals", "covariance")
WRONG_LENS = {
    "lens-ends": say("claim.model.ends", "The lens model does not cover the whole field"),
    "another-lens": say("claim.model.contradicted", "Another lens model contradicts this one"),
    "residuals-too-large": say("claim.model.residuals", "The lens model does not fit the points"),
}
UNUSUAL_LENS = ("unusual-principal-point", "unusual-aspect", "unusual-focal-length")
WRONG_HEIGHT = {
    "implausible-camera": say("claim.height.implausible", "The camera height is implausible"),
    "height-contradicted": say(
        "claim.height.contradicted", "The points contradict the entered camera height"
    ),
    "unusual-height": say("claim.height.unusual", "The camera height is unusual"),
}
ACCURACY = {
    "good": say("claim.accuracy.good", "Accurate on the carpet"),
    "fair": say("claim.accuracy.fair", "Usable accuracy on the carpet"),
    "poor": say("claim.accuracy.poor", "Not accurate enough on the carpet"),
}
TOPS = {
    "good": say("claim.tops.good", "Accurate at robot tops"),
    "fair": say("claim.tops.fair", "Usable accuracy at robot tops"),
    "poor": say("claim.tops.poor", "Not accurate enough at robot tops"),
}
ADD_POINTS = say(
    "claim.accuracy.fix", "Add points on lines inside the field, or use another lens model."
)
ENTER_HEIGHT = say("claim.height.fix", "Measure the camera height and enter it.")


class ClaimFigure(TypedDict):
    """A length that a claim is about; at_most: whether it is a bound."""

    value: float
    unit: Literal["mm", "px"]
    at_most: bool


class CaseJson(Stated):
    text: str
    fix: str
    camera: str | None


class ClaimJson(Stated):
    """state: held only if something was tried that would have refuted it; gates: whether activation is refused while
    it is not held, unless `despite` names its code; tried: what was looked at; cure: where its fix is done; cases: what
    refutes it one by one, where each has its own fix."""

    code: str
    state: State
    gates: bool
    title: str
    evidence: str
    fix: str
    tried: list[str]
    figure: ClaimFigure | None
    cure: Cure
    camera: str | None
    cases: list[CaseJson]


@dataclass(frozen=True)
class Case:
    """One of several things that refute a claim. camera: whose it is, None where it is of none."""

    text: str
    fix: str
    camera: str | None = None

    def to_json(self) -> CaseJson:
        return stated(CaseJson(text=self.text, fix=self.fix, camera=self.camera))


@dataclass(frozen=True)
class Claim:
    """One claim. camera: whose it is, where it is not of the calibration itself."""

    code: str
    state: State
    title: str
    evidence: str = ""
    fix: str = ""
    tried: tuple[str, ...] = ()
    gates: bool = False
    figure: ClaimFigure | None = None
    cure: Cure = ""
    camera: str | None = None
    cases: tuple[Case, ...] = ()

    def __post_init__(self) -> None:
        assert self.state != "held" or self.tried, f"{self.code} is held by nothing"

    @property
    def is_problem(self) -> bool:
        """Whether it stands against activation."""
        return self.gates and self.state != "held"

    def to_json(self) -> ClaimJson:
        return stated(
            ClaimJson(
                code=self.code,
                state=self.state,
                gates=self.gates,
                title=self.title,
                evidence=self.evidence,
                fix=self.fix,
                tried=list(self.tried),
                figure=self.figure,
                cure=self.cure,
                camera=self.camera,
                cases=[one.to_json() for one in self.cases],
            )
        )


def mm(value: float, at_most: bool = False) -> ClaimFigure:
    return {"value": value, "unit": "mm", "at_most": at_most}


def state_of_level(level: Level) -> State:
    """Return held for good, refuted for less: fair is told, poor gates."""
    return "held" if level == "good" else "refuted"


def gate_of(claims: Sequence[Claim]) -> Gate:
    """Return what stands against relying on all of them: problems, something that was not tested, or nothing."""
    if problems(claims):
        return "problems"
    return "not-tested" if any(claim.state == "not-tested" for claim in claims) else "ready"


def problems(claims: Iterable[Claim], despite: Iterable[str] = ()) -> tuple[Claim, ...]:
    """Return the claims that stand against activation, without those that somebody accepts by their code."""
    accepted = set(despite)
    return tuple(claim for claim in claims if claim.is_problem and claim.code not in accepted)


def difference_claims(found: Mapping[str, Any], former: int) -> list[Claim]:
    """Return how a version differs from the active one. found: a Difference; former: the active one's number."""
    claims, lens = [], found["lens"]
    if lens is not None:
        share = max(MIN_LENS_SHARE, abs(100 * (lens["focal_ratio"] - 1)))
        text = say("claim.lens.focal-length", "Focal length within {share:.2f} %.", share=share)
        if lens["max_px"] is None:
            claims.append(Claim("lens", "not-tested", say("claim.lens", "Lens not compared"), text))
        else:
            is_same = lens["max_px"] <= LENS_SAME_PX
            shown: ClaimFigure = {
                "value": max(MIN_LENS_PX, lens["max_px"]),
                "unit": "px",
                "at_most": False,
            }
            claims.append(
                Claim(
                    "lens",
                    "held" if is_same else "refuted",
                    say("claim.lens.same", "Lens unchanged since version {former}", former=former)
                    if is_same
                    else say(
                        "claim.lens.differs", "Lens differs from version {former}", former=former
                    ),
                    text,
                    tried=("active-version",),
                    figure=shown,
                )
            )
    median, largest = found["median_mm"], found["max_mm"]
    if median is None or largest is None:
        claims.append(
            Claim(
                "difference",
                "not-tested",
                say("claim.difference", "Not compared with version {former}", former=former),
                say("claim.difference.nothing-common", "The covered areas do not overlap."),
            )
        )
        return claims
    is_same = largest <= SAME_MM
    claims.append(
        Claim(
            "difference",
            "held" if is_same else "refuted",
            say("claim.difference.same", "Same positions as version {former}", former=former)
            if is_same
            else say("claim.difference.differs", "Differs from version {former}", former=former),
            say(
                "claim.difference.worst",
                "The median; the largest difference is {mm:mm} mm.",
                mm=largest,
            ),
            tried=("active-version",),
            figure=mm(median),
        )
    )
    return claims


def report_claims(calibration: Calibration) -> list[Claim]:
    """Return what a version's report claims of it; a report that came in a file may lack any part."""
    report = calibration.report
    claims = [_accuracy(report), _robot_tops(report), _model(calibration), _height(report)]
    level = (report.get("verdict") or {}).get("level")
    # for a reason that no part of it names
    if level == "poor" and not any(claim.is_problem for claim in claims):
        claims[0] = replace(
            claims[0],
            state="refuted",
            gates=True,
            fix=ADD_POINTS,
            cure="points",
            title=say("claim.accuracy.verdict", "Its own verdict is: not accurate enough"),
            evidence=sentence_in(report["verdict"], "sentence"),
        )
    return claims


def field_claims(
    calibration: Calibration,
    changes: Sequence[str],
    field: str | None,
    region: str | None,
    active: Calibration | None,
) -> Iterator[Claim]:
    """Yield whether the version is about the field and the area that its camera looks at.

    changes: of its field since then. field, region: the camera's own, None where it has none; then what the active
    version has counts.
    """
    name, area = calibration.field["name"], calibration.region
    if changes:
        yield Claim(
            "field",
            "refuted",
            say("claim.field.changed", "The field has changed"),
            say(
                "claim.field.changes",
                "It was calibrated before its field was changed: {changes}.",
                changes=changes_in_words(changes),
            ),
            FIELD_CHANGED_FIX,
            ("field-now",),
            True,
            cure="versions",
        )
    wanted_field = field or (active.field["name"] if active else None)
    wanted_area = region or (active.region if active and active.field["name"] == name else None)
    if wanted_field is not None and wanted_field != name:
        yield Claim(
            "camera-field",
            "refuted",
            say("claim.other-field", "This version is for another field"),
            say(
                "claim.other-field.text",
                "It is for {field}; the camera is used on {wanted}.",
                field=name,
                wanted=wanted_field,
            ),
            _of_another(),
            ("camera-settings",),
            True,
            cure="camera",
        )
    elif wanted_area is not None and wanted_area != area:
        yield Claim(
            "region",
            "refuted",
            say("claim.other-area", "This version covers another area"),
            say(
                "claim.other-area.text",
                "It covers: {area}. The camera covers: {wanted}.",
                area=area_name(area),
                wanted=area_name(wanted_area),
            ),
            _of_another(),
            ("camera-settings",),
            True,
            cure="camera",
        )
    elif wanted_area is not None:
        yield Claim(
            "region",
            "held",
            say("claim.same-area", "Field and covered area are those of the camera"),
            tried=("camera-settings", "field-now"),
        )


def _of_another() -> Sentence:
    return say(
        "claim.other-area.fix", "Choose a version of this area, or change the camera's settings."
    )


def _accuracy(report: Mapping[str, Any]) -> Claim:
    verdict, sigma = report.get("verdict") or {}, report.get("sigma_mm") or {}
    length = number(verdict.get("mm"))
    if verdict.get("level") not in LEVELS or length is None:
        return Claim(
            "accuracy",
            "not-tested",
            say("claim.accuracy.unknown", "Accuracy inside the field is unknown"),
            sentence_in(verdict, "sentence") if verdict.get("sentence") else "",
            ADD_POINTS,
            gates=True,
            cure="points",
        )
    own = level_likely(length, number(sigma.get("rms_95")) or 0.0)
    level = _level(report, "carpet", own)
    is_bad = level == "poor"
    # something else than this figure
    against = sentence_in(verdict, "sentence") if level != own else ""
    return Claim(
        "accuracy",
        state_of_level(level),
        ACCURACY[level],
        against,
        ADD_POINTS if is_bad else "",
        (*FIT, *(("points-left-out",) if report.get("cv_rms_mm") is not None else ())),
        is_bad,
        mm(length),
        "points" if is_bad else "",
    )


def _robot_tops(report: Mapping[str, Any]) -> Claim:
    hat = (report.get("sigma_mm") or {}).get("hat") or {}
    error = number(hat.get("rms"))
    if report.get("camera") is None or error is None:
        return Claim(
            "robot-tops",
            "not-tested",
            say("claim.tops.none", "Robot tops are not corrected"),
            say(
                "claim.tops.none.text", "This model has no camera height, or its error is unknown."
            ),
            tried=(),
        )
    height = number(hat.get("z_mm")) or 0.0
    if not tops_are_known(error, hat.get("known", True) is not False):
        return Claim(
            "robot-tops",
            "not-tested",
            say("claim.tops.unknown", "The error at robot tops is unknown"),
            say("claim.tops.unknown.text", "The points do not determine the camera height."),
            ENTER_HEIGHT,
            gates=True,
            cure="model",
        )
    level = _level(report, "robot_tops", level_likely(error, number(hat.get("rms_95")) or 0.0))
    return Claim(
        "robot-tops",
        state_of_level(level),
        TOPS[level],
        say("claim.tops.height", "{height:g} mm above the carpet.", height=height),
        ENTER_HEIGHT if level == "poor" else "",
        FIT,
        level == "poor",
        mm(error),
        "model" if level == "poor" else "",
    )


def _level(report: Mapping[str, Any], figure: str, own: Level) -> Level:
    """Return the level of a figure as the verdict has it; by itself in an older report."""
    level = ((report.get("verdict") or {}).get("levels") or {}).get(figure)
    return level if level in LEVELS else own


def _model(calibration: Calibration) -> Claim:
    report, name = calibration.report, calibration.model_name
    title = MODELS[name].TITLE if name in MODELS else name
    px = number(report.get("rms_px"))
    shown = (
        say("claim.model.residual", "{model}, residual {px:px} px.", model=title, px=px)
        if px is not None
        else say("claim.model.name", "{model}.", model=title)
    )
    if wrong := _warning(report, *WRONG_LENS):
        return Claim(
            "model",
            "refuted",
            WRONG_LENS[wrong["reason"]],
            join(shown, sentence_in(wrong, "text")),
            sentence_in(wrong, "fix"),
            ("points", "freer-lens"),
            True,
            cure="model",
        )
    if odd := _warning(report, *UNUSUAL_LENS):
        return Claim(
            "model",
            "refuted",
            say("claim.model.unusual", "The lens is unusual"),
            join(shown, sentence_in(odd, "text")),
            sentence_in(odd, "fix"),
            ("points", "usual-lenses"),
            cure="model",
        )
    if px is None or not calibration.observations:
        return Claim(
            "model",
            "not-tested",
            say("claim.model.no-points", "No points to test the lens model"),
            shown,
        )
    return Claim(
        "model",
        "held",
        say("claim.model.ok", "Lens model fits the points"),
        shown,
        tried=("residuals", "freer-lens"),
    )


def _height(report: Mapping[str, Any]) -> Claim:
    camera, height_check = report.get("camera"), report.get("height") or {}
    measured = (
        say(
            "claim.height.measured",
            "{height:.1f} m, tilt {tilt:.1f}°.",
            height=camera["height_mm"] / 1000,
            tilt=camera["tilt_deg"],
        )
        if camera
        else Sentence("")
    )
    if wrong := _warning(report, *WRONG_HEIGHT):
        return Claim(
            "height",
            "refuted",
            WRONG_HEIGHT[wrong["reason"]],
            sentence_in(wrong, "text"),
            sentence_in(wrong, "fix"),
            ("points-height",),
            True,
            cure="model",
        )
    if not camera:
        return Claim(
            "height",
            "not-tested",
            say("claim.height.none", "No camera height"),
            say("claim.height.none.text", "This model has none, or it was not recorded."),
        )
    if height_check.get("state") == "agrees":
        return Claim(
            "height",
            "held",
            say("claim.height.agrees", "The points agree with the entered camera height"),
            measured,
            tried=("points-height",),
        )
    if height_check.get("state") == "not-checked":
        return Claim(
            "height",
            "not-tested",
            say("claim.height.not-checked", "The points cannot check the camera height"),
            measured,
        )
    if _warning(report, "height-unknown"):
        return Claim(
            "height",
            "not-tested",
            say("claim.height.unknown", "The camera height is unknown"),
            join(measured, say("claim.height.undetermined", "A rough estimate from the points.")),
            ENTER_HEIGHT,
            cure="model",
        )
    return Claim(
        "height",
        "held",
        say("claim.height.ok", "Camera height is plausible"),
        join(measured, say("claim.height.estimated", "Estimated from the points.")),
        tried=("points-height", "usual-heights"),
    )


def _warning(report: Mapping[str, Any], *reasons: str) -> Mapping[str, Any] | None:
    """Return the first warning for the first of these reasons that there is one for."""
    known = {
        w.get("reason"): w for w in reversed(report.get("warnings") or ()) if isinstance(w, Mapping)
    }
    return next((known[reason] for reason in reasons if reason in known), None)
