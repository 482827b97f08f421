"""WebSockets that tell: whoever listens hears each newest state; a refusal is a problem in a text, then the end."""

import asyncio
from collections.abc import AsyncIterator, Coroutine
from contextlib import asynccontextmanager, suppress
from typing import Any

from fastapi import WebSocket
from starlette.websockets import WebSocketDisconnect

from app.api.answers import json_bytes
from app.api.mjpeg import TAKE_S
from app.core.errors import TouchlineError


async def refuse(socket: WebSocket, error: TouchlineError) -> None:
    """The problem as JSON, and the socket closed with 4000 + its status."""
    problem = {"type": f"/problems/{error.reason}", "title": error.title, "status": error.status,
               "detail": error.what, "fix": error.fix}
    with suppress(RuntimeError, WebSocketDisconnect):
        await socket.send_text(json_bytes(problem).decode())
        await socket.close(4000 + error.status, error.reason[:100])


@asynccontextmanager
async def spoken_with(socket: WebSocket) -> AsyncIterator[None]:
    """Open the line; a refusal within is told and ends it, and a line that breaks or falls silent is closed."""
    await socket.accept()
    try:
        yield
    except TouchlineError as error:
        await refuse(socket, error)
    except (TimeoutError, WebSocketDisconnect, RuntimeError):
        with suppress(RuntimeError, WebSocketDisconnect):
            await socket.close()


async def both(*doing: Coroutine[Any, Any, None]) -> None:
    """As until_either; a refusal by one of them is raised."""
    if (error := await until_either(*doing)) is not None:
        raise error


async def tell(socket: WebSocket, values: AsyncIterator[Any]) -> None:
    """Send each value as JSON until there is no more, or nobody who listens; then close."""
    await socket.accept()
    error = await until_either(_tell(socket, values), until_gone(socket))
    if error is not None:
        return await refuse(socket, error)
    with suppress(RuntimeError, WebSocketDisconnect):
        await socket.close()


async def until_either(*doing: Coroutine[Any, Any, None]) -> TouchlineError | None:
    """Do both until one has ended, and stop the other; a refusal by one of them, any other error is the line's end."""
    tasks = [asyncio.create_task(each) for each in doing]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        ended = await asyncio.gather(*tasks, return_exceptions=True)
    return next((error for error in ended if isinstance(error, TouchlineError)), None)


async def _tell(socket: WebSocket, values: AsyncIterator[Any]) -> None:
    async for value in values:
        await asyncio.wait_for(socket.send_text(json_bytes(value).decode()), TAKE_S)


async def until_gone(socket: WebSocket) -> None:
    """Until who listens has gone; what they say meanwhile means nothing."""
    with suppress(WebSocketDisconnect, RuntimeError):
        while (await socket.receive())["type"] != "websocket.disconnect":
            pass
