"""Import a calibration or a lens from a file that anybody may have written: all of it is checked before it is saved."""

import json
import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError

from touchline.core.errors import BadInput
from touchline.core.field_json import field_from_json
from touchline.core.json_values import completed_report
from touchline.core.quarter_turn import check_turn
from touchline.core.records import Calibration
from touchline.models import model_from_json
from touchline.services.container import Services
from touchline.services.fields import save_field
from touchline.services.forms import (
    FittedModelForm,
    Name,
    Note,
    ObservationForm,
    OptionValues,
    Rotate,
    Size,
    Strict,
)
from touchline.workflows import interchange

FIX = "Use a file that Touchline exported as json."
# given beside the file
OPTIONS = (
    "camera",
    "field",
    "region",
    "rotate",
    "image_size",
    "camera_id",
    "model",
    "entry",
    "turn",
)
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")


class CalibrationFile(Strict):
    """The form of an exported calibration; what the numbers mean is checked separately."""

    format: Note
    format_version: Literal[1]
    id: Name
    version: Annotated[int, Field(ge=1, le=10**9)]
    camera: Name | None
    field: Name
    region: Name
    rotate: Rotate
    model: FittedModelForm
    image_size: Size
    corrected_size: Size
    observations: Annotated[list[ObservationForm], Field(max_length=500)]
    options: OptionValues
    report: dict[str, Any]
    created_at: Note
    software: Note
    snapshot: Name | None
    image_sha256: Annotated[str, Field(max_length=64)] | None
    parent: Name | None
    note: Note
    made_by: Note = ""
    active: bool
    field_definition: dict[str, Any]


def import_file(
    services: Services, data: bytes, texts: Mapping[str, str], by: str, origin: str = ""
) -> tuple[dict[str, Any], str]:
    """Save what the file holds; return the record as JSON, and "calibrations" or "lenses", where it is now.

    origin: where the file is from, in a sentence, for the note of a calibration of another format.
    """
    store, options = services.store, _import_options(texts)
    content = interchange.read_file(data, options)
    if isinstance(content, Calibration):
        given = [name for name in OPTIONS if name not in ("camera", "turn") and texts[name]]
        if given:
            raise BadInput(
                f"A calibration exported as json already states its {given[0]}.",
                f"Omit {given[0]}.",
                reason="bad-request",
            )
        checked = _checked(content, data)
        mine = interchange.turned_as_stated(
            replace(checked, camera=options.camera or checked.camera), options
        )
        return store.calibrations.add(mine, by).to_json(), "calibrations"
    if interchange.is_lens(content):
        return store.lenses.add(interchange.lens_record_from_file(content, options)), "lenses"
    imported = interchange.calibration_from_file(content, options, services.fields)
    # that of a packet: without it, the calibration is of no use
    if imported.field["name"] not in services.fields:
        save_field(services, imported.field["name"], dict(imported.field), None, new=True)
    return store.calibrations.add(
        replace(imported, note=f"{imported.note} {origin}".strip()), by
    ).to_json(), "calibrations"


def _import_options(texts: Mapping[str, str]) -> interchange.ImportOptions:
    given: dict[str, Any] = {name: text for name, text in texts.items() if name != "file" and text}
    for name in ("field", "region", "camera", "model"):
        if name in given and not NAME.fullmatch(given[name]):
            raise BadInput(
                f"The {name} {given[name][:64]!r} is not a valid name.",
                f"Send the name of an existing {name}.",
                reason="bad-request",
            )
    for name in ("rotate", "camera_id", "turn"):
        if name in given:
            if not re.fullmatch(r"[0-9]{1,10}", given[name]):
                raise BadInput(
                    f"{name} is not a whole number.",
                    f"Send {name} as digits.",
                    reason="bad-request",
                )
            given[name] = int(given[name])
    check_turn(given.get("turn", 0))
    if "image_size" in given:
        given["image_size"] = interchange.size_from_text(given["image_size"])
    return interchange.ImportOptions(**given)


def _checked(calibration: Calibration, data: bytes) -> Calibration:
    """Check an exported calibration; its note says where it is from, ids of the other server are left out."""
    try:
        CalibrationFile.model_validate(json.loads(data))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        location = ".".join(str(part) for part in first["loc"])
        raise BadInput(
            f"This is not a valid calibration: {location}: {first['msg']}.",
            FIX,
            reason="bad-calibration",
        ) from None
    field = field_from_json(calibration.field)
    field.region(calibration.region, calibration.rotate)
    model = model_from_json(calibration.model_name, calibration.model_parameters)
    if model.corrected_size != calibration.corrected_size:
        raise BadInput(
            "This is not a valid calibration: its model and its corrected size do not match.",
            FIX,
            reason="bad-calibration",
        )
    origin = f"Imported: version {calibration.version} of {calibration.created_at[:40]}."
    return replace(
        calibration,
        field=field.to_json(),
        report=completed_report(calibration.report),
        snapshot=None,
        parent=None,
        active=False,
        note=f"{calibration.note} {origin}".strip()[:2000],
    )
