"""/cameras/{id}/rolls: a ball rolling before a live camera measures its distortion; every roll is saved."""

import asyncio
from typing import Annotated, Any

from fastapi import APIRouter, Query, WebSocket
from starlette.responses import Response

from app.api.dependencies import ServicesDep
from app.api.responses import Json
from app.api.schemas import responses
from app.api.schemas.requests import Id
from app.api.sockets import SessionLimit, run_until_first, send_json, until_disconnect, websocket_session
from app.live import LiveCamera
from app.services.container import Services
from app.services.live import when_awake
from app.services.value_types import Strict
from app.store import Store
from app.workflows.rolling_request import stored_rolls_json

router = APIRouter(prefix="/cameras", tags=["rolls"])

MIN_INTERVAL_S = 0.1  # between two messages: ten a second at most
SAVED = ("at", "seconds", "points", "rms_px", "straight_px")
SESSIONS = SessionLimit(4, "Others watch what rolls before this camera.",
                        "Wait until they are done, or read GET /api/v1/cameras/{id}/rolls.", "rolls-watched")


class RollChange(Strict):
    left_out: bool


@router.get("/{id}/rolls", response_model=responses.Rolls)
def list_rolls(services: ServicesDep, id: Id) -> Json:
    """List saved rolls, oldest first, and their straightness: Eq. (9) of each, of zones, along the picture's edge.

    Corrected as well, where the camera's active calibration is of pictures of their size.
    """
    services.cameras.get(id)
    return Json(_rolls_json(services.store, id))


@router.patch("/{id}/rolls/{roll}", response_model=responses.Rolls)
def leave_roll_out(services: ServicesDep, id: Id, roll: Id, body: RollChange) -> Json:
    """Leave one out, or take it in again; return the list."""
    services.store.rolls.leave_out(id, roll, body.left_out)
    return Json(_rolls_json(services.store, id))


@router.delete("/{id}/rolls/{roll}", status_code=204)
def delete_roll(services: ServicesDep, id: Id, roll: Id) -> Response:
    """Delete one roll."""
    services.store.rolls.delete(id, roll)
    return Response(status_code=204)


@router.delete("/{id}/rolls", status_code=204)
def delete_rolls(services: ServicesDep, id: Id) -> Response:
    """Delete all rolls of this camera, as after it was moved."""
    services.cameras.get(id)
    services.store.rolls.clear(id)
    return Response(status_code=204)


@router.websocket("/{id}/rolls/stream")
async def watch_rolls(socket: WebSocket, services: ServicesDep, id: str,
                      keep: Annotated[bool, Query()] = True) -> None:
    """Send JSON texts, up to ten a second: `tracks` of what moves, ids of `new` rolls, and `told` whenever it changes.

    told is what GET /cameras/{id}/rolls returns. Rolls are followed only while somebody watches; with keep=false
    they are not saved, and `new` has the rolls themselves.
    """
    async with websocket_session(socket):
        with SESSIONS.session(id):
            await run_until_first(until_disconnect(socket), _send(socket, services, services.live.get(id), keep))


async def _send(socket: WebSocket, services: Services, camera: LiveCamera, keep: bool) -> None:
    loop, store = asyncio.get_running_loop(), services.store
    watch, after, seq, sent_state = "", 0, 0, None
    while True:
        start_s = loop.time()
        result = await when_awake(camera, lambda _left_s, at=(watch, after, seq): camera.rolls(*at))
        new = result["rolls"]
        if result["watch"] != watch:
            watch, after = result["watch"], 0
        after, seq = max([after, *(roll["number"] for roll in new)]), result["seq"]
        if keep and new:
            await services.run_in_thread(_save, store, camera.id, new, [result["width"], result["height"]])
        state = (store.rolls.revision, camera.calibration.id if camera.calibration else None)
        summary = None
        if state != sent_state:
            summary, sent_state = await services.run_in_thread(_rolls_json, store, camera.id), state
        await send_json(socket, {
            **{name: result[name] for name in ("seq", "time", "width", "height", "tracks", "hint")},
            "new": [roll["id"] for roll in new] if keep else new, "told": summary})
        await asyncio.sleep(max(MIN_INTERVAL_S - (loop.time() - start_s), 0.0))


def _save(store: Store, camera: str, new: list[dict[str, Any]], image_size: list[int]) -> None:
    for roll in new:
        store.rolls.add(camera, roll["id"], {**{name: roll[name] for name in SAVED}, "image_size": image_size})


def _rolls_json(store: Store, camera: str) -> dict[str, Any]:
    return stored_rolls_json(store.rolls.of(camera), store.calibrations.active(camera))
