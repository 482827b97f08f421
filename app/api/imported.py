"""A calibration from a file that anybody may have written: every part of it is checked before it is kept."""

import json
from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError

from app.api.schemas import Name, Observation, OptionValue, Rotate, Size, Strict
from app.errors import BadInput
from app.exports import EXPORTS
from app.field_reader import field_from_json
from app.models import model_from_json
from app.records import Calibration

Text = Annotated[str, Field(max_length=2000)]
FIX = "Give a file that Touchline exported as json."


class ModelPart(Strict):
    name: Name
    parameters: dict[str, Any]


class CalibrationFile(Strict):
    """The form of an exported calibration; what the numbers mean is checked apart."""

    format: Text
    format_version: Literal[1]
    id: Name
    version: Annotated[int, Field(ge=1, le=10**9)]
    camera: Name | None
    field: Name
    region: Name
    rotate: Rotate
    model: ModelPart
    image_size: Size
    corrected_size: Size
    observations: Annotated[list[Observation], Field(max_length=500)]
    options: Annotated[dict[str, OptionValue], Field(max_length=50)]
    report: dict[str, Any]
    created_at: Text
    software: Text
    snapshot: Name | None
    image_sha256: Annotated[str, Field(max_length=64)] | None
    parent: Name | None
    note: Text
    made_by: Text = ""
    active: bool
    field_definition: dict[str, Any]


def calibration_from_file(data: bytes) -> Calibration:
    """The calibration in the file, its note saying where it is from; ids of another house are left out."""
    calibration = EXPORTS["json"].read(data)
    try:
        CalibrationFile.model_validate(json.loads(data))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(str(part) for part in first["loc"])
        raise BadInput(f"This is no calibration: {place}: {first['msg']}.", FIX, reason="bad-calibration") from None
    field = field_from_json(calibration.field)
    field.region(calibration.region, calibration.rotate)
    model = model_from_json(calibration.model_name, calibration.model_parameters)
    if model.corrected_size != calibration.corrected_size:
        raise BadInput("This is no calibration: its model and its corrected size disagree.", FIX,
                       reason="bad-calibration")
    origin = f"Imported: version {calibration.version} of {calibration.created_at[:40]}."
    return replace(calibration, field=field.to_json(), snapshot=None, parent=None, active=False,
                   note=f"{calibration.note} {origin}".strip()[:2000])
