"""Check whether a calibration still holds in a new picture, line by line, in mm. Nothing is fitted or stored."""

from dataclasses import asdict, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.core import opencv
from app.core.errors import Conflict, FitFailed
from app.core.field import Field
from app.core.geometry import ImageSize
from app.core.json_values import number
from app.core.progress import Progress, no_progress
from app.core.records import Calibration
from app.evaluate.cameras.offsets import fit_offset_field
from app.evaluate.cameras.rig_agreement import agreement
from app.evaluate.drift.check_verdict import INCONCLUSIVE, MIN_FOUND, CheckFigures, check_verdict
from app.evaluate.drift.line_check import LineMeasurements, line_deviations, measure_lines
from app.models import CameraModel
from app.models.restored import Restored
from app.workflows.automatic import detect_lines
from app.workflows.automatic_request import median_frame
from app.workflows.calibration import subprogress
from app.workflows.job_pictures import job_pictures

Pixels = NDArray[np.uint8]
MAX_DRAWN = 400
LONG = 0.05  # of the diagonal: a laid line, not a scratch
ON_LINE_PX = 8.0


def check(calibration: Calibration, pixels: Pixels, progress: Progress = no_progress) -> dict[str, Any]:
    """Plain JSON: verdict, a row a marking, mm over carpet and hats, and the points for drawing; (h, w[, 3]) pixels.

    Conflict size-mismatch for a picture of another size.
    """
    size = ImageSize(pixels.shape[1], pixels.shape[0])
    if size != calibration.image_size:
        raise Conflict(f"The picture is {size}, the calibration is for {calibration.image_size}.",
                       "Check with a picture of that size, or calibrate the camera again.", reason="size-mismatch")
    model, field, region = Restored.of(calibration)
    progress(0.0, "Looking for the field's lines")
    gray = opencv.to_grey(pixels)
    seen = measure_lines(model, gray, field, region)
    progress(0.7, "Judging")
    lines = [asdict(line) for line in line_deviations(seen)]
    own_mm = number((calibration.report.get("verdict") or {}).get("mm"))  # none in an imported report
    found = replace(_judged(model, gray, field, seen), own_mm=own_mm)
    verdict = check_verdict(found, lines)
    if verdict["reason"] in INCONCLUSIVE:  # what lies where a line is expected is then something else
        found = replace(found, rms_mm=None, p95_mm=None, rms_px=None, left_mm=None, carpet=None, hat=None)
        lines = [{**line, "mean_mm": None, "rms_mm": None, "worst_mm": None, "rms_px": None} for line in lines]
    return {"calibration": calibration.id, "camera": calibration.camera, "version": calibration.version,
            "model": calibration.model_name, "field": calibration.field["name"], "region": calibration.region,
            "image_size": list(calibration.image_size), "verdict": verdict, "lines": lines,
            **found.to_json(), "points": _drawn(seen)}


def _judged(model: CameraModel, gray: Pixels, field: Field, seen: LineMeasurements) -> CheckFigures:
    of = seen.found
    mm = np.abs(seen.off_mm[of])
    carpet, hat, left = None, None, None
    try:
        evidence = seen.evidence()
        moved = fit_offset_field(evidence)
        rest = evidence.offset_mm - np.sum(moved.at(evidence.places)[0] * evidence.normals, axis=1)
        left = float(np.sqrt(np.mean(rest[moved.good] ** 2))) if moved.good.any() else None
        size = ImageSize(gray.shape[1], gray.shape[0])
        figures = agreement(model, size, model, size, field, evidence, moved)
        carpet, hat = figures["carpet"], figures["hat"]
    except FitFailed:
        pass  # too little was seen for a map; the lines speak for themselves
    expected_px = float(seen.stands_for_px.sum())
    return CheckFigures(
        found_share=seen.share, lines_found=len(set(seen.marking[of].tolist())),
        rms_mm=float(np.sqrt(np.mean(mm**2))) if len(mm) else None,
        p95_mm=float(np.percentile(mm, 95)) if len(mm) else None,
        rms_px=float(np.sqrt(np.mean(seen.off_px[of] ** 2))) if len(mm) else None,
        left_mm=left, carpet=carpet, hat=hat, others_share=_other_lines_px(gray, seen) / max(expected_px, 1e-9))


def _other_lines_px(gray: Pixels, seen: LineMeasurements) -> float:
    """Return the length of long bright lines where none is expected; 0 where most lines were found."""
    if seen.share >= MIN_FOUND:
        return 0.0
    total = 0.0
    for chain in detect_lines(gray).chains:
        if len(chain) < 2 or not (length := float(np.linalg.norm(np.diff(chain, axis=0), axis=1).sum())
                                  ) > LONG * float(np.hypot(*gray.shape)):
            continue
        away = np.array([np.linalg.norm(seen.expected_px - point, axis=1).min(initial=np.inf) for point in chain[::8]])
        total += length * float(np.mean(away > ON_LINE_PX))
    return total


def _drawn(seen: LineMeasurements) -> list[dict[str, Any]]:
    """Where lines were found and where the calibration has them, for drawing; raw px and mm."""
    index = np.flatnonzero(seen.found)
    index = index[np.unique(np.linspace(0, max(len(index) - 1, 0), min(len(index), MAX_DRAWN)).round().astype(int))]
    return [{"feature": seen.names[seen.marking[i]], "expected": seen.expected_px[i].round(2).tolist(),
             "found": seen.raw[i].round(2).tolist(), "off_mm": round(float(seen.off_mm[i]), 2)} for i in index]


def run_check(spec: Any, progress: Progress) -> dict[str, Any]:
    """A job: {"calibration": whole, "snapshot", "pictures": [{"name", "path", "sha256"}, …], untrusted}."""
    with job_pictures(spec["pictures"]) as pictures:
        frame = median_frame(pictures, subprogress(progress, 0.0, 0.4))
    found = check(Calibration.from_json(spec["calibration"]), frame.pixels, subprogress(progress, 0.4, 1.0))
    return {**found, "snapshot": spec["snapshot"]}
