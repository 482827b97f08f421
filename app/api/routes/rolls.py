"""/cameras/{id}/rolls: a ball that rolls before a live camera measures its distortion; every roll is kept."""

import asyncio
from collections import Counter
from contextlib import contextmanager
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, WebSocket
from starlette.responses import Response

from app.api.answers import Json, json_bytes
from app.api.mjpeg import TAKE_S
from app.api.routes.streams import first_picture, live_camera
from app.api.schemas.requests import Id, Strict
from app.api.schemas.responses.base import Answer
from app.api.sockets import both, spoken_with, until_gone
from app.api.work import at_work
from app.core.errors import Busy
from app.live import LiveCamera
from app.store import Store
from app.workflows.rolling_request import stored_rolls_json

router = APIRouter(prefix="/cameras", tags=["rolls"])

EVERY_S = 0.1  # between two looks: ten a second at most
MOST_AT_ONCE = 4  # who watch one camera's rolls
KEPT = ("at", "seconds", "points", "rms_px", "straight_px")
_watched: Counter[str] = Counter()


class RollsTold(Answer):
    """items: oldest first, each with what it says raw and corrected; report: what all say together."""

    items: list[dict[str, Any]]
    report: dict[str, Any] | None


class RollChange(Strict):
    left_out: bool


@router.get("/{id}/rolls", response_model=RollsTold)
def list_rolls(request: Request, id: Id) -> Json:
    """The rolls that are kept, oldest first, and what they say: Eq. (9) of each, of zones, along the picture's edge.

    Corrected as well, where the camera's active calibration is of pictures of their size.
    """
    request.app.state.camera_shelf.get(id)
    return Json(_told(request.app.state.store, id))


@router.patch("/{id}/rolls/{roll}", response_model=RollsTold)
def leave_roll_out(request: Request, id: Id, roll: Id, body: RollChange) -> Json:
    """Leave one out, or take it in again; answers what all say then."""
    request.app.state.store.rolls.leave_out(id, roll, body.left_out)
    return Json(_told(request.app.state.store, id))


@router.delete("/{id}/rolls/{roll}", status_code=204)
def delete_roll(request: Request, id: Id, roll: Id) -> Response:
    """Forget one."""
    request.app.state.store.rolls.delete(id, roll)
    return Response(status_code=204)


@router.delete("/{id}/rolls", status_code=204)
def delete_rolls(request: Request, id: Id) -> Response:
    """Forget all of this camera's, as after it was moved."""
    request.app.state.camera_shelf.get(id)
    request.app.state.store.rolls.clear(id)
    return Response(status_code=204)


@router.websocket("/{id}/rolls/stream")
async def watch_rolls(socket: WebSocket, id: str, keep: Annotated[bool, Query()] = True) -> None:
    """JSON texts, up to ten a second: `tracks` of what moves, the ids of `new` rolls, and `told` whenever it changes.

    told is what GET /cameras/{id}/rolls answers. What rolls is followed only while somebody listens; with keep=false
    it is not kept, and `new` has the rolls themselves.
    """
    async with spoken_with(socket):
        with _one_more(id):
            camera = await live_camera(socket, id)
            await both(until_gone(socket), _tell(socket, camera, keep))


async def _tell(socket: WebSocket, camera: LiveCamera, keep: bool) -> None:
    loop, store = asyncio.get_running_loop(), socket.app.state.store
    watch, after, seq, told_of = "", 0, 0, None
    while True:
        begun = loop.time()
        seen = await first_picture(camera, lambda _timeout_s, at=(watch, after, seq): camera.rolls(*at))
        new = seen["rolls"]
        if seen["watch"] != watch:
            watch, after = seen["watch"], 0
        after, seq = max([after, *(roll["number"] for roll in new)]), seen["seq"]
        if keep and new:
            await at_work(socket, _keep, store, camera.id, new, [seen["width"], seen["height"]])
        state = (store.rolls.revision, camera.calibration.id if camera.calibration else None)
        told = None
        if state != told_of:
            told, told_of = await at_work(socket, _told, store, camera.id), state
        message = {**{name: seen[name] for name in ("seq", "time", "width", "height", "tracks", "hint")},
                   "new": [roll["id"] for roll in new] if keep else new, "told": told}
        await asyncio.wait_for(socket.send_text(json_bytes(message).decode()), TAKE_S)
        await asyncio.sleep(max(EVERY_S - (loop.time() - begun), 0.0))


def _keep(store: Store, camera: str, new: list[dict[str, Any]], image_size: list[int]) -> None:
    for roll in new:
        store.rolls.add(camera, roll["id"], {**{name: roll[name] for name in KEPT}, "image_size": image_size})


def _told(store: Store, camera: str) -> dict[str, Any]:
    return stored_rolls_json(store.rolls.of(camera), store.calibrations.active(camera))


@contextmanager
def _one_more(id: str) -> Any:
    if _watched[id] >= MOST_AT_ONCE:
        raise Busy("Others watch what rolls before this camera.", "Wait until they are done, or read GET "
                   "/api/v1/cameras/{id}/rolls.", reason="rolls-watched")
    _watched[id] += 1
    try:
        yield
    finally:
        _watched[id] -= 1
        if not _watched[id]:
            del _watched[id]
