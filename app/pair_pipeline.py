"""Two cameras that see the same: the geometry between their pictures, and whether they agree in millimetres.

Each part stands by itself: things that all lie on the carpet tell no geometry, and yet whether two calibrations agree
there. A part that cannot be had is named under "failed", with its cure.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from app.errors import BadInput, Conflict, FitFailed
from app.evaluate.agreement import from_matches, from_observations, overlap
from app.field_reader import field_from_json
from app.geometry import Points
from app.models import CameraModel, Progress, model_from_json, no_progress
from app.models.relative_pose import calibrated_epipolar_px, relative_pose
from app.models.rotation import vector_from_matrix
from app.models.two_views import as_matches, fundamental_matrix
from app.records import Calibration, observations_from_json


def run_pair(spec: Any, progress: Progress) -> dict[str, Any]:
    """A job: {"points_a", "points_b", "calibration_a", "calibration_b" (whole, as JSON; or None), "z_mm"}."""
    a, b = (None if spec[k] is None else Calibration.from_json(spec[k]) for k in ("calibration_a", "calibration_b"))
    return judge_pair(spec["points_a"], spec["points_b"], a, b, spec["z_mm"], progress)


def judge_pair(points_a: Any, points_b: Any, a: Calibration | None = None, b: Calibration | None = None,
               z_mm: float = 0.0, progress: Progress = no_progress) -> dict[str, Any]:
    """Plain JSON: "fundamental", "pose", "calibrated" and "agreement", each None where it was not asked for.

    points_a, points_b (n, 2) raw px: the same things in both pictures, at z_mm above the carpet where agreement is
    asked for; None to judge two calibrations by the lines and landmarks that both were clicked on.
    """
    if (points_a is None) != (points_b is None) or (a is None) != (b is None):
        raise BadInput("Only one of two was given.", "Give points for both pictures, and both calibrations or none.",
                       reason="one-sided")
    if points_a is None and a is None:
        raise BadInput("There is nothing to judge.", "Give matched points, or two calibrations.",
                       reason="nothing-given")
    if a is not None and a.field != b.field:
        raise Conflict("The two calibrations are for different fields.", "Choose two cameras over one field.",
                       reason="different-fields")
    parts: dict[str, Callable[[], dict[str, Any]]] = {}
    matches = None if points_a is None else as_matches(points_a, points_b)
    models = None if a is None else tuple(model_from_json(c.model_name, c.model_parameters) for c in (a, b))
    if matches is not None:
        parts["fundamental"] = lambda: _fundamental(*matches)
        if models is not None and all(hasattr(model, "unproject") for model in models):
            parts["pose"] = lambda: _pose(*models, *matches)
            parts["calibrated"] = lambda: _calibrated(*models, *matches)
    if models is not None:
        parts["agreement"] = lambda: _agreement(a, b, *models, matches, z_mm)
    found, failed = {}, []
    for number, (name, part) in enumerate(parts.items()):
        progress(number / len(parts), f"Judging the pair: {name}")
        try:
            found[name] = part()
        except FitFailed as refusal:
            failed.append((name, refusal))
    if not found:
        raise failed[0][1]
    return {**{name: found.get(name) for name in ("fundamental", "pose", "calibrated", "agreement")},
            "matches": 0 if matches is None else len(matches[0]),
            "failed": [{"part": name, "reason": e.reason, "what": e.what, "fix": e.fix} for name, e in failed]}


def _fundamental(a: Points, b: Points) -> dict[str, Any]:
    found = fundamental_matrix(a, b)
    return {"matrix": found.fundamental.tolist(), "rms_px": found.rms_px, "sigma_px": found.sigma_px,
            "epipolar_px": _plain(found.epipolar_px), "outliers": np.flatnonzero(~found.good).tolist(),
            "epipoles": [e.tolist() for e in found.epipoles]}


def _pose(model_a: CameraModel, model_b: CameraModel, a: Points, b: Points) -> dict[str, Any]:
    found = relative_pose(model_a, model_b, a, b)
    good = found.epipolar_px[found.good]
    return {"rotation": vector_from_matrix(found.b_from_a).tolist(), "direction": found.direction.tolist(),
            "rotation_sigma_deg": found.rotation_sigma_deg, "direction_sigma_deg": found.direction_sigma_deg,
            "essential": found.essential.tolist(), "rms_px": float(np.sqrt(np.mean(good**2))),
            "epipolar_px": _plain(found.epipolar_px), "outliers": np.flatnonzero(~found.good).tolist()}


def _calibrated(model_a: CameraModel, model_b: CameraModel, a: Points, b: Points) -> dict[str, Any]:
    found = calibrated_epipolar_px(model_a, model_b, a, b)
    seen = found[np.isfinite(found)]
    if not seen.size:
        raise FitFailed("None of the matches is within reach of both lenses.", "Check that the points belong to these "
                        "cameras.", reason="nothing-shared")
    return {"median_px": float(np.median(seen)), "rms_px": float(np.sqrt(np.mean(seen**2))),
            "epipolar_px": _plain(found)}


def _agreement(a: Calibration, b: Calibration, model_a: CameraModel, model_b: CameraModel,
               matches: tuple[Points, Points] | None, z_mm: float) -> dict[str, Any]:
    field = field_from_json(a.field)
    shared = overlap(model_a, a.image_size, model_b, b.image_size, field)
    if matches is not None:
        found = from_matches(model_a, model_b, *matches, z_mm)
    else:
        seen = [observations_from_json(c.observations) for c in (a, b)]
        found = from_observations(model_a, seen[0], model_b, seen[1], field, field.region(a.region, a.rotate),
                                  field.region(b.region, b.rotate))
    return {**found.to_json(shared), "from": "matches" if matches is not None else "clicks"}


def _plain(values: np.ndarray) -> list[float | None]:
    return [float(v) if np.isfinite(v) else None for v in values]
