"""What a calibration said of itself when it was made: its verdict and the largest error of its report."""

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple, Self

from touchline.core.errors import TouchlineError
from touchline.core.json_values import number
from touchline.core.records import Calibration, Observation, Observations, observations_from_json
from touchline.evaluate.report_types import Level
from touchline.evaluate.verdict import LEVELS

OwnLevel = Level | Literal["unknown"]


class Promise(NamedTuple):
    """level: of its own verdict; mm: None in an imported report."""

    level: OwnLevel
    mm: float | None

    @classmethod
    def of(cls, report: Mapping[str, Any]) -> Self:
        verdict = report.get("verdict") or {}
        told = [verdict.get("mm"), *(row.get("rms_mm") for row in report.get("per_feature") or ())]
        level = verdict.get("level")
        return cls(level if level in LEVELS else "unknown",
                   max((mm for mm in map(number, told) if mm is not None), default=None))


def believed_observations(calibration: Calibration) -> Observations:
    """Return its points without those that its report calls outliers; none where they cannot be read."""
    try:
        observations = observations_from_json(calibration.observations)
    except TouchlineError:
        return ()
    return tuple(Observation(o.feature, o.kind, o.points[~out], o.z_mm)
                 for o, out in zip(observations, calibration.outliers(observations), strict=True))
