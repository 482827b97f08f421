"""The report on rolls, as plain JSON and in words: raw, and as far as a calibration leaves it.

    report = roll_report(rolls, size)                  Eq. (9) per roll, per zone, along the picture's edge
    report = roll_report(rolls, size, model, name)     the same of the picture that the model corrects
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from app.core.geometry import ImageSize, Points
from app.evaluate.fit.distortion import STANDARD_LENS_PCT
from app.evaluate.motion.rolls import Roll, RollAnalysis, analyse_rolls
from app.models import CameraModel

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
    raw = analyse_rolls([roll.points for roll in rolls], seconds, size)
    corrected = None
    if model is not None:
        corrected = analyse_rolls([model.corrected_from_raw(roll.points) for roll in rolls], seconds,
                                  model.corrected_size)
    report = {"raw": _roll_json(raw, "the raw image"),
              "corrected": corrected and _roll_json(corrected, "the corrected image")}
    return {"image_size": [size.width, size.height], "rolls": len(rolls), **report, "model": name,
            "sentence": (report["corrected"] or report["raw"])["sentence"]}


def sentence(report: RollAnalysis, where: str) -> str:
    """Describe in a sentence what all rolls together show."""
    if not report.rolls:
        return ("No straight roll was long enough. Roll a ball quickly across the field, preferably near its borders.")
    count = "One roll" if len(report.rolls) == 1 else f"{len(report.rolls)} rolls"
    left = f"{report.border_pct:+.2f} ± {report.border_sigma_pct:.2f} %".replace("-", "−")
    if not report.is_free:
        return (f"{count} in {where} followed irregular curves: the object was driven or pushed. Roll a single ball "
                "freely, with no other movement on the field.")
    if report.border_sigma_pct > STANDARD_LENS_PCT:
        return (f"{count} in {where}: {left}. This is inconclusive. Roll more balls, quickly and near the borders.")
    if abs(report.border_pct) <= SIGMAS * report.border_sigma_pct:
        return f"{count} in {where}: no significant distortion, {left} along the edge."
    band = "within" if abs(report.border_pct) <= STANDARD_LENS_PCT else "above"
    return (f"{count} in {where}: {_kind(report.border_pct)} of {left} along the edge, {band} the "
            f"±{STANDARD_LENS_PCT:g} % of a typical lens.")


def roll_verdict(roll: Roll) -> tuple[str, str]:
    """One roll by itself: good, fair or poor (of the picture, not of the roll), and why, in words."""
    if not roll.used:
        return "left-out", "Excluded: it does not agree with the other rolls (pushed, spinning or not free)."
    if roll.spread_pct > STANDARD_LENS_PCT:
        return "unknown", "Too short or too slow to be conclusive."
    if abs(roll.sag_pct) <= SIGMAS * roll.spread_pct:
        return "good", "Straight within the uncertainty."
    if abs(roll.sag_pct) <= STANDARD_LENS_PCT:
        return "fair", f"A {_kind(roll.sag_pct)}, within the ±{STANDARD_LENS_PCT:g} % of a typical lens."
    return "poor", f"A {_kind(roll.sag_pct)}, above the ±{STANDARD_LENS_PCT:g} % of a typical lens."


def _roll_json(rolls: RollAnalysis, where: str) -> dict[str, Any]:
    """With a sentence, each roll's verdict, and its number among those that were given."""
    report = {**rolls.to_json(), "sentence": sentence(rolls, where)}
    for one, roll in zip(report["rolls"], rolls.rolls, strict=True):
        level, words = roll_verdict(roll)
        one |= {"number": roll.number, "level": level, "words": words}
    return report


def _kind(pct: float) -> str:
    return "barrel" if pct < 0 else "pincushion"
