"""Plain data, as JSON and YAML have it: numbers without NaN, and types and reports read from it strictly.

    class Sample(TypedDict):
        rgb: tuple[Level, Level, Level]
        spread: NotRequired[Annotated[float, Interval(ge=0, le=1)]]

    sample = read(Sample, value, "The sample", "Give a sample that a profile holds.", "bad-colours")

read() is strict: "3" and true are no numbers, NaN and infinity are neither, and an entry that the type does not have is
an error. The type is a TypedDict or a dataclass; its limits are those of annotated_types.

An imported calibration's report may hold anything. Later readers rely on the kinds below; other entries stay as they
are. The covariance is checked against its model where it is used (evaluate/uncertainty.py).
"""

import math
from collections.abc import Mapping
from types import GenericAlias
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import numpy as np
from annotated_types import Len

from touchline.core.errors import BadInput
from touchline.core.statements import STATEMENTS, Sentence, read_statements, say

if TYPE_CHECKING:
    from pydantic import TypeAdapter


PointJson = Annotated[list[float], Len(2, 2)]
PointsJson = list[PointJson | None]  # None: out of reach
SizeJson = Annotated[list[int], Len(2, 2)]
JsonObject = dict[str, Any]

T = TypeVar("T")
# What pydantic finds, in words; {…} is the limit that it states.
FAULTS = {
    "missing": "is missing",
    "extra_forbidden": "is unknown",
    "unexpected_keyword_argument": "is unknown",
    "float_type": "is not a number",
    "finite_number": "is not a number",
    "int_type": "is not a whole number",
    "string_type": "is not a text",
    "bool_type": "is neither true nor false",
    "literal_error": "is not one of {expected}",
    "list_type": "is not a list",
    "tuple_type": "is not a list",
    "dict_type": "is not an object",
    "dataclass_type": "is not an object",
    "model_type": "is not an object",
    "greater_than_equal": "is less than {ge:g}",
    "less_than_equal": "is more than {le:g}",
    "too_short": "has fewer than {min_length} entries",
    "too_long": "has more than {max_length} entries",
    "string_too_short": "is too short",
    "string_pattern_mismatch": "has characters that are not allowed",
    "string_unicode": "is not valid text",
    "int_from_float": "is not a whole number",
    "int_parsing": "is not a whole number",
    "int_parsing_size": "is not a whole number",
    "float_parsing": "is not a number",
    "bool_parsing": "is neither true nor false",
    "greater_than": "is not more than {gt:g}",
    "less_than": "is not less than {lt:g}",
    "json_invalid": "is not valid JSON",
    "model_attributes_type": "is not an object",
    "string_too_long": "has more than {max_length} characters",
    "other": "is not valid",
}
MAX_PLACE = 100  # characters
MAX_SHOWN = 40  # characters of a refused value

MAX_TEXT = 400  # characters of a sentence; ours have 200
MAX_NAME = 64
MAX_OFFSET_MM = 1000.0
IMPORTED = "Imported calibration. Its accuracy is unknown."  # the verdict of another program's file


def in_words(value: object) -> str:
    """Return a refused value as a sentence shows it: a number or a short text itself, of others what they are."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return f"{value:g}"
    if isinstance(value, str):
        return repr(value[:MAX_SHOWN]) if value else "an empty text"
    return "a list" if isinstance(value, (list, tuple)) else "a group of values"


def fault_in_words(error: Any) -> Sentence:
    """Return what pydantic found wrong with a value; "is not valid" for a fault that has no words here."""
    kind = error["type"] if error["type"] in FAULTS else "other"
    values = dict(error.get("ctx", {}))
    if kind == "literal_error":
        values["expected"] = values["expected"].replace(" or ", ", ")
    return say(f"fault.{kind.replace('_', '-')}", FAULTS[kind], **values)


def number(value: Any) -> float | None:
    """A finite number, as a float; None for anything else."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return None
    try:
        found = float(value)
    except OverflowError:  # an integer of 400 digits
        return None
    return found if math.isfinite(found) else None


def finite_json(value: Any) -> Any:
    """Any JSON, with None for a number that is not finite."""
    if isinstance(value, Mapping):
        return {str(key): finite_json(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite_json(part) for part in value]
    return value if value is None or isinstance(value, (bool, str, int)) else number(value)


def nullable(values: Any) -> Any:
    """A number, or an array as nested lists; None for each number that is not finite."""
    numbers = np.asarray(values, np.float64)
    found = numbers.astype(object)
    found[~np.isfinite(numbers)] = None
    return found.tolist()


def nullable_points(points: Any) -> list[list[float] | None]:
    """Points (n, 2) as a list of pairs; None for each that is out of reach."""
    pairs = np.asarray(points, np.float64).reshape(-1, 2)
    reachable = np.all(np.isfinite(pairs), axis=1)
    return [
        pair if ok else None for pair, ok in zip(pairs.tolist(), reachable.tolist(), strict=True)
    ]


_adapters: "dict[type, TypeAdapter[Any]]" = {}  # made once: it takes a millisecond


class Whole:
    """Among a type's limits: a whole number may be written with a point, as 9.0."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        from pydantic_core import core_schema

        return core_schema.no_info_before_validator_function(
            lambda value: int(value) if isinstance(value, float) and value.is_integer() else value,
            handler(source),
        )


def read(kind: type[T], value: Any, what: str, fix: str, reason: str) -> T:
    """Read value as that type. what: how an error calls it, such as "The board"; fix, reason: of the BadInput."""
    from pydantic import ConfigDict, TypeAdapter, ValidationError
    from pydantic_core import to_json

    if kind not in _adapters:
        # a list hands its configuration on to all that is within
        one: Any = GenericAlias(list, (kind,))
        _adapters[kind] = TypeAdapter(
            one, config=ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)
        )
    # as JSON, whose lists and objects are tuples and dataclasses as well; NaN becomes a text, so no
    # number
    try:
        found: T = _adapters[kind].validate_json(to_json([value], inf_nan_mode="strings"))[0]
        return found
    except ValidationError as refused:
        error = refused.errors(include_url=False, include_input=False)[0]
        place = "".join(
            f"[{part}]" if isinstance(part, int) else f".{part}" for part in error["loc"][1:]
        )[1:MAX_PLACE]
        fault = fault_in_words(error)
        raise BadInput(
            f"{what}: {place} {fault}." if place else f"{what} {fault}.", fix, reason=reason
        ) from None
    except ValueError:  # half a character, or a nesting without an end
        raise BadInput(f"{what} has an entry that JSON cannot hold.", fix, reason=reason) from None


def text(value: Any, longest: int = MAX_TEXT) -> str | None:
    """A text, cut with an ellipsis where it is longer."""
    if not isinstance(value, str):
        return None
    return value if len(value) <= longest else value[: longest - 1] + "…"


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
    return {
        name: mm
        for name, mm in value.items()
        if isinstance(name, str) and number(mm) is not None and abs(mm) <= MAX_OFFSET_MM
    }


def _centres(value: Any) -> Any:
    """How far arcs' centres lie beside their places, mm along x and y by name."""
    if not isinstance(value, Mapping):
        return None
    return {
        name: pair
        for name, mm in value.items()
        if isinstance(name, str)
        and (pair := _pair(mm)) is not None
        and max(map(abs, pair)) <= MAX_OFFSET_MM
    }


_BORDER = {"before_pct": _number, "after_pct": _number}
_SIGMA = {"rms": _number, "median": _number}
_RESIDUAL = {"point": _pair, "px": _number, "mm": _number}
_FORM: dict[str, Any] = {
    "verdict": {"level": _string, "mm": _number, "sentence": _string, STATEMENTS: read_statements},
    **dict.fromkeys(
        ("rms_px", "max_px", "rms_mm", "max_mm", "mm_per_px", "cv_rms_mm", "check_rms_mm"), _number
    ),
    "inliers": _whole,
    "outliers": _whole,
    "sigma_mm": {**_SIGMA, "hat": {**_SIGMA, "known": _flag}},
    "distortion": {
        "kind": _string,
        "standard_lens_pct": _number,
        **_BORDER,
        "per_border": dict.fromkeys(("left", "right", "top", "bottom"), _BORDER),
    },
    "per_feature": [
        {
            "feature": _feature,
            "kind": _string,
            "n": _whole,
            "rms_px": _number,
            "rms_mm": _number,
            "max_mm": _number,
            "residuals": [_RESIDUAL],
        }
    ],
    "height": {
        **dict.fromkeys(
            ("entered_mm", "entered_sigma_mm", "points_mm", "points_sigma_mm", "sigmas"), _number
        ),
        "state": _string,
    },
    "line_offsets_mm": _offsets,
    "line_offset_sigmas_mm": _offsets,
    "arc_offsets_mm": _centres,
    "next_click": {
        "feature": _feature,
        "point": _pair,
        "worst_mm": _number,
        "worst_mm_then": _number,
        "z_mm": _number,
    },
    "warnings": [
        {
            "reason": _string,
            "text": _string,
            "fix": _string,
            "feature": _feature,
            "index": _whole,
            STATEMENTS: read_statements,
        }
    ],
}


def read_report(value: Any) -> dict[str, Any]:
    """Return the report with every known entry of its kind, None or left out where it was not."""
    return _read(value, _FORM) or {}


def completed_report(report: Mapping[str, Any]) -> dict[str, Any]:
    """Return a read report of another server with what is shown of every version, empty where it was lacking."""
    verdict = {"level": "unknown", "mm": None, "sentence": IMPORTED}
    shown = {
        key: _complete(report.get(key), _FORM[key])
        for key in ("distortion", "per_feature", "warnings")
    }
    return {**report, **shown, "verdict": {**verdict, **(report.get("verdict") or {})}}


def _complete(value: Any, form: Any) -> Any:
    if isinstance(form, dict):
        return {
            **(value or {}),
            **{key: _complete((value or {}).get(key), part) for key, part in form.items()},
        }
    return [_complete(row, form[0]) for row in value or ()] if isinstance(form, list) else value


def _read(value: Any, form: Any) -> Any:
    if isinstance(form, dict):
        if not isinstance(value, Mapping):
            return None
        return {
            **value,
            **{key: _read(value[key], part) for key, part in form.items() if key in value},
        }
    if isinstance(form, list):
        return (
            [_read(row, form[0]) for row in value if isinstance(row, Mapping)]
            if isinstance(value, (list, tuple))
            else []
        )
    return form(value)
