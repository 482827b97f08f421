"""Numbers as plain JSON: None where one is not finite, since JSON has neither NaN nor infinity."""

import math
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from annotated_types import Len

PointJson = Annotated[list[float], Len(2, 2)]
PointsJson = list[PointJson | None]  # None: out of reach
SizeJson = Annotated[list[int], Len(2, 2)]
JsonObject = dict[str, Any]


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
    return [pair if ok else None for pair, ok in zip(pairs.tolist(), reachable.tolist(), strict=True)]
