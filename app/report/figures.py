"""The numbers that head a report: where each stands in the record, its unit, and how to read it in half a sentence."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from app.core.json_values import number


@dataclass(frozen=True)
class Figure:
    """title: how the page calls it. reading: half a sentence. digits: after the point."""

    title: str
    unit: str
    reading: str
    digits: int = 2


HEAD = {
    "cv_rms_mm": Figure("Cross-validated error", "mm", "error at points that were excluded from the fit in turn; does "
                        "not cover areas without points"),
    "check_rms_mm": Figure("Error on check points", "mm", "on lines and landmarks that the fit does not use"),
    "expected_mm": Figure("Expected error, carpet", "mm", "effect of the noise of the points over the whole covered "
                          "area; does not include errors that the model cannot represent"),
    "expected_hat_mm": Figure("Expected error, robot tops", "mm", "the same at the height of the robot markers"),
    "rms_px": Figure("Residual", "px", "distance of points from the fitted lines; a small value does not prove "
                                       "accuracy"),
    "max_px": Figure("Largest residual", "px", "the largest of all points except outliers"),
    "rms_mm": Figure("Residual on the field", "mm", "the same on the carpet"),
    "max_mm": Figure("Largest residual on the field", "mm", "the largest of all points except outliers, on the carpet"),
    "mm_per_px": Figure("One pixel", "mm/px", "size of a pixel on the carpet, in the centre of all points"),
    "inliers": Figure("Points used", "", "points in the fit and the checks", 0),
    "outliers": Figure("Outliers", "", "points excluded as mistakes, listed below", 0),
    "distortion_before_pct": Figure("Distortion before", "%", "deviation of a border from its chord, mean of the "
                                    "four; negative is barrel, positive is pincushion; typical lens: within ±3 %"),
    "distortion_after_pct": Figure("Distortion after", "%", "remaining distortion in the corrected image"),
}


def figures(report: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Each of HEAD with its value, None where the record does not tell it."""
    sigma, distortion = report.get("sigma_mm") or {}, report.get("distortion") or {}
    apart = {"expected_mm": sigma.get("rms"), "expected_hat_mm": (sigma.get("hat") or {}).get("rms"),
             **{f"distortion_{when}": distortion.get(when) for when in ("before_pct", "after_pct")}}
    return {key: {"title": it.title, "value": number(apart.get(key, report.get(key))), "unit": it.unit,
                  "reading": it.reading} for key, it in HEAD.items()}
