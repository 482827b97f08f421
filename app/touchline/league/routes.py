"""/publishing: geometry on the league's multicast group, sent and received; and what teams receive of a version."""

import hashlib
from datetime import UTC, datetime
from typing import Annotated, Literal

from fastapi import APIRouter
from pydantic import Field

from touchline.api import schemas
from touchline.api.dependencies import IfMatch, OperatorDep, ServicesDep, in_thread
from touchline.api.requests import CameraId, Id
from touchline.api.responses import Json, created, versioned
from touchline.api.schemas import JsonObject, Texts, list_of, response
from touchline.core.errors import Conflict
from touchline.core.statements import say
from touchline.league.packet import PublishingConfig
from touchline.league.service import PublishingService
from touchline.services.forms import Name, Number, Rotate, Size, Strict
from touchline.services.import_file import OPTIONS, import_file

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
    state=Literal["off", "starting", "on-air", "silent", "failing"],
    said=JsonObject | None,
    passed_on=JsonObject | None,
    cameras=list_of(PublishedCamera),
    interfaces=list[JsonObject],
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

Text = Annotated[str, Field(max_length=64)]
WireNumber = Annotated[int, Field(ge=0, le=2**32 - 1)]


class PublishingChanges(Strict):
    """The settings to change; omitted values stay."""

    enabled: bool = False
    absorb: bool = False
    group: Text = Field("", description="IPv4 multicast address")
    port: Annotated[int, Field(ge=1, le=65535)] = 10006
    interface: Text = Field("", description="name or address; empty: the system's choice")
    ttl: Annotated[int, Field(ge=0, le=255)] = 1
    interval_s: Annotated[float, Field(ge=0.1, le=60)] = 3.0
    limit_mm: Annotated[Number, Field(ge=0, le=100_000)] = 30.0
    pass_on: bool = Field(
        True, description="send another publisher's field and ball models as they came"
    )
    field: CameraId | None = Field(
        None, description="if cameras have different fields; null: that of most cameras"
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
def read_publishing(services: ServicesDep) -> Json:
    """Return settings and state, and what each camera's calibration loses in the league's format, sent or not.

    The ETag of the settings goes into the next PUT's If-Match.
    """
    publishing = services.part(PublishingService)
    etag = publishing.etag  # an older one than the settings only makes a change too careful
    return versioned(publishing.status(), etag)


@router.put("", response_model=Publishing)
async def update_publishing(
    services: ServicesDep, body: PublishingChanges, if_match: IfMatch = None
) -> Json:
    """Change some settings, also for after a restart; omitted values stay. 409 where this network cannot send it.

    With If-Match only if nobody has changed them since: else 412, with `current`.
    """
    publishing = services.part(PublishingService)
    await services.run_in_thread(
        publishing.change, body.model_dump(exclude_unset=True), etag=if_match
    )
    for part in services.running_parts:  # the game controller is listened to on the same network
        await services.run_in_thread(part.wake)
    # their detections go by the same numbers
    for camera in await services.run_in_thread(services.cameras.all):
        services.live.refresh(camera.id)
    return await read_publishing(services)


@router.get("/heard", response_model=GeometrySenders)
@in_thread
def list_geometry_senders(services: ServicesDep) -> Json:
    """List who else publishes geometry: each sender's newest complete packet, and what of it contradicts ours."""
    return Json(services.part(PublishingService).received())


@router.post("/heard/{id}/import", status_code=201, response_model=schemas.Calibration)
@in_thread
def import_geometry_camera(
    services: ServicesDep, by: OperatorDep, id: Id, body: ImportBody
) -> Json:
    """Save one camera of a sender's newest packet as a new version of a calibration; its note says who sent it."""
    sender = services.part(PublishingService).remote_publisher(id)
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
