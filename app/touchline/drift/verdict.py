"""The verdict of a check against a new picture: a level, a sentence, and what to do.

What counts is what the calibration promised when it was made. Its own points tell where the lines lay then: lines that
lie there still are as good as they were, and no better; lines that lie elsewhere have moved. Where it has no such
points, its report must do; and one without either was never right, whatever the camera did.
"""

from collections.abc import Iterator, Sequence
from typing import Literal

from touchline.core.sentences import marking_name
from touchline.core.statements import Sentence, Stated, format_mm, join, say, stated
from touchline.drift.figures import CheckFigures
from touchline.evaluate.field_lines.measurement import MIN_SHARE, LineDeviation
from touchline.evaluate.report_types import Level
from touchline.evaluate.verdict import FAIR_MM, GOOD_MM, LEVELS, SURE, level_of
from touchline.evaluate.verification import MARKING_FOUND, MAX_MISSING, MIN_FOUND, MISSING_SHOWN

MIN_LINES = 3
# times the level's bound: so far may one marking lie off alone, painted beside its place
REPAINTED_FACTOR = 3.0
# of the expected length: with more of other lines, the camera looks elsewhere
MAX_OTHERS_SHARE = 0.5
# times the error in the calibration's own report: then nothing has changed
MAX_AS_MADE_FACTOR = 1.5
# times: what is left when the picture's motion is taken away, against the level's bound
MIN_LENS_FACTOR = 2.0

Since = Literal["unchanged", "moved", "never-right"]  # of the lines, since the calibration was made
UNCHANGED = {
    "good": say("check.valid", "The calibration is still valid"),
    "fair": say("check.was-fair", "The calibration is unchanged, and it was fair"),
    "poor": say("check.was-poor", "The calibration is unchanged, and it was poor"),
}
MOVED = {
    "fair": say("check.drifted", "The calibration is usable but has drifted"),
    "poor": say("check.not-valid", "The calibration is no longer valid"),
}
MISSING = {
    "fair": say(
        "check.some-missing", "The calibration is usable, but not all lines are where it has them"
    ),
    "poor": say("check.many-missing", "The calibration does not describe this field"),
}
NOT_THIS_CAMERA = say(
    "check.not-this-camera",
    "This calibration was never verified, and does not describe this camera",
)
NOT_EVERYWHERE = say(
    "check.never-accurate", "The calibration is unchanged, but it was never accurate everywhere"
)
NEVER_RIGHT = {
    "fair": say(
        "check.roughly",
        "This calibration was never verified, and describes this camera only roughly",
    ),
    "poor": NOT_THIS_CAMERA,
}
AS_MADE_FIX = say(
    "check.as-made.fix",
    "The camera has not moved. Calibrate again with a better lens model or more points.",
)
NEVER_RIGHT_FIX = say(
    "check.never-right.fix", "Nothing shows that the camera has moved. Calibrate this camera."
)


class CheckVerdict(Stated):
    """level: None where it is inconclusive; lines_level: of how the lines lie alone, whatever its report says."""

    level: Level | None
    lines_level: Level | None
    sentence: str
    fix: str
    reason: Literal[
        "holds",
        "moved",
        "lens",
        "lines-missing",
        "as-made",
        "elsewhere",
        "not-seen",
        "never-right",
        "turned",
        "mirrored",
    ]


def is_conclusive(found: CheckFigures) -> bool:
    """Return whether so much of the lines was found that figures in mm mean something."""
    share = found["found_share"]
    known_share = share + found["missing_share"]  # of the rest, something may stand on it
    is_elsewhere = share < MIN_FOUND and found["others_share"] > MAX_OTHERS_SHARE
    return not (
        known_share < MIN_FOUND
        or share < MIN_SHARE
        or found["lines_found"] < MIN_LINES
        or found["p95_mm"] is None
        or is_elsewhere
    )


def check_verdict(found: CheckFigures, lines: Sequence[LineDeviation]) -> CheckVerdict:
    """Judge the figures of a check, and the deviation of every marking."""
    if not is_conclusive(found):
        return _by_points(found) or _inconclusive(found, lines)
    farthest_mm, farthest = max(
        (
            (line["rms_mm"], line["feature"])
            for line in lines
            if line["rms_mm"] is not None and line["found_share"] >= MARKING_FOUND
        ),
        key=lambda line: line[0],
    )
    worst_mm = max(
        found["p95_mm"] or 0.0,
        *(plane["p95_mm"] for plane in (found["carpet"], found["hat"]) if plane),
        farthest_mm / REPAINTED_FACTOR,
    )
    since = _since(found, worst_mm)
    lines_level = _lines_level(found, since, worst_mm)
    level = _worse(lines_level, found["own_level"])
    reason, words, fix = _cause(found, since, level)
    sentence = join(
        _errors(found, words),
        say(
            "check.detected",
            "{share:.0f} % of the expected lines were detected.",
            share=100 * found["found_share"],
        ),
    )
    if reason != "holds":
        far = (marking_name(farthest), farthest_mm) if worst_mm > GOOD_MM else None
        sentence = join(sentence, *_details(found, since, reason, far))
    return stated(
        CheckVerdict(
            level=level, lines_level=lines_level, sentence=sentence, fix=fix or "", reason=reason
        )
    )


def _lines_level(found: CheckFigures, since: Since, worst_mm: float) -> Level:
    """Return the level of how the lines lie, whatever the calibration's report says."""
    change = found["change"]
    # Lines that lie where its points had them are as wrong as when it was made: that error is within noise.
    made_mm = (
        worst_mm if change is None or since == "moved" else max(worst_mm - change["mm"], 0.0) / SURE
    )
    level = level_of(made_mm)
    if since == "moved" and change is not None:
        level = _worse(level, level_of(change["mm"]))
    if found["missing"]:
        is_many = found["missing_share"] > MAX_MISSING or found["missing_inside"] > MIN_SHARE
        level = _worse(level, "poor" if is_many else "fair")
    return level


def _details(
    found: CheckFigures, since: Since, reason: str, far: tuple[Sentence, float] | None
) -> Iterator[Sentence]:
    """Yield what else a verdict says that is not good. far: the name of the farthest line and how far it is, mm."""
    change = found["change"]
    if far is not None:
        yield say("check.largest", "Largest error: {line}, {mm}.", line=far[0], mm=_mm(far[1]))
    if found["missing"]:
        yield say(
            "check.missing",
            "Not at their calibrated position, and not covered: {lines}.",
            lines=[marking_name(name) for name in found["missing"][:MISSING_SHOWN]],
        )
    if since == "moved" and change is not None:
        yield say(
            "check.moved-by",
            "Since it was calibrated, the lines have moved by {mm}.",
            mm=_mm(change["mm"]),
        )
    if reason == "as-made" and found["own_mm"] is not None and found["own_mm"] > GOOD_MM:
        yield say(
            "check.as-made",
            "When it was calibrated, the error was already {mm}.",
            mm=_mm(found["own_mm"]),
        )


def _since(found: CheckFigures, worst_mm: float) -> Since:
    """Return what became of the lines, by the calibration's own points, else by its report."""
    change, own_mm, own_level = found["change"], found["own_mm"], found["own_level"]
    if change is None:
        if worst_mm <= max(GOOD_MM, MAX_AS_MADE_FACTOR * (own_mm or 0.0)):
            return "unchanged"
        return "moved" if own_level in ("good", "fair") else "never-right"
    own_rank = 0 if own_level == "unknown" else LEVELS.index(own_level)
    # More than a half of what is wrong now came since then, where its own verdict does not account for it.
    is_worse_than_made = LEVELS.index(level_of(worst_mm)) > own_rank
    min_mm = max(change["least_mm"], min(GOOD_MM, worst_mm / 2) if is_worse_than_made else GOOD_MM)
    return "moved" if change["mm"] > min_mm else "unchanged"


def _cause(
    found: CheckFigures, since: Since, level: Level
) -> tuple[
    Literal["holds", "moved", "lens", "lines-missing", "as-made", "never-right"], Sentence, Sentence
]:
    """Return the reason, how the sentence begins, and what to do."""
    change = found["change"]
    if since == "moved":
        left_mm = change["left_mm"] if change is not None else found["left_mm"]
        if (
            left_mm is not None
            and left_mm > (GOOD_MM if level == "fair" else FAIR_MM) / MIN_LENS_FACTOR
        ):
            return (
                "lens",
                MOVED[level],
                say(
                    "check.lens.fix",
                    "This is not a simple shift: the lens settings changed, the lines were repainted, or "
                    "the lens model was not accurate between its points. Calibrate again.",
                ),
            )
        return (
            "moved",
            MOVED[level],
            say("check.moved.fix", "The camera has moved. Update its pose, or calibrate it again."),
        )
    if since == "never-right" or (found["missing"] and _is_unverified(found)):
        return "never-right", _never_right(found, level), NEVER_RIGHT_FIX
    if found["missing"] and found["own_level"] != "poor":
        return (
            "lines-missing",
            MISSING[level],
            say(
                "check.missing.fix",
                "Check the overlay on the image. If these lines exist on the field, calibrate again "
                "with a physical lens model, or with points on them. Otherwise choose the correct field.",
            ),
        )
    if level == "good":
        return "holds", UNCHANGED[level], Sentence("")
    if level == found["own_level"]:
        return (
            "as-made",
            UNCHANGED[level],
            AS_MADE_FIX
            if level == "poor"
            else say(
                "check.was-fair.fix",
                "The camera has not moved. The calibration's report says how to make it more "
                "accurate.",
            ),
        )
    return "as-made", NOT_EVERYWHERE, AS_MADE_FIX


def _never_right(found: CheckFigures, level: Level) -> Sentence:
    return (
        NEVER_RIGHT[level]
        if _is_unverified(found)
        else say(
            "check.was-inaccurate",
            "The calibration was not shown to be accurate when it was made, and does not describe "
            "the image",
        )
    )


def _is_unverified(found: CheckFigures) -> bool:
    """Return whether it came without points and without an error, as other programs' files do."""
    return found["change"] is None and found["own_mm"] is None and found["own_level"] == "unknown"


def _worse(level: Level, other: str) -> Level:
    return max((level, *(known for known in LEVELS if known == other)), key=LEVELS.index)


def _by_points(found: CheckFigures) -> CheckVerdict | None:
    """Return what its own points tell where the model's lines are not found; None where they tell nothing."""
    change, own = found["change"], found["own_level"]
    if change is None:
        return None
    values = {"share": 100 * found["found_share"], "mm": _mm(change["mm"])}
    if change["mm"] > max(change["least_mm"], GOOD_MM):
        return stated(
            CheckVerdict(
                level="poor",
                lines_level="poor",
                reason="moved",
                sentence=say(
                    "check.points-moved",
                    "Only {share:.0f} % of the expected lines were detected at their calibrated position. "
                    "Since it was calibrated, the lines have moved by {mm}.",
                    **values,
                ),
                fix=say("check.points-moved.fix", "The camera has moved. Calibrate it again."),
            )
        )
    if found["others_share"] > MAX_OTHERS_SHARE or own == "poor":
        return stated(
            CheckVerdict(
                level="poor",
                lines_level="poor",
                reason="as-made",
                sentence=say(
                    "check.points-unchanged",
                    "The calibration is unchanged, but it was never accurate everywhere: only "
                    "{share:.0f} % of the expected lines were detected. Its own points lie where they lay "
                    "(within {mm}).",
                    **values,
                ),
                fix=AS_MADE_FIX,
            )
        )
    return None


def _errors(found: CheckFigures, words: Sentence) -> Sentence:
    """Say how far the lines are off, and what lines that cross tell of the carpet between them."""
    begin, values = (
        "{verdict}: the lines are {mm} from their calibrated position (95 % within {mm_95})",
        {"verdict": words, "mm": _mm(found["rms_mm"]), "mm_95": _mm(found["p95_mm"])},
    )
    if found["carpet"] is None:
        return say("check.lines", begin + ".", **values)
    values["carpet"] = _mm(found["carpet"]["mean_mm"])
    if found["hat"] is None:
        return say("check.carpet", begin + "; the whole carpet {carpet}.", **values)
    return say(
        "check.robot-tops",
        begin + "; the whole carpet {carpet}, robot tops up to {tops}.",
        **values,
        tops=_mm(found["hat"]["max_mm"]),
    )


def _inconclusive(found: CheckFigures, lines: Sequence[LineDeviation]) -> CheckVerdict:
    share = 100 * found["found_share"]
    doubtful = _is_unverified(found) or (found["change"] is None and found["own_level"] == "poor")
    if found["others_share"] > MAX_OTHERS_SHARE:
        if doubtful:
            return stated(
                CheckVerdict(
                    level="poor",
                    lines_level="poor",
                    reason="never-right",
                    sentence=say(
                        "check.other-lines",
                        "{verdict}: only {share:.0f} % of the expected lines were detected, but other "
                        "lines are visible.",
                        verdict=_never_right(found, "poor"),
                        share=share,
                    ),
                    fix=NEVER_RIGHT_FIX,
                )
            )
        return stated(
            CheckVerdict(
                level="poor",
                lines_level="poor",
                reason="elsewhere",
                sentence=say(
                    "check.elsewhere",
                    "Only {share:.0f} % of the expected lines were detected at their calibrated position, "
                    "but other lines are visible: the camera has rotated, or the image shows another field.",
                    share=share,
                ),
                fix=say(
                    "check.elsewhere.fix",
                    "Check the field type and the covered area, then calibrate the camera again.",
                ),
            )
        )
    hidden = [
        marking_name(line["feature"]) for line in lines if line["found_share"] < MARKING_FOUND
    ]
    return stated(
        CheckVerdict(
            level=None,
            lines_level=None,
            reason="not-seen",
            sentence=say(
                "check.not-seen.named",
                "Only {share:.0f} % of the expected lines were detected; not detected: {lines}. The "
                "result is inconclusive.",
                share=share,
                lines=hidden[:MISSING_SHOWN],
            )
            if hidden
            else say(
                "check.not-seen",
                "Only {share:.0f} % of the expected lines were detected. The result is inconclusive.",
                share=share,
            ),
            fix=say(
                "check.not-seen.fix.unverified",
                "Uncover the lines, improve the lighting, or take several images. "
                "Then check again. If the field is clear, this calibration does not describe this camera: "
                "calibrate it.",
            )
            if doubtful
            else say(
                "check.not-seen.fix",
                "Uncover the lines, improve the lighting, or take several images so that moving "
                "people are removed. Then check again. If the field is clear, the camera was rotated far: calibrate it "
                "again.",
            ),
        )
    )


def _mm(value: float | None) -> str:
    if value is None:
        return say("unknown-distance", "an unknown distance")
    return "0.1 mm" if value < 0.1 else format_mm(value)
