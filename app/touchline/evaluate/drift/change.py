"""How far the field's lines lie from where a calibration's own points had them: whether anything changed since then."""

from contextlib import suppress

import numpy as np
from typing_extensions import TypedDict

from touchline.core.errors import FitFailed
from touchline.core.field import Field
from touchline.core.geometry import Array, ImageSize
from touchline.evaluate.agreement import agreement
from touchline.evaluate.drift.line_check import MOST, LineMeasurements
from touchline.evaluate.offsets import MIN_MEASURES, OffsetMeasurements, fit_offset_field
from touchline.evaluate.residuals import rms
from touchline.evaluate.verdict import GOOD_MM
from touchline.models import CameraModel

MIN_PLACES, MIN_LINES = 8, 2
MIN_MARKING = 4  # places of a line that tell whether it alone was painted anew
PAINTED = 3.0  # times the bound: so far a single line must lie off to count as one
MOTION_TERMS = 8  # of the smooth motion of a plane's picture
NOISES = 3.0
LINE_PX = 0.2  # σ: two measurements of one line may differ all along it, as beside the edge of a wall
SURE_SIGMAS = 3.0
TINY = 1e-6
BOTH = 2  # directions of the carpet


class Change(TypedDict):
    """mm: how far lines have moved since the points were set, on the carpet; least_mm: less cannot be measured.

    left_mm: rms of what no motion of the camera explains, without the points' own scatter. found_share: of the places.
    """

    mm: float
    least_mm: float
    left_mm: float
    found_share: float


def change_since(seen: LineMeasurements | None, model: CameraModel, size: ImageSize, field: Field) -> Change | None:
    """Return the change that measure_change() found; None where too little of it was found."""
    if seen is None:
        return None
    of = seen.found
    lines = set(seen.marking[of].tolist())
    if seen.share < MOST or of.sum() < MIN_PLACES or len(lines) < MIN_LINES:
        return None
    noise, count = _scatter(seen), int(of.sum())
    evidence = seen.evidence()
    moved = fit_offset_field(evidence)
    smooth = np.sum(moved.at(evidence.places)[0] * evidence.normals, axis=1)
    figures = [0.0 if (stands := _stands(seen, evidence)) else rms(smooth) or 0.0]
    if count >= MIN_MEASURES[-1] and not stands:
        with suppress(FitFailed):  # where no part of the carpet is known, the lines speak for themselves
            figures.append(agreement(model, size, model, size, field, evidence, moved)["carpet"]["p95_mm"])
    for number in lines:
        mm = seen.off_mm[of & (seen.marking == number)]
        if len(mm) >= MIN_MARKING:
            figures.append(abs(float(np.median(mm))) / PAINTED)
    mm = max(figures)
    least_mm = max(mm / max(_chance(seen), TINY), NOISES * noise * float(np.sqrt(MOTION_TERMS / count)))
    return {"mm": mm, "least_mm": least_mm,
            "left_mm": float(np.sqrt(max((rms(evidence.offset_mm - smooth) or 0.0) ** 2 - noise**2, 0.0))),
            "found_share": seen.share}


def _stands(seen: LineMeasurements, evidence: OffsetMeasurements) -> bool:
    """Return whether most places lie where they lay, and fix the camera: then only single lines can lie elsewhere.

    Such a line was painted anew, or was measured at the edge of its paint once and in its middle now.
    """
    still = np.abs(seen.off_px[seen.found]) <= LINE_PX
    if still.mean() <= MOST:
        return False
    resting = OffsetMeasurements.of_lines(evidence.places[still], evidence.normals[still], np.zeros(int(still.sum())),
                                          evidence.offset_mm[still])
    _, directions = fit_offset_field(resting).known_mm(evidence.places)
    return float(np.mean(directions == BOTH)) > MOST


def _chance(seen: LineMeasurements) -> float:
    """Return how far lines lie off in the picture, as a share of what the lines' own errors may add up to by chance."""
    of_line = [np.abs(seen.off_px[seen.found & (seen.marking == number)]) for number in range(len(seen.names))]
    lines = [float(np.median(px)) for px in of_line if len(px)]
    sum_of_squares = float(np.sum((np.array(lines) / LINE_PX) ** 2))
    return float(np.sqrt(sum_of_squares / (len(lines) + SURE_SIGMAS * np.sqrt(2 * len(lines)))))


def _scatter(seen: LineMeasurements) -> float:
    """Return σ of one point, mm, from how neighbours on a line differ."""
    steps: list[Array] = [np.empty(0)]
    for number in range(len(seen.names)):
        steps.append(np.diff(seen.off_mm[seen.found & (seen.marking == number)]))
    every = np.concatenate(steps)
    return 1.4826 * float(np.median(np.abs(every))) / float(np.sqrt(2)) if len(every) else GOOD_MM
