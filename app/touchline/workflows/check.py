"""Check whether a calibration still holds in a new picture, line by line, in mm. Nothing is fitted or stored."""

from contextlib import suppress
from functools import partial
from typing import Any

import numpy as np
from typing_extensions import TypedDict

from touchline.core.errors import Conflict, TouchlineError
from touchline.core.geometry import ImageSize, Pixels
from touchline.core.jobs import Progress, no_progress, subprogress
from touchline.core.json_values import PointJson
from touchline.core.records import Calibration
from touchline.core.sentences import CALIBRATE_AGAIN_FOR_SIZE, DETECTING_FIELD_LINES, other_image_size
from touchline.core.statements import stated
from touchline.evaluate.drift.check_figures import CheckFigures
from touchline.evaluate.drift.check_verdict import CheckVerdict, is_conclusive
from touchline.evaluate.drift.checked import checked
from touchline.evaluate.drift.line_check import LineDeviation, LineMeasurements
from touchline.evaluate.drift.orientation import FIX, SAID, UNKNOWN, Orientation, OrientationReference, State
from touchline.evaluate.verification import MIN_FOUND
from touchline.models import Restored
from touchline.vision.ridges import painted_lines, with_bright_lines
from touchline.workflows.job_pictures import job_pictures, median_frame

MAX_DRAWN = 400
LONG = 0.05  # of the diagonal: a laid line, not a scratch
ON_LINE_PX = 8.0


class CheckedPlace(TypedDict):
    """expected: where the calibration has it, found: where it is, raw px; off_mm: across the marking, on the carpet."""

    feature: str
    expected: PointJson
    found: PointJson
    off_mm: float


class Check(CheckFigures):
    calibration: str
    version: int | None
    camera: str | None
    model: str
    field: str
    region: str
    image_size: list[int]
    verdict: CheckVerdict
    lines: list[LineDeviation]
    points: list[CheckedPlace]  # some of them, for drawing
    orientation: State  # against the picture that the calibration came from


class CalibrationCheck(Check):
    """How far the field's lines are in a picture from where the calibration has them.

    Shares are of the length of the lines that should be visible. missing: markings that should be visible, are not
    covered, and were not detected; others_share: of other long lines; left_mm: rms that no camera movement explains;
    own_mm, own_level: the largest error and the verdict of the
    calibration's own report when it was made; change: how far lines lie from where its points had them then.
    """

    snapshot: str


def check(calibration: Calibration, pixels: Pixels, progress: Progress = no_progress, before: Pixels | None = None,
          ) -> Check:
    """(h, w[, 3]) pixels; Conflict size-mismatch for a picture of another size.

    before: the picture that the calibration came from, where it is stored.
    """
    size = ImageSize(pixels.shape[1], pixels.shape[0])
    if size != calibration.image_size:
        raise Conflict(other_image_size(size, calibration.image_size), CALIBRATE_AGAIN_FOR_SIZE, reason="size-mismatch")
    progress(0.0, DETECTING_FIELD_LINES)
    gray = with_bright_lines(pixels)
    seen, lines, found, verdict = checked(calibration, gray, partial(_others_share, gray))
    seen_as = _orientation(calibration, before, pixels)
    if seen_as.way is not None:
        verdict = stated(CheckVerdict(level="poor", lines_level=verdict["lines_level"], reason=seen_as.way,
                                      sentence=SAID[seen_as.way], fix=FIX))
    if not is_conclusive(found):  # what lies where a line is expected is then something else
        found = {**found, "rms_mm": None, "p95_mm": None, "rms_px": None, "left_mm": None, "carpet": None, "hat": None}
        lines = [{**line, "mean_mm": None, "rms_mm": None, "worst_mm": None, "rms_px": None} for line in lines]
    return {"calibration": calibration.id, "camera": calibration.camera, "version": calibration.version,
            "model": calibration.model_name, "field": calibration.field["name"], "region": calibration.region,
            "image_size": list(calibration.image_size), "verdict": verdict, "lines": lines, **found,
            "points": _drawn(seen), "orientation": seen_as.state}


def _orientation(calibration: Calibration, before: Pixels | None, now: Pixels) -> Orientation:
    if before is None or before.shape[:2] != now.shape[:2]:
        return UNKNOWN
    model, _, region = Restored.of(calibration)
    return OrientationReference.of(before, model, region).compare(now, model)


def _others_share(gray: Pixels, seen: LineMeasurements) -> float:
    """Return the length of long bright lines where none is expected, as a share of what is; 0 where most was found."""
    if seen.share >= MIN_FOUND:
        return 0.0
    total = 0.0
    for chain in painted_lines(gray).chains:
        if len(chain) < 2 or not (length := float(np.linalg.norm(np.diff(chain, axis=0), axis=1).sum())
                                  ) > LONG * float(np.hypot(*gray.shape)):
            continue
        away = np.array([np.linalg.norm(seen.expected_px - point, axis=1).min(initial=np.inf) for point in chain[::8]])
        total += length * float(np.mean(away > ON_LINE_PX))
    return total / max(float(seen.stands_for_px.sum()), 1e-9)


def _drawn(seen: LineMeasurements) -> list[CheckedPlace]:
    index = np.flatnonzero(seen.found)
    index = index[np.unique(np.linspace(0, max(len(index) - 1, 0), min(len(index), MAX_DRAWN)).round().astype(int))]
    return [{"feature": seen.names[seen.marking[i]], "expected": seen.expected_px[i].round(2).tolist(),
             "found": seen.raw[i].round(2).tolist(), "off_mm": round(float(seen.off_mm[i]), 2)} for i in index]


def run_check(spec: Any, progress: Progress) -> CalibrationCheck:
    """A job: {"calibration": whole, "snapshot", "pictures": [{"name", "path", "sha256"}, …], untrusted, "before": the
    calibration's own or null}."""
    with job_pictures(spec["pictures"]) as pictures:
        frame = median_frame(pictures, subprogress(progress, 0.0, 0.4))
    before = None
    if spec.get("before") is not None:
        # Gone or damaged, it tells nothing.
        with suppress(TouchlineError), job_pictures([spec["before"]]) as pictures:
            before = pictures[0][1]().pixels
    found = check(Calibration.from_json(spec["calibration"]), frame.pixels, subprogress(progress, 0.4, 1.0), before)
    return {**found, "snapshot": spec["snapshot"]}
