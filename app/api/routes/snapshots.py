"""/snapshots: saved pictures, uploaded or taken from a camera."""

from typing import Literal, get_args

from fastapi import APIRouter, Request
from starlette.responses import Response

from app.api.bodies import content_type, json_body, uploaded_file
from app.api.dependencies import ServicesDep
from app.api.responses import Json, created, page, picture
from app.api.schemas import responses
from app.api.schemas.media import PICTURE, upload
from app.api.schemas.requests import CameraSnapshot, Cursor, Id, Limit, Purpose
from app.core.errors import BadInput
from app.images import screen
from app.services.capture import take_snapshot
from app.services.container import Services
from app.store import Snapshot

router = APIRouter(prefix="/snapshots", tags=["snapshots"])

PURPOSES = get_args(Purpose)
BODY = upload(camera={"type": "string"},
              purpose={"type": "string", "enum": list(PURPOSES), "default": "picture"})
BODY["content"]["application/json"] = {"schema": CameraSnapshot.model_json_schema()}


@router.post("", status_code=201, response_model=responses.Snapshot, openapi_extra={"requestBody": BODY})
async def keep_snapshot(request: Request, services: ServicesDep) -> Json:
    """Save a picture: multipart with `file` (PNG, JPEG, BMP or WebP), or JSON {"camera": id} to take one now."""
    kind = content_type(request)
    if kind == "multipart/form-data":
        data, texts = await uploaded_file(request, services.decoder.limits.max_bytes)
        snapshot = await services.run_in_thread(_save, services, data, texts["camera"] or None,
                                                texts["purpose"] or "picture")
    elif kind == "application/json":
        body = await json_body(request, CameraSnapshot)
        snapshot = await take_snapshot(services, body.camera, request.is_disconnected, body.frames, body.over_s,
                                       body.purpose)
    else:
        raise BadInput("This is neither a form with a file nor JSON.", 'Send multipart/form-data with the picture as '
                       '"file", or JSON {"camera": id}.', reason="wrong-content-type")
    return created(snapshot.to_json(), f"snapshots/{snapshot.id}")


def _save(services: Services, data: bytes, camera: str | None, purpose: str) -> Snapshot:
    """Decode a picture first: what cannot be decoded is not saved."""
    if purpose not in PURPOSES:
        raise BadInput("This is no purpose of a picture.", f"Use one of: {', '.join(PURPOSES)}.", reason="bad-request")
    if camera is not None:
        services.cameras.get(camera)
    size = services.decoder.frame_from_bytes(data).size
    format = screen(data, services.decoder.limits).format
    return services.store.snapshots.add(data, size, format, camera, purpose)


@router.get("", response_model=responses.Snapshots)
def list_snapshots(services: ServicesDep, limit: Limit = 50, cursor: Cursor = None,
                   purpose: Purpose | None = None) -> Json:
    """List snapshots, newest first; those that were taken for one purpose, or all."""
    snapshots = services.store.snapshots.list(limit, cursor, purpose)
    return page((snapshot.to_json() for snapshot in snapshots.items), snapshots.next_cursor)


@router.get("/{id}", response_model=responses.Snapshot)
def read_snapshot(services: ServicesDep, id: Id) -> Json:
    """Describe a snapshot: size, camera, when it was taken, the checksum of its bytes."""
    return Json(services.store.snapshots.get(id).to_json())


@router.get("/{id}/image.{format}", response_class=Response, responses=PICTURE)
async def show_snapshot(services: ServicesDep, id: Id, format: Literal["png", "jpg"]) -> Response:
    """Return the picture, pixel for pixel as the sensor saw it: encoded anew, so that EXIF tags rotate nothing."""
    # An id is never used for another picture, so a browser may keep it for ever.
    return await services.run_in_thread(lambda: picture(
        services.frame(id).pixels, format, {"Cache-Control": "private, max-age=31536000, immutable"}))
