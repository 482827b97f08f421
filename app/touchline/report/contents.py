"""All contents of a report, as plain JSON in which nothing is NaN; the page is made of this and of pictures alone."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from typing import Any

from touchline.core.errors import BadImage, NotFound, TouchlineError, Unavailable
from touchline.core.field import BORDERS
from touchline.core.json_values import MAX_NAME, JsonObject, finite_json, number, text
from touchline.core.records import Calibration, Frame
from touchline.evaluate.claims import Claim, report_claims
from touchline.evaluate.headline_figures import headline_figures
from touchline.evaluate.uncertainty import GRID
from touchline.installation import __version__
from touchline.models import RayModel, Restored
from touchline.workflows import calibration as workflow

FORMAT, FORMAT_VERSION = "touchline-report", 1
LEVELS = ("good", "fair", "poor", "unknown")
MAX_FEATURES, MAX_OUTLIERS, MAX_WARNINGS = 500, 200, 50


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


def report_picture(
    calibration: Calibration, frame_of: Callable[[str], Frame], camera_name: str | None = None
) -> ReportPicture:
    """Load the picture that was clicked, if it is still stored. frame_of: returns it by its id."""
    if calibration.snapshot is None:
        return ReportPicture(
            None,
            "The calibration has no image: it was imported, or made from points alone.",
            camera_name,
        )
    try:
        return ReportPicture(frame_of(calibration.snapshot), camera_name=camera_name)
    except (NotFound, Unavailable, BadImage) as refusal:
        return ReportPicture(None, f"The image cannot be shown: {refusal.what}", camera_name)


def contents(
    calibration: Calibration, picture: ReportPicture, claims: Sequence[Claim] | None = None
) -> JsonObject:
    """Return the whole report. claims: what is claimed of the version; without them what its own report claims."""
    restored = Restored.of(calibration)
    claims = report_claims(calibration) if claims is None else claims
    report = calibration.report
    features, outliers = _features(report), _outliers(report)
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "written_by": f"touchline {__version__}",
        "calibration": _versions(calibration, picture),
        "field": _field(restored),
        "model": _model(calibration, restored),
        "picture": _picture(calibration, picture),
        "verdict": _verdict(report),
        "claims": [claim.to_json() for claim in claims],
        "figures": headline_figures(report),
        "distortion": _distortion(report),
        "per_feature": features[:MAX_FEATURES],
        "outliers": outliers[:MAX_OUTLIERS],
        "outliers_not_listed": max(0, len(outliers) - MAX_OUTLIERS),
        "uncertainty": uncertainty(calibration, restored),
        "next_click": _next_click(report),
        "warnings": [
            {
                "reason": text(w.get("reason")),
                "text": text(w.get("text")),
                "fix": text(w.get("fix")),
                "feature": _feature(w),
                "index": w.get("index"),
            }
            for w in report.get("warnings", ())[:MAX_WARNINGS]
        ],
    }


def _feature(row: Mapping[str, Any]) -> str | list[float] | None:
    name = row.get("feature")
    return text(name, MAX_NAME) if isinstance(name, str) else name


def _versions(calibration: Calibration, picture: ReportPicture) -> JsonObject:
    return {
        "id": calibration.id,
        "version": calibration.version,
        "active": calibration.active,
        "camera": calibration.camera,
        "camera_name": text(picture.camera_name),
        "note": text(calibration.note, 2000),
        "created_at": text(calibration.created_at),
        "parent": calibration.parent,
        "software": text(calibration.software),
        "snapshot": calibration.snapshot,
        "image_sha256": text(calibration.image_sha256),
        "image_size": list(calibration.image_size),
        "corrected_size": list(calibration.corrected_size),
        "options": finite_json(calibration.options),
    }


def _field(restored: Restored) -> JsonObject:
    field, region = restored.field, restored.region
    return {
        "name": field.name,
        "title": field.title,
        "length_mm": field.length_mm,
        "width_mm": field.width_mm,
        "region": region.name,
        "rotate": region.rotate_deg,
        "region_x_mm": list(region.x_mm),
        "region_y_mm": list(region.y_mm),
        "hat_height_mm": field.hat_height_mm,
    }


def _model(calibration: Calibration, restored: Restored) -> JsonObject:
    parameters = finite_json(calibration.model_parameters)
    written = json.dumps(parameters, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return {
        "name": calibration.model_name,
        "title": restored.model.TITLE,
        "parameters": parameters,
        "parameters_sha256": sha256(written.encode("utf-8", "replace")).hexdigest(),
    }


def _picture(calibration: Calibration, picture: ReportPicture) -> JsonObject:
    """same: whether the picture is the one that was clicked, to the byte; None where that is not known."""
    frame, clicked = picture.frame, calibration.image_sha256
    return {
        "shown": frame is not None,
        "why_not": None if frame is not None else picture.why,
        "sha256": frame.sha256 or None if frame is not None else None,
        "same": frame.sha256 == clicked if frame is not None and frame.sha256 and clicked else None,
    }


def _verdict(report: Mapping[str, Any]) -> JsonObject:
    part = report.get("verdict") or {}
    level = part.get("level")
    return {
        "level": level if level in LEVELS else "unknown",
        "mm": number(part.get("mm")),
        "sentence": text(part.get("sentence"))
        or "The calibration has no verdict, so its error is unknown.",
    }


def _distortion(report: Mapping[str, Any]) -> JsonObject:
    part = report.get("distortion") or {}
    per_border = part.get("per_border") or {}
    return {
        "kind": text(part.get("kind")),
        "standard_lens_pct": number(part.get("standard_lens_pct")),
        "per_border": {
            name: {
                when: number((per_border.get(name) or {}).get(when))
                for when in ("before_pct", "after_pct")
            }
            for name in BORDERS
        },
    }


def _features(report: Mapping[str, Any]) -> list[JsonObject]:
    return [
        {
            "feature": _feature(row),
            "kind": text(row.get("kind")),
            "n": row.get("n"),
            "used": row.get("used") is not False,
            "outliers": sum(r.get("outlier") is True for r in row.get("residuals", ())),
            **{name: number(row.get(name)) for name in ("rms_px", "rms_mm", "max_mm")},
        }
        for row in report.get("per_feature", ())[:MAX_FEATURES]
    ]


def _outliers(report: Mapping[str, Any]) -> list[JsonObject]:
    return [
        {
            "feature": _feature(row),
            "index": index,
            "point": r.get("point"),
            "px": number(r.get("px")),
            "mm": number(r.get("mm")),
        }
        for row in report.get("per_feature", ())[:MAX_FEATURES]
        for index, r in enumerate(row.get("residuals", ()))
        if r.get("outlier") is True
    ]


def _next_click(report: Mapping[str, Any]) -> JsonObject | None:
    part = report.get("next_click")
    if not part:
        return None
    return {
        "feature": _feature(part),
        "point": part.get("point"),
        **{name: number(part.get(name)) for name in ("worst_mm", "worst_mm_then", "z_mm")},
    }


def uncertainty(calibration: Calibration, restored: Restored) -> JsonObject:
    """Return the expected error on the carpet and at robot tops, over the report's own grid.

    Each is {"map"} or {"map": None, "why", "fix"}.
    """
    model, robot_top_mm = restored.model, restored.field.hat_height_mm
    carpet = _map(calibration, restored, 0.0)
    if isinstance(model, RayModel):
        return {"carpet": carpet, "hat": _map(calibration, restored, robot_top_mm)}
    return {
        "carpet": carpet,
        "hat": {
            "map": None,
            "z_mm": robot_top_mm,
            "why": f"This model ({model.TITLE}) is valid only "
            f"on the carpet. Positions at robot-top height ({robot_top_mm:g} mm) are unknown.",
            "fix": "Use a physical lens model if robot positions matter.",
        },
    }


def _map(calibration: Calibration, restored: Restored, z_mm: float) -> JsonObject:
    try:
        # the grid of the report's own figures, so that one place has one number
        found = finite_json(
            workflow.uncertainty(
                restored.model, calibration.covariance, restored.region, z_mm, *GRID
            )
        )
    except TouchlineError as refusal:
        return {"map": None, "z_mm": z_mm, "why": refusal.what, "fix": refusal.fix}
    return {"map": found, "z_mm": z_mm, "why": None, "fix": None}
