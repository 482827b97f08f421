"""WebSockets: a session that answers refusals with a problem, and the loops that send and receive in it."""

import asyncio
from collections import Counter
from collections.abc import AsyncIterator, Coroutine, Iterator
from contextlib import asynccontextmanager, contextmanager, suppress
from typing import Any, TypeVar

from fastapi import WebSocket
from pydantic import BaseModel, ValidationError
from starlette.websockets import WebSocketDisconnect

from touchline.api.middleware.problems import MANUAL, json_bytes
from touchline.core.errors import BadInput, Busy, TouchlineError
from touchline.core.statements import stated

Received = TypeVar("Received", bound=BaseModel)
SEND_TIMEOUT_S = 10.0  # a viewer that takes nothing for so long is closed
CLOSE_TIMEOUT_S = 1.0


@asynccontextmanager
async def websocket_session(socket: WebSocket) -> AsyncIterator[None]:
    """Accept the socket and close it at the end; a refusal raised within is sent as a problem first."""
    await socket.accept()
    with suppress(TimeoutError, WebSocketDisconnect, RuntimeError):
        try:
            yield
        except TouchlineError as error:
            await send_json(
                socket,
                stated(
                    {
                        "type": MANUAL + error.reason,
                        "title": error.title,
                        "status": error.status,
                        "detail": error.what,
                        "fix": error.fix,
                    }
                ),
            )
            await socket.close(4000 + error.status, error.reason[:100])
            return
    with suppress(TimeoutError, WebSocketDisconnect, RuntimeError):
        async with asyncio.timeout(CLOSE_TIMEOUT_S):
            await socket.close()


async def run_until_first(*coroutines: Coroutine[Any, Any, None]) -> None:
    """Run all until one has ended and cancel the others; raise a refusal, ignore what breaks with the connection."""
    tasks = [asyncio.create_task(coroutine) for coroutine in coroutines]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        results = await asyncio.gather(*tasks, return_exceptions=True)
    for result in results:
        if isinstance(result, TouchlineError):
            raise result


async def send_stream(socket: WebSocket, values: AsyncIterator[Any]) -> None:
    """Send each value as JSON until there are no more or the client has gone; then close."""

    async def send_all() -> None:
        async for value in values:
            await send_json(socket, value)

    async with websocket_session(socket):
        await run_until_first(send_all(), until_disconnect(socket))


async def send_json(socket: WebSocket, value: Any) -> None:
    await send_text(socket, json_bytes(value).decode())


async def send_text(socket: WebSocket, text: str) -> None:
    async with asyncio.timeout(SEND_TIMEOUT_S):
        await socket.send_text(text)


async def receive_json(
    socket: WebSocket, schema: type[Received], max_length: int, fix: str
) -> Received:
    """Return the client's next message; BadInput with the fix for one of bytes, a longer one, and what is none."""
    message = await socket.receive()
    if message["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(message.get("code", 1005))
    text = message.get("text")
    try:
        if text is not None and len(text) <= max_length:
            return schema.model_validate_json(text)
    except ValidationError:
        pass
    raise BadInput("The message is not valid here.", fix, reason="bad-request")


async def until_disconnect(socket: WebSocket) -> None:
    """Return when the client has gone; whatever it sends meanwhile is ignored."""
    with suppress(WebSocketDisconnect, RuntimeError):
        while (await socket.receive())["type"] != "websocket.disconnect":
            pass


class SessionLimit:
    """At most so many sessions at once for one key; Busy for one more."""

    def __init__(self, max_sessions: int, what: str, fix: str, reason: str) -> None:
        self._max, self._refusal = max_sessions, (what, fix, reason)
        self._open: Counter[str] = Counter()

    @contextmanager
    def session(self, key: str) -> Iterator[None]:
        if self._open[key] >= self._max:
            what, fix, reason = self._refusal
            raise Busy(what, fix, reason=reason)
        self._open[key] += 1
        try:
            yield
        finally:
            self._open[key] -= 1
            if not self._open[key]:
                del self._open[key]
