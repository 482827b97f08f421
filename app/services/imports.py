"""A calibration or a lens from a file that anybody may have written: all of it is checked before it is kept."""

import json
import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError
from starlette.datastructures import State

from app.api.schemas.requests import Name, Observation, OptionValue, Rotate, Size, Strict
from app.core.errors import BadInput
from app.core.field_json import field_from_json
from app.core.records import Calibration
from app.models import model_from_json
from app.workflows.interchange import (
    ImportOptions,
    calibration_from_file,
    for_camera,
    is_lens,
    lens_record_from_file,
    read_file,
    size_from_text,
)

Text = Annotated[str, Field(max_length=2000)]
FIX = "Give a file that Touchline exported as json."
MAX_IMPORT_BYTES = 4 << 20
PARTS = ("camera", "field", "region", "rotate", "image_size", "camera_id", "model")
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")


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


def keep_import(state: State, data: bytes, texts: Mapping[str, str], who: str,
                origin: str = "") -> tuple[dict[str, Any], str]:
    """Keep what the file holds: the record as JSON, and "calibrations" or "lenses", where it stands now.

    origin: where the file is from, in a sentence, for the note of a calibration that is not ours.
    """
    wanted = _wanted(texts)
    found = read_file(data, texts["file"], wanted.camera_id)
    if isinstance(found, Calibration):
        said = [name for name in PARTS if name != "camera" and texts[name]]
        if said:
            raise BadInput(f"A calibration exported as json says its {said[0]} itself.", f"Leave {said[0]} out.",
                           reason="bad-request")
        return state.store.calibrations.add(for_camera(_checked(found, data), wanted.camera),
                                            who).to_json(), "calibrations"
    if is_lens(found):
        return state.store.lenses.add(lens_record_from_file(found, wanted)), "lenses"
    made = calibration_from_file(found, wanted, state.fields)
    return state.store.calibrations.add(replace(made, note=f"{made.note} {origin}".strip()),
                                        who).to_json(), "calibrations"


def _wanted(texts: Mapping[str, str]) -> ImportOptions:
    """What the form says beside the file."""
    said: dict[str, Any] = {name: text for name, text in texts.items() if name != "file" and text}
    for name in ("field", "region", "camera", "model"):
        if name in said and not NAME.fullmatch(said[name]):
            raise BadInput(f"The {name} {said[name][:64]!r} is no name.", f"Send the {name} as it is called here.",
                           reason="bad-request")
    for name in ("rotate", "camera_id"):
        if name in said:
            if not re.fullmatch(r"[0-9]{1,10}", said[name]):
                raise BadInput(f"{name} is no whole number.", f"Send {name} as digits.", reason="bad-request")
            said[name] = int(said[name])
    if "image_size" in said:
        said["image_size"] = size_from_text(said["image_size"])
    return ImportOptions(**said)


def _checked(calibration: Calibration, data: bytes) -> Calibration:
    """Our own calibration from another house, its note saying where it is from; ids of that house are left out."""
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
