"""What an answer looks like: plain JSON in which nothing is NaN, and pictures."""

import json
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from starlette.responses import Response

from app.core.geometry import Points
from app.images import ENCODED_MEDIA_TYPES, encode


def json_bytes(value: Any) -> bytes:
    """UTF-8 JSON; NaN and infinities are null, and half a surrogate pair is a question mark."""
    try:
        text = json.dumps(value, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    except ValueError:
        text = json.dumps(_finite(value), allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    return text.encode("utf-8", "replace")


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    return [_finite(item) for item in value] if isinstance(value, (list, tuple)) else value


class Json(Response):
    """A JSON answer that is sent as it is; response models only describe it in the documentation."""

    media_type = "application/json"

    def render(self, content: Any) -> bytes:
        return json_bytes(content)


def points_or_null(points: Points) -> list[list[float] | None]:
    """(n, 2) points as JSON, unreachable ones as null."""
    reachable = np.isfinite(points).all(axis=-1)
    return [point if ok else None for point, ok in zip(points.tolist(), reachable.tolist(), strict=True)]


def picture(pixels: NDArray[np.uint8], format: str, headers: dict[str, str] | None = None) -> Response:
    """A picture as a file of that format."""
    return Response(encode(pixels, format), media_type=ENCODED_MEDIA_TYPES[format], headers=headers)
