"""What a calibration's own report keeps two cameras from being called good, however well they agree."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

LEVELS = ("good", "fair", "poor")


class OwnAccuracy(NamedTuple):
    """The best level that a verdict with this camera in it may have, why, and what to do."""

    level: str
    reason: str
    text: str
    fix: str


def own_accuracy(title: str, report: Mapping[str, Any]) -> OwnAccuracy | None:
    """Return what the report of the camera with this title says against it; None for nothing, or an imported report."""
    level = (report.get("verdict") or {}).get("level")
    if level == "poor":
        return OwnAccuracy("poor", "not-accurate", f"{title} was not accurate enough when it was calibrated.",
                           f"Calibrate {title} again with a physical lens model, or with more points.")
    if level == "unknown":
        return OwnAccuracy("fair", "accuracy-unknown", f"The accuracy of {title} inside the field is unknown.",
                           f"Calibrate {title} with a physical lens model, or with points on lines inside the field.")
    return None


def capped_level(level: str, caps: Sequence[str | None]) -> str:
    """Return the worst of them; None caps nothing."""
    return max([level, *(cap for cap in caps if cap is not None)], key=LEVELS.index)
