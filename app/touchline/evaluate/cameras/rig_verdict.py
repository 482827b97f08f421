"""Verdicts on the figures of a rig: a level, a sentence for each pair, and what to do."""

from collections.abc import Mapping, Sequence
from typing import Literal

from typing_extensions import TypedDict

from touchline.core.statements import Sentence, Stated, join, say, stated
from touchline.core.text_format import format_mm
from touchline.evaluate.cameras.own_accuracy import capped_level
from touchline.evaluate.cameras.rig_agreement import RigAgreement
from touchline.evaluate.cameras.robot_tops import HatUnknown
from touchline.evaluate.fit.report_types import Level
from touchline.evaluate.fit.verdict import GOOD_MM, LEVELS, level_of

STANDS_OUT = 2.5  # times the other's error: then it is this camera
COVERED = 0.25  # of the shared part: less near a measure speaks for a small piece of it
Source = Literal["pictures", "matches", "clicks"]  # what two cameras are compared by
FROM: dict[Source, str] = {"pictures": "", "matches": "", "clicks": say(
    "rig.from-points", "This compares the points of the calibrations. Movement since then is not detected. Check with "
                       "current images.")}
WORDS = {"good": say("rig.good", "The cameras agree."),
         "fair": say("rig.fair", "The cameras agree roughly. A robot shifts slightly when it passes from one to "
                                 "another."),
         "poor": say("rig.poor", "The cameras do not agree.")}


TOPS_UNKNOWN: dict[HatUnknown, Sentence] = {
    "no-rays": say("rig.tops-no-rays", "At robot tops the difference is unknown: that requires physical lens models."),
    "no-covariance": say("rig.tops-no-covariance", "At robot tops the difference is unknown, because the accuracy of "
                                                   "an imported calibration is unknown."),
    "not-seen": say("rig.tops-not-seen", "The cameras share no area at robot tops.")}


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


def of_pair(a: str, b: str, found: RigAgreement, source: Source) -> PairVerdict:
    """Judge two cameras called a and b."""
    carpet, hat = found["carpet"], found["hat"]
    level = level_of(carpet["p95_mm"])
    if hat:  # an error that is only expected does not show that they disagree
        at_tops = level_of(hat["p95_mm"])
        level = capped_level(level, ["fair" if at_tops == "poor" and found["hat_from"] == "expected" else at_tops])
    differ = "{a} and {b} differ by {mean} on average, at most {most} at ({x:.0f}, {y:.0f}) mm"
    values = {"a": a, "b": b, "mean": format_mm(carpet["mean_mm"]), "most": format_mm(carpet["max_mm"]),
              "x": carpet["where"][0], "y": carpet["where"][1]}
    if hat is None:
        unknown = found["hat_unknown"]
        sentence = join(say("rig.differ", differ + ".", **values), TOPS_UNKNOWN[unknown] if unknown else "")
    else:
        values["tops"] = format_mm(hat["max_mm"])
        sentence = (say("rig.expected-at-tops", differ + "; at robot tops up to about {tops} is expected.", **values)
                    if found["hat_from"] == "expected" else
                    say("rig.differ-at-tops", differ + "; at robot tops at most {tops}.", **values))
    if not found["both_directions"]:
        sentence = join(sentence, say("rig.one-direction", "In most of the shared area this is known in one direction "
                                      "only, because a line does not show movement along itself."))
    fixes = []
    if level_of(carpet["p95_mm"]) != "good":
        fixes.append(_cure(a, b, found))
    elif level != "good":
        fixes.append(say("rig.tops.fix", "Measure the heights of both cameras and enter them as known camera heights, "
                         "or add matches at robot tops."))
    if not found["both_directions"]:
        fixes.append(say("rig.one-direction.fix", "Mark lines that cross in both images, or add matches."))
    elif found["covered"] < COVERED:
        fixes.append(add_matches())
    return stated(PairVerdict(level=level, sentence=sentence, fix=join(*fixes, FROM[source])))


def add_matches() -> Sentence:
    """Return what to do where matches lie in a small piece of what two cameras share."""
    return say("pair.few-matches.fix", "Add matches all over the shared area. These cover only a small part of it.")


def _cure(a: str, b: str, found: RigAgreement) -> Sentence:
    own_a, own_b = found["own_mm"]["a"], found["own_mm"]["b"]
    if own_a is not None and own_b is not None:
        for name, own, other in ((a, own_a, own_b), (b, own_b, own_a)):
            if own > GOOD_MM and own > STANDS_OUT * other:
                return say("rig.one-camera.fix", "The error is in {camera}: its field lines are {mm} from their "
                           "calibrated position. Calibrate {camera} again.", camera=name, mm=format_mm(own))
    x, y = found["shift_mm"]
    return say("rig.both-cameras.fix", "Both cameras contribute: on average {b} is ({x:.0f}, {y:.0f}) mm from {a}. "
               "Calibrate both again with a physical lens model and with points on lines inside the shared area.",
               a=a, b=b, x=x, y=y)


def of_rig(pairs: Sequence[ComparedPair], troubles: Sequence[RigTrouble], titles: Mapping[str, str]) -> RigVerdict:
    """Judge all pairs, and what is wrong with single cameras. titles: of all cameras of the rig.

    Cameras that agree can be wrong alike, or where only one of them looks: a trouble with a level caps the rig's. So
    does a camera that was compared with no other.
    """
    judged = [(pair, pair["verdict"], pair["agreement"]["carpet"]["max_mm"]) for pair in pairs
              if pair["verdict"] is not None and pair["agreement"] is not None]
    if len(titles) < 2:
        return stated(RigVerdict(level=None, reason="single-camera", sentence=say(
            "rig.single", "This rig has one camera: there is no other that it could agree with."),
            fix=join(*(trouble["fix"] for trouble in troubles[:1]), say(
                "rig.single.fix", "Add the other cameras above the field to the rig."))))
    if not judged:
        fix = troubles[0]["fix"] if troubles else say(
            "rig.no-pair.fix", "Calibrate each camera, and make sure that the images overlap.")
        return stated(RigVerdict(level=None, reason="nothing-compared", fix=fix, sentence=say(
            "rig.no-pair", "No two cameras of this rig can be compared.")))
    _, worst, _ = max(judged, key=lambda pair: (LEVELS.index(pair[1]["level"]), pair[2]))
    sentence = join(WORDS[worst["level"]], say("rig.largest", "Largest difference: {pair}", pair=worst["sentence"]))
    level = capped_level(worst["level"], [trouble["level"] for trouble in troubles])
    if level != worst["level"]:
        sentence = join(*(trouble["text"] for trouble in troubles if trouble["level"] == level), sentence)
    compared = {camera for pair, _, _ in judged for camera in (pair["a"], pair["b"])}
    if alone := [title for camera, title in titles.items() if camera not in compared]:
        level = capped_level(level, ["fair"])
        sentence = join(say("rig.not-compared", "Compared with no other camera: {cameras}.", cameras=alone), sentence)
    return stated(RigVerdict(level=level, reason=None, sentence=sentence,
                             fix=join(worst["fix"], *(t["fix"] for t in troubles[:2]))))
