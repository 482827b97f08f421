"""Verdicts on the figures of a rig, and of two cameras: a level, a sentence, and what to do."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from typing_extensions import TypedDict

from touchline.core.geometry import Array, Indices, Mask, root_mean_square
from touchline.core.statements import Sentence, Stated, format_mm, join, say, sentence_in, stated
from touchline.evaluate.agreement import HatUnknown, RigAgreement
from touchline.evaluate.claims import Case, Claim, mm
from touchline.evaluate.report_types import Level
from touchline.evaluate.verdict import GOOD_MM, LEVELS, level_of, worst_level

STANDS_OUT = 2.5  # times the other's error: then it is this camera
COVERED = 0.25  # of the shared part: less near a measure speaks for a small piece of it
GOOD_PX, FAIR_PX = 1.0, 3.0  # a careful click is good to half a pixel, and two of them meet
FAR_OFF = 3.0  # times the median: one match is the matter
FEW_MATCHES = 20  # seven numbers are fitted; fewer matches hardly test them
NAMED = 6  # matches
Source = Literal["pictures", "matches", "clicks"]  # what two cameras are compared by
FROM: dict[Source, str] = {
    "pictures": "",
    "matches": "",
    "clicks": say(
        "rig.from-points",
        "This compares the points of the calibrations. Movement since then is not detected. Check with "
        "current images.",
    ),
}
WORDS = {
    "good": say("rig.good", "The cameras agree."),
    "fair": say(
        "rig.fair",
        "The cameras agree roughly. A robot shifts slightly when it passes from one to another.",
    ),
    "poor": say("rig.poor", "The cameras do not agree."),
}
TOPS_UNKNOWN: dict[HatUnknown, Sentence] = {
    "no-rays": say(
        "rig.tops-no-rays",
        "At robot tops the difference is unknown: that requires physical lens models.",
    ),
    "no-covariance": say(
        "rig.tops-no-covariance",
        "At robot tops the difference is unknown, because the accuracy of "
        "an imported calibration is unknown.",
    ),
    "not-seen": say("rig.tops-not-seen", "The cameras share no area at robot tops."),
}


class PairVerdict(Stated):
    level: Level
    sentence: str
    fix: str


class RigVerdict(Stated):
    """reason: why there is no level; null where there is one."""

    level: Level | None
    reason: Literal["single-camera", "nothing-compared", "outdated"] | None
    sentence: str
    fix: str


class RigTrouble(Stated):
    """What is wrong with a camera of a rig; level: the best that the rig's verdict may be, null if it is unknown."""

    camera: str
    reason: str
    text: str
    fix: str
    level: Level | None


class ComparedPair(TypedDict):
    """Cameras a and b; null where they could not be compared."""

    a: str
    b: str
    agreement: RigAgreement | None
    verdict: PairVerdict | None


def of_pair(a: str, b: str, found: RigAgreement, things: int, source: Source) -> PairVerdict:
    """Judge two cameras called a and b, by so many things that both see."""
    carpet, hat = found["carpet"], found["hat"]
    level = level_of(carpet["p95_mm"])
    if hat:  # an error that is only expected does not show that they disagree
        at_tops = level_of(hat["p95_mm"])
        level = worst_level(
            level, "fair" if at_tops == "poor" and found["hat_from"] == "expected" else at_tops
        )
    differ = "{a} and {b} differ by {mean} on average, at most {most} at ({x:.0f}, {y:.0f}) mm"
    values = {
        "a": a,
        "b": b,
        "mean": format_mm(carpet["mean_mm"]),
        "most": format_mm(carpet["max_mm"]),
        "x": carpet["where"][0],
        "y": carpet["where"][1],
    }
    if hat is None:
        unknown = found["hat_unknown"]
        sentence = join(
            say("rig.differ", differ + ".", **values), TOPS_UNKNOWN[unknown] if unknown else ""
        )
    else:
        values["tops"] = format_mm(hat["max_mm"])
        sentence = (
            say(
                "rig.expected-at-tops",
                differ + "; at robot tops up to about {tops} is expected.",
                **values,
            )
            if found["hat_from"] == "expected"
            else say("rig.differ-at-tops", differ + "; at robot tops at most {tops}.", **values)
        )
    if not found["both_directions"]:
        sentence = join(
            sentence,
            say(
                "rig.one-direction",
                "In most of the shared area this is known in one direction "
                "only, because a line does not show movement along itself.",
            ),
        )
    fixes: list[str] = []
    if source == "matches" and (outliers := found["outliers"]):
        level = worst_level(level, "fair")
        sentence = join(sentence, _outliers(outliers, things))
        fixes.append(
            say(
                "pair.outliers.fix",
                "Check match {match}: is it the same point in both images, and is its "
                "height correct?",
                match=outliers[0] + 1,
            )
        )
    if level_of(carpet["p95_mm"]) != "good":
        if source == "matches":
            fixes.append(say("pair.heights.fix", "Check the heights of the matched points."))
        fixes.append(_cure(a, b, found))
    elif level != "good" and not fixes:
        fixes.append(
            say(
                "rig.tops.fix",
                "Measure the heights of both cameras and enter them as known camera heights, "
                "or add matches at robot tops.",
            )
        )
    if not found["both_directions"]:
        fixes.append(
            say("rig.one-direction.fix", "Mark lines that cross in both images, or add matches.")
        )
    elif found["covered"] < COVERED:
        fixes.append(_add_matches())
    return stated(PairVerdict(level=level, sentence=sentence, fix=join(*fixes, FROM[source])))


def _outliers(outliers: Sequence[int], n: int) -> Sentence:
    if len(outliers) == 1:
        return say("pair.outlier", "1 of {all} is an outlier.", all=n)
    return say("pair.outliers", "{n} of {all} are outliers.", n=len(outliers), all=n)


def _add_matches() -> Sentence:
    return say(
        "pair.few-matches.fix",
        "Add matches all over the shared area. These cover only a small part of it.",
    )


def _cure(a: str, b: str, found: RigAgreement) -> Sentence:
    own_a, own_b = found["own_mm"]["a"], found["own_mm"]["b"]
    if own_a is not None and own_b is not None:
        for name, own, other in ((a, own_a, own_b), (b, own_b, own_a)):
            if own > GOOD_MM and own > STANDS_OUT * other:
                return say(
                    "rig.one-camera.fix",
                    "The error is in {camera}: its field lines are {mm} from their "
                    "calibrated position. Calibrate {camera} again.",
                    camera=name,
                    mm=format_mm(own),
                )
    x, y = found["shift_mm"]
    return say(
        "rig.both-cameras.fix",
        "Both cameras contribute: on average {b} is ({x:.0f}, {y:.0f}) mm from {a}. "
        "Calibrate both again with a physical lens model and with points on lines inside the shared area.",
        a=a,
        b=b,
        x=x,
        y=y,
    )


def of_rig(
    pairs: Sequence[ComparedPair], troubles: Sequence[RigTrouble], titles: Mapping[str, str]
) -> RigVerdict:
    """Judge all pairs, and what is wrong with single cameras. titles: of all cameras of the rig.

    Cameras that agree can be wrong alike, or where only one of them looks: a trouble with a level caps the rig's. So
    does a camera that was compared with no other.
    """
    judged = [
        (pair, pair["verdict"], pair["agreement"]["carpet"]["max_mm"])
        for pair in pairs
        if pair["verdict"] is not None and pair["agreement"] is not None
    ]
    if len(titles) < 2:
        return stated(
            RigVerdict(
                level=None,
                reason="single-camera",
                sentence=say(
                    "rig.single",
                    "This rig has one camera: there is no other that it could agree with.",
                ),
                fix=join(
                    *(trouble["fix"] for trouble in troubles[:1]),
                    say("rig.single.fix", "Add the other cameras above the field to the rig."),
                ),
            )
        )
    if not judged:
        fix = (
            troubles[0]["fix"]
            if troubles
            else say(
                "rig.no-pair.fix", "Calibrate each camera, and make sure that the images overlap."
            )
        )
        return stated(
            RigVerdict(
                level=None,
                reason="nothing-compared",
                fix=fix,
                sentence=say("rig.no-pair", "No two cameras of this rig can be compared."),
            )
        )
    _, worst, _ = max(judged, key=lambda pair: (LEVELS.index(pair[1]["level"]), pair[2]))
    sentence = join(
        WORDS[worst["level"]],
        say("rig.largest", "Largest difference: {pair}", pair=worst["sentence"]),
    )
    verdict = capped(_verdict(worst["level"], sentence, worst["fix"]), troubles)
    level, text = verdict["level"], verdict["sentence"]
    compared = {camera for pair, _, _ in judged for camera in (pair["a"], pair["b"])}
    if alone := [title for camera, title in titles.items() if camera not in compared]:
        level = worst_level(level, "fair")
        text = join(
            say("rig.not-compared", "Compared with no other camera: {cameras}.", cameras=alone),
            text,
        )
    return stated(RigVerdict(level=level, reason=None, sentence=text, fix=verdict["fix"]))


def capped(verdict: PairVerdict, troubles: Sequence[RigTrouble]) -> PairVerdict:
    """Return a verdict no better than what is wrong with the cameras allows."""
    level = worst_level(
        verdict["level"], *(one["level"] for one in troubles if one["level"] is not None)
    )
    texts = (
        [one["text"] for one in troubles if one["level"] == level]
        if level != verdict["level"]
        else []
    )
    return _verdict(
        level,
        join(*texts, verdict["sentence"]),
        join(verdict["fix"], *(one["fix"] for one in troubles[:2])),
    )


def camera_trouble(
    camera: str, reason: str, text: str, fix: str, level: Level | None = None
) -> RigTrouble:
    """Return what is wrong with a camera of a rig; level: the best that the rig's verdict may then be."""
    return stated(RigTrouble(camera=camera, reason=reason, text=text, fix=fix, level=level))


def of_report(camera: str, title: str, report: Mapping[str, Any]) -> Iterator[RigTrouble]:
    """Yield what a calibration's own report says against a camera; nothing of an imported one."""
    level = (report.get("verdict") or {}).get("level")
    if level == "poor":
        yield camera_trouble(
            camera,
            "not-accurate",
            say(
                "own.poor", "{camera} was not accurate enough when it was calibrated.", camera=title
            ),
            say(
                "own.poor.fix",
                "Calibrate {camera} again with a physical lens model, or with more points.",
                camera=title,
            ),
            "poor",
        )
    elif level == "unknown":
        yield camera_trouble(
            camera,
            "accuracy-unknown",
            say(
                "own.unknown", "The accuracy of {camera} inside the field is unknown.", camera=title
            ),
            say(
                "own.unknown.fix",
                "Calibrate {camera} with a physical lens model, or with points on lines inside the "
                "field.",
                camera=title,
            ),
            "fair",
        )


def of_fundamental(epipolar_px: Array, good: Mask, which: Indices) -> PairVerdict:
    """Judge a geometry that was found from matches; all (n,), which: as they are counted."""
    rms_px, wrong = root_mean_square(epipolar_px[good]), which[~good]
    level = worst_level(_level_of_px(rms_px), "fair" if len(wrong) else "good")
    agreed = say(
        "pair.geometry",
        "{n} of {all} matches agree with one geometry, within {px:px} px.",
        n=int(good.sum()),
        all=len(good),
        px=rms_px,
    )
    if len(wrong):
        return _verdict(
            level,
            join(agreed, _mistaken(wrong)),
            say(
                "pair.mistaken.fix",
                "Check whether they show the same point in both images. Move or remove them.",
            ),
        )
    few = int(good.sum()) < FEW_MATCHES
    return _verdict(
        level,
        agreed,
        say(
            "pair.untested.fix",
            "Add matches. These are too few to test the geometry that was fitted to them.",
        )
        if few
        else "",
    )


def _mistaken(wrong: Indices) -> Sentence:
    numbers = [str(i + 1) for i in wrong[:NAMED]]
    if len(wrong) == 1:
        return say("pair.mistaken-one", "Match {match} does not.", match=numbers[0])
    if len(wrong) > NAMED:
        return say(
            "pair.mistaken-many",
            "Matches {matches} and {n} more do not.",
            matches=numbers,
            n=len(wrong) - NAMED,
        )
    return say(
        "pair.mistaken",
        "Matches {matches} and {last} do not.",
        matches=numbers[:-1],
        last=numbers[-1],
    )


def of_calibrated(epipolar_px: Array, which: Indices) -> PairVerdict:
    """Judge matches beside the lines that two calibrations foretell; (n,) px, NaN unseen."""
    known = epipolar_px[np.isfinite(epipolar_px)]
    median, worst = float(np.median(known)), int(np.nanargmax(epipolar_px))
    level = _level_of_px(median)
    sentence = say(
        "pair.predicted",
        "The matches are {px:px} px (median) from the position predicted by the two calibrations.",
        px=median,
    )
    if epipolar_px[worst] > max(FAR_OFF * median, FAIR_PX):
        return _verdict(
            "fair" if level == "good" else level,
            sentence,
            say(
                "pair.predicted-one.fix",
                "Check match {match}, which is {px:px} px off: is it the same point in both "
                "images?",
                match=int(which[worst]) + 1,
                px=epipolar_px[worst],
            ),
        )
    fix = (
        ""
        if level == "good"
        else say(
            "pair.predicted.fix",
            "One camera was moved after its calibration, or a lens model is wrong. Calibrate again, "
            "starting with the camera whose lines no longer fit.",
        )
    )
    return _verdict(level, sentence, fix)


def _level_of_px(px: float) -> Level:
    return "good" if px <= GOOD_PX else "fair" if px <= FAIR_PX else "poor"


def _verdict(level: Level, sentence: str, fix: str) -> PairVerdict:
    return stated(PairVerdict(level=level, sentence=sentence, fix=fix))


@dataclass(frozen=True)
class CheckedLevel:
    """What a rig's newest check says: None where nothing could be compared. outdated: what has happened since."""

    is_checked: bool = False
    level: Level | None = None
    p95_mm: float | None = None
    outdated: str = ""


def rig_claim(name: str, title: str, newest: CheckedLevel, troubles: Sequence[RigTrouble]) -> Claim:
    """Return whether the cameras of a rig agree. troubles: why they do not fit together, whatever a check says."""
    code, named = f"rig-{name}", Sentence(title)
    shown = None if newest.p95_mm is None else mm(newest.p95_mm)
    if newest.level == "poor" and not newest.outdated:
        return Claim(
            code,
            "refuted",
            say("claim.rig.disagree", "Cameras do not agree"),
            named,
            tried=("rig-check",),
            gates=True,
            figure=shown,
            cure="rig",
        )
    if troubles:
        return Claim(
            code,
            "refuted",
            say("claim.rig.troubles", "The cameras of a rig do not fit together"),
            named,
            tried=("versions",),
            cure="rig",
            cases=tuple(
                Case(sentence_in(one, "text"), sentence_in(one, "fix")) for one in troubles
            ),
        )
    if not newest.is_checked or newest.level is None or newest.outdated:
        return Claim(
            code,
            "not-tested",
            say("claim.rig.not-checked", "Agreement not checked"),
            join(
                say("claim.rig.name", "{rig}.", rig=named),
                newest.outdated
                or (
                    ""
                    if not newest.is_checked
                    else say("claim.rig.nothing", "No two cameras could be compared.")
                ),
            ),
            cure="rig",
        )
    return Claim(
        code,
        "held" if newest.level == "good" else "refuted",
        say("claim.rig.agree", "Cameras agree")
        if newest.level == "good"
        else say("claim.rig.roughly", "Cameras agree roughly"),
        named,
        tried=("rig-check",),
        figure=shown,
        cure="rig",
    )


def neighbour_claim(
    camera: str, title: str, found: RigAgreement, against: Sequence[Level]
) -> Claim:
    """Return whether a version agrees on the carpet with a neighbour's active version.

    camera: that one's id; title: its name; against: what the reports of both allow at best.
    """
    level, code = worst_level(level_of(found["carpet"]["p95_mm"]), *against), f"neighbour-{camera}"
    gates, is_near = level == "poor", found["median_mm"] <= GOOD_MM
    if gates and is_near:
        name = say(
            "claim.neighbour.unreliable", "Agreement with {camera} is not reliable", camera=title
        )
        text = say(
            "claim.neighbour.inaccurate",
            "One of the two versions is not accurate enough for matches.",
        )
    else:
        name = (
            say("claim.neighbour.agrees", "Agrees with {camera}", camera=title)
            if is_near
            else say("claim.neighbour.disagrees", "Does not agree with {camera}", camera=title)
        )
        text = say(
            "claim.neighbour.overlap",
            "Median over {area:.0f} m² that both cameras cover.",
            area=found["overlap_m2"],
        )
    return Claim(
        code,
        "held" if is_near and level == "good" else "refuted",
        name,
        text,
        say(
            "claim.neighbour.fix",
            "Compare the two cameras, and calibrate the less accurate one again.",
        )
        if gates
        else "",
        ("shared-points",),
        gates,
        mm(found["median_mm"]),
        "pair" if gates else "",
        camera,
    )
