"""What a job of a batch does with its one picture; plain JSON in, the figures of a row out."""

import time
from functools import cache
from typing import Any

from touchline.batch.verification import verify
from touchline.core.errors import Conflict
from touchline.core.progress import Progress
from touchline.core.records import Calibration, Frame, observations_from_json
from touchline.images import ImageDecoder
from touchline.models.restored import Restored
from touchline.store.files import read_checked
from touchline.workflows.calibration_request import CalibrationRequest


def run_calibration(spec: Any, progress: Progress) -> dict[str, Any]:
    """Fit and judge {"picture", "task"} as a job, as the page and calibrate do it."""
    start = time.perf_counter()
    task = CalibrationRequest.from_json(spec["task"])
    _checked(spec["picture"], task.image_size)
    report = task.run(progress).report
    distortion = report["distortion"]
    return {"verdict": report["verdict"]["level"], "judged_by": "fit", "held_out_mm": report["cv_rms_mm"],
            "rms_mm": report["rms_mm"], "rms_px": report["rms_px"], "worst_mm": report["max_mm"],
            "distortion_before_pct": distortion["before_pct"], "distortion_after_pct": distortion["after_pct"],
            "warnings": [f"{warning['text']} {warning['fix']}" for warning in report["warnings"]],
            "seconds": time.perf_counter() - start}


def run_verification(spec: Any, progress: Progress) -> dict[str, Any]:
    """Verify {"picture", "calibration", "observations"} as a job: how well the calibration holds on the picture."""
    start = time.perf_counter()
    known = Calibration.from_json(spec["calibration"])
    model, field, region = Restored.of(known)
    frame = _checked(spec["picture"], known.image_size)
    found = verify(model, frame.pixels, observations_from_json(spec["observations"]), field, region,
                   frame.sha256 == known.image_sha256, progress)
    return {**found, "seconds": time.perf_counter() - start}


def _checked(picture: dict[str, str], size: Any) -> Frame:
    frame = _decoder().frame_from_bytes(read_checked(**picture))
    if frame.size != size:
        raise Conflict(f"The image has {frame.size}, not {size}.", "Use images of one camera at one resolution.",
                       reason="size-mismatch")
    return frame


@cache
def _decoder() -> ImageDecoder:
    """One for the life of this process, which does many pictures; its own process ends with this one."""
    return ImageDecoder(workers=1)
