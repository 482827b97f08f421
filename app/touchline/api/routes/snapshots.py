"""/snapshots and /drafts: saved pictures, clicks moved to painted lines, and an operator's work in progress on one."""

from typing import Annotated, get_args

from fastapi import APIRouter, Query, Request, WebSocket
from pydantic import Field
from starlette.responses import Response

from touchline.api import requests, schemas
from touchline.api.bodies import content_type, json_body, uploaded_file
from touchline.api.dependencies import (
    MAX_NAME,
    IfMatch,
    IfMatchNeeded,
    OperatorDep,
    ServicesDep,
    in_thread,
    operator_name,
)
from touchline.api.requests import (
    CameraSnapshot,
    Cursor,
    Format,
    Id,
    IdQuery,
    Limit,
    Purpose,
    WidthPx,
)
from touchline.api.responses import Json, created, page, picture, versioned
from touchline.api.schemas import PICTURE, JsonObject, page_of, response, upload
from touchline.api.sockets import send_stream
from touchline.core.errors import BadInput
from touchline.core.opencv import shrink_to_width
from touchline.core.records import ObservationJson
from touchline.images import screen
from touchline.services.container import Services
from touchline.services.fields import with_known_field
from touchline.services.forms import FittedModelForm, Name, Pair, Rotate, Strict
from touchline.services.snapping import SnappedPoint, points_along, snap_clicks
from touchline.store.snapshots import Snapshot
from touchline.vision.snap import REACH_PX

router = APIRouter()

Draft = response(
    "Draft",
    says=True,
    field=str | None,
    region=str | None,
    rotate=int | None,
    model=str | None,
    options=JsonObject,
    observations=list[ObservationJson],
    updated_at=str | None,
)
SnappedPoints = response("SnappedPoints", points=list[SnappedPoint])
Snapshots = page_of("Snapshots", schemas.Snapshot)

PURPOSES = get_args(Purpose)
Reach = Annotated[float, Field(ge=2, le=40, description="how far from the point a line may be, px")]
Feature = Annotated[
    str, Field(min_length=1, max_length=200, description="border, line or arc of the field")
]
BODY = upload(
    {
        "camera": {"type": "string"},
        "purpose": {"type": "string", "enum": list(PURPOSES), "default": "picture"},
    }
)
BODY["content"]["application/json"] = {"schema": CameraSnapshot.model_json_schema()}


@router.post(
    "/snapshots",
    tags=["snapshots"],
    status_code=201,
    response_model=schemas.Snapshot,
    openapi_extra={"requestBody": BODY},
)
async def create_snapshot(request: Request, services: ServicesDep) -> Json:
    """Save an image: multipart with `file` (PNG, JPEG, BMP or WebP), or JSON {"camera": id} to take one now."""
    kind = content_type(request)
    if kind == "multipart/form-data":
        data, texts = await uploaded_file(request, services.decoder.limits.max_bytes)
        snapshot = await services.run_in_thread(_save, services, data, texts)
    elif kind == "application/json":
        body = await json_body(request, CameraSnapshot)
        snapshot = await services.take_snapshot(
            body.camera, request.is_disconnected, body.frames, body.over_s, body.purpose
        )
    else:
        raise BadInput(
            "The request is neither a form with a file nor JSON.",
            'Send multipart/form-data with the image as "file", or JSON {"camera": id}.',
            reason="wrong-content-type",
        )
    return created(snapshot.to_json(), f"snapshots/{snapshot.id}")


def _save(services: Services, data: bytes, texts: dict[str, str]) -> Snapshot:
    """Decode a picture first: what cannot be decoded is not saved."""
    camera, purpose = texts["camera"] or None, texts["purpose"] or "picture"
    if purpose not in PURPOSES:
        raise BadInput(
            "This purpose is unknown.", f"Use one of: {', '.join(PURPOSES)}.", reason="bad-request"
        )
    if camera is not None:
        services.cameras.get(camera)
    size = services.decoder.frame_from_bytes(data).size
    format = screen(data, services.decoder.limits).format
    return services.store.snapshots.add(data, size, format, camera, purpose, texts["file"])


@router.get("/snapshots", tags=["snapshots"], response_model=Snapshots)
def list_snapshots(
    services: ServicesDep,
    limit: Limit = 50,
    cursor: Cursor = None,
    purpose: Purpose | None = None,
    camera: Annotated[IdQuery | None, Query()] = None,
) -> Json:
    """List snapshots, newest first; those that were taken for one purpose, of one camera, or all."""
    snapshots = services.store.snapshots.list(limit, cursor, purpose, camera)
    return page((snapshot.to_json() for snapshot in snapshots.items), snapshots.next_cursor)


@router.get("/snapshots/{id}", tags=["snapshots"], response_model=schemas.Snapshot)
def read_snapshot(services: ServicesDep, id: Id) -> Json:
    """Describe a snapshot: size, camera, when it was taken, the checksum of its bytes."""
    return Json(services.store.snapshots.get(id).to_json())


@router.get(
    "/snapshots/{id}/image.{format}", tags=["snapshots"], response_class=Response, responses=PICTURE
)
@in_thread
def read_snapshot_image(
    services: ServicesDep, id: Id, format: Format, width: WidthPx = None
) -> Response:
    """Return the image, pixel for pixel as from the sensor: encoded again, so that EXIF tags rotate nothing.

    With `width` scaled down to that, unless it is no wider.
    """
    pixels = services.frame(id).pixels
    if width is not None:
        pixels = shrink_to_width(pixels, width)
    # An id is never used for another picture, so a browser may keep it for ever.
    return picture(pixels, format, {"Cache-Control": "private, max-age=31536000, immutable"})


class FitForm(Strict):
    """Where the field is, as far as it is known."""

    model: FittedModelForm
    field: Name
    region: Name
    rotate: Rotate | None = None


class SnapRequest(Strict):
    """Points, and what is known about the line next to them."""

    points: Annotated[list[Pair], Field(max_length=500)]
    reach_px: Reach = REACH_PX
    width_px: Annotated[float, Field(ge=0.5, le=40)] | None = None
    direction_deg: Annotated[float, Field(ge=-360, le=360)] | None = None
    feature: Feature | None = None
    fit: FitForm | None = None


class AlongRequest(Strict):
    """Which line, and how many points are wanted along it."""

    fit: FitForm
    feature: Feature
    count: Annotated[int, Field(ge=1, le=50)] = 9
    reach_px: Reach = REACH_PX


@router.post("/snapshots/{id}/snap", tags=["snapshots"], response_model=SnappedPoints)
@in_thread
def snap_points(services: ServicesDep, id: Id, body: SnapRequest) -> Json:
    """Move each point to the middle of the painted line next to it, or leave it unchanged, with the reason.

    width_px and direction_deg say which line is meant; a fit and a feature give both for every point.
    """
    return Json({"points": snap_clicks(services, id, **dict(body))})


@router.post("/snapshots/{id}/along", tags=["snapshots"], response_model=SnappedPoints)
@in_thread
def find_points_along_line(services: ServicesDep, id: Id, body: AlongRequest) -> Json:
    """Find points along one line of the field, near its predicted position; none where it is hidden."""
    return Json({"points": points_along(services, id, **dict(body))})


@router.get("/drafts/{snapshot}", tags=["drafts"], response_model=Draft)
def read_draft(services: ServicesDep, snapshot: Id) -> Json:
    """Return the draft that was saved last, or an empty one; its ETag goes into the next PUT's If-Match.

    Where its field was deleted, or has its region no more, those are null and `notice` says so; its clicks are kept.
    """
    draft = services.store.drafts.get(snapshot)
    return versioned(with_known_field(services, draft), draft.etag)


@router.put("/drafts/{snapshot}", tags=["drafts"], response_model=Draft)
def save_draft(
    services: ServicesDep,
    by: OperatorDep,
    snapshot: Id,
    body: requests.DraftBody,
    if_match: IfMatch = None,
) -> Response:
    """Replace the draft that If-Match names: 428 without it, 412 with the `current` draft after another change."""
    services.store.snapshots.get(snapshot)
    if if_match is None:
        raise IfMatchNeeded("The request does not state which version of the draft it changes.")
    draft = services.store.drafts.save(snapshot, body.model_dump(), if_match, by)
    services.presence.saved(snapshot, draft.etag, by)
    return versioned(draft.to_json(), draft.etag)


@router.websocket("/drafts/{snapshot}/stream")
async def watch_draft(
    socket: WebSocket, services: ServicesDep, snapshot: str, name: str = ""
) -> None:
    """Send who else has this image open, and the ETag of the draft as soon as a user has saved it, as JSON.

    {"others": [name, …], "etag": "…" | null, "by": name | null}, now and after every change; with name=, what others
    read of you.
    """
    await send_stream(socket, services.presence.changes(snapshot[:MAX_NAME], operator_name(name)))
