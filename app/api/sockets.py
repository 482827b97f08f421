"""WebSockets that tell: whoever listens hears each newest state; a refusal is a problem in a text, then the end."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import suppress
from typing import Any

from fastapi import WebSocket
from starlette.websockets import WebSocketDisconnect

from app.api.answers import json_bytes
from app.api.mjpeg import TAKE_S
from app.errors import TouchlineError


async def refuse(socket: WebSocket, error: TouchlineError) -> None:
    """The problem as JSON, and the socket closed with 4000 + its status."""
    problem = {"type": f"/problems/{error.reason}", "title": error.title, "status": error.status,
               "detail": error.what, "fix": error.fix}
    with suppress(RuntimeError, WebSocketDisconnect):
        await socket.send_text(json_bytes(problem).decode())
        await socket.close(4000 + error.status, error.reason[:100])


async def tell(socket: WebSocket, values: AsyncIterator[Any]) -> None:
    """Send each value as JSON until there is no more, or nobody who listens; then close."""
    await socket.accept()
    telling, hearing = asyncio.create_task(_tell(socket, values)), asyncio.create_task(_until_gone(socket))
    try:
        await asyncio.wait((telling, hearing), return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in (telling, hearing):
            task.cancel()
        ended = await asyncio.gather(telling, hearing, return_exceptions=True)
    for error in ended:
        if isinstance(error, TouchlineError):
            return await refuse(socket, error)
    with suppress(RuntimeError, WebSocketDisconnect):
        await socket.close()


async def _tell(socket: WebSocket, values: AsyncIterator[Any]) -> None:
    async for value in values:
        await asyncio.wait_for(socket.send_text(json_bytes(value).decode()), TAKE_S)


async def _until_gone(socket: WebSocket) -> None:
    with suppress(WebSocketDisconnect, RuntimeError):
        while (await socket.receive())["type"] != "websocket.disconnect":
            pass
