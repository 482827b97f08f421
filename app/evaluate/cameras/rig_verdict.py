"""Verdicts on the figures of a rig: a level, a sentence for each pair, and what to do."""

from collections.abc import Mapping, Sequence
from typing import Any

from app.core.text_format import format_mm
from app.evaluate.cameras.own_accuracy import LEVELS, capped_level
from app.evaluate.fit.verdict import FAIR_MM, GOOD_MM

STANDS_OUT = 2.5  # times the other's error: then it is this camera
COVERED = 0.25  # of the shared part: less near a measure speaks for a small piece of it
FROM = {"pictures": "", "clicks": "This compares the points of the calibrations. Movement since then is not detected. "
                                  "Check with current images.", "matches": ""}


def of_pair(a: str, b: str, found: Mapping[str, Any], source: str) -> dict[str, Any]:
    """{"level", "sentence", "fix"} of two cameras called a and b. source: what it was measured by."""
    carpet, hat = found["carpet"], found["hat"]
    worst = max(carpet["p95_mm"], hat["p95_mm"] if hat else 0.0)
    level = "good" if worst <= GOOD_MM else "fair" if worst <= FAIR_MM else "poor"
    x, y = carpet["where"]
    sentence = (f"{a} and {b} differ by {format_mm(carpet['mean_mm'])} on average, at most "
                f"{format_mm(carpet['max_mm'])} at ({x:.0f}, {y:.0f}) mm")
    sentence += f"; at robot tops at most {format_mm(hat['max_mm'])}." if hat else "."
    if not found["both_directions"]:
        sentence += (" In most of the shared area this is known in one direction only, because a line does not show "
                     "movement along itself.")
    fixes = []
    if level != "good":
        fixes.append(_cure(a, b, found))
    if not found["both_directions"]:
        fixes.append("Mark lines that cross in both images, or add matches.")
    elif found["covered"] < COVERED:
        fixes.append("Add matches all over the shared area. These cover only a small part of it.")
    if FROM[source]:
        fixes.append(FROM[source])
    return {"level": level, "sentence": sentence, "fix": " ".join(fixes)}


def _cure(a: str, b: str, found: Mapping[str, Any]) -> str:
    own_a, own_b = found["own_mm"]["a"], found["own_mm"]["b"]
    if own_a is not None and own_b is not None:
        for name, own, other in ((a, own_a, own_b), (b, own_b, own_a)):
            if own > GOOD_MM and own > STANDS_OUT * other:
                return (f"The error is in {name}: its field lines are {format_mm(own)} from their calibrated position. "
                        f"Calibrate {name} again.")
    shift = found["shift_mm"]
    return (f"Both cameras contribute: on average {b} is ({shift[0]:.0f}, {shift[1]:.0f}) mm from {a}. Calibrate both "
            "again with a physical lens model and with points on lines inside the shared area.")


def of_rig(pairs: Sequence[Mapping[str, Any]], troubles: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """{"level", "sentence", "fix"} of all pairs and of what is wrong with single cameras; level None if unknown.

    Cameras that agree can be wrong alike, or where only one of them looks: a trouble with a level caps the rig's.
    """
    judged = [pair for pair in pairs if pair.get("verdict")]
    if not judged:
        first = troubles[0] if troubles else {"fix": "Calibrate each camera, and make sure that the images overlap."}
        return {"level": None, "sentence": "No two cameras of this rig can be compared.", "fix": first["fix"]}
    worst = max(judged, key=lambda p: (LEVELS.index(p["verdict"]["level"]), p["agreement"]["carpet"]["max_mm"]))
    level = worst["verdict"]["level"]
    words = {"good": "The cameras agree.", "fair": "The cameras agree roughly. A robot shifts slightly when it passes "
                                                   "from one to another.",
             "poor": "The cameras do not agree."}[level]
    sentence = f"{words} Largest difference: {worst['verdict']['sentence']}"
    capped = capped_level(level, [trouble["level"] for trouble in troubles])
    if capped != level:
        told = " ".join(trouble["text"] for trouble in troubles if trouble["level"] == capped)
        sentence, level = f"{told} {sentence}", capped
    return {"level": level, "sentence": sentence,
            "fix": " ".join(filter(None, [worst["verdict"]["fix"], *(t["fix"] for t in troubles[:2])]))}
