"""The report: all figures of a fit as plain JSON, with a verdict of one length in millimetres and one sentence."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from touchline.core.field import BORDERS, Field, Region
from touchline.core.json_values import number
from touchline.core.records import Fit, Observation, Observations, Warning
from touchline.core.statements import say
from touchline.evaluate.areas import (
    FITS_OVERLAP,
    NEAR_OVERLAP,
    NOT_IN_IMAGE,
    SeenArea,
    area_sentences,
    better_areas,
)
from touchline.evaluate.cross_validation import whole_lines
from touchline.evaluate.difference import Contradiction
from touchline.evaluate.distortion import distortion_report
from touchline.evaluate.next_click import next_best_click, observability_warnings
from touchline.evaluate.report_types import (
    CovarianceJson,
    ExpectedFigures,
    FeatureRow,
    FitReport,
    ReportedNotes,
    ReportedPose,
    SigmaReport,
)
from touchline.evaluate.residuals import (
    FeatureResiduals,
    feature_residuals,
    largest,
    mm_per_px,
    residual_rows,
    rms,
)
from touchline.evaluate.uncertainty import knows_its_error, reach_warnings, sigma_report
from touchline.evaluate.verdict import FAIR_MM, GOOD_MM, FitAccuracy, fit_verdict, worst_doubt
from touchline.fitting import FITTERS
from touchline.models import CameraModel, RayModel, parameters_json, raw_from_field
from touchline.models.ray_camera import RayCamera

MAX_LINE_SIGMAS = 4.0


def report(
    fit: Fit,
    observations: Observations,
    field: Field,
    region: Region,
    held_out: tuple[np.ndarray, ...] | None,
    freer: Contradiction | None = None,
) -> FitReport:
    """Put the figures together. held_out: mm per point from cross-validation, or None while dragging.

    freer: what a lens that bends more freely makes of the points, where that was asked.
    """
    painted = field.as_painted(fit.notes, region)
    residuals = [feature_residuals(fit.model, o, painted, region) for o in observations]
    inside = [r.px[fine] for r, fine in zip(residuals, fit.inliers, strict=True)]
    inside_mm = [r.mm[fine] for r, fine in zip(residuals, fit.inliers, strict=True)]
    rests = [i for i, used in enumerate(fit.used) if used]
    checks = [i for i, used in enumerate(fit.used) if not used]
    held = _joined([held_out[i] for i in rests]) if held_out is not None else np.empty(0)
    fitted_px, fitted_mm = (_joined([each[i] for i in rests]) for each in (inside, inside_mm))
    check_mm = rms(_joined([inside_mm[i] for i in checks]))
    cv_rms_mm = rms(held)
    spared = whole_lines(
        observations, fit.used, needs_every_border=FITTERS[fit.model.NAME].NEEDS_EVERY_BORDER
    )
    lines_mm = _joined(
        [
            np.full(np.isfinite(held_out[i]).sum(), _line_sigma_mm(fit, field, observations[i]))
            * (i in spared)
            for i in rests
        ]
        if held_out is not None
        else []
    )
    robot_top_mm = field.hat_height_mm
    ends = reach_warnings(fit.model, region, robot_top_mm)
    warnings = [*fit.warnings, *observability_warnings(fit, region, robot_top_mm), *ends]
    # a lens bends the inside as it bends the borders; curves of their own know nothing between them
    knows_inside = knows_its_error(fit) or any(
        o.feature not in BORDERS and len(o.points) for o in observations
    )
    if not knows_inside:  # what these figures cannot see
        warnings.append(
            Warning(
                "inside-not-checked",
                say(
                    "warning.inside-not-checked",
                    "Only the borders have points. The accuracy inside the field is unknown.",
                ),
                say(
                    "warning.inside-not-checked.fix",
                    "Add a few points on a line or landmark inside the field, such as the centre circle.",
                ),
            )
        )
    height_is_known = all(w.reason != "height-unknown" for w in warnings)
    # of a lens with one term, its own covariance knows nothing of what it lacks
    determined, stand_in = (
        (freer.freer, fit.model)
        if freer is not None and isinstance(fit.model, RayCamera)
        else (fit, None)
    )
    # the points know better than a height that contradicts them
    if determined.alternative is not None:
        determined, stand_in = determined.alternative, fit.model
    sigma = sigma_report(determined, region, robot_top_mm, height_is_known, stand_in=stand_in)
    areas = _better_areas(fit.model, field, region, sigma)
    if areas:
        warnings.append(Warning(NOT_IN_IMAGE, *area_sentences(areas)))
    height = fit.notes.get("height")
    apart_mm = 0.0 if freer is None else max(freer.carpet_mm, freer.robot_top_mm or 0.0)
    if freer is not None and apart_mm > GOOD_MM:
        warnings.append(
            Warning(
                "another-lens",
                say(
                    "warning.another-lens",
                    "{model} places the field {mm:.0f} mm away with the same points. This lens "
                    "model may not describe the lens correctly.",
                    model=freer.title,
                    mm=apart_mm,
                ),
                say(
                    "warning.another-lens.fix",
                    "Use {model}, or compare all models.",
                    model=freer.title,
                ),
            )
        )
    return {
        "rms_px": rms(fitted_px),
        "max_px": largest(fitted_px),
        "rms_mm": rms(fitted_mm),
        "max_mm": largest(fitted_mm),
        "mm_per_px": mm_per_px(_joined(inside), _joined(inside_mm)),
        "cv_rms_mm": cv_rms_mm,
        "check_rms_mm": check_mm,
        "inliers": int(sum(fine.sum() for fine in fit.inliers)),
        "outliers": int(sum((~fine).sum() for fine in fit.inliers)),
        # None where each border is a curve of its own: no common parameters, no covariance
        "sigma_mm": sigma,
        "distortion": distortion_report(fit.model, region, _border_clicks(fit, observations)),
        "per_feature": [
            _feature_json(r, fine, used)
            for r, fine, used in zip(residuals, fit.inliers, fit.used, strict=True)
        ],
        "verdict": fit_verdict(
            FitAccuracy(
                _without(cv_rms_mm, rms(lines_mm)),
                check_mm,
                sigma,
                knows_inside,
                isinstance(fit.model, RayModel),
                reaches=not ends,
                hat_height_mm=robot_top_mm,
                apart_mm=apart_mm,
                freer="" if freer is None else freer.title,
                is_apart_expected=stand_in is not None,
                doubt=worst_doubt(warnings, height, region),
                is_height_believed=height is not None and height["state"] == "not-checked",
            )
        ),
        "areas": [area.to_json() for area in areas],
        "next_click": next_best_click(
            fit, field, region, fit.model.image_size, fit.notes.get("click_sigma_px", 0.5)
        ),
        "warnings": [w.to_json() for w in warnings],
        "camera": _camera_json(fit.model),
        "covariance": _covariance_json(fit, None if stand_in is None else determined),
        **_reported(fit.notes),
    }


def _better_areas(
    model: CameraModel, field: Field, region: Region, sigma: SigmaReport | None
) -> tuple[SeenArea, ...]:
    """Return what the picture shows in place of the region; the less that has to fit, the less the region is known."""
    if not isinstance(model, RayModel):
        return ()
    is_poor = sigma is not None and sigma["rms"] > FAIR_MM
    return better_areas(
        partial(raw_from_field, model),
        field,
        region,
        model.image_size,
        least_overlap=NEAR_OVERLAP if is_poor else FITS_OVERLAP,
    )


def expected_figures(report: Mapping[str, Any]) -> ExpectedFigures:
    """Return the expected error of a report, also of one that was imported."""
    sigma = report.get("sigma_mm") or {}
    hat = sigma.get("hat") or {}
    return {
        "expected_mm": sigma.get("rms"),
        "expected_hat_mm": hat.get("rms"),
        "hat_height_mm": number(hat.get("z_mm")),
    }


def _covariance_json(fit: Fit, freer: Fit | None) -> CovarianceJson | None:
    """Return the fit's covariance, with the freer fit that tells its error; None where it does not know it."""
    if fit.covariance is None or not knows_its_error(fit):
        return None
    found: CovarianceJson = {"names": list(fit.parameter_names), "matrix": fit.covariance.tolist()}
    if freer is not None and freer.covariance is not None:
        found["freer"] = {
            "model": freer.model.NAME,
            "parameters": parameters_json(freer.model),
            "names": list(freer.parameter_names),
            "matrix": freer.covariance.tolist(),
        }
    return found


def _reported(notes: Mapping[str, Any]) -> ReportedNotes:
    found: Any = {
        key: value for key, value in notes.items() if key in ReportedNotes.__optional_keys__
    }
    return found


def _camera_json(model: CameraModel) -> ReportedPose | None:
    """Return how high the camera is and how far it looks from straight down; None for a model without rays."""
    if not isinstance(model, RayCamera):
        return None
    down = -model.camera_from_field[2, 2]  # of the optical axis: its share straight down
    return {
        "height_mm": float(model.position_mm[2]),
        "tilt_deg": float(np.degrees(np.arccos(np.clip(down, -1, 1)))),
    }


def _line_sigma_mm(fit: Fit, field: Field, observation: Observation) -> float:
    """Return how far a line may lie beside its place, σ: as learned, in bounds so that no misfit passes for paint."""
    learned = fit.notes.get("line_sigmas_mm", {}).get(observation.feature, 0.0)
    return min(learned, MAX_LINE_SIGMAS * field.line_sigma_mm)


def _without(measured_mm: float | None, lines_mm: float | None) -> float | None:
    """Return what of a distance from lines is the camera's, and not that of the lines from their places."""
    return (
        None
        if measured_mm is None
        else float(np.sqrt(max(measured_mm**2 - (lines_mm or 0.0) ** 2, 0.0)))
    )


def _joined(parts: list[np.ndarray]) -> np.ndarray:
    return np.concatenate([np.empty(0), *parts])


def _border_clicks(fit: Fit, observations: Observations) -> Mapping[str, np.ndarray]:
    pairs = list(zip(observations, fit.inliers, strict=True))
    return {
        name: np.concatenate(
            [np.empty((0, 2)), *(o.points[fine] for o, fine in pairs if o.feature == name)]
        )
        for name in BORDERS
    }


def _feature_json(r: FeatureResiduals, fine: np.ndarray, used: bool) -> FeatureRow:
    return {
        "feature": r.observation.feature_json,
        "kind": r.observation.kind,
        "n": len(r.px),
        "used": used,
        "rms_px": rms(r.px[fine]),
        "rms_mm": rms(r.mm[fine]),
        "max_mm": largest(r.mm[fine]),
        "residuals": residual_rows(r, r.observation.points, r.foot, r.px, ~fine),
    }
