"""/viser/NAME/: an open scene under our own port, behind our own login; viser itself hears only this proxy."""

from fastapi import APIRouter, Request, WebSocket
from starlette.responses import HTMLResponse
from starlette.websockets import WebSocketDisconnect
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import WebSocketException
from websockets.typing import Subprotocol

from app.api.sockets import until_either
from app.core.errors import NotFound
from app.scene.messages import KEY_HEADER
from app.scene.page import client_page
from app.scene.policy import PAGE_POLICY

router = APIRouter(prefix="/viser", include_in_schema=False)

PROTOCOL = "viser-v"
LONGEST = 1 << 20  # of a viewer's message: cameras and clicks have some hundred bytes
OPEN_S = 10.0


@router.get("/{name}/")
async def show_viser(request: Request, name: str) -> HTMLResponse:
    request.app.state.scenes.get(name)
    return HTMLResponse(client_page(), headers={"Content-Security-Policy": PAGE_POLICY, "Cache-Control": "no-cache"})


@router.websocket("/{name}")
async def pass_on(socket: WebSocket, name: str) -> None:
    """Bytes both ways, nothing read and nothing kept; the protocol's name goes through."""
    offered = [Subprotocol(one) for one in socket.scope.get("subprotocols") or () if one.startswith(PROTOCOL)]
    try:
        scene = socket.app.state.scenes.get(name)
        inner = await connect(f"ws://127.0.0.1:{scene.port}/", subprotocols=offered or None, proxy=None,
                              additional_headers={KEY_HEADER: scene.key}, max_size=None, compression=None,
                              open_timeout=OPEN_S)
    except (NotFound, OSError, TimeoutError, WebSocketException):
        await socket.close(1008)  # before it was accepted: 403
        return
    async with inner:
        await socket.accept(subprotocol=inner.subprotocol)
        await until_either(_down(inner, socket), _up(socket, inner))


async def _down(inner: ClientConnection, socket: WebSocket) -> None:
    async for message in inner:
        if isinstance(message, bytes):
            await socket.send_bytes(message)


async def _up(socket: WebSocket, inner: ClientConnection) -> None:
    while True:
        message = await socket.receive()
        if message["type"] == "websocket.disconnect":
            raise WebSocketDisconnect
        data = message.get("bytes")
        if data is None or len(data) > LONGEST:
            return
        await inner.send(data)
