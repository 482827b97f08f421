"""/viser/NAME/: an open scene under our own port and login; viser itself accepts only this proxy."""

from fastapi import APIRouter, WebSocket
from starlette.responses import HTMLResponse
from starlette.websockets import WebSocketDisconnect
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import WebSocketException
from websockets.typing import Subprotocol

from touchline.api.dependencies import ServicesDep
from touchline.api.sockets import run_until_first
from touchline.core.errors import NotFound
from touchline.scene.messages import KEY_HEADER
from touchline.scene.page import PAGE_POLICY, client_page

router = APIRouter(prefix="/viser", include_in_schema=False)

PROTOCOL = "viser-v"
MAX_MESSAGE_BYTES = 1 << 20  # of a viewer's message: cameras and clicks have some hundred bytes
OPEN_S = 10.0


@router.get("/{name}/")
async def show_viser(services: ServicesDep, name: str) -> HTMLResponse:
    services.scenes.get(name)
    return HTMLResponse(client_page(), headers={"Content-Security-Policy": PAGE_POLICY, "Cache-Control": "no-cache"})


@router.websocket("/{name}")
async def forward_viser(socket: WebSocket, services: ServicesDep, name: str) -> None:
    """Forward bytes both ways and the subprotocol's name; nothing is read or stored."""
    offered = [Subprotocol(one) for one in socket.scope.get("subprotocols") or () if one.startswith(PROTOCOL)]
    try:
        scene = services.scenes.get(name)
        inner = await connect(f"ws://127.0.0.1:{scene.port}/", subprotocols=offered or None, proxy=None,
                              additional_headers={KEY_HEADER: scene.key}, max_size=None, compression=None,
                              open_timeout=OPEN_S)
    except (NotFound, OSError, TimeoutError, WebSocketException):
        await socket.close(1008)  # before it was accepted: 403
        return
    async with inner:
        await socket.accept(subprotocol=inner.subprotocol)
        await run_until_first(_to_client(inner, socket), _to_viser(socket, inner))


async def _to_client(inner: ClientConnection, socket: WebSocket) -> None:
    async for message in inner:
        if isinstance(message, bytes):
            await socket.send_bytes(message)


async def _to_viser(socket: WebSocket, inner: ClientConnection) -> None:
    while True:
        message = await socket.receive()
        if message["type"] == "websocket.disconnect":
            raise WebSocketDisconnect
        data = message.get("bytes")
        if data is None or len(data) > MAX_MESSAGE_BYTES:
            return
        await inner.send(data)
