"""Values out of a record that a stranger may have written: of the kind that is meant, or None.

An imported calibration's report is kept as it came. What is no finite number is no number here, and texts have an end.
"""

import math
from collections.abc import Mapping
from typing import Any

MAX_TEXT = 400  # characters of a sentence; ours have 200
MAX_NAME = 64


def number(value: Any) -> float | None:
    """A finite number as a float."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return None
    try:
        found = float(value)
    except OverflowError:  # an integer of 400 digits
        return None
    return found if math.isfinite(found) else None


def whole(value: Any) -> int | None:
    found = number(value)
    return None if found is None or found != int(found) else int(found)


def text(value: Any, longest: int = MAX_TEXT) -> str | None:
    """A text, cut with an ellipsis where it is longer."""
    if not isinstance(value, str):
        return None
    return value if len(value) <= longest else value[:longest - 1] + "…"


def table(value: Any) -> Mapping[str, Any]:
    return value if isinstance(value, Mapping) else {}


def rows(value: Any, most: int) -> list[Mapping[str, Any]]:
    """The objects of a list, so many at most."""
    return [row for row in value if isinstance(row, Mapping)][:most] if isinstance(value, (list, tuple)) else []


def pair(value: Any) -> list[float] | None:
    """Two finite numbers."""
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        return None
    found = [number(part) for part in value]
    return None if None in found else found  # type: ignore[return-value]


def feature(value: Any) -> str | list[float] | None:
    """A border, line, arc or landmark by name, or a field position in mm."""
    return text(value, MAX_NAME) if isinstance(value, str) else pair(value)


def plain(value: Any) -> Any:
    """Any JSON, with null for a number that is not finite."""
    if isinstance(value, Mapping):
        return {str(key): plain(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(part) for part in value]
    return value if value is None or isinstance(value, (bool, str, int)) else number(value)
