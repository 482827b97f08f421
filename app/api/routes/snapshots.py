"""/snapshots: pictures that are kept, uploaded or taken from a camera."""

from dataclasses import asdict
from typing import Any, Literal, get_args

from fastapi import APIRouter, Request
from starlette.responses import Response

from app.api.answers import Json, picture
from app.api.bodies import content_type, json_body, uploaded_file
from app.api.routes.streams import first_picture, live_camera
from app.api.schemas import responses
from app.api.schemas.requests import CameraSnapshot, Cursor, Id, Limit, Purpose
from app.api.work import at_work
from app.core.errors import BadInput, Cancelled
from app.core.geometry import ImageSize
from app.core.records import Frame
from app.images import screen
from app.store import Snapshot

router = APIRouter(prefix="/snapshots", tags=["snapshots"])

SPREAD_S = 1 / 3  # between two frames of a background: who walks by needs some seconds to leave
STILL_S = 20.0  # a picture of many frames of a slow camera takes its time

IMAGE = {"schema": {"type": "string", "format": "binary"}}
PICTURE: dict[int | str, dict[str, Any]] = {200: {"content": {"image/png": IMAGE, "image/jpeg": IMAGE}}}
BODY = {"requestBody": {"required": True, "content": {
    "multipart/form-data": {"schema": {"type": "object", "required": ["file"], "properties": {
        "file": {"type": "string", "format": "binary"}, "camera": {"type": "string"},
        "purpose": {"type": "string", "enum": list(get_args(Purpose)), "default": "picture"}}}},
    "application/json": {"schema": CameraSnapshot.model_json_schema()}}}}


@router.post("", status_code=201, response_model=responses.Snapshot, openapi_extra=BODY)
async def keep_snapshot(request: Request) -> Json:
    """Keep a picture: multipart with `file` (PNG, JPEG, BMP or WebP), or JSON {"camera": id} to take one now."""
    state = request.app.state
    kind = content_type(request)
    if kind == "multipart/form-data":
        data, told = await uploaded_file(request, state.decoder.limits.max_bytes)
        snapshot = await at_work(request, _kept, request, data, told["camera"] or None, told["purpose"] or "picture")
    elif kind == "application/json":
        asked = await json_body(request, CameraSnapshot)
        snapshot = await take_snapshot(request, asked)
    else:
        raise BadInput("This is neither a form with a file nor JSON.", 'Send multipart/form-data with the picture as '
                       '"file", or JSON {"camera": id}.', reason="wrong-content-type")
    return Json(snapshot.to_json(), 201, headers={"Location": f"/api/v1/snapshots/{snapshot.id}"})


def _kept(request: Request, data: bytes, camera: str | None, purpose: str) -> Snapshot:
    """Decoded first: what cannot be decoded is not kept."""
    if purpose not in get_args(Purpose):
        raise BadInput("This is no purpose of a picture.", f"Use one of: {', '.join(get_args(Purpose))}.",
                       reason="bad-request")
    state = request.app.state
    if camera is not None:
        state.camera_shelf.get(camera)
    frame = state.decoder.frame_from_bytes(data)
    return state.store.snapshots.add(data, frame.size, screen(data, state.decoder.limits).format, camera, purpose)


async def take_snapshot(request: Request, asked: CameraSnapshot) -> Snapshot:
    """With the evidence of which camera it is from, so that its calibration is not applied to another."""
    camera = await live_camera(request, asked.camera)
    over_s = SPREAD_S * (asked.frames - 1) if asked.over_s is None else asked.over_s
    head, png = await first_picture(camera, lambda timeout_s: camera.still(asked.frames, timeout_s, over_s), STILL_S)
    if await request.is_disconnected():  # who asked has changed their mind: nothing is kept
        raise Cancelled("Nobody waits for this picture any more.", "Take it again.")
    store, identity = request.app.state.store, camera.identity

    def keep() -> Snapshot:
        snapshot = store.snapshots.add(png, ImageSize(head["width"], head["height"]), "png", asked.camera,
                                      asked.purpose)
        if identity is not None:
            store.identities.confirm(snapshot.id, asdict(identity))
        return snapshot
    return await at_work(request, keep)


@router.get("", response_model=responses.Snapshots)
def list_snapshots(request: Request, limit: Limit = 50, cursor: Cursor = None, purpose: Purpose | None = None) -> Json:
    """Newest first; those that were taken for one purpose, or all."""
    page = request.app.state.store.snapshots.list(limit, cursor, purpose)
    return Json({"items": [snapshot.to_json() for snapshot in page.items], "next_cursor": page.next_cursor})


@router.get("/{id}", response_model=responses.Snapshot)
def read_snapshot(request: Request, id: Id) -> Json:
    """What a snapshot is: size, camera, when it was taken, the checksum of its bytes."""
    return Json(request.app.state.store.snapshots.get(id).to_json())


@router.get("/{id}/image.{format}", response_class=Response, responses=PICTURE)
async def show_snapshot(request: Request, id: Id, format: Literal["png", "jpg"]) -> Response:
    """The picture, pixel for pixel as the sensor saw it: encoded anew, so that no viewer turns it by its EXIF note."""
    # An id is never used for another picture, so a browser may keep it for ever.
    return await at_work(request, _encoded, request, id, format)


def _encoded(request: Request, id: str, format: str) -> Response:
    frame: Frame = request.app.state.frames[id]
    return picture(frame.pixels, format, {"Cache-Control": "private, max-age=31536000, immutable"})
