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
    "cv_rms_mm": Figure("Held-out error", "mm", "how far points that the fit had not seen were missed: what the next "
                        "place will be like; blind where nothing was clicked"),
    "check_rms_mm": Figure("Error on unused lines", "mm", "on lines and landmarks that the fit did not rest on"),
    "expected_mm": Figure("Expected error, carpet", "mm", "what the clicks' noise leaves uncertain, over the whole "
                          "region; blind to what the model cannot bend to"),
    "expected_hat_mm": Figure("Expected error, hat height", "mm", "the same where robots carry their patterns"),
    "rms_px": Figure("Residual", "px", "how far clicks lie from the fitted lines; small does not mean right"),
    "max_px": Figure("Largest residual", "px", "the worst click that counts"),
    "rms_mm": Figure("Residual on the field", "mm", "the same on the carpet"),
    "max_mm": Figure("Largest residual on the field", "mm", "the worst click that counts, on the carpet"),
    "mm_per_px": Figure("One pixel", "mm/px", "what a pixel is worth on the carpet, in the middle of all clicks"),
    "inliers": Figure("Points that count", "", "clicks that the report rests on", 0),
    "outliers": Figure("Strays", "", "clicks that were left out as mistakes, listed below", 0),
    "distortion_before_pct": Figure("Distortion before", "%", "how far a border bows from its chord, mean of the four: "
                                    "negative is barrel, positive pincushion, within ±3 % a standard lens"),
    "distortion_after_pct": Figure("Distortion after", "%", "what is left of it in the corrected picture"),
}


def figures(report: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Each of HEAD with its value, None where the record does not tell it."""
    sigma, distortion = report.get("sigma_mm") or {}, report.get("distortion") or {}
    apart = {"expected_mm": sigma.get("rms"), "expected_hat_mm": (sigma.get("hat") or {}).get("rms"),
             **{f"distortion_{when}": distortion.get(when) for when in ("before_pct", "after_pct")}}
    return {key: {"title": it.title, "value": number(apart.get(key, report.get(key))), "unit": it.unit,
                  "reading": it.reading} for key, it in HEAD.items()}
