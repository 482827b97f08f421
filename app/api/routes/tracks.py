"""/rigs/{name}/tracks: ball and robots on a field, once each, however many of its cameras see them."""

import asyncio
from typing import Any

from fastapi import APIRouter, WebSocket
from starlette.responses import Response

from app.api.dependencies import ServicesDep
from app.api.responses import NO_STORE
from app.api.schemas import responses
from app.api.schemas.requests import Id
from app.api.sockets import run_until_first, send_text, until_disconnect, websocket_session
from app.core.errors import Unavailable
from app.live.track_fusion import TrackFusion
from app.services.tracks import track_fusion_of

router = APIRouter(prefix="/rigs", tags=["rigs"])

FIRST_S = 20.0  # cameras that were asleep, their stages to be set up, on a busy machine
FOLLOW_S = 0.6  # for a single response, where nobody else follows


@router.get("/{name}/tracks", response_model=responses.Tracks)
async def newest_tracks(services: ServicesDep, name: Id) -> Response:
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
    return Response(text, media_type="application/json", headers=NO_STORE)


@router.websocket("/{name}/tracks")
async def watch_tracks(socket: WebSocket, services: ServicesDep, name: str) -> None:
    """Send the same, twenty times a second."""
    async with websocket_session(socket):
        await run_until_first(until_disconnect(socket), _send(socket, await track_fusion_of(services, name)))


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
        raise Unavailable("No camera of this rig has shown anything yet.", "Look at their states, then try again.",
                          reason="camera-silent") from None
