"""What a calibration's own report keeps two cameras from being called good, however well they agree."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from touchline.core.statements import say
from touchline.evaluate.fit.report_types import Level
from touchline.evaluate.fit.verdict import worst_level


class OwnAccuracy(NamedTuple):
    """The best level that a verdict with this camera in it may have, why, and what to do."""

    level: Level
    reason: str
    text: str
    fix: str


def own_accuracy(title: str, report: Mapping[str, Any]) -> OwnAccuracy | None:
    """Return what the report of the camera with this title says against it; None for nothing, or an imported report."""
    level = (report.get("verdict") or {}).get("level")
    if level == "poor":
        return OwnAccuracy(
            "poor", "not-accurate",
            say("own.poor", "{camera} was not accurate enough when it was calibrated.", camera=title),
            say("own.poor.fix", "Calibrate {camera} again with a physical lens model, or with more points.",
                camera=title))
    if level == "unknown":
        return OwnAccuracy(
            "fair", "accuracy-unknown",
            say("own.unknown", "The accuracy of {camera} inside the field is unknown.", camera=title),
            say("own.unknown.fix", "Calibrate {camera} with a physical lens model, or with points on lines inside the "
                                   "field.", camera=title))
    return None


def capped_level(level: Level, caps: Sequence[Level | None]) -> Level:
    """Return the worst of them; None caps nothing."""
    return worst_level(level, *(cap for cap in caps if cap is not None))
