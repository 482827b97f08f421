"""Strict numbers in text files: checked as a parser returned them, written so that every reader accepts them.

YAML 1.1 takes 1e-05 for a word: it wants a point and a sign, 1.0e-05, and OpenCV, Python and JSON read that as well.
"""

import math
import re
from collections.abc import Iterable
from typing import Any

from touchline.core.errors import BadInput
from touchline.core.geometry import MAX_COORDINATE, MAX_SIDE_PX, MIN_SIDE_PX, ImageSize

NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
DECIMAL_COMMA = re.compile(r"[+-]?[0-9]+,[0-9]+(?:[eE][+-]?[0-9]+)?")
MAX_DIGITS = 400


def format_number(value: float) -> str:
    """Return the shortest text that reads back as the same double: 5.0, -0.25, 1.0e-05."""
    text = repr(float(value))
    mantissa, e, exponent = text.partition("e")
    return f"{mantissa}.0e{exponent}" if e and "." not in mantissa else text


def format_list(values: Iterable[float]) -> str:
    """Return a list in brackets: [1.0, 2.0]."""
    return f"[{', '.join(format_number(v) for v in values)}]"


def number(
    value: Any, at: str, low: float = -MAX_COORDINATE, high: float = MAX_COORDINATE
) -> float:
    """Return one finite number, given as such or as text. BadInput names the place, and recognises a decimal comma."""
    if isinstance(value, str):
        text = value.strip()
        if DECIMAL_COMMA.fullmatch(text[:MAX_DIGITS]):
            raise format_error(
                f"{at} is written with a decimal comma ({text[:40]}).", "Use a decimal point."
            )
        value = float(text) if len(text) <= MAX_DIGITS and NUMBER.fullmatch(text) else None
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise format_error(f"{at} is not a number.", "Correct it.")
    if not low <= value <= high:  # NaN is in no range
        raise format_error(
            f"{at} is {value:g}."
            if isinstance(value, float) and math.isfinite(value)
            else f"{at} is out of range.",
            f"Use a number from {low:g} to {high:g}.",
        )
    return float(value)


def integer(value: Any, at: str, low: int, high: int) -> int:
    """Return a whole number; 640.0 is one."""
    found = number(value, at, low, high)
    if found != int(found):
        raise format_error(f"{at} is {found:g}.", "Use a whole number.")
    return int(found)


def numbers(value: Any, at: str, counts: Iterable[int]) -> tuple[float, ...]:
    """Return a list of numbers whose length is one of `counts`."""
    counts = tuple(counts)
    many = " or ".join(map(str, counts))
    if not isinstance(value, (list, tuple)):
        raise format_error(f"{at} is not a list of numbers.", f"Use {many} numbers.")
    if len(value) not in counts:
        commas = (
            " If the file has decimal commas, use decimal points."
            if len(value) > max(counts)
            else ""
        )
        raise format_error(
            f"{at} has {len(value)} number{'' if len(value) == 1 else 's'}.", f"Use {many}.{commas}"
        )
    return tuple(number(v, f"{at}[{i}]") for i, v in enumerate(value))


def require(value: Any, key: str, at: str) -> Any:
    """Return value[key] of what must be a mapping with that key."""
    if not isinstance(value, dict):
        raise format_error(f"{at} is not a mapping.", f"Use a mapping with {key}.")
    if key not in value:
        raise format_error(f"{at} has no {key}.", f"Add {key}.")
    return value[key]


def flat_numbers(value: Any, at: str) -> list[Any]:
    """Return the numbers of a row or column in any shape: a list, a list of lists, {rows, cols, data}."""
    if isinstance(value, dict):
        flat = flat_numbers(value.get("data", []), f"{at}.data")
        if "rows" in value or "cols" in value:
            rows, columns = (
                integer(value.get(key), f"{at}.{key}", 0, 100) for key in ("rows", "cols")
            )
            if min(rows, columns) > 1:
                raise format_error(f"{at} is {rows} × {columns}.", "Use one row or one column.")
            if rows * columns != len(flat):
                raise format_error(
                    f"{at} has {len(flat)} numbers for {rows} × {columns}.", "Correct the file."
                )
        return flat
    if not isinstance(value, list):
        raise format_error(f"{at} is not a list of numbers.", "Use the distortion coefficients.")
    if value and all(isinstance(row, list) for row in value):
        if len(value) > 1 and any(len(row) != 1 for row in value):
            raise format_error(f"{at} is not one row or one column.", "Use one row or one column.")
        return [number for row in value for number in row]
    return value


def camera_matrix(value: Any, at: str) -> tuple[float, ...]:
    """Return the numbers of a 3 × 3 matrix row by row: {rows, cols, data}, nine, or three rows of three.

    One that is written column by column is known by its last row, 0 0 1, which is then its last column.
    """
    if isinstance(value, dict):
        shape = tuple(integer(value.get(key, 3), f"{at}.{key}", 1, 100) for key in ("rows", "cols"))
        if shape != (3, 3):
            raise format_error(f"{at} is {shape[0]} × {shape[1]}.", "Use a matrix of 3 × 3.")
        return camera_matrix(value.get("data"), f"{at}.data")
    if isinstance(value, list) and len(value) == 3:
        rows = [numbers(row, f"{at}[{i}]", (3,)) for i, row in enumerate(value)]
        nine = rows[0] + rows[1] + rows[2]
    else:
        nine = numbers(value, at, (9,))
    by_columns = not any((nine[2], nine[5])) and any(nine[6:8])
    return tuple(nine[3 * i + j] for j in range(3) for i in range(3)) if by_columns else nine


def checked_size(width: Any, height: Any) -> ImageSize:
    return ImageSize(
        integer(width, "The image width", MIN_SIDE_PX, MAX_SIDE_PX),
        integer(height, "The image height", MIN_SIDE_PX, MAX_SIDE_PX),
    )


def format_error(what: str, fix: str) -> BadInput:
    """Return the error for a file that cannot be read."""
    return BadInput(what, fix, reason="bad-calibration")
