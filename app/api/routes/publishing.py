"""/publishing: geometry on the league's multicast group, sent, and heard from others."""

import hashlib
from datetime import UTC, datetime
from typing import Any

from fastapi import APIRouter, Request

from app.api.answers import Json
from app.api.operator import operator
from app.api.schemas import publishing, responses
from app.api.schemas.requests import Id
from app.api.work import at_work
from app.core.errors import Conflict
from app.league.received import source_name
from app.services.imports import PARTS, keep_import
from app.services.publishing import PublishingShelf

router = APIRouter(prefix="/publishing", tags=["publishing"])


@router.get("", response_model=publishing.Publishing)
async def read_publishing(request: Request) -> Json:
    """What is set, whether it is on the air, and what each camera's calibration loses on the wire, sent or not."""
    return Json(await at_work(request, _shelf(request).publishing.status))


@router.put("", response_model=publishing.Publishing)
async def set_publishing(request: Request, body: publishing.PublishingChanges) -> Json:
    """Change some of it, kept over a restart; what is left out stays. 409 where this network does not carry it."""
    changes = body.model_dump(exclude_unset=True)
    if changes.get("field") is not None:
        _ = request.app.state.fields[changes["field"]]
    shelf = _shelf(request)
    await at_work(request, shelf.change, changes)
    for camera in await at_work(request, request.app.state.camera_shelf.all):  # their detections go by the same numbers
        request.app.state.live.refresh(camera.id)
    return Json(await at_work(request, shelf.publishing.status))


@router.get("/heard", response_model=publishing.Heard)
async def read_heard(request: Request) -> Json:
    """Who else publishes geometry: each sender's newest whole packet, and what of it contradicts ours."""
    fields = request.app.state.fields
    return Json(await at_work(request, lambda: _shelf(request).publishing.received(fields.values())))


@router.post("/heard/{id}/import", status_code=201, response_model=responses.Calibration)
async def import_heard(request: Request, id: Id, body: publishing.TakeOver) -> Json:
    """Keep one camera of a sender's newest packet as a calibration, a new version; its note says who sent it."""
    kept = await at_work(request, _taken, request, id, body)
    return Json(kept, 201, headers={"Location": f"/api/v1/calibrations/{kept['id']}"})


def _taken(request: Request, id: str, body: publishing.TakeOver) -> dict[str, Any]:
    sender = _shelf(request).publishing.remote_publisher(id)
    if body.sha256 is not None and body.sha256 != hashlib.sha256(sender.data).hexdigest():
        raise Conflict(f"{id} has sent another geometry since.", "Look at it again, then take it over.",
                       reason="heard-changed")
    said = body.model_dump(exclude={"sha256", "image_size"}, exclude_none=True)
    texts = dict.fromkeys(PARTS, "") | {name: str(value) for name, value in said.items()} | {"file": "heard.pb"}
    if body.image_size is not None:
        texts["image_size"] = "x".join(map(str, body.image_size))
    at = datetime.fromtimestamp(sender.geometry_at, UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
    origin = (f"Heard from {sender.address}, port {sender.port} ({source_name(sender.source)}), as camera "
              f"{body.camera_id}, at {at}.")
    return keep_import(request.app.state, sender.data, texts, operator(request), origin)[0]


def _shelf(request: Request) -> PublishingShelf:
    return request.app.state.publishing
