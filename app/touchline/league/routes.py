"""/publishing: geometry on the league's multicast group, sent and received; and what teams receive of a version."""

import hashlib
from datetime import UTC, datetime
from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request
from pydantic import Field
from starlette.responses import Response

from touchline.api import schemas
from touchline.api.bodies import uploaded_file
from touchline.api.dependencies import IfMatch, OperatorDep, ServicesDep, in_thread
from touchline.api.requests import CameraId, Id
from touchline.api.responses import Json, attachment, created, versioned
from touchline.api.schemas import JsonObject, Responses, Texts, list_of, response, upload
from touchline.core.errors import Conflict
from touchline.core.statements import say, stated
from touchline.formats import vision_processor
from touchline.formats.numbers import format_error
from touchline.league.ball_models import BallModels
from touchline.league.packet import PublishingConfig
from touchline.league.service import SERVER, PublishingService
from touchline.services.container import Services
from touchline.services.forms import Name, Number, Rotate, Size, Strict
from touchline.services.import_file import OPTIONS, import_file
from touchline.workflows.interchange import ball_models

router = APIRouter(prefix="/publishing", tags=["publishing"])
packets = APIRouter(tags=["judging"])

PublishedCamera = response(
    "PublishedCamera",
    camera=str,
    calibration=str,
    version=int,
    model=str,
    field=str,
    region=str,
    camera_id=int,
    published=bool,
    exact=bool,
    loss=JsonObject | None,
    expected=JsonObject | None,
    fit_expected=JsonObject | None,
    level=str | None,
    warnings=list[JsonObject],
    problem=Texts | None,
)
Publishing = response(
    "Publishing",
    record=PublishingConfig,
    problem=Texts | None,
    state=Literal["off", "starting", "asking", "on-air", "silent", "failing"],
    said=JsonObject | None,
    passed_on=JsonObject | None,
    ball_models=JsonObject | None,
    cameras=list_of(PublishedCamera),
    interfaces=list[JsonObject],
    rig=str,
    members=list[str],
    rigs=list[JsonObject],
)
GeometrySender = response(
    "GeometrySender",
    id=str,
    address=str,
    port=int,
    source=str,
    age_s=float,
    packets=int,
    geometries=int,
    refused=int,
    refusal=str | None,
    skipped=int,
    geometry_age_s=float | None,
    sha256=str | None,
    field=JsonObject | None,
    problem=Texts | None,
    cameras=list[JsonObject],
    ball_models=JsonObject | None,
    differs=list[JsonObject],
)
GeometrySenders = response(
    "GeometrySenders",
    listening=bool,
    problem=Texts | None,
    datagrams=int,
    own=int,
    items=list_of(GeometrySender),
)
Packet = response(
    "Packet",
    calibration=str,
    exact=bool,
    loss=JsonObject | None,
    expected=JsonObject | None,
    fit_expected=JsonObject | None,
    level=str | None,
    asked=bool,
    warnings=list[JsonObject],
    problem=Texts | None,
)

BallModelsFile = response("BallModelsFile", ball_models=JsonObject)
SslVisionSettings = response(
    "SslVisionSettings", content=str, cameras=list[int], notes=list[JsonObject]
)

YAML: Responses = {200: {"content": {"application/yaml": {"schema": {}}}}}
MAX_FILE_BYTES = 2 << 20  # ssl-vision's settings have 0.4 MB
Text = Annotated[str, Field(max_length=64)]
WireNumber = Annotated[int, Field(ge=0, le=2**32 - 1)]
Rig = Annotated[
    str,
    Query(
        pattern=r"^([A-Za-z0-9][A-Za-z0-9._-]{0,63})?$",
        description="a rig that is published separately; empty: all cameras of no such rig",
    ),
]


class PublishingChanges(Strict):
    """The settings to change; omitted values stay."""

    enabled: bool = False
    absorb: bool = False
    group: Text = Field("", description="IPv4 multicast address")
    port: Annotated[int, Field(ge=1, le=65535)] = 10006
    interface: Text = Field("", description="name or address; empty: the system's choice")
    ttl: Annotated[int, Field(ge=0, le=255)] = 1
    broadcast: bool = Field(
        False, description="send to all of the interface's network in place of the group"
    )
    interval_s: Annotated[float, Field(ge=0.1, le=60)] = 3.0
    limit_mm: Annotated[Number, Field(ge=0, le=100_000)] = 30.0
    pass_on: bool = Field(
        True, description="send another publisher's field, ball models and cameras as they came"
    )
    listen_first_s: Annotated[float, Field(ge=0, le=60)] = Field(
        4.0, description="time to listen for other publishers before the first packet, s"
    )
    field: CameraId | None = Field(
        None, description="if cameras have different fields; null: that of most cameras"
    )
    ball_models: BallModels | None = Field(
        None,
        description="sent where no other publisher's are; accelerations in m/s², negative",
    )
    numbers: Annotated[dict[CameraId, WireNumber | None], Field(max_length=100)] = Field(
        {},
        description="cameras' numbers on the wire, null for that of the region; other cameras are unchanged",
    )
    approved: Annotated[dict[CameraId, Name | None], Field(max_length=100)] = Field(
        {},
        description="cameras whose error is accepted, with the calibration for which it was; others are unchanged",
    )


class ImportBody(Strict):
    """Which camera of a sender is saved as a calibration, and what its packet does not say."""

    camera_id: WireNumber
    camera: CameraId | None = None
    field: CameraId | None = None
    region: CameraId | None = None
    rotate: Rotate | None = None
    image_size: Size | None = None
    sha256: Annotated[str, Field(min_length=64, max_length=64)] | None = Field(
        None,
        description="of the checked packet; 409 if the sender has sent a different one since then",
    )


@router.get("", response_model=Publishing)
@in_thread
def read_publishing(services: ServicesDep, rig: Rig = SERVER) -> Json:
    """Return settings and state, and what each camera's calibration loses in the league's format, sent or not.

    The ETag of the settings goes into the next PUT's If-Match. 404 for a rig that is not published separately.
    """
    publishing = services.part(PublishingService)
    etag = publishing.of(rig).etag  # an older one than the settings only makes a change too careful
    return versioned(publishing.status(rig), etag)


@router.put("", response_model=Publishing)
async def update_publishing(
    services: ServicesDep, body: PublishingChanges, rig: Rig = SERVER, if_match: IfMatch = None
) -> Json:
    """Change some settings, also for after a restart; omitted values stay. 409 where this network cannot send it.

    With If-Match only if nobody has changed them since: else 412, with `current`. A rig is published separately from
    then on: its cameras are in no other packet.
    """
    publishing = services.part(PublishingService)
    changes = body.model_dump(exclude_unset=True)
    await services.run_in_thread(publishing.change, rig, changes, if_match)
    await _follow(services)
    return await read_publishing(services, rig=rig)


@router.delete("", status_code=204, response_class=Response)
async def end_separate_publishing(
    services: ServicesDep, rig: Annotated[Rig, Query(min_length=1)], if_match: IfMatch = None
) -> None:
    """Publish a rig with all other cameras again; its own settings are deleted. With If-Match only if unchanged."""
    await services.run_in_thread(services.part(PublishingService).end, rig, if_match)
    await _follow(services)


async def _follow(services: Services) -> None:
    for part in services.running_parts:  # the game controller is listened to on the same network
        await services.run_in_thread(part.wake)
    # their detections go by the same numbers
    for camera in await services.run_in_thread(services.cameras.all):
        services.live.refresh(camera.id)


@router.post("/confirm", response_model=Publishing)
async def confirm_publishing(services: ServicesDep, rig: Rig = SERVER) -> Json:
    """Publish although another program does, where `state` is "asking"; else nothing changes."""
    services.part(PublishingService).of(rig).publish_anyway()
    return await read_publishing(services, rig=rig)


@router.get("/geometry.yml", response_class=Response, responses=YAML)
@in_thread
def download_geometry(services: ServicesDep, rig: Rig = SERVER) -> Response:
    """Return what is published, or would be, as a geometry.yml for vision-processor's publisher.

    409 where no camera can be published, or the file cannot hold the field.
    """
    data = services.part(PublishingService).of(rig).geometry_file()
    kind = vision_processor.FORMAT
    name = {"Content-Disposition": attachment(f"touchline{kind.suffix}")}
    return Response(data, media_type=kind.media_type, headers=name)


@router.post(
    "/ball-models/read",
    response_model=BallModelsFile,
    openapi_extra={"requestBody": upload()},
)
async def read_ball_models(request: Request, services: ServicesDep) -> Json:
    """Read the ball models of a file, multipart with `file`: a geometry packet of the league, vision-processor's
    geometry.yml or ssl-vision's settings. Nothing is saved."""
    data, _ = await uploaded_file(request, MAX_FILE_BYTES, ())
    found = await services.run_in_thread(ball_models, data)
    if found is None:
        raise format_error(
            "The file contains no ball models.",
            "Use a geometry.yml of vision-processor, or the settings of ssl-vision.",
        )
    return Json({"ball_models": BallModels.of(found).to_json()})


@router.post(
    "/ssl-vision-settings",
    response_model=SslVisionSettings,
    openapi_extra={"requestBody": upload()},
)
async def update_ssl_vision_settings(
    request: Request, services: ServicesDep, rig: Rig = SERVER
) -> Json:
    """Return ssl-vision's settings, multipart with `file` (robocup-ssl.xml), with the published field, ball models and
    cameras in place of its own. Nothing is saved. 409 where the file has none of the cameras."""
    data, _ = await uploaded_file(request, MAX_FILE_BYTES, ())
    publication = services.part(PublishingService).of(rig)
    found = await services.run_in_thread(publication.ssl_vision_settings, data)
    notes = [stated({"text": note}) for note in found.notes]
    return Json({"content": found.data.decode(), "cameras": found.cameras, "notes": notes})


@router.get("/heard", response_model=GeometrySenders)
@in_thread
def list_geometry_senders(services: ServicesDep, rig: Rig = SERVER) -> Json:
    """List who else publishes geometry: each sender's newest complete packet, and what of it contradicts ours."""
    return Json(services.part(PublishingService).of(rig).received())


@router.post("/heard/{id}/import", status_code=201, response_model=schemas.Calibration)
@in_thread
def import_geometry_camera(
    services: ServicesDep, by: OperatorDep, id: Id, body: ImportBody, rig: Rig = SERVER
) -> Json:
    """Save one camera of a sender's newest packet as a new version of a calibration; its note says who sent it."""
    sender = services.part(PublishingService).of(rig).remote_publisher(id)
    if body.sha256 is not None and body.sha256 != hashlib.sha256(sender.data).hexdigest():
        raise Conflict(
            say(
                "receiving.geometry-changed",
                "{sender} has sent a different geometry since then.",
                sender=id,
            ),
            say("receiving.check-geometry", "Check the new geometry, then import it."),
            reason="heard-changed",
        )
    given = body.model_dump(exclude={"sha256", "image_size"}, exclude_none=True)
    texts = (
        dict.fromkeys(OPTIONS, "")
        | {name: str(value) for name, value in given.items()}
        | {"file": "heard.pb"}
    )
    if body.image_size is not None:
        texts["image_size"] = "x".join(map(str, body.image_size))
    at = datetime.fromtimestamp(sender.geometry_at, UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
    origin = (
        f"Received from {sender.address}, port {sender.port} ({sender.source_name}), as camera "
        f"{body.camera_id}, at {at}."
    )
    record = import_file(services, sender.data, texts, by, origin)[0]
    return created(record, f"calibrations/{record['id']}")


@packets.get("/calibrations/{id}/packet", response_model=Packet)
@in_thread
def read_packet(services: ServicesDep, id: Id) -> Json:
    """Return what teams receive of a version through the league's packet, whether it is published or not.

    expected: the error of that, on the carpet and at robot tops; fit_expected: the version's own. asked: whether it is
    published only after approval. problem: why a packet cannot hold it.
    """
    return Json(services.part(PublishingService).packet_json(services.store.calibrations.get(id)))
