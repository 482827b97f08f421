"""Figures of a check: how far a calibration is off in a new picture, from where the field's lines are in it."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np

from app.core.errors import FitFailed
from app.core.field import Field
from app.core.geometry import ImageSize
from app.evaluate.cameras.offsets import fit_offset_field
from app.evaluate.cameras.rig_agreement import agreement
from app.evaluate.drift.line_check import LineMeasurements
from app.models import CameraModel

MAPPED = 0.85  # of the places: with fewer that follow it, a smooth map is not what the lines show


@dataclass(frozen=True)
class CheckFigures:
    """How far off, mm: of the places (rms, p95), and carried over carpet and hats (p95, max). None where not known.

    left_mm: rms of what is not a motion of the camera, as of a lens that was changed. others_share: length of long
    lines that lie where none is expected, as a share of what is. own_mm: the error in its own report. missing:
    markings that should be in sight, are not covered, and are not there; missing_share: of the expected length;
    missing_inside: of that inside the borders.
    """

    found_share: float
    lines_found: int
    rms_mm: float | None
    p95_mm: float | None
    rms_px: float | None
    left_mm: float | None
    carpet: Mapping[str, Any] | None
    hat: Mapping[str, Any] | None
    missing: tuple[str, ...] = ()
    missing_share: float = 0.0
    missing_inside: float = 0.0
    others_share: float = 0.0
    own_mm: float | None = None

    def to_json(self) -> dict[str, Any]:
        return asdict(self)

    @classmethod
    def of(cls, seen: LineMeasurements, model: CameraModel, size: ImageSize, field: Field) -> Self:
        """Compute them from where the lines are; all but others_share and own_mm."""
        of = seen.found
        mm = np.abs(seen.off_mm[of])
        carpet, hat, left = None, None, None
        try:
            evidence = seen.evidence()
            moved = fit_offset_field(evidence)
            rest = evidence.offset_mm - np.sum(moved.at(evidence.places)[0] * evidence.normals, axis=1)
            left = float(np.sqrt(np.mean(rest[moved.good] ** 2))) if moved.good.any() else None
            if moved.good.mean() > MAPPED:
                figures = agreement(model, size, model, size, field, evidence, moved)
                carpet, hat = figures["carpet"], figures["hat"]
        except FitFailed:
            pass  # too little was seen for a map; the lines speak for themselves
        return cls(
            found_share=seen.share, lines_found=len(set(seen.marking[of].tolist())),
            rms_mm=float(np.sqrt(np.mean(mm**2))) if len(mm) else None,
            p95_mm=float(np.percentile(mm, 95)) if len(mm) else None,
            rms_px=float(np.sqrt(np.mean(seen.off_px[of] ** 2))) if len(mm) else None,
            left_mm=left, carpet=carpet, hat=hat, missing=tuple(np.array(seen.names)[seen.missing].tolist()),
            missing_share=seen.missing_share, missing_inside=seen.missing_inside)
