"""A scene's process seen from the server's event loop: started, spoken to, and ended."""

import asyncio
import contextlib
import json
import os
import secrets
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from app.core.errors import TouchlineError, Unavailable
from app.live import messages as form
from app.live.process import KINDS, ONE_THREAD, READ_BYTES
from app.scene import messages, worker_main

START_S = 45.0  # importing viser takes 1 s, on a busy small machine many
ANSWER_S = 60.0
Heard = Callable[[dict[str, Any]], None]


class SceneProcess:
    """One process from its start to its end. Only for the event loop's own thread.

    clicked: called with what a click on the carpet means. port and key: where viser listens, and what it wants to hear.
    """

    def __init__(self, process: subprocess.Popen[bytes], reader: asyncio.StreamReader, writer: asyncio.StreamWriter,
                 clicked: Heard) -> None:
        self.key = secrets.token_hex(16)
        self.port = 0
        self.viewers = 0
        self._process, self._reader, self._writer, self._clicked = process, reader, writer, clicked
        self._asked: dict[int, asyncio.Future[tuple[dict[str, Any], bytes]]] = {}
        self._number = 0
        self._listening: asyncio.Task[None] | None = None

    @classmethod
    async def start(cls, clicked: Heard = lambda _told: None) -> "SceneProcess":
        """A living process with an empty scene; Unavailable where none can be started."""
        ours, theirs = socket.socketpair()
        try:
            with theirs:
                process = await asyncio.to_thread(_started, theirs)
            reader, writer = await asyncio.open_connection(sock=ours, limit=READ_BYTES)
        except OSError:
            ours.close()
            raise _no_start() from None
        made = cls(process, reader, writer, clicked)
        try:
            made.send(messages.KEY, {"key": made.key})
            kind, head, _ = await asyncio.wait_for(made._receive(), START_S)
            if kind != messages.READY:
                raise ConnectionResetError
        except (TimeoutError, OSError, asyncio.IncompleteReadError):
            await made.end()
            raise _no_start() from None
        except BaseException:
            await made.end()
            raise
        made.port = head["port"]
        made._listening = asyncio.create_task(made._listen(), name="scene")
        return made

    @property
    def pid(self) -> int:
        return self._process.pid

    async def show(self, given: dict[str, Any]) -> dict[str, Any]:
        """Draw it all anew; what is told beside the scene. What cannot be shown is refused."""
        return (await self._ask(messages.DRAW, given))[0]

    async def export(self, title: str, dark: bool) -> bytes:
        """The scene as it stands, as one HTML file."""
        return (await self._ask(messages.EXPORT, {"title": title, "dark": dark}))[1]

    def send(self, kind: int, head: dict[str, Any], payload: bytes = b"") -> None:
        body = form.message(head, payload)
        self._writer.write(form.HEADER.pack(kind, 0, len(body)) + body)

    @property
    def is_congested(self) -> bool:
        """Whether it has not even taken yet what was sent: another picture would only queue."""
        return self._writer.transport.get_write_buffer_size() > 0

    @property
    def is_alive(self) -> bool:
        return self._listening is not None and not self._listening.done()

    async def end(self) -> None:
        """Kill it, and wait until it is gone."""
        self._process.kill()
        await asyncio.to_thread(self._process.wait)
        if self._listening is not None:
            self._listening.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._listening
        self._writer.close()
        self._give_up()

    async def _ask(self, kind: int, head: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
        self._number += 1
        number = self._number
        answer: asyncio.Future[tuple[dict[str, Any], bytes]] = asyncio.get_running_loop().create_future()
        self._asked[number] = answer
        try:
            self.send(kind, {**head, "number": number})
            return await asyncio.wait_for(answer, ANSWER_S)
        except TimeoutError:
            raise Unavailable("The scene does not answer.", "Open it again.", reason="scene-silent") from None
        finally:
            self._asked.pop(number, None)

    async def _listen(self) -> None:
        with contextlib.suppress(OSError, asyncio.IncompleteReadError):
            while True:
                kind, head, payload = await self._receive()
                if kind == messages.ANSWER:
                    self._answered(head, payload)
                elif kind == messages.CLICKED:
                    self._clicked(head)
                elif kind == messages.VIEWERS:
                    self.viewers = head["count"]
        self._give_up()

    def _answered(self, head: dict[str, Any], payload: bytes) -> None:
        future = self._asked.pop(head["number"], None)
        if future is None or future.done():
            return
        if problem := head.get("problem"):
            kind: type[TouchlineError] = KINDS.get(problem["kind"], Unavailable)
            future.set_exception(kind(problem["what"], problem["fix"], reason=problem["reason"]))
        else:
            future.set_result((head["told"], payload))

    def _give_up(self) -> None:
        for future in self._asked.values():
            if not future.done():
                future.set_exception(Unavailable("The scene's process has ended.", "Open the scene again.",
                                                 reason="scene-gone"))
        self._asked.clear()

    async def _receive(self) -> tuple[int, dict[str, Any], bytes]:
        kind, _, length = form.HEADER.unpack(await self._reader.readexactly(form.HEADER.size))
        if length > form.MAX_BODY:
            raise ConnectionResetError
        head, payload = form.parts(await self._reader.readexactly(length))
        return kind, head, bytes(payload)


def _no_start() -> Unavailable:
    return Unavailable("The scene's process cannot be started.", "Free some memory, then open the scene again.",
                       reason="scene-process")


def _started(theirs: socket.socket) -> subprocess.Popen[bytes]:
    environment = {k: v for k, v in os.environ.items() if not k.startswith("TOUCHLINE_TOKEN")} | ONE_THREAD
    return subprocess.Popen([sys.executable, "-P", str(Path(worker_main.__file__)), json.dumps(sys.path)],
                            env=environment, stdin=theirs, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                            start_new_session=True)
