"""Reads a report as it comes from a file or the store: what it should hold is of its kind afterwards, or None.

An imported calibration's report may hold anything. Later readers rely on the kinds below; other entries stay as they
are. The covariance is checked against its model where it is used (evaluate/fit/covariance_json.py).
"""

from collections.abc import Mapping
from typing import Any

from touchline.core.json_values import number
from touchline.core.statements import STATEMENTS, read_statements

MAX_TEXT = 400  # characters of a sentence; ours have 200
MAX_NAME = 64
MAX_OFFSET_MM = 1000.0


def text(value: Any, longest: int = MAX_TEXT) -> str | None:
    """A text, cut with an ellipsis where it is longer."""
    if not isinstance(value, str):
        return None
    return value if len(value) <= longest else value[:longest - 1] + "…"


def _number(value: Any) -> Any:
    return None if number(value) is None else value


def _whole(value: Any) -> Any:
    return None if number(value) is None or value != int(value) else value


def _string(value: Any) -> str | None:
    return value if isinstance(value, str) else None


def _flag(value: Any) -> bool | None:
    return value if isinstance(value, bool) else None


def _pair(value: Any) -> Any:
    good = isinstance(value, (list, tuple)) and len(value) == 2 and None not in map(number, value)
    return value if good else None


def _feature(value: Any) -> Any:
    """A border, line, arc or landmark by name, or a field position in mm."""
    return value if isinstance(value, str) else _pair(value)


def _offsets(value: Any) -> Any:
    """How far lines lie beside their places, mm by name."""
    if not isinstance(value, Mapping):
        return None
    return {name: mm for name, mm in value.items()
            if isinstance(name, str) and number(mm) is not None and abs(mm) <= MAX_OFFSET_MM}


def _centres(value: Any) -> Any:
    """How far arcs' centres lie beside their places, mm along x and y by name."""
    if not isinstance(value, Mapping):
        return None
    return {name: pair for name, mm in value.items() if isinstance(name, str)
            and (pair := _pair(mm)) is not None and max(map(abs, pair)) <= MAX_OFFSET_MM}


IMPORTED = "Imported calibration. Its accuracy is unknown."  # the verdict of another program's file

_BORDER = {"before_pct": _number, "after_pct": _number}
_SIGMA = {"rms": _number, "median": _number}
_RESIDUAL = {"point": _pair, "px": _number, "mm": _number}
_FORM: dict[str, Any] = {
    "verdict": {"level": _string, "mm": _number, "sentence": _string, STATEMENTS: read_statements},
    **dict.fromkeys(("rms_px", "max_px", "rms_mm", "max_mm", "mm_per_px", "cv_rms_mm", "check_rms_mm"), _number),
    "inliers": _whole, "outliers": _whole, "sigma_mm": {**_SIGMA, "hat": {**_SIGMA, "known": _flag}},
    "distortion": {"kind": _string, "standard_lens_pct": _number, **_BORDER,
                   "per_border": dict.fromkeys(("left", "right", "top", "bottom"), _BORDER)},
    "per_feature": [{"feature": _feature, "kind": _string, "n": _whole, "rms_px": _number, "rms_mm": _number,
                     "max_mm": _number, "residuals": [_RESIDUAL]}],
    "height": {**dict.fromkeys(("entered_mm", "entered_sigma_mm", "points_mm", "points_sigma_mm", "sigmas"), _number),
               "state": _string},
    "line_offsets_mm": _offsets, "line_offset_sigmas_mm": _offsets, "arc_offsets_mm": _centres,
    "next_click": {"feature": _feature, "point": _pair, "worst_mm": _number, "worst_mm_then": _number,
                   "z_mm": _number},
    "warnings": [{"reason": _string, "text": _string, "fix": _string, "feature": _feature, "index": _whole,
                  STATEMENTS: read_statements}],
}


def read_report(value: Any) -> dict[str, Any]:
    """Return the report with every known entry of its kind, None or left out where it was not."""
    return _read(value, _FORM) or {}


def completed_report(report: Mapping[str, Any]) -> dict[str, Any]:
    """Return a read report of another server with what is shown of every version, empty where it was lacking."""
    verdict = {"level": "unknown", "mm": None, "sentence": IMPORTED}
    shown = {key: _complete(report.get(key), _FORM[key]) for key in ("distortion", "per_feature", "warnings")}
    return {**report, **shown, "verdict": {**verdict, **(report.get("verdict") or {})}}


def _complete(value: Any, form: Any) -> Any:
    if isinstance(form, dict):
        return {**(value or {}), **{key: _complete((value or {}).get(key), part) for key, part in form.items()}}
    return [_complete(row, form[0]) for row in value or ()] if isinstance(form, list) else value


def _read(value: Any, form: Any) -> Any:
    if isinstance(form, dict):
        if not isinstance(value, Mapping):
            return None
        return {**value, **{key: _read(value[key], part) for key, part in form.items() if key in value}}
    if isinstance(form, list):
        return [_read(row, form[0]) for row in value if isinstance(row, Mapping)] \
            if isinstance(value, (list, tuple)) else []
    return form(value)
