"""The verdict of a check against a new picture: a level, a sentence, and what to do."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from app.core.text_format import format_mm
from app.evaluate.fit.report import FAIR_MM, GOOD_MM

MIN_FOUND = 0.5  # of the length of the lines that should be seen: people may stand on a third of it
MIN_LINES = 3
SEEN = 0.3  # of a marking: below it, it says nothing
ELSEWHERE = 0.5  # of the length that is expected: so much of other lines, and the camera looks elsewhere
INCONCLUSIVE = ("elsewhere", "not-seen")  # reasons for which no figure in mm means anything
AS_MADE = 1.5  # times the error in the calibration's own report: then nothing has changed
LENS = 2.0  # times: what is left when the picture's motion is taken away, against the level's bound
WORDS = {"good": "The calibration still holds", "fair": "The calibration holds with some play",
         "poor": "The calibration no longer holds"}


@dataclass(frozen=True)
class CheckFigures:
    """How far off, mm: of the places (rms, p95), and carried over carpet and hats (p95, max). None where not known.

    left_mm: rms of what is not a motion of the camera, as of a lens that was changed. others_share: length of long
    lines that lie where none is expected, as a share of what is. own_mm: the error in its own report.
    """

    found_share: float
    lines_found: int
    rms_mm: float | None
    p95_mm: float | None
    rms_px: float | None
    left_mm: float | None
    carpet: Mapping[str, Any] | None
    hat: Mapping[str, Any] | None
    others_share: float
    own_mm: float | None = None

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


def check_verdict(found: CheckFigures, lines: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """{"level": good, fair, poor or None, "sentence", "fix", "reason"}. None: inconclusive."""
    if found.found_share < MIN_FOUND or found.lines_found < MIN_LINES or found.p95_mm is None:
        return _inconclusive(found, lines)
    worst = max(v["p95_mm"] for v in ({"p95_mm": found.p95_mm}, found.carpet, found.hat) if v is not None)
    level = "good" if worst <= GOOD_MM else "fair" if worst <= FAIR_MM else "poor"
    far = max((line for line in lines if line["rms_mm"] is not None), key=lambda line: line["rms_mm"])
    whole = ""  # what lines that cross tell of the carpet between them
    if found.carpet is not None:
        whole = f"; the carpet as a whole is {_mm(found.carpet['mean_mm'])} off"
        whole += f", a robot's hat up to {_mm(found.hat['max_mm'])}" if found.hat else ""
    sentence = (f"{WORDS[level]}: the lines lie {_mm(found.rms_mm)} from where it has them, 95 % within "
                f"{_mm(found.p95_mm)}{whole}. {100 * found.found_share:.0f} % of the lines that should be seen "
                "were found.")
    if level == "good":
        return {"level": level, "sentence": sentence, "fix": "", "reason": "holds"}
    sentence += f" Farthest off is {far['feature']}, by {_mm(far['rms_mm'])}."
    if found.own_mm is not None and worst <= AS_MADE * found.own_mm:
        return {"level": level, "sentence": f"{sentence} It was no better when it was made: {_mm(found.own_mm)}.",
                "fix": "Nothing has moved. Calibrate with a better model or more points.", "reason": "as-made"}
    bound = GOOD_MM if level == "fair" else FAIR_MM
    if found.left_mm is not None and found.left_mm > bound / LENS:
        return {"level": level, "sentence": sentence, "reason": "lens",
                "fix": "More than a knock: the lens has changed, or the lines were laid anew. Calibrate it again."}
    return {"level": level, "sentence": sentence, "reason": "moved",
            "fix": "The camera has moved. Register its pose again, with the lens kept, or calibrate it again."}


def _inconclusive(found: CheckFigures, lines: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    share = f"Only {100 * found.found_share:.0f} % of the lines that should be in the picture were found"
    if found.others_share > ELSEWHERE:
        return {"level": "poor", "reason": "elsewhere",
                "sentence": f"{share} where the calibration has them, but other lines are plain to see: the camera "
                "looks elsewhere, or the picture shows another field.",
                "fix": "Calibrate the camera again; check that the field and the region are the right ones."}
    hidden = [line["feature"] for line in lines if line["found_share"] < SEEN]
    named = f"; not seen: {', '.join(hidden[:4])}" if hidden else ""
    return {"level": None, "reason": "not-seen", "sentence": f"{share}{named}. That is too little to judge by.",
            "fix": "Clear the lines, light them, or take several pictures so that people vanish; then check again. If "
                   "the field is free, the camera was turned far: calibrate it again."}


def _mm(value: float | None) -> str:
    if value is None:
        return "an unknown distance"
    return "0.1 mm" if value < 0.1 else format_mm(value)
