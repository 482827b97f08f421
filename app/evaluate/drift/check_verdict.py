"""The verdict of a check against a new picture: a level, a sentence, and what to do."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from app.core import opencv
from app.core.field import Field, Region
from app.core.geometry import ImageSize
from app.core.marking_names import marking_name
from app.core.statements import Sentence, Stated, join, say, stated
from app.core.text_format import format_mm
from app.evaluate.drift.check_figures import CheckFigures, check_figures
from app.evaluate.drift.line_check import MOST, LineDeviation, line_deviations, measure_lines
from app.evaluate.fit.report_types import Level
from app.evaluate.fit.verdict import FAIR_MM, GOOD_MM, level_of
from app.evaluate.fit.verification import MARKING_FOUND, MAX_MISSING, MIN_FOUND, MISSING_SHOWN
from app.models import CameraModel

MIN_LINES = 3
PAINT = 3.0  # times the level's bound: so far may one marking lie off alone, painted beside its place
ELSEWHERE = 0.5  # of the length that is expected: so much of other lines, and the camera looks elsewhere
INCONCLUSIVE = ("elsewhere", "not-seen")  # reasons for which no figure in mm means anything
AS_MADE = 1.5  # times the error in the calibration's own report: then nothing has changed
LENS = 2.0  # times: what is left when the picture's motion is taken away, against the level's bound
WORDS = {"good": say("check.valid", "The calibration is still valid"),
         "fair": say("check.drifted", "The calibration is usable but has drifted"),
         "poor": say("check.not-valid", "The calibration is no longer valid")}


class CheckVerdict(Stated):
    level: Level | None  # None: inconclusive
    sentence: str
    fix: str
    reason: Literal["holds", "moved", "lens", "lines-missing", "as-made", "elsewhere", "not-seen"]


def verdict_in(picture: NDArray[np.uint8], model: CameraModel, field: Field, region: Region) -> CheckVerdict:
    """Return the verdict of a check in a picture (h, w[, 3]) of the model's size, for all that only asks for it."""
    gray = opencv.to_grey(picture)
    seen = measure_lines(model, gray, field, region)
    size = ImageSize(gray.shape[1], gray.shape[0])
    return check_verdict(check_figures(seen, model, size, field), line_deviations(seen))


def check_verdict(found: CheckFigures, lines: Sequence[LineDeviation]) -> CheckVerdict:
    share, p95_mm = found["found_share"], found["p95_mm"]
    judged = share + found["missing_share"]  # of the rest, something may stand on it
    too_little = judged < MIN_FOUND or share < MOST or found["lines_found"] < MIN_LINES
    if too_little or p95_mm is None or (share < MIN_FOUND and found["others_share"] > ELSEWHERE):
        return _inconclusive(found, lines)
    far_mm, far = max(((line["rms_mm"], line["feature"]) for line in lines
                       if line["rms_mm"] is not None and line["found_share"] >= MARKING_FOUND), key=lambda far: far[0])
    worst = max(p95_mm, *(plane["p95_mm"] for plane in (found["carpet"], found["hat"]) if plane), far_mm / PAINT)
    level = level_of(worst)
    if found["missing"]:
        many = found["missing_share"] > MAX_MISSING or found["missing_inside"] > MOST
        level = "poor" if level == "poor" or many else "fair"
    sentence = join(_errors(found, WORDS[level]), say(
        "check.detected", "{share:.0f} % of the expected lines were detected.", share=100 * share))
    if level == "good":
        return stated(CheckVerdict(level=level, sentence=sentence, fix="", reason="holds"))
    if worst > GOOD_MM:
        sentence = join(sentence, say("check.largest", "Largest error: {line}, {mm}.",
                                      line=marking_name(far), mm=_mm(far_mm)))
    if found["missing"]:
        reason: Literal["lines-missing", "as-made", "lens", "moved"] = "lines-missing"
        sentence = join(sentence, say(
            "check.missing", "Not at their calibrated position, and not covered: {lines}.",
            lines=[marking_name(name) for name in found["missing"][:MISSING_SHOWN]]))
        fix = say(
            "check.missing.fix", "Check the overlay on the image. If these lines exist on the field, calibrate again "
            "with a physical lens model, or with points on them. Otherwise choose the correct field.")
    elif found["own_mm"] is not None and worst <= AS_MADE * found["own_mm"]:
        sentence = join(sentence, say("check.as-made", "When it was calibrated, the error was already {mm}.",
                                      mm=_mm(found["own_mm"])))
        reason, fix = "as-made", say("check.as-made.fix", "The camera has not moved. Calibrate again with a better "
                                                          "lens model or more points.")
    elif found["left_mm"] is not None and found["left_mm"] > (GOOD_MM if level == "fair" else FAIR_MM) / LENS:
        reason, fix = "lens", say(
            "check.lens.fix", "This is not a simple shift: the lens settings changed, the lines were repainted, or the "
            "lens model was not accurate between its points. Calibrate again.")
    else:
        reason, fix = "moved", say("check.moved.fix", "The camera has moved. Update its pose, or calibrate it again.")
    return stated(CheckVerdict(level=level, sentence=sentence, fix=fix, reason=reason))


def _errors(found: CheckFigures, words: Sentence) -> Sentence:
    """Say how far the lines are off, and what lines that cross tell of the carpet between them."""
    begin, values = "{verdict}: the lines are {mm} from their calibrated position (95 % within {mm_95})", {
        "verdict": words, "mm": _mm(found["rms_mm"]), "mm_95": _mm(found["p95_mm"])}
    if found["carpet"] is None:
        return say("check.lines", begin + ".", **values)
    values["carpet"] = _mm(found["carpet"]["mean_mm"])
    if found["hat"] is None:
        return say("check.carpet", begin + "; the whole carpet {carpet}.", **values)
    return say("check.robot-tops", begin + "; the whole carpet {carpet}, robot tops up to {tops}.",
               **values, tops=_mm(found["hat"]["max_mm"]))


def _inconclusive(found: CheckFigures, lines: Sequence[LineDeviation]) -> CheckVerdict:
    share = 100 * found["found_share"]
    if found["others_share"] > ELSEWHERE:
        return stated(CheckVerdict(level="poor", reason="elsewhere", sentence=say(
            "check.elsewhere", "Only {share:.0f} % of the expected lines were detected at their calibrated position, "
            "but other lines are visible: the camera has rotated, or the image shows another field.", share=share),
            fix=say("check.elsewhere.fix",
                    "Check the field type and the covered area, then calibrate the camera again.")))
    hidden = [marking_name(line["feature"]) for line in lines if line["found_share"] < MARKING_FOUND]
    return stated(CheckVerdict(level=None, reason="not-seen", sentence=say(
        "check.not-seen.named", "Only {share:.0f} % of the expected lines were detected; not detected: {lines}. The "
        "result is inconclusive.", share=share, lines=hidden[:MISSING_SHOWN]) if hidden else say(
        "check.not-seen", "Only {share:.0f} % of the expected lines were detected. The result is inconclusive.",
        share=share),
        fix=say("check.not-seen.fix", "Uncover the lines, improve the lighting, or take several images so that moving "
                "people are removed. Then check again. If the field is clear, the camera was rotated far: calibrate "
                "it again.")))


def _mm(value: float | None) -> str:
    if value is None:
        return say("unknown-distance", "an unknown distance")
    return "0.1 mm" if value < 0.1 else format_mm(value)
