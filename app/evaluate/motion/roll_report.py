"""What rolls say, as plain JSON and in words: raw, and as far as a calibration leaves it.

    report = roll_report(rolls, size)                  Eq. (9) per roll, per zone, along the picture's edge
    report = roll_report(rolls, size, model, name)     the same of the picture that the model corrects
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from app.core.geometry import ImageSize, Points
from app.evaluate.fit.distortion import STANDARD_LENS_PCT
from app.evaluate.motion.rolls import Roll, Rolls, rolls_of
from app.models import CameraModel

SIGMAS = 2  # a bow of fewer is none that is seen


@dataclass(frozen=True, eq=False)
class Rolled:
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


def roll_report(rolls: Sequence[Rolled], size: ImageSize, model: CameraModel | None = None,
                name: str | None = None) -> dict[str, Any]:
    """Everything that these rolls say; `corrected` where a model was given, called by that name."""
    seconds = [roll.seconds for roll in rolls]
    raw = rolls_of([roll.points for roll in rolls], seconds, size)
    corrected = None
    if model is not None:
        corrected = rolls_of([model.corrected_from_raw(roll.points) for roll in rolls], seconds, model.corrected_size)
    told = {"raw": _told(raw, "the raw picture"), "corrected": corrected and _told(corrected, "the corrected picture")}
    return {"image_size": [size.width, size.height], "rolls": len(rolls), **told, "model": name,
            "sentence": (told["corrected"] or told["raw"])["sentence"]}


def sentence(told: Rolls, where: str) -> str:
    """What all rolls together say of a picture."""
    if not told.rolls:
        return ("Nothing rolled straight for long enough: let a ball roll across the field, best near its borders and "
                "quickly.")
    count = "One roll" if len(told.rolls) == 1 else f"{len(told.rolls)} rolls"
    left = f"{told.border_pct:+.2f} ± {told.border_sigma_pct:.2f} %".replace("-", "−")
    if not told.is_free:
        return (f"{count} in {where} go curves of their own: what moves here is driven or pushed. Let one ball roll "
                "freely, and nobody else move.")
    if told.border_sigma_pct > STANDARD_LENS_PCT:
        return (f"{count} in {where}: {left}. That is too uncertain to say anything: roll more, quickly, near the "
                "borders.")
    if abs(told.border_pct) <= SIGMAS * told.border_sigma_pct:
        return f"{count} in {where}: no distortion is seen, {left} along its edge."
    return (f"{count} in {where}: {_kind(told.border_pct)} of {left} along its edge, {_band(told.border_pct)} the "
            f"±{STANDARD_LENS_PCT:g} % of a standard lens.")


def roll_verdict(roll: Roll) -> tuple[str, str]:
    """One roll by itself: good, fair or poor (of the picture, not of the roll), and why, in words."""
    if not roll.used:
        return "left-out", "It disagrees with the others and is not counted: pushed, spun or not free."
    if roll.spread_pct > STANDARD_LENS_PCT:
        return "unknown", "Too short, or too slow, to say anything."
    if abs(roll.bow_pct) <= SIGMAS * roll.spread_pct:
        return "good", "Straight, as far as it can tell."
    if abs(roll.bow_pct) <= STANDARD_LENS_PCT:
        return "fair", f"A {_kind(roll.bow_pct)}, within the ±{STANDARD_LENS_PCT:g} % of a standard lens."
    return "poor", f"A {_kind(roll.bow_pct)}, beyond the ±{STANDARD_LENS_PCT:g} % of a standard lens."


def _told(rolls: Rolls, where: str) -> dict[str, Any]:
    """With a sentence, each roll's verdict, and its number among those that were given."""
    told = {**rolls.to_json(), "sentence": sentence(rolls, where)}
    for one, roll in zip(told["rolls"], rolls.rolls, strict=True):
        level, words = roll_verdict(roll)
        one |= {"number": roll.number, "level": level, "words": words}
    return told


def _kind(pct: float) -> str:
    return "barrel" if pct < 0 else "pincushion"


def _band(pct: float) -> str:
    return "within" if abs(pct) <= STANDARD_LENS_PCT else "beyond"
