"""Figures of a check: how far the field's lines lie in a picture from where a calibration has them.

They stand beside what the calibration said of itself when it was made, and beside how far the lines have moved since
then, by its own points.
"""

from collections.abc import Mapping
from contextlib import suppress
from typing import Any, Literal, NamedTuple, Self

import numpy as np
from typing_extensions import TypedDict

from touchline.core.errors import FitFailed, TouchlineError
from touchline.core.field import Field
from touchline.core.geometry import Array, ImageSize
from touchline.core.json_values import number
from touchline.core.records import Calibration, Observation, Observations, observations_from_json
from touchline.evaluate.agreement import PlaneDifference, agreement
from touchline.evaluate.field_lines.measurement import MIN_SHARE, LineMeasurements
from touchline.evaluate.offsets import MIN_MEASURES, OffsetMeasurements, fit_offset_field
from touchline.evaluate.report_types import Level
from touchline.evaluate.residuals import rms
from touchline.evaluate.verdict import GOOD_MM, LEVELS
from touchline.models import CameraModel

# of the places: with fewer that follow it, a smooth map is not what the lines show
MIN_MAPPED_SHARE = 0.85

# Whether lines have moved since the points were set.
MIN_PLACES, MIN_LINES = 8, 2
MIN_MARKING_PLACES = 4  # of a line, that tell whether it alone was painted anew
REPAINTED_FACTOR = 3.0  # times the bound: so far a single line must lie off to count as one
MOTION_TERMS = 8  # of the smooth motion of a plane's picture
MIN_NOISE_FACTOR = 3.0  # times the points' scatter: what is less cannot be measured
# two measurements of one line may differ all along it, as beside the edge of a wall
LINE_SIGMA_PX = 0.2
MIN_SIGMAS = 3.0
MIN_CHANCE = 1e-6
BOTH_DIRECTIONS = 2  # of the carpet
SIGMA_PER_MEDIAN = 1.4826  # of the size of a normal error

OwnLevel = Level | Literal["unknown"]


class Promise(NamedTuple):
    """What a calibration said of itself: the level of its own verdict, and its largest error, None if imported."""

    level: OwnLevel
    mm: float | None

    @classmethod
    def of(cls, report: Mapping[str, Any]) -> Self:
        """Read a calibration's report; one of another program may have none of it."""
        verdict = report.get("verdict") or {}
        errors_mm = [
            verdict.get("mm"),
            *(row.get("rms_mm") for row in report.get("per_feature") or ()),
        ]
        level = verdict.get("level")
        return cls(
            level if level in LEVELS else "unknown",
            max((mm for mm in map(number, errors_mm) if mm is not None), default=None),
        )


def observations_without_outliers(calibration: Calibration) -> Observations:
    """Return its points without those that its report calls outliers; none where they cannot be read."""
    try:
        observations = observations_from_json(calibration.observations)
    except TouchlineError:
        return ()
    return tuple(
        Observation(o.feature, o.kind, o.points[~is_outlier], o.z_mm)
        for o, is_outlier in zip(observations, calibration.outliers(observations), strict=True)
    )


class Change(TypedDict):
    """mm: how far lines have moved since the points were set, on the carpet; least_mm: less cannot be measured.

    left_mm: rms of what no motion of the camera explains, without the points' own scatter. found_share: of the places.
    """

    mm: float
    least_mm: float
    left_mm: float
    found_share: float


class CheckFigures(TypedDict):
    """How far off, mm: of the places (rms, p95), and carried over carpet and hats (p95, max). None where not known.

    left_mm: rms of what is not a motion of the camera, as of a lens that was changed. others_share: length of long
    lines that lie where none is expected, as a share of what is. own_mm, own_level: the error and the verdict in its
    own report. change: since then, None where its points do not tell. missing: markings that should be in sight, are
    not covered, and are not there; missing_share: of the expected length; missing_inside: of that inside the borders.
    """

    found_share: float
    lines_found: int
    rms_mm: float | None
    p95_mm: float | None
    rms_px: float | None
    left_mm: float | None
    carpet: PlaneDifference | None
    hat: PlaneDifference | None
    missing: list[str]
    missing_share: float
    missing_inside: float
    others_share: float
    own_mm: float | None
    own_level: OwnLevel
    change: Change | None


def check_figures(
    seen: LineMeasurements,
    model: CameraModel,
    size: ImageSize,
    field: Field,
    promise: Promise,
    change: Change | None,
    others_share: float = 0.0,
) -> CheckFigures:
    """Compute the figures from where the lines are."""
    of = seen.found
    mm = np.abs(seen.off_mm[of])
    carpet, hat, left_mm = None, None, None
    with suppress(FitFailed):  # too little was seen for a map; the lines speak for themselves
        evidence = seen.evidence()
        moved = fit_offset_field(evidence)
        rest_mm = evidence.offset_mm - np.sum(
            moved.at(evidence.places)[0] * evidence.normals, axis=1
        )
        left_mm = rms(rest_mm[moved.good])
        if moved.good.mean() > MIN_MAPPED_SHARE:
            figures = agreement(model, size, model, size, field, evidence, moved)
            carpet, hat = figures["carpet"], figures["hat"]
    return {
        "found_share": seen.share,
        "lines_found": len(set(seen.marking[of].tolist())),
        "rms_mm": rms(mm),
        "p95_mm": float(np.percentile(mm, 95)) if len(mm) else None,
        "rms_px": rms(seen.off_px[of]),
        "left_mm": left_mm,
        "carpet": carpet,
        "hat": hat,
        "missing": np.array(seen.names)[seen.missing].tolist(),
        "missing_share": seen.missing_share,
        "missing_inside": seen.missing_inside,
        "others_share": others_share,
        "own_mm": promise.mm,
        "own_level": promise.level,
        "change": change,
    }


def change_since(
    seen: LineMeasurements | None, model: CameraModel, size: ImageSize, field: Field
) -> Change | None:
    """Return the change that measure_change() found; None where too little of it was found."""
    if seen is None:
        return None
    of = seen.found
    lines = set(seen.marking[of].tolist())
    if seen.share < MIN_SHARE or of.sum() < MIN_PLACES or len(lines) < MIN_LINES:
        return None
    scatter_mm, count = _point_scatter_mm(seen), int(of.sum())
    evidence = seen.evidence()
    moved = fit_offset_field(evidence)
    smooth_mm = np.sum(moved.at(evidence.places)[0] * evidence.normals, axis=1)
    # The largest of what the whole picture, the carpet between the lines, and single lines show.
    is_still = _is_still(seen, evidence)
    changes_mm = [0.0 if is_still else rms(smooth_mm) or 0.0]
    if count >= MIN_MEASURES[-1] and not is_still:
        # where no part of the carpet is known, the lines speak for themselves
        with suppress(FitFailed):
            changes_mm.append(
                agreement(model, size, model, size, field, evidence, moved)["carpet"]["p95_mm"]
            )
    for line in lines:
        mm = seen.off_mm[of & (seen.marking == line)]
        if len(mm) >= MIN_MARKING_PLACES:
            changes_mm.append(abs(float(np.median(mm))) / REPAINTED_FACTOR)
    mm = max(changes_mm)
    # Neither what the lines' own errors explain nor what the points' scatter leaves of a motion is a change.
    by_lines_mm = mm / max(_ratio_to_line_errors(seen), MIN_CHANCE)
    by_scatter_mm = MIN_NOISE_FACTOR * scatter_mm * float(np.sqrt(MOTION_TERMS / count))
    left_squared = (rms(evidence.offset_mm - smooth_mm) or 0.0) ** 2 - scatter_mm**2
    return {
        "mm": mm,
        "least_mm": max(by_lines_mm, by_scatter_mm),
        "left_mm": float(np.sqrt(max(left_squared, 0.0))),
        "found_share": seen.share,
    }


def _is_still(seen: LineMeasurements, evidence: OffsetMeasurements) -> bool:
    """Return whether most places lie where they lay, and fix the camera: then only single lines can lie elsewhere.

    Such a line was painted anew, or was measured at the edge of its paint once and in its middle now.
    """
    still = np.abs(seen.off_px[seen.found]) <= LINE_SIGMA_PX
    if still.mean() <= MIN_SHARE:
        return False
    resting = OffsetMeasurements.of_lines(
        evidence.places[still],
        evidence.normals[still],
        np.zeros(int(still.sum())),
        evidence.offset_mm[still],
    )
    _, directions = fit_offset_field(resting).known_mm(evidence.places)
    return float(np.mean(directions == BOTH_DIRECTIONS)) > MIN_SHARE


def _ratio_to_line_errors(seen: LineMeasurements) -> float:
    """Return how far lines lie off in the picture, as a share of what the lines' own errors may add up to by chance."""
    of_line = [
        np.abs(seen.off_px[seen.found & (seen.marking == line)]) for line in range(len(seen.names))
    ]
    medians_px = [float(np.median(px)) for px in of_line if len(px)]
    sum_of_squares = float(np.sum((np.array(medians_px) / LINE_SIGMA_PX) ** 2))
    # A sum of n squared normal errors, in σ, has the mean n and the variance 2 n.
    count = len(medians_px)
    return float(np.sqrt(sum_of_squares / (count + MIN_SIGMAS * np.sqrt(2 * count))))


def _point_scatter_mm(seen: LineMeasurements) -> float:
    """Return σ of one point, mm, from how neighbours on a line differ."""
    steps: list[Array] = [np.empty(0)]
    for line in range(len(seen.names)):
        steps.append(np.diff(seen.off_mm[seen.found & (seen.marking == line)]))
    differences = np.concatenate(steps)
    if not len(differences):
        return GOOD_MM
    return SIGMA_PER_MEDIAN * float(np.median(np.abs(differences))) / float(np.sqrt(2))
