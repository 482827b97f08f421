"""The figures that head a report: where each stands in the record, its unit, and how to read it in half a sentence."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from touchline.core.json_values import JsonObject, number


@dataclass(frozen=True)
class Figure:
    """title: what a report calls it. reading: how to read it, half a sentence. digits: after the point.

    needs: what would make it known; empty where a fit may have none of it.
    """

    title: str
    unit: str
    reading: str
    needs: str
    digits: int = 2


MORE_POINTS = "more points on lines or landmarks"
RAYS = "a physical lens model"
WITHIN_REACH = "points on the carpet that the model covers"


HEADLINE = {
    "cv_rms_mm": Figure(
        "Cross-validated error",
        "mm",
        "error at points that were excluded from the fit in turn; does "
        "not cover areas without points",
        MORE_POINTS,
    ),
    "check_rms_mm": Figure(
        "Error on check points", "mm", "on lines and landmarks that the fit does not use", ""
    ),
    "expected_mm": Figure(
        "Expected error, carpet",
        "mm",
        "effect of the noise of the points over the whole covered "
        "area; does not include errors that the model cannot represent",
        RAYS,
    ),
    "expected_hat_mm": Figure(
        "Expected error, robot tops", "mm", "the same at the height of the robot markers", RAYS
    ),
    "rms_px": Figure(
        "Residual",
        "px",
        "distance of points from the fitted lines; a small value does not prove accuracy",
        WITHIN_REACH,
    ),
    "max_px": Figure(
        "Largest residual", "px", "the largest of all points except outliers", WITHIN_REACH
    ),
    "rms_mm": Figure("Residual on the field", "mm", "the same on the carpet", WITHIN_REACH),
    "max_mm": Figure(
        "Largest residual on the field",
        "mm",
        "the largest of all points except outliers, on the carpet",
        WITHIN_REACH,
    ),
    "mm_per_px": Figure(
        "One pixel",
        "mm/px",
        "size of a pixel on the carpet, in the centre of all points",
        MORE_POINTS,
    ),
    "inliers": Figure(
        "Points used", "", "points in the fit and the checks", "a calibration from points", 0
    ),
    "outliers": Figure(
        "Outliers", "", "points excluded as mistakes, listed below", "a calibration from points", 0
    ),
    "distortion_before_pct": Figure(
        "Distortion before",
        "%",
        "deviation of a border from its chord, mean of the "
        "four; negative is barrel, positive is pincushion; typical lens: within ±3 %",
        "a model that covers the whole of a border",
    ),
    "distortion_after_pct": Figure(
        "Distortion after",
        "%",
        "remaining distortion in the corrected image",
        "four points along one border",
    ),
}


def headline_figures(report: Mapping[str, Any]) -> dict[str, JsonObject]:
    """Return each of HEADLINE with its value, None where the record does not tell it."""
    sigma, distortion = report.get("sigma_mm") or {}, report.get("distortion") or {}
    nested = {
        "expected_mm": sigma.get("rms"),
        "expected_hat_mm": (sigma.get("hat") or {}).get("rms"),
        **{f"distortion_{when}": distortion.get(when) for when in ("before_pct", "after_pct")},
    }
    return {
        key: {
            "title": it.title,
            "value": number(nested.get(key, report.get(key))),
            "unit": it.unit,
            "reading": it.reading,
        }
        for key, it in HEADLINE.items()
    }


def what_is_missing(
    known: Mapping[str, Mapping[str, Any]], keys: Iterable[str] = HEADLINE
) -> list[str]:
    """Say of each figure that is not known what would make it known."""
    return [
        f"{HEADLINE[key].title}: unknown. It needs {HEADLINE[key].needs}."
        for key in keys
        if known[key]["value"] is None and HEADLINE[key].needs
    ]
