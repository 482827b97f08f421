"""Figures of a check: how far a calibration is off in a new picture, from where the field's lines are in it."""

import numpy as np
from typing_extensions import TypedDict

from touchline.core.errors import FitFailed
from touchline.core.field import Field
from touchline.core.geometry import ImageSize
from touchline.evaluate.agreement import PlaneDifference, agreement
from touchline.evaluate.drift.change import Change
from touchline.evaluate.drift.line_check import LineMeasurements
from touchline.evaluate.drift.promise import OwnLevel, Promise
from touchline.evaluate.offsets import fit_offset_field
from touchline.evaluate.residuals import rms
from touchline.models import CameraModel

MAPPED = 0.85  # of the places: with fewer that follow it, a smooth map is not what the lines show


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


def check_figures(seen: LineMeasurements, model: CameraModel, size: ImageSize, field: Field, promise: Promise,
                  change: Change | None, others_share: float = 0.0) -> CheckFigures:
    """Compute them from where the lines are."""
    of = seen.found
    mm = np.abs(seen.off_mm[of])
    carpet, hat, left = None, None, None
    try:
        evidence = seen.evidence()
        moved = fit_offset_field(evidence)
        rest = evidence.offset_mm - np.sum(moved.at(evidence.places)[0] * evidence.normals, axis=1)
        left = rms(rest[moved.good])
        if moved.good.mean() > MAPPED:
            figures = agreement(model, size, model, size, field, evidence, moved)
            carpet, hat = figures["carpet"], figures["hat"]
    except FitFailed:
        pass  # too little was seen for a map; the lines speak for themselves
    return {"found_share": seen.share, "lines_found": len(set(seen.marking[of].tolist())),
            "rms_mm": rms(mm), "p95_mm": float(np.percentile(mm, 95)) if len(mm) else None,
            "rms_px": rms(seen.off_px[of]), "left_mm": left, "carpet": carpet, "hat": hat,
            "missing": np.array(seen.names)[seen.missing].tolist(), "missing_share": seen.missing_share,
            "missing_inside": seen.missing_inside, "others_share": others_share,
            "own_mm": promise.mm, "own_level": promise.level, "change": change}
