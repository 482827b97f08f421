"""/rigs/{name}/tracks: what plays on a field, once each, however many of its cameras see it."""

import asyncio
from typing import Any

from fastapi import APIRouter, Request, WebSocket
from starlette.responses import Response

from app.api.mjpeg import TAKE_S
from app.api.schemas.requests import Id
from app.api.schemas.responses.base import Answer
from app.api.sockets import both, spoken_with, until_gone
from app.api.work import at_work
from app.core.errors import Unavailable
from app.live.track_fusion import TrackFusion

router = APIRouter(prefix="/rigs", tags=["rigs"])

FIRST_S = 20.0  # cameras that were asleep, their stages to be set up, on a busy machine
LOOK_S = 0.6  # a single answer has followed for so long, where nobody else does


class Tracks(Answer):
    """items: the tracks; seams: how far apart cameras see the same things; cameras: what each gives, or why not."""

    time_s: float
    items: list[dict[str, Any]]
    seams: dict[str, Any]
    cameras: list[dict[str, Any]]


@router.get("/{name}/tracks", response_model=Tracks)
async def newest_tracks(request: Request, name: Id) -> Response:
    """Ball and robots now, put together from all cameras of the rig: places, speeds, covariance, and the seam in mm.

    Cameras see only while somebody asks: for more than a look, listen to the WebSocket of the same name.
    """
    tracked = await _tracked(request, name)
    loop = asyncio.get_running_loop()
    with tracked.listening() as viewer:
        begun = loop.time()
        text = await _first(viewer)
        while loop.time() - begun < LOOK_S:
            text = await viewer.next(FIRST_S)
    return Response(text, media_type="application/json", headers={"Cache-Control": "no-store"})


@router.websocket("/{name}/tracks")
async def watch_tracks(socket: WebSocket, name: str) -> None:
    """The same, twenty times a second."""
    async with spoken_with(socket):
        tracked = await _tracked(socket, name)
        await both(until_gone(socket), _send(socket, tracked))


async def _send(socket: WebSocket, tracked: TrackFusion) -> None:
    with tracked.listening() as viewer:
        text = await _first(viewer)
        while True:
            await asyncio.wait_for(socket.send_text(text.decode()), TAKE_S)
            text = await viewer.next()


async def _first(viewer: Any) -> bytes:
    try:
        return await viewer.next(FIRST_S)
    except TimeoutError:
        raise Unavailable("No camera of this rig has shown anything yet.", "Look at their states, then try again.",
                          reason="camera-silent") from None


async def _tracked(connection: Request | WebSocket, name: str) -> TrackFusion:
    """The rig's, shared by all who listen; another one where its cameras have changed. NotFound."""
    state = connection.app.state
    rig = await at_work(connection, state.store.rigs.get, name)
    cameras = tuple(camera["camera"] for camera in rig.body["cameras"])
    if not hasattr(state, "tracked"):
        state.tracked = {}
    kept: dict[str, TrackFusion] = state.tracked
    if name not in kept or kept[name].names != cameras:
        if name in kept:
            kept[name].end()
        kept[name] = TrackFusion(cameras, state.live.get)
    return kept[name]
