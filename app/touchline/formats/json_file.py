"""Touchline's own format: the whole calibration as JSON, read back exactly."""

import json
from typing import Any

from touchline.core.errors import BadInput
from touchline.core.jobs import Progress, no_progress
from touchline.core.records import Calibration, observations_from_json
from touchline.formats import Format
from touchline.models import model_from_json

MAX_BYTES = 4 << 20  # 20 000 points with their residuals fit; more is no calibration
NAME = "touchline-calibration"  # of the format, in the file


def write(calibration: Calibration, _: Progress = no_progress) -> bytes:
    record = {"format": NAME, "format_version": 1, **calibration.to_json()}
    return json.dumps(record, indent=1, allow_nan=False, ensure_ascii=False).encode()


def read(data: bytes) -> Calibration:
    """Read what write wrote; BadInput for anything else. Every number is checked, the model is rebuilt."""
    if len(data) > MAX_BYTES:
        raise BadInput(
            f"The file has {len(data)} bytes. The limit for a calibration is {MAX_BYTES}.",
            "Use a file that Touchline exported as json.",
            reason="bad-calibration",
        )
    try:
        value = json.loads(data, parse_constant=_refuse_constant, parse_float=_finite)
    except (ValueError, RecursionError) as error:
        raise BadInput(
            f"The file is not valid JSON: {error}.",
            "Use a file that Touchline exported as json.",
            reason="bad-calibration",
        ) from None
    if not isinstance(value, dict) or value.get("format") != NAME:
        raise BadInput(
            "The file is not a Touchline calibration.",
            "Use a file that Touchline exported as json.",
            reason="bad-calibration",
        )
    calibration = Calibration.from_json(value)
    if not isinstance(calibration.model_parameters, dict):
        raise BadInput(
            "The file names no model.",
            "Use a file that Touchline exported as json.",
            reason="bad-calibration",
        )
    model_from_json(calibration.model_name, calibration.model_parameters)
    observations_from_json(calibration.observations)
    return calibration


def _finite(text: str) -> float:
    value = float(text)
    if abs(value) == float("inf"):
        raise ValueError(f"{text} is out of range")
    return value


def _refuse_constant(name: str) -> Any:
    raise ValueError(f"{name} is not a JSON number")


FORMAT = Format(
    "Touchline JSON",
    "application/json",
    ".json",
    "Complete: all models, with their points and settings.",
    write,
    read,
    recognises=lambda data: data.lstrip()[:1] == b"{" and f'"{NAME}"'.encode() in data,
)
