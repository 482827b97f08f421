"""/rigs/{name}/tracks: ball and robots, fused from all cameras of a rig."""

import asyncio
from typing import Any

from fastapi import APIRouter, WebSocket
from starlette.responses import Response

from touchline.api.dependencies import ServicesDep
from touchline.api.responses import NO_STORE, JsonText
from touchline.api.schemas.base import JsonObject, response
from touchline.api.schemas.requests import Id
from touchline.api.sockets import run_until_first, send_text, until_disconnect, websocket_session
from touchline.core.errors import Unavailable
from touchline.core.statements import say
from touchline.live.track_fusion import TrackFusion
from touchline.services.container import Services

router = APIRouter(prefix="/rigs", tags=["rigs"])

Tracks = response("Tracks", time_s=float, items=list[JsonObject], seams=JsonObject, cameras=list[JsonObject])

FIRST_S = 20.0  # cameras that were asleep, their stages to be set up, on a busy machine
FOLLOW_S = 0.6  # for a single response, where nobody else follows


class Fusions(dict[str, TrackFusion]):
    """What each rig tracks, by its name, while the server runs."""

    def __init__(self, _services: Services) -> None:
        super().__init__()


@router.get("/{name}/tracks", response_model=Tracks)
async def read_tracks(services: ServicesDep, name: Id) -> Response:
    """Return ball and robots now, fused from all cameras of the rig: positions, speeds, covariance, and the seam in mm.

    Detection runs only while somebody asks: for more than one moment, use the WebSocket of the same name.
    """
    fusion = await track_fusion_of(services, name)
    loop = asyncio.get_running_loop()
    with fusion.listening() as viewer:
        end_s = loop.time() + FOLLOW_S
        text = await _first(viewer)
        while loop.time() < end_s:
            text = await viewer.next(FIRST_S)
    return JsonText(text, headers=NO_STORE)


@router.websocket("/{name}/tracks")
async def watch_tracks(socket: WebSocket, services: ServicesDep, name: str) -> None:
    """Send the same, twenty times a second."""
    async with websocket_session(socket):
        fusion = await track_fusion_of(services, name)
        await run_until_first(until_disconnect(socket), _send(socket, fusion))


async def track_fusion_of(services: Services, name: str) -> TrackFusion:
    """Return the rig's fusion, shared by all who watch; a new one where its cameras have changed; NotFound."""
    rig = await services.run_in_thread(services.store.rigs.get, name)
    cameras = tuple(camera["camera"] for camera in rig.body["cameras"])
    fusions = services.part(Fusions)
    fusion = fusions.get(name)
    if fusion is None or fusion.names != cameras:
        if fusion is not None:
            fusion.end()
        fusion = fusions[name] = TrackFusion(cameras, services.live.get)
    return fusion


async def _send(socket: WebSocket, fusion: TrackFusion) -> None:
    with fusion.listening() as viewer:
        text = await _first(viewer)
        while True:
            await send_text(socket, text.decode())
            text = await viewer.next()


async def _first(viewer: Any) -> bytes:
    try:
        return await viewer.next(FIRST_S)
    except TimeoutError:
        raise Unavailable(say("rig.no-frame-yet", "No camera of this rig has delivered a frame yet."),
                          say("rig.check-states", "Check the camera states, then try again."),
                          reason="camera-silent") from None
