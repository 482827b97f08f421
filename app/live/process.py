"""A camera's process seen from the server's event loop: started, spoken to, and killed when it misbehaves."""

import asyncio
import json
import os
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

from app.core.errors import BadInput, NotFound, TouchlineError, Unavailable
from app.live import messages, worker_main

START_S = 30.0  # importing OpenCV takes 0.3 s, on a busy small machine some seconds
READ_BYTES = 1 << 22
ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
KINDS: dict[str, type[TouchlineError]] = {kind.__name__: kind for kind in (BadInput, NotFound, Unavailable)}


class CameraProcess:
    """One process from its start to its end. Only for the event loop's own thread."""

    def __init__(self, process: subprocess.Popen[bytes], reader: asyncio.StreamReader,
                 writer: asyncio.StreamWriter) -> None:
        self._process = process
        self._reader, self._writer = reader, writer
        self._asked: dict[int, asyncio.Future[tuple[dict[str, Any], bytes]]] = {}
        self._number = 0

    @classmethod
    async def start(cls, spec: dict[str, Any]) -> "CameraProcess":
        """A living process that reads the source; Unavailable where none can be started."""
        ours, theirs = socket.socketpair()
        try:
            with theirs:
                process = await asyncio.to_thread(_started, theirs)
            reader, writer = await asyncio.open_connection(sock=ours, limit=READ_BYTES)
        except OSError:
            ours.close()
            raise Unavailable("The camera's process cannot be started.", "Free some memory.",
                              reason="camera-process") from None
        started = cls(process, reader, writer)
        try:
            kind, _, _ = await asyncio.wait_for(started.receive(), START_S)
            if kind != messages.READY:
                raise ConnectionResetError
            started.send(messages.OPEN, spec)
        except (TimeoutError, OSError, asyncio.IncompleteReadError):
            await started.end()
            raise Unavailable("The camera's process does not start.", "Free some memory, or reinstall Touchline.",
                              reason="camera-process") from None
        except BaseException:
            await started.end()
            raise
        return started

    @property
    def pid(self) -> int:
        return self._process.pid

    async def receive(self) -> tuple[int, int, bytes]:
        """The next message; IncompleteReadError or ConnectionResetError when the process has gone."""
        kind, number, length = messages.HEADER.unpack(await self._reader.readexactly(messages.HEADER.size))
        if length > messages.MAX_BODY:
            raise ConnectionResetError
        return kind, number, await self._reader.readexactly(length)

    def send(self, kind: int, head: dict[str, Any], number: int = 0) -> None:
        body = messages.message(head)
        self._writer.write(messages.HEADER.pack(kind, number, len(body)) + body)

    async def ask(self, head: dict[str, Any], timeout_s: float) -> tuple[dict[str, Any], bytes]:
        """What the process answers; what it refuses is raised here. Unavailable when it does not answer."""
        self._number += 1
        number = self._number
        answer: asyncio.Future[tuple[dict[str, Any], bytes]] = asyncio.get_running_loop().create_future()
        self._asked[number] = answer
        try:
            self.send(messages.REQUEST, head, number)
            return await asyncio.wait_for(answer, timeout_s)
        except TimeoutError:
            raise Unavailable("The camera does not answer.", "Look at its state, then try again.",
                              reason="camera-silent") from None
        finally:
            self._asked.pop(number, None)

    def answered(self, number: int, body: bytes) -> None:
        """An ANSWER came; it is handed to who asked, if they still wait."""
        future = self._asked.pop(number, None)
        if future is None or future.done():
            return
        head, payload = messages.parts(body)
        if problem := head.get("problem"):
            future.set_exception(KINDS.get(problem["kind"], Unavailable)(
                problem["what"], problem["fix"], reason=problem["reason"]))
        else:
            future.set_result((head, bytes(payload)))

    def kill(self) -> None:
        """End it at once, stopped or not; receive() then notices."""
        self._process.kill()

    async def end(self) -> None:
        """Kill it, and wait until it is gone; who asked it something gets Unavailable."""
        self._process.kill()
        await asyncio.to_thread(self._process.wait)
        self._writer.close()
        for future in self._asked.values():
            if not future.done():
                future.set_exception(Unavailable("The camera's process was ended.", "Try again in a moment.",
                                                 reason="camera-silent"))
        self._asked.clear()


def _started(theirs: socket.socket) -> subprocess.Popen[bytes]:
    # A session of its own: an operator's Ctrl-C is for the server, which then ends its cameras. Our settings may hold a
    # token, for which a camera has no use.
    environment = {k: v for k, v in os.environ.items() if not k.startswith("TOUCHLINE_TOKEN")} | ONE_THREAD
    return subprocess.Popen([sys.executable, "-P", str(Path(worker_main.__file__)), json.dumps(sys.path)],
                            env=environment, stdin=theirs, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                            start_new_session=True)


