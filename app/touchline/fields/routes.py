"""/fields: those that come with Touchline, and the operator's own, which are made, changed and deleted here."""

import json
from collections.abc import Iterable
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Body, Header, Request
from pydantic import Field as Value
from starlette.responses import Response

from touchline.api import schemas
from touchline.api.bodies import uploaded_file
from touchline.api.dependencies import CallerDep, IfMatch, ServicesDep, in_thread
from touchline.api.requests import CameraId, Id
from touchline.api.responses import Json, accepted, attachment, packed, versioned
from touchline.api.schemas import EXPORTED, page_of, response, upload
from touchline.core.errors import BadInput, Conflict
from touchline.core.field import Field, FieldJson
from touchline.core.field_json import MAX_SIDE_MM, MIN_SIDE_MM, field_from_json, refuse
from touchline.core.jobs import Progress
from touchline.core.records import Calibration
from touchline.core.statements import named, say, stated
from touchline.fields.measuring import (
    MAX_DISTANCES,
    TAPE_SIGMA_MM,
    MeasuredFieldJson,
    TapeDistance,
    adjust_to_tape,
    as_found,
)
from touchline.fields.proposal import ProposedFieldJson, proposed_field
from touchline.fields.seen_markings import SeenField, seen_field
from touchline.formats import ssl_vision, vision_processor
from touchline.formats.ssl_field import field_from_wire, field_to_wire
from touchline.services.container import Services
from touchline.services.fields import delete_field, save_field, simulated
from touchline.services.forms import Strict
from touchline.ssl_protocol.protobuf import encode
from touchline.ssl_protocol.ssl_vision_pb2 import SSL_GeometryData, SSL_Source, SSL_WrapperPacket
from touchline.store.fields import field_etag
from touchline.workflows.calibration_request import run_refit
from touchline.workflows.interchange import league_field

router = APIRouter(prefix="/fields", tags=["fields"])


class PlayingField(FieldJson):
    """A field as the API shows it. own: whether an operator made it, and may change it."""

    own: bool


PlayingFields = response("PlayingFields", page_of("PlayingFieldsPage", PlayingField), revision=str)

MAX_FILE_BYTES = 1 << 20
FIX = "Use a field exported as JSON, or a geometry packet or settings of the league's programs."
Side = Annotated[float, Value(ge=MIN_SIDE_MM, le=MAX_SIDE_MM)]
OnlyNew = Annotated[
    str | None,
    Header(alias="If-None-Match", pattern=r"^\*$", description="*: only where there is none"),
]


class Refit(Strict):
    """Which cameras are calibrated again."""

    cameras: Annotated[list[CameraId], Value(min_length=1, max_length=100)] | None = Value(
        None,
        description="by default all cameras whose active calibration is older than the field change",
    )


@router.get("", response_model=PlayingFields)
def list_fields(request: Request, services: ServicesDep) -> Response:
    """List every field with its lines, arcs, landmarks and regions, mm. revision: as GET /cameras/status tells it."""
    revision = services.fields.revision  # an older one than the fields only has them read once more
    items = [field_json(services, field) for field in services.fields.values()]
    return packed(request, {"items": items, "next_cursor": None, "revision": revision})


@router.get("/{name}", response_model=PlayingField)
def read_field(services: ServicesDep, name: Id) -> Json:
    """Return one field by name; its ETag goes into If-Match of PUT and DELETE."""
    return _shown(services, services.fields[name])


@router.put("/{name}", response_model=PlayingField)
async def save_own_field(
    services: ServicesDep,
    name: Id,
    body: Annotated[dict[str, Any], Body()],
    if_match: IfMatch = None,
    if_none_match: OnlyNew = None,
) -> Json:
    """Create or change a field of your own; those that come with Touchline cannot be changed.

    With If-Match only if nobody has changed it since: else 412, with `current`. With If-None-Match: * only if there is
    none of that name: else 409. A refusal's `entry` says which entry is wrong, such as "lines[3].to".
    """
    field = await services.run_in_thread(
        save_field, services, name, body, if_match, if_none_match is not None
    )
    for camera in await services.run_in_thread(simulated, services, name):
        await services.live.forget(camera)
        services.live.refresh(camera)
    return _shown(services, field)


@router.delete("/{name}", status_code=204, response_class=Response)
@in_thread
def delete_own_field(services: ServicesDep, name: Id, if_match: IfMatch = None) -> None:
    """Delete a field of your own; 409 while a camera, a rig or publishing names it. Calibrations keep theirs.

    With If-Match only if nobody has changed it since.
    """
    delete_field(services, name, if_match)


@router.get("/{name}/export/{format}", response_class=Response, responses=EXPORTED)
def export_field(
    services: ServicesDep, name: Id, format: Literal["json", "ssl-vision", "vision-processor"]
) -> Response:
    """Return the field as a file: JSON, or without cameras and in whole millimetres a geometry packet of the league or
    vision-processor's geometry.yml."""
    data, media_type, suffix = write_field(services.fields[name], format)
    return Response(
        data, media_type=media_type, headers={"Content-Disposition": attachment(f"{name}{suffix}")}
    )


@router.post("/read", response_model=PlayingField, openapi_extra={"requestBody": upload()})
async def read_field_file(request: Request, services: ServicesDep) -> Json:
    """Read the field of a file, multipart with `file`: JSON, a geometry packet of the league, vision-processor's
    geometry.yml or ssl-vision's settings. Nothing is saved."""
    data, _ = await uploaded_file(request, MAX_FILE_BYTES, ())
    field = await services.run_in_thread(parsed_field, data, tuple(services.fields.values()))
    return Json(field_json(services, field))


class Distance(Strict):
    """Between two landmarks, line middle to line middle, by tape."""

    start: CameraId = Value(alias="from")
    end: CameraId = Value(alias="to")
    mm: Annotated[float, Value(gt=0, le=MAX_SIDE_MM)]
    sigma_mm: Annotated[float, Value(ge=0.1, le=1000)] = TAPE_SIGMA_MM


class Tape(Strict):
    """A field as the rules have it, and what was measured on it."""

    field: dict[str, Any]
    distances: Annotated[list[Distance], Value(min_length=1, max_length=MAX_DISTANCES)]


class Painted(Strict):
    """A field, and a calibration over it that says where its lines lie."""

    field: dict[str, Any]
    calibration: Id


@router.post("/measured", response_model=MeasuredFieldJson)
@in_thread
def adjust_field(services: ServicesDep, body: Tape) -> Json:
    """Adjust a field to tape distances: where its lines lie, how sure that is, and what is left of each distance, mm.

    Nothing is saved.
    """
    distances = [TapeDistance(one.start, one.end, one.mm, one.sigma_mm) for one in body.distances]
    return Json(adjust_to_tape(field_from_json(body.field), distances).to_json())


@router.post("/painted", response_model=MeasuredFieldJson)
@in_thread
def adopt_line_offsets(services: ServicesDep, body: Painted) -> Json:
    """Adjust a field to where a calibration has found its lines, with σ where that is known. Nothing is saved."""
    calibration = services.store.calibrations.get(body.calibration)
    return Json(as_found(calibration, field_from_json(body.field)).to_json())


class CalibratedPicture(Strict):
    """A field, and a calibrated image that may show more of it."""

    field: dict[str, Any]
    calibration: Id
    snapshot: Id | None = Value(None, description="by default the calibration image")


@router.post("/seen", response_model=SeenField)
async def add_seen_lines(request: Request, services: ServicesDep, body: CalibratedPicture) -> Json:
    """Add lines and circles that a calibrated image shows and the field does not have. Nothing is saved.

    The calibration says where the carpet is; it may be one of another field in the same place, such as the borders.
    """
    calibration = await services.run_in_thread(services.store.calibrations.get, body.calibration)
    snapshot = body.snapshot or calibration.snapshot
    if snapshot is None:
        raise Conflict(
            say("field.no-image", "This calibration has no image."),
            "Select an image with snapshot.",
            reason="no-picture",
        )
    field = field_from_json(body.field)

    def look(progress: Progress) -> Json:
        return Json(seen_field(services.frame(snapshot).pixels, calibration, field, progress))

    return await services.process_picture(calibration.image_size, look, request.is_disconnected)


class Uncalibrated(Strict):
    """An image, and the field's length between its goal lines, or its width, or both, by tape."""

    snapshot: Id
    length_mm: Side | None = None
    width_mm: Side | None = None


@router.post("/proposed", response_model=ProposedFieldJson)
async def propose_field(request: Request, services: ServicesDep, body: Uncalibrated) -> Json:
    """Propose a field from the lines of an image that shows all its borders. Nothing is saved.

    Its lines are made the same on both halves; line_sigma_mm says how exactly they were read.
    """
    snapshot = await services.run_in_thread(services.store.snapshots.get, body.snapshot)

    def look(progress: Progress) -> Json:
        return Json(
            proposed_field(
                services.frame(body.snapshot).pixels, body.length_mm, body.width_mm, progress
            )
        )

    return await services.process_picture(snapshot.size, look, request.is_disconnected)


@router.post("/{name}/refit", status_code=202, response_model=schemas.Job)
@in_thread
def refit_field(services: ServicesDep, caller: CallerDep, name: Id, body: Refit) -> Response:
    """Start a job that makes calibrations again from their saved points on the current field, as new versions of
    which none is activated: {"calibrations": [id, …]}."""
    field = services.fields[name]
    outdated = outdated_calibrations(services, field)
    known = {calibration.camera for calibration in outdated}
    if unknown := set(body.cameras or ()) - known:
        raise BadInput(
            f"The active calibration of {sorted(unknown)[0]} matches this field.",
            f"Use {', '.join(sorted(map(str, known))) or 'none: all calibrations match the field'}.",
            reason="unknown-camera",
        )
    chosen = [
        one.to_json() for one in outdated if body.cameras is None or one.camera in body.cameras
    ]
    if not chosen:
        raise Conflict(
            say("field.all-match", "All active calibrations match the field."),
            say("field.no-new-versions", "No new versions are needed."),
            reason="nothing-to-refit",
        )
    spec = {"calibrations": chosen, "rectangles": {}, "field": field.to_json()}
    return accepted(
        services.jobs.start(
            "field-refit", run_refit, spec, "calibrations", {"by": caller.name}, caller=caller
        )
    )


def _shown(services: Services, field: Field) -> Json:
    return versioned(field_json(services, field), field_etag(field))


def write_field(field: Field, format: str) -> tuple[bytes, str, str]:
    """Return (bytes, media type, suffix) in a format; those of the league have whole mm and no landmarks."""
    if format == "json":
        text = json.dumps(field.to_json(), indent=1, allow_nan=False, ensure_ascii=False)
        return text.encode(), "application/json", ".json"
    if format == "vision-processor":
        kind = vision_processor.FORMAT
        return vision_processor.geometry(field).encode(), kind.media_type, kind.suffix
    packet = SSL_WrapperPacket(
        geometry=SSL_GeometryData(field=field_to_wire(field)), source=SSL_Source.OTHER
    )
    return encode(packet), ssl_vision.FORMAT.media_type, ssl_vision.FORMAT.suffix


def parsed_field(data: bytes, known: Iterable[Field] = ()) -> Field:
    """Return the field that write_field wrote, of any geometry packet or settings of ssl-vision; else BadInput.

    known: one of the league with just their lines is one of these, with its landmarks and regions.
    """
    if (found := league_field(data)) is not None:
        return field_from_wire(found, known)
    try:
        value = json.loads(data)
    except (ValueError, RecursionError):
        raise refuse("The file is not a field.", FIX) from None
    return field_from_json(value)


def field_json(services: Services, field: Field) -> PlayingField:
    own = services.fields.is_own(field.name)
    is_shipped = (
        not own
        and field.name in services.fields
        and field.title == services.fields[field.name].title
    )
    title = named(f"field.{field.name}", field.title) if is_shipped else field.title
    shown: PlayingField = {**field.to_json(), "title": title, "own": own}
    return stated(shown)


def outdated_calibrations(services: Services, field: Field) -> list[Calibration]:
    """List the active calibrations that the field's changes have made wrong."""
    now = field.to_json()
    return [
        calibration
        for calibration in services.cameras.active_calibrations()
        if calibration.field["name"] == field.name and calibration.field_changes(now)
    ]
