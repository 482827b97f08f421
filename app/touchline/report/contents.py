"""All contents of a report, as plain JSON in which nothing is NaN; the page is made of this and of pictures alone.

Its numbers: where each stands in the record, its unit, and how to read it in half a sentence.
"""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from typing import Any

from touchline.core.errors import BadImage, NotFound, TouchlineError
from touchline.core.field import BORDERS
from touchline.core.json_values import MAX_NAME, finite_json, number, text
from touchline.core.records import Calibration, Frame
from touchline.evaluate.claims import Claim, report_claims
from touchline.evaluate.uncertainty import GRID
from touchline.installation import __version__
from touchline.models import RayModel, Restored
from touchline.store.quarantine import DamagedFile
from touchline.workflows import calibration as workflow

FORMAT, FORMAT_VERSION = "touchline-report", 1
LEVELS = ("good", "fair", "poor", "unknown")
MAX_FEATURES, MAX_OUTLIERS, MAX_WARNINGS = 500, 200, 50


@dataclass(frozen=True)
class Figure:
    """title: how the page calls it. reading: half a sentence. needs: what would make it known; empty
    where a fit may have none of it. digits: after the point."""

    title: str
    unit: str
    reading: str
    needs: str
    digits: int = 2


MORE_POINTS = "more points on lines or landmarks"
RAYS = "a physical lens model"
WITHIN_REACH = "points on the carpet that the model covers"


HEAD = {
    "cv_rms_mm": Figure("Cross-validated error", "mm", "error at points that were excluded from the fit in turn; does "
                        "not cover areas without points", MORE_POINTS),
    "check_rms_mm": Figure("Error on check points", "mm", "on lines and landmarks that the fit does not use", ""),
    "expected_mm": Figure("Expected error, carpet", "mm", "effect of the noise of the points over the whole covered "
                          "area; does not include errors that the model cannot represent", RAYS),
    "expected_hat_mm": Figure("Expected error, robot tops", "mm", "the same at the height of the robot markers", RAYS),
    "rms_px": Figure("Residual", "px", "distance of points from the fitted lines; a small value does not prove "
                                       "accuracy", WITHIN_REACH),
    "max_px": Figure("Largest residual", "px", "the largest of all points except outliers", WITHIN_REACH),
    "rms_mm": Figure("Residual on the field", "mm", "the same on the carpet", WITHIN_REACH),
    "max_mm": Figure("Largest residual on the field", "mm", "the largest of all points except outliers, on the carpet",
                     WITHIN_REACH),
    "mm_per_px": Figure("One pixel", "mm/px", "size of a pixel on the carpet, in the centre of all points",
                        MORE_POINTS),
    "inliers": Figure("Points used", "", "points in the fit and the checks", "a calibration from points", 0),
    "outliers": Figure("Outliers", "", "points excluded as mistakes, listed below", "a calibration from points", 0),
    "distortion_before_pct": Figure("Distortion before", "%", "deviation of a border from its chord, mean of the "
                                    "four; negative is barrel, positive is pincushion; typical lens: within ±3 %",
                                    "a model that covers the whole of a border"),
    "distortion_after_pct": Figure("Distortion after", "%", "remaining distortion in the corrected image",
                                   "four points along one border"),
}


def figures(report: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Each of HEAD with its value, None where the record does not tell it."""
    sigma, distortion = report.get("sigma_mm") or {}, report.get("distortion") or {}
    apart = {"expected_mm": sigma.get("rms"), "expected_hat_mm": (sigma.get("hat") or {}).get("rms"),
             **{f"distortion_{when}": distortion.get(when) for when in ("before_pct", "after_pct")}}
    return {key: {"title": it.title, "value": number(apart.get(key, report.get(key))), "unit": it.unit,
                  "reading": it.reading} for key, it in HEAD.items()}


def what_is_missing(known: Mapping[str, Mapping[str, Any]], keys: Iterable[str] = HEAD) -> list[str]:
    """Say of each figure that is not known what would make it known."""
    return [f"{HEAD[key].title}: unknown. It needs {HEAD[key].needs}." for key in keys
            if known[key]["value"] is None and HEAD[key].needs]


def outcome(claim: Mapping[str, Any]) -> str:
    """Return in a word what came of a check; one that failed stands against activation."""
    if claim["state"] == "refuted":
        return "Failed" if claim["gates"] else "Note"
    return "Passed" if claim["state"] == "held" else "Not tested"


@dataclass(frozen=True, eq=False)
class ReportPicture:
    """The picture that a report shows; without one, why there is none. camera_name: as operators call the camera."""

    frame: Frame | None
    why: str | None = None
    camera_name: str | None = None


def report_picture(calibration: Calibration, frame_of: Callable[[str], Frame],
                   camera_name: str | None = None) -> ReportPicture:
    """Load the picture that was clicked, if it is still stored. frame_of: by its id."""
    if calibration.snapshot is None:
        return ReportPicture(None,
                             "The calibration has no image: it was imported, or made from points alone.",
                             camera_name)
    try:
        return ReportPicture(frame_of(calibration.snapshot), camera_name=camera_name)
    except (NotFound, DamagedFile, BadImage) as refusal:
        return ReportPicture(None, f"The image cannot be shown: {refusal.what}", camera_name)


def contents(calibration: Calibration, picture: ReportPicture, claims: Sequence[Claim] | None = None) -> dict[str, Any]:
    """The whole report. claims: what is claimed of the version; without them what its own report claims."""
    built = Restored.of(calibration)
    claims = report_claims(calibration) if claims is None else claims
    report = calibration.report
    features, outliers = _features(report), _outliers(report)
    return {"format": FORMAT, "format_version": FORMAT_VERSION, "written_by": f"touchline {__version__}",
            "calibration": _versions(calibration, picture), "field": _field(built), "model": _model(calibration, built),
            "picture": _picture(calibration, picture), "verdict": _verdict(report),
            "claims": [claim.to_json() for claim in claims], "figures": figures(report),
            "distortion": _distortion(report), "per_feature": features[:MAX_FEATURES],
            "outliers": outliers[:MAX_OUTLIERS], "outliers_not_listed": max(0, len(outliers) - MAX_OUTLIERS),
            "uncertainty": uncertainty(calibration, built), "next_click": _next_click(report),
            "warnings": [{"reason": text(w.get("reason")), "text": text(w.get("text")), "fix": text(w.get("fix")),
                          "feature": _feature(w), "index": w.get("index")}
                         for w in report.get("warnings", ())[:MAX_WARNINGS]]}


def _feature(row: Mapping[str, Any]) -> str | list[float] | None:
    name = row.get("feature")
    return text(name, MAX_NAME) if isinstance(name, str) else name


def _versions(calibration: Calibration, picture: ReportPicture) -> dict[str, Any]:
    return {"id": calibration.id, "version": calibration.version, "active": calibration.active, "camera":
            calibration.camera, "camera_name": text(picture.camera_name), "note": text(calibration.note, 2000),
            "created_at": text(calibration.created_at), "parent": calibration.parent, "software":
            text(calibration.software), "snapshot": calibration.snapshot, "image_sha256":
            text(calibration.image_sha256), "image_size": list(calibration.image_size), "corrected_size":
            list(calibration.corrected_size), "options": finite_json(calibration.options)}


def _field(built: Restored) -> dict[str, Any]:
    field, region = built.field, built.region
    return {"name": field.name, "title": field.title, "length_mm": field.length_mm, "width_mm": field.width_mm,
            "region": region.name, "rotate": region.rotate_deg, "region_x_mm": list(region.x_mm),
            "region_y_mm": list(region.y_mm), "hat_height_mm": field.hat_height_mm}


def _model(calibration: Calibration, built: Restored) -> dict[str, Any]:
    parameters = finite_json(calibration.model_parameters)
    written = json.dumps(parameters, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return {"name": calibration.model_name, "title": built.model.TITLE, "parameters": parameters,
            "parameters_sha256": sha256(written.encode("utf-8", "replace")).hexdigest()}


def _picture(calibration: Calibration, picture: ReportPicture) -> dict[str, Any]:
    """same: whether the picture is the one that was clicked, to the byte; None where that is not known."""
    frame, clicked = picture.frame, calibration.image_sha256
    return {"shown": frame is not None, "why_not": None if frame is not None else picture.why,
            "sha256": frame.sha256 or None if frame is not None else None,
            "same": frame.sha256 == clicked if frame is not None and frame.sha256 and clicked else None}


def _verdict(report: Mapping[str, Any]) -> dict[str, Any]:
    part = report.get("verdict") or {}
    level = part.get("level")
    return {"level": level if level in LEVELS else "unknown", "mm": number(part.get("mm")),
            "sentence": text(part.get("sentence")) or "The calibration has no verdict, so its error is unknown."}


def _distortion(report: Mapping[str, Any]) -> dict[str, Any]:
    part = report.get("distortion") or {}
    per_border = part.get("per_border") or {}
    return {"kind": text(part.get("kind")), "standard_lens_pct": number(part.get("standard_lens_pct")),
            "per_border": {name: {when: number((per_border.get(name) or {}).get(when))
                                  for when in ("before_pct", "after_pct")} for name in BORDERS}}


def _features(report: Mapping[str, Any]) -> list[dict[str, Any]]:
    return [{"feature": _feature(row), "kind": text(row.get("kind")), "n": row.get("n"),
             "used": row.get("used") is not False,
             "outliers": sum(r.get("outlier") is True for r in row.get("residuals", ())),
             **{name: number(row.get(name)) for name in ("rms_px", "rms_mm", "max_mm")}}
            for row in report.get("per_feature", ())[:MAX_FEATURES]]


def _outliers(report: Mapping[str, Any]) -> list[dict[str, Any]]:
    return [{"feature": _feature(row), "index": index, "point": r.get("point"),
             "px": number(r.get("px")), "mm": number(r.get("mm"))}
            for row in report.get("per_feature", ())[:MAX_FEATURES]
            for index, r in enumerate(row.get("residuals", ())) if r.get("outlier") is True]


def _next_click(report: Mapping[str, Any]) -> dict[str, Any] | None:
    part = report.get("next_click")
    if not part:
        return None
    return {"feature": _feature(part), "point": part.get("point"),
            **{name: number(part.get(name)) for name in ("worst_mm", "worst_mm_then", "z_mm")}}


def uncertainty(calibration: Calibration, built: Restored) -> dict[str, Any]:
    """Expected error on the carpet and at hat height over the report's own grid, each {"map"} or {"map": None, "why",
    "fix"}."""
    model, hat_mm = built.model, built.field.hat_height_mm
    carpet = _map(calibration, built, 0.0)
    if isinstance(model, RayModel):
        return {"carpet": carpet, "hat": _map(calibration, built, hat_mm)}
    return {"carpet": carpet, "hat": {"map": None, "z_mm": hat_mm, "why": f"This model ({model.TITLE}) is valid only "
            f"on the carpet. Positions at robot-top height ({hat_mm:g} mm) are unknown.",
            "fix": "Use a physical lens model if robot positions matter."}}


def _map(calibration: Calibration, built: Restored, z_mm: float) -> dict[str, Any]:
    try:
        # the grid of the report's own figures, so that one place has one number
        found = finite_json(workflow.uncertainty(built.model, calibration.covariance, built.region, z_mm, *GRID))
    except TouchlineError as refusal:
        return {"map": None, "z_mm": z_mm, "why": refusal.what, "fix": refusal.fix}
    return {"map": found, "z_mm": z_mm, "why": None, "fix": None}
