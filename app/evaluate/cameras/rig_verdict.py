"""Verdicts on the figures of a rig: a level, a sentence for each pair, and what to do."""

from collections.abc import Mapping, Sequence
from typing import Any

from app.core.text_format import format_mm
from app.evaluate.cameras.own_accuracy import LEVELS, capped_level
from app.evaluate.fit.report import FAIR_MM, GOOD_MM

STANDS_OUT = 2.5  # times the other's error: then it is this camera
COVERED = 0.25  # of the shared part: less near a measure speaks for a small piece of it
FROM = {"pictures": "", "clicks": "It rests on the clicks of the calibrations: what has moved since, it cannot see. "
        "Check with pictures for that.", "matches": ""}


def of_pair(a: str, b: str, found: Mapping[str, Any], source: str) -> dict[str, Any]:
    """{"level", "sentence", "fix"} of two cameras called a and b. source: what it was measured by."""
    carpet, hat = found["carpet"], found["hat"]
    worst = max(carpet["p95_mm"], hat["p95_mm"] if hat else 0.0)
    level = "good" if worst <= GOOD_MM else "fair" if worst <= FAIR_MM else "poor"
    x, y = carpet["where"]
    sentence = (f"{a} and {b} put the same thing {format_mm(carpet['mean_mm'])} apart in the mean, "
                f"{format_mm(carpet['max_mm'])} at the worst place, ({x:.0f}, {y:.0f}) mm")
    sentence += f"; a robot's hat {format_mm(hat['max_mm'])} at worst." if hat else "."
    if not found["both_directions"]:
        sentence += " Over most of it that is known in one direction only: along a line nobody can tell."
    fixes = []
    if level != "good":
        fixes.append(_cure(a, b, found))
    if not found["both_directions"]:
        fixes.append("Let both see lines that cross, or match some things.")
    elif found["covered"] < COVERED:
        fixes.append("Match more things all over the part that both see: these figures speak for a small piece of it.")
    if FROM[source]:
        fixes.append(FROM[source])
    return {"level": level, "sentence": sentence, "fix": " ".join(fixes)}


def _cure(a: str, b: str, found: Mapping[str, Any]) -> str:
    own_a, own_b = found["own_mm"]["a"], found["own_mm"]["b"]
    if own_a is not None and own_b is not None:
        for name, own, other in ((a, own_a, own_b), (b, own_b, own_a)):
            if own > GOOD_MM and own > STANDS_OUT * other:
                return (f"It is {name}: the field's lines lie {format_mm(own)} from where its calibration has them. "
                        f"Calibrate {name} again.")
    shift = found["shift_mm"]
    return (f"Both have a part in it; in the mean {b} is ({shift[0]:.0f}, {shift[1]:.0f}) mm from {a}. Calibrate both "
            "again with a lens model, with lines clicked inside the part that both see.")


def of_rig(pairs: Sequence[Mapping[str, Any]], troubles: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """{"level", "sentence", "fix"} of all pairs and of what is wrong with single cameras; level None if unknown.

    Cameras that agree can be wrong alike, or where only one of them looks: a trouble with a level caps the rig's.
    """
    judged = [pair for pair in pairs if pair.get("verdict")]
    if not judged:
        first = troubles[0] if troubles else {"fix": "Give each camera a calibration, and let their pictures overlap."}
        return {"level": None, "sentence": "No two cameras of this rig could be compared.", "fix": first["fix"]}
    worst = max(judged, key=lambda p: (LEVELS.index(p["verdict"]["level"]), p["agreement"]["carpet"]["max_mm"]))
    level = worst["verdict"]["level"]
    words = {"good": "The cameras agree.", "fair": "A robot jumps a little where one camera takes over from another.",
             "poor": "The cameras put the same thing at different places."}[level]
    sentence = f"{words} Worst: {worst['verdict']['sentence']}"
    capped = capped_level(level, [trouble["level"] for trouble in troubles])
    if capped != level:
        told = " ".join(trouble["text"] for trouble in troubles if trouble["level"] == capped)
        sentence, level = f"{told} {sentence}", capped
    return {"level": level, "sentence": sentence,
            "fix": " ".join(filter(None, [worst["verdict"]["fix"], *(t["fix"] for t in troubles[:2])]))}
