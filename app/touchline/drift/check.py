"""Check whether a calibration still holds in a new picture, line by line, in mm. Nothing is fitted or stored."""

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from typing_extensions import TypedDict

from touchline.core.errors import Conflict, TouchlineError
from touchline.core.geometry import ImageSize, Pixels
from touchline.core.jobs import Progress, no_progress, subprogress
from touchline.core.json_values import PointJson
from touchline.core.records import Calibration
from touchline.core.sentences import (
    CALIBRATE_AGAIN_FOR_SIZE,
    DETECTING_FIELD_LINES,
    other_image_size,
)
from touchline.core.statements import stated
from touchline.drift.figures import (
    CheckFigures,
    Promise,
    change_since,
    check_figures,
    observations_without_outliers,
)
from touchline.drift.verdict import CheckVerdict, check_verdict, is_conclusive
from touchline.evaluate.field_lines.measurement import (
    LineDeviation,
    LineMeasurements,
    line_deviations,
    measure_change,
    measure_lines,
)
from touchline.evaluate.field_lines.orientation import (
    FIX,
    SENTENCES,
    UNKNOWN,
    Orientation,
    OrientationReference,
    State,
)
from touchline.evaluate.verification import MIN_FOUND
from touchline.models import Restored
from touchline.vision.ridges import painted_lines, with_bright_lines
from touchline.workflows.job_pictures import job_pictures, median_frame

MAX_DRAWN = 400
MIN_OTHER_LENGTH = 0.05  # of the diagonal: a laid line, not a scratch
MAX_ON_LINE_PX = 8.0
CHAIN_STEP = 8  # points of a chain, of which one is compared


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


def check(
    calibration: Calibration,
    pixels: Pixels,
    progress: Progress = no_progress,
    before: Pixels | None = None,
) -> Check:
    """Check the calibration in a picture (h, w[, 3]); Conflict size-mismatch for one of another size.

    before: the picture that the calibration came from, where it is stored.
    """
    size = ImageSize(pixels.shape[1], pixels.shape[0])
    if size != calibration.image_size:
        raise Conflict(
            other_image_size(size, calibration.image_size),
            CALIBRATE_AGAIN_FOR_SIZE,
            reason="size-mismatch",
        )
    progress(0.0, DETECTING_FIELD_LINES)
    gray = with_bright_lines(pixels)
    seen, lines, figures, verdict = _compare(calibration, gray, partial(_others_share, gray))
    orientation = _orientation(calibration, before, pixels)
    if (way := orientation.way) is not None:
        verdict = stated(
            CheckVerdict(
                level="poor",
                lines_level=verdict["lines_level"],
                reason=way,
                sentence=SENTENCES[way],
                fix=FIX,
            )
        )
    if not is_conclusive(figures):  # what lies where a line is expected is then something else
        figures = {
            **figures,
            "rms_mm": None,
            "p95_mm": None,
            "rms_px": None,
            "left_mm": None,
            "carpet": None,
            "hat": None,
        }
        lines = [
            {**line, "mean_mm": None, "rms_mm": None, "worst_mm": None, "rms_px": None}
            for line in lines
        ]
    return {
        "calibration": calibration.id,
        "camera": calibration.camera,
        "version": calibration.version,
        "model": calibration.model_name,
        "field": calibration.field["name"],
        "region": calibration.region,
        "image_size": list(calibration.image_size),
        "verdict": verdict,
        "lines": lines,
        **figures,
        "points": _drawn_places(seen),
        "orientation": orientation.state,
    }


def verdict_in(picture: Pixels, calibration: Calibration) -> CheckVerdict:
    """Return the verdict of a check in a picture (h, w[, 3]) of the calibration's size."""
    return _compare(calibration, with_bright_lines(picture)).verdict


class _Compared(NamedTuple):
    """seen: where the model's lines are."""

    seen: LineMeasurements
    lines: list[LineDeviation]
    figures: CheckFigures
    verdict: CheckVerdict


def _compare(
    calibration: Calibration,
    gray: Pixels,
    others_share: Callable[[LineMeasurements], float] | None = None,
) -> _Compared:
    """Compare a calibration with a picture (h, w) of its size. others_share: see _others_share()."""
    model, field, region = Restored.of(calibration)
    size = ImageSize(gray.shape[1], gray.shape[0])
    seen = measure_lines(model, gray, field, region)
    since = measure_change(model, gray, field, region, observations_without_outliers(calibration))
    figures = check_figures(
        seen,
        model,
        size,
        field,
        Promise.of(calibration.report),
        change_since(since, model, size, field),
        others_share(seen) if others_share else 0.0,
    )
    lines = line_deviations(seen)
    return _Compared(seen, lines, figures, check_verdict(figures, lines))


def _orientation(calibration: Calibration, before: Pixels | None, now: Pixels) -> Orientation:
    if before is None or before.shape[:2] != now.shape[:2]:
        return UNKNOWN
    model, _, region = Restored.of(calibration)
    return OrientationReference.of(before, model, region).compare(now, model)


def _others_share(gray: Pixels, seen: LineMeasurements) -> float:
    """Return the length of long bright lines where none is expected, as a share of what is; 0 where most was found."""
    if seen.share >= MIN_FOUND:
        return 0.0
    min_length_px = MIN_OTHER_LENGTH * float(np.hypot(*gray.shape))
    others_px = 0.0
    for chain in painted_lines(gray).chains:
        length_px = float(np.linalg.norm(np.diff(chain, axis=0), axis=1).sum())
        if len(chain) < 2 or not length_px > min_length_px:
            continue
        distances = np.array(
            [
                np.linalg.norm(seen.expected_px - point, axis=1).min(initial=np.inf)
                for point in chain[::CHAIN_STEP]
            ]
        )
        others_px += length_px * float(np.mean(distances > MAX_ON_LINE_PX))
    return others_px / max(float(seen.stands_for_px.sum()), 1e-9)


def _drawn_places(seen: LineMeasurements) -> list[CheckedPlace]:
    """Return some of the places that were found, evenly spread."""
    found = np.flatnonzero(seen.found)
    count = min(len(found), MAX_DRAWN)
    drawn = found[np.unique(np.linspace(0, max(len(found) - 1, 0), count).round().astype(int))]
    return [
        {
            "feature": seen.names[seen.marking[i]],
            "expected": seen.expected_px[i].round(2).tolist(),
            "found": seen.raw[i].round(2).tolist(),
            "off_mm": round(float(seen.off_mm[i]), 2),
        }
        for i in drawn
    ]


def run_check(spec: Any, progress: Progress) -> CalibrationCheck:
    """Run a job: {"calibration": whole, "snapshot", "pictures": [{"name", "path", "sha256"}, …], untrusted, "before":
    the calibration's own or null}."""
    with job_pictures(spec["pictures"]) as pictures:
        frame = median_frame(pictures, subprogress(progress, 0.0, 0.4))
    before = None
    if spec.get("before") is not None:
        # Gone or damaged, it tells nothing.
        with suppress(TouchlineError), job_pictures([spec["before"]]) as pictures:
            before = pictures[0][1]().pixels
    found = check(
        Calibration.from_json(spec["calibration"]),
        frame.pixels,
        subprogress(progress, 0.4, 1.0),
        before,
    )
    return {**found, "snapshot": spec["snapshot"]}
