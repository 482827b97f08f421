"""A child process as the event loop of its parent holds it."""

import asyncio
from typing import Any, ClassVar, Self

from touchline.core.errors import Unavailable
from touchline.processes.framing import (
    ANSWER,
    HEADER,
    MAX_BODY,
    START,
    Message,
    decode_body,
    encode_body,
    error_from_json,
)
from touchline.processes.start import Program, start

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

    def __init__(
        self, process: Any, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
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
        child = cls(process, reader, writer)
        try:
            child.send(START, arguments)
            async with asyncio.timeout(cls.START_S):
                message = await child.receive()
            if message.kind != START:
                raise ConnectionResetError
            child.start_head, _ = decode_body(message.body)
        except (TimeoutError, OSError, asyncio.IncompleteReadError):
            await child.end()
            raise _unavailable(cls.NOT_READY) from None
        except BaseException:
            await child.end()
            raise
        return child

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

    async def request(
        self, kind: int, head: dict[str, Any], timeout_s: float
    ) -> tuple[dict[str, Any], bytes]:
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
