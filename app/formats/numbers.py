"""Numbers in files of text: read strictly from whatever a parser made of them, written so that every reader reads them.

YAML 1.1 takes 1e-05 for a word: it wants a point and a sign, 1.0e-05, and OpenCV, Python and JSON read that as well.
"""

import math
import re
from collections.abc import Iterable
from typing import Any

from app.core.errors import BadInput
from app.core.geometry import MAX_COORDINATE

NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
DECIMAL_COMMA = re.compile(r"[+-]?[0-9]+,[0-9]+(?:[eE][+-]?[0-9]+)?")
MAX_DIGITS = 400


def written(value: float) -> str:
    """The shortest text that is read back as the same double: 5.0, -0.25, 1.0e-05."""
    text = repr(float(value))
    mantissa, e, exponent = text.partition("e")
    return f"{mantissa}.0e{exponent}" if e and "." not in mantissa else text


def listed(values: Iterable[float]) -> str:
    """[1.0, 2.0]."""
    return f"[{', '.join(written(v) for v in values)}]"


def number(value: Any, at: str, low: float = -MAX_COORDINATE, high: float = MAX_COORDINATE) -> float:
    """One finite number, given as such or as text; BadInput names the place, and a decimal comma by name."""
    if isinstance(value, str):
        text = value.strip()
        if DECIMAL_COMMA.fullmatch(text[:MAX_DIGITS]):
            raise refuse(f"{at} is written with a decimal comma ({text[:40]}).", "Write a decimal point.")
        value = float(text) if len(text) <= MAX_DIGITS and NUMBER.fullmatch(text) else None
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise refuse(f"{at} is no number.", "Correct it.")
    if not low <= value <= high:  # NaN is in no range
        raise refuse(f"{at} is {value:g}." if isinstance(value, float) and math.isfinite(value) else
                     f"{at} is beyond all numbers that can be meant.", f"Give a number from {low:g} to {high:g}.")
    return float(value)


def whole(value: Any, at: str, low: int, high: int) -> int:
    """A whole number; 640.0 is one."""
    found = number(value, at, low, high)
    if found != int(found):
        raise refuse(f"{at} is {found:g}.", "Give a whole number.")
    return int(found)


def numbers(value: Any, at: str, counts: Iterable[int]) -> tuple[float, ...]:
    """A list of numbers, as many as one of `counts` says."""
    counts = tuple(counts)
    many = " or ".join(map(str, counts))
    if not isinstance(value, (list, tuple)):
        raise refuse(f"{at} is no list of numbers.", f"Give {many} numbers.")
    if len(value) not in counts:
        commas = " If it was written with decimal commas, write points." if len(value) > max(counts) else ""
        raise refuse(f"{at} has {len(value)} number{'' if len(value) == 1 else 's'}.", f"Give {many}.{commas}")
    return tuple(number(v, f"{at}[{i}]") for i, v in enumerate(value))


def entry(value: Any, key: str, at: str) -> Any:
    """value[key] of what must be a mapping that has it."""
    if not isinstance(value, dict):
        raise refuse(f"{at} is no mapping.", f"Give one with {key}.")
    if key not in value:
        raise refuse(f"{at} has no {key}.", f"Add {key}.")
    return value[key]


def matrix(value: Any, at: str, rows: int, columns: int) -> tuple[float, ...]:
    """The numbers of {rows, cols, data}, row by row; its shape is checked."""
    shape = tuple(whole(entry(value, key, at), f"{at}.{key}", 1, 100) for key in ("rows", "cols"))
    if shape != (rows, columns):
        raise refuse(f"{at} is {shape[0]} × {shape[1]}.", f"Give a matrix of {rows} × {columns}.")
    return numbers(entry(value, "data", at), f"{at}.data", (rows * columns,))


def intrinsics(k: tuple[float, ...], at: str) -> tuple[tuple[float, float], tuple[float, float]]:
    """Focal lengths and centre, px, from a camera matrix (9 numbers) that is none but for those four."""
    fx, skew, cx, zero, fy, cy, *last = k
    if abs(skew) > 1e-9 * abs(fx) or zero != 0 or last != [0, 0, 1]:
        raise refuse(f"{at} is no camera matrix without skew.", "Give [fx, 0, cx, 0, fy, cy, 0, 0, 1].")
    return (fx, fy), (cx, cy)


def refuse(what: str, fix: str) -> BadInput:
    return BadInput(what, fix, reason="bad-calibration")
