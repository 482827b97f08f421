"""Start a child process in a session of its own, on one socket, without the server's secrets, and speak with it."""

import asyncio
import json
import os
import socket
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Thread
from typing import Any, ClassVar, Self

from touchline.core.errors import Unavailable
from touchline.processes.framing import (
    ANSWER,
    HEADER,
    MAX_BODY,
    START,
    Connection,
    Message,
    decode_body,
    encode_body,
    error_from_json,
)

CHILD_MAIN = Path(__file__).with_name("child_main.py")
FRUGAL = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1",
          "MALLOC_ARENA_MAX": "1"}  # of a thread's own arena the GNU library returns little of what was freed
REAPER = "reaper of"
SECRET = "TOUCHLINE"  # our settings may hold a token or a database's password, for which a child has no use


@dataclass(frozen=True)
class Program:
    """What a child process runs.

    main: "module:function", called with the connection to its parent and its arguments, a dict of plain JSON.
    memory_bytes: of address space; None where main sets its own limits. nice: niceness.
    """

    main: str
    memory_bytes: int | None = None
    nice: int = 0


class Child(subprocess.Popen[bytes]):
    """A process whose end is collected at once, also where nobody asks for it any more."""

    _reaper: Thread | None = None

    def collect_soon(self) -> None:
        """Collect it in a thread of its own, or, where no thread is to be had, when somebody looks for it."""
        reaper = Thread(target=self._collect, name=f"{REAPER} {self.pid}", daemon=True)
        with suppress(RuntimeError):
            reaper.start()
            self._reaper = reaper

    def wait(self, timeout: float | None = None) -> int:
        """Wait until it has ended and nothing of it is left, no thread either."""
        code = super().wait(timeout)
        if self._reaper is not None:
            self._reaper.join()
        return code

    def _collect(self) -> None:
        with suppress(ChildProcessError):  # another thread was faster
            # Not wait(): it holds the lock all the while without which poll() of other threads cannot tell.
            os.waitid(os.P_PID, self.pid, os.WEXITED | os.WNOWAIT)
        self.poll()


def start(program: Program) -> tuple[Child, socket.socket]:
    """Return the process and the parent's end of the socket; OSError where none can be started."""
    ours, theirs = socket.socketpair()
    start_up = json.dumps({"path": sys.path, "main": program.main, "memory_bytes": program.memory_bytes,
                           "nice": program.nice})
    environment = {name: value for name, value in os.environ.items() if not name.startswith(SECRET)} | FRUGAL
    try:
        with theirs:
            # A session of its own: an operator's Ctrl-C is for the server, which then ends its children.
            process = Child([sys.executable, "-P", str(CHILD_MAIN), start_up], env=environment, stdin=theirs.fileno(),
                            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    except OSError:
        ours.close()
        raise
    process.collect_soon()
    return process, ours


class ChildProcess:
    """One process from its start to its end, and the connection to it. Only end() may be called by other threads.

    arguments: plain JSON for its main. OSError where none can be started.
    """

    def __init__(self, program: Program, arguments: dict[str, Any], allocate: Callable[[int], Any] = bytearray,
                 max_body: int = MAX_BODY) -> None:
        self._process, line = start(program)
        self.connection = Connection(line, allocate, max_body)
        try:
            self.connection.send(START, 0, encode_body(arguments))
        except OSError:
            self.close()
            raise

    @property
    def pid(self) -> int:
        return self._process.pid

    @property
    def is_alive(self) -> bool:
        return self._process.poll() is None

    def await_ready(self, timeout_s: float) -> None:
        """Wait until it says that it is ready; OSError where it does not."""
        message = self.connection.receive(timeout_s)
        if message is None or message.kind != START:
            raise ConnectionResetError

    def end(self) -> None:
        """Kill it and wait until it is gone; whoever waits for its answer gets OSError."""
        self._process.kill()
        self._process.wait()

    def close(self) -> None:
        """Kill it, and close our end of the socket."""
        self.end()
        self.connection.close()


READ_BYTES = 1 << 22
Refusal = tuple[str, str, str]  # what, fix, reason


class AsyncProcess:
    """One process from its start to its end. Only for the event loop's own thread.

    A kind of process says what it runs, how long that may take to start, and how its failures are told.
    """

    PROGRAM: ClassVar[Program]
    START_S: ClassVar[float]
    CANNOT_START: ClassVar[Refusal]
    NOT_READY: ClassVar[Refusal]
    SILENT: ClassVar[Refusal]
    ENDED: ClassVar[Refusal]

    def __init__(self, process: Any, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._process, self._reader, self._writer = process, reader, writer
        self._requests: dict[int, asyncio.Future[tuple[dict[str, Any], bytes]]] = {}
        self._number = 0
        self.start_head: dict[str, Any] = {}  # what it said when it was ready

    @classmethod
    async def start(cls, arguments: dict[str, Any]) -> Self:
        """Return a living process that is ready; Unavailable where none can be started."""
        try:
            process, line = await asyncio.to_thread(start, cls.PROGRAM)
            reader, writer = await asyncio.open_connection(sock=line, limit=READ_BYTES)
        except OSError:
            raise _unavailable(cls.CANNOT_START) from None
        made = cls(process, reader, writer)
        try:
            made.send(START, arguments)
            async with asyncio.timeout(cls.START_S):
                message = await made.receive()
            if message.kind != START:
                raise ConnectionResetError
            made.start_head, _ = decode_body(message.body)
        except (TimeoutError, OSError, asyncio.IncompleteReadError):
            await made.end()
            raise _unavailable(cls.NOT_READY) from None
        except BaseException:
            await made.end()
            raise
        return made

    @property
    def pid(self) -> int:
        return self._process.pid

    @property
    def is_congested(self) -> bool:
        """Whether it has not even taken what was sent to it: more would only queue."""
        return self._writer.transport.get_write_buffer_size() > 0

    async def receive(self) -> Message:
        """Return the next message; IncompleteReadError or ConnectionResetError when it has gone or sends no JSON.

        An ANSWER is handed to whoever waits for it, too.
        """
        kind, number, length = HEADER.unpack(await self._reader.readexactly(HEADER.size))
        if length > MAX_BODY:
            raise ConnectionResetError
        message = Message(kind, number, await self._reader.readexactly(length))
        if kind == ANSWER:
            self._resolve(number, message.body)
        return message

    def send(self, kind: int, head: dict[str, Any], payload: bytes = b"", number: int = 0) -> None:
        body = encode_body(head, payload)
        self._writer.write(HEADER.pack(kind, number, len(body)) + body)

    async def request(self, kind: int, head: dict[str, Any], timeout_s: float) -> tuple[dict[str, Any], bytes]:
        """Return what the process answers; raise what it refuses. Unavailable when it does not answer.

        Somebody must be receiving meanwhile.
        """
        self._number += 1
        number = self._number
        self._requests[number] = asyncio.get_running_loop().create_future()
        try:
            self.send(kind, head, number=number)
            async with asyncio.timeout(timeout_s):
                return await self._requests[number]
        except TimeoutError:
            raise _unavailable(self.SILENT) from None
        finally:
            self._requests.pop(number, None)

    def kill(self) -> None:
        """End it at once, stopped or not; receive() then notices."""
        self._process.kill()

    async def end(self) -> None:
        """Kill it, and wait until it is gone; who waits for an answer gets Unavailable."""
        self._process.kill()
        await asyncio.to_thread(self._process.wait)
        self._writer.close()
        self.fail_requests()

    def fail_requests(self) -> None:
        """Tell everybody who waits for an answer that none will come."""
        for future in self._requests.values():
            if not future.done():
                future.set_exception(_unavailable(self.ENDED))
        self._requests.clear()

    def _resolve(self, number: int, body: bytes) -> None:
        head, payload = decode_body(body)
        future = self._requests.pop(number, None)
        if future is None or future.done():
            return
        if problem := head.get("problem"):
            future.set_exception(error_from_json(problem))
        else:
            future.set_result((head, bytes(payload)))


def _unavailable(refusal: Refusal) -> Unavailable:
    what, fix, reason = refusal
    return Unavailable(what, fix, reason=reason)
