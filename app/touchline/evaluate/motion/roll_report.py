"""The report on rolls, as plain JSON and in words: raw, and as far as a calibration leaves it.

    report = roll_report(rolls, size)                  Eq. (9) per roll, per zone, along the picture's edge
    report = roll_report(rolls, size, model, name)     the same of the picture that the model corrects
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from touchline.core.geometry import ImageSize, Points
from touchline.core.statements import Sentence, say, stated
from touchline.evaluate.fit.distortion import STANDARD_LENS_PCT
from touchline.evaluate.motion.rolls import Roll, RollAnalysis, analyse_rolls
from touchline.models import CameraModel

SIGMAS = 2  # a bow of fewer is none that is seen


@dataclass(frozen=True, eq=False)
class RecordedRoll:
    """One straight roll. points (n, 2) raw px, in order; from_s: when it began; rms_px about its arc, straight_px
    about a straight line."""

    points: Points
    from_s: float
    to_s: float
    rms_px: float
    straight_px: float

    @property
    def seconds(self) -> float:
        return self.to_s - self.from_s

    def to_json(self) -> dict[str, Any]:
        return {"from_s": self.from_s, "to_s": self.to_s, "points": self.points.round(2).tolist(),
                "rms_px": self.rms_px, "straight_px": self.straight_px}


def roll_report(rolls: Sequence[RecordedRoll], size: ImageSize, model: CameraModel | None = None,
                name: str | None = None) -> dict[str, Any]:
    """Report on rolls; `corrected` where a model was given, called by that name."""
    seconds = [roll.seconds for roll in rolls]
    raw = _roll_json(analyse_rolls([roll.points for roll in rolls], seconds, size), RAW)
    corrected = None
    if model is not None:
        corrected = _roll_json(analyse_rolls([model.corrected_from_raw(roll.points) for roll in rolls], seconds,
                                             model.corrected_size), CORRECTED)
    return stated({"image_size": [size.width, size.height], "rolls": len(rolls), "raw": raw, "corrected": corrected,
                   "model": name, "sentence": (corrected or raw)["sentence"]})


RAW = say("rolls.raw", "the raw image")
CORRECTED = say("rolls.corrected", "the corrected image")


def sentence(report: RollAnalysis, where: Sentence) -> Sentence:
    """Describe in a sentence what all rolls together show."""
    if not report.rolls:
        return say("rolls.none", "No straight roll was long enough. Roll a ball quickly across the field, preferably "
                                 "near its borders.")
    count = (say("rolls.one", "One roll") if len(report.rolls) == 1
             else say("rolls.several", "{n} rolls", n=len(report.rolls)))
    pct = f"{report.border_pct:+.2f} ± {report.border_sigma_pct:.2f} %".replace("-", "−")
    if not report.is_free:
        return say("rolls.not-free", "{rolls} in {image} followed irregular curves: the object was driven or pushed. "
                   "Roll a single ball freely, with no other movement on the field.", rolls=count, image=where)
    if report.border_sigma_pct > STANDARD_LENS_PCT:
        return say("rolls.inconclusive", "{rolls} in {image}: {pct}. This is inconclusive. Roll more balls, quickly "
                   "and near the borders.", rolls=count, image=where, pct=pct)
    if abs(report.border_pct) <= SIGMAS * report.border_sigma_pct:
        return say("rolls.straight", "{rolls} in {image}: no significant distortion, {pct} along the edge.",
                   rolls=count, image=where, pct=pct)
    values = {"rolls": count, "image": where, "kind": _kind(report.border_pct), "pct": pct,
              "typical_pct": STANDARD_LENS_PCT}
    if abs(report.border_pct) <= STANDARD_LENS_PCT:
        return say("rolls.within", "{rolls} in {image}: {kind} of {pct} along the edge, within the ±{typical_pct:g} % "
                   "of a typical lens.", **values)
    return say("rolls.above", "{rolls} in {image}: {kind} of {pct} along the edge, above the ±{typical_pct:g} % of a "
               "typical lens.", **values)


def roll_verdict(roll: Roll) -> tuple[str, Sentence]:
    """One roll by itself: good, fair or poor (of the picture, not of the roll), and why, in words."""
    if not roll.used:
        return "left-out", say("roll.left-out", "Excluded: it does not agree with the other rolls (pushed, spinning or "
                                                "not free).")
    if roll.spread_pct > STANDARD_LENS_PCT:
        return "unknown", say("roll.inconclusive", "Too short or too slow to be conclusive.")
    if abs(roll.sag_pct) <= SIGMAS * roll.spread_pct:
        return "good", say("roll.straight", "Straight within the uncertainty.")
    values = {"kind": _kind(roll.sag_pct), "typical_pct": STANDARD_LENS_PCT}
    if abs(roll.sag_pct) <= STANDARD_LENS_PCT:
        return "fair", say("roll.within", "A {kind}, within the ±{typical_pct:g} % of a typical lens.", **values)
    return "poor", say("roll.above", "A {kind}, above the ±{typical_pct:g} % of a typical lens.", **values)


def _roll_json(rolls: RollAnalysis, where: Sentence) -> dict[str, Any]:
    """With a sentence, each roll's verdict, and its number among those that were given."""
    report = stated({**rolls.to_json(), "sentence": sentence(rolls, where)})
    for one, roll in zip(report["rolls"], rolls.rolls, strict=True):
        level, words = roll_verdict(roll)
        one |= stated({"number": roll.number, "level": level, "words": words})
    return report


def _kind(pct: float) -> Sentence:
    return say("kind.barrel", "barrel") if pct < 0 else say("kind.pincushion", "pincushion")
