"""JSON text in which nothing is NaN."""

import json
from typing import Any

from touchline.core.json_values import finite_json


def json_bytes(value: Any) -> bytes:
    """Return UTF-8 JSON; NaN and infinities are null, and half a surrogate pair is a question mark."""
    try:
        text = json.dumps(value, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    except ValueError:
        text = json.dumps(finite_json(value), allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    return text.encode("utf-8", "replace")
