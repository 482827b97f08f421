"""/snapshots: pictures that are kept, uploaded or taken from a camera."""

from typing import Any, Literal

from fastapi import APIRouter, Request
from starlette.responses import Response

from app.api import answer_schemas
from app.api.answers import Json, picture
from app.api.bodies import content_type, json_body, uploaded_file
from app.api.schemas import CameraSnapshot, Cursor, Id, Limit
from app.api.work import at_work
from app.errors import BadInput
from app.images import screen
from app.records import Frame
from app.store import Snapshot

router = APIRouter(prefix="/snapshots", tags=["snapshots"])

IMAGE = {"schema": {"type": "string", "format": "binary"}}
PICTURE: dict[int | str, dict[str, Any]] = {200: {"content": {"image/png": IMAGE, "image/jpeg": IMAGE}}}
BODY = {"requestBody": {"required": True, "content": {
    "multipart/form-data": {"schema": {"type": "object", "required": ["file"], "properties": {
        "file": {"type": "string", "format": "binary"}, "camera": {"type": "string"}}}},
    "application/json": {"schema": CameraSnapshot.model_json_schema()}}}}


@router.post("", status_code=201, response_model=answer_schemas.Snapshot, openapi_extra=BODY)
async def keep_snapshot(request: Request) -> Json:
    """Keep a picture: multipart with `file` (PNG, JPEG, BMP or WebP), or JSON {"camera": id} to take one now."""
    state = request.app.state
    kind = content_type(request)
    if kind == "multipart/form-data":
        data, camera = await uploaded_file(request, state.decoder.limits.max_bytes)
        snapshot = await at_work(request, _kept, request, data, camera or None)
    elif kind == "application/json":
        asked = await json_body(request, CameraSnapshot)
        snapshot = await at_work(request, _taken, request, asked.camera)
    else:
        raise BadInput("This is neither a form with a file nor JSON.", 'Send multipart/form-data with the picture as '
                       '"file", or JSON {"camera": id}.', reason="wrong-content-type")
    return Json(snapshot.to_json(), 201, headers={"Location": f"/api/v1/snapshots/{snapshot.id}"})


def _kept(request: Request, data: bytes, camera: str | None) -> Snapshot:
    """Decoded first: what cannot be decoded is not kept."""
    state = request.app.state
    if camera is not None:
        state.settings.camera(camera)
    frame = state.decoder.frame_from_bytes(data)
    return state.store.add_snapshot(data, frame.size, screen(data, state.decoder.limits).format, camera)


def _taken(request: Request, camera: str) -> Snapshot:
    state = request.app.state
    data, frame = state.cameras.take(camera)
    return state.store.add_snapshot(data, frame.size, "png", camera)


@router.get("", response_model=answer_schemas.Snapshots)
def list_snapshots(request: Request, limit: Limit = 50, cursor: Cursor = None) -> Json:
    """Newest first."""
    page = request.app.state.store.snapshots(limit, cursor)
    return Json({"items": [snapshot.to_json() for snapshot in page.items], "next_cursor": page.next_cursor})


@router.get("/{id}", response_model=answer_schemas.Snapshot)
def read_snapshot(request: Request, id: Id) -> Json:
    """What a snapshot is: size, camera, when it was taken, the checksum of its bytes."""
    return Json(request.app.state.store.snapshot(id).to_json())


@router.get("/{id}/image.{format}", response_class=Response, responses=PICTURE)
async def show_snapshot(request: Request, id: Id, format: Literal["png", "jpg"]) -> Response:
    """The picture, pixel for pixel as the sensor saw it: encoded anew, so that no viewer turns it by its EXIF note."""
    # An id is never used for another picture, so a browser may keep it for ever.
    return await at_work(request, _encoded, request, id, format)


def _encoded(request: Request, id: str, format: str) -> Response:
    frame: Frame = request.app.state.frames[id]
    return picture(frame.pixels, format, {"Cache-Control": "private, max-age=31536000, immutable"})
