"""Whole messages over a socket: HEADER (kind, number, how many bytes follow), then a body. Nothing is pickled.

Most bodies are a little-endian uint32, that many bytes of JSON, then bytes of their own (a JPEG, a PNG, nothing).

START and ANSWER mean the same to every child. START is the first message each way: to the child its arguments, from
it that it is ready. An ANSWER has the number of its request. Each kind of child counts its own kinds from FIRST_KIND.
"""

import json
import socket
import struct
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, overload

from touchline.core.errors import BadInput, NotFound, ProblemJson, TouchlineError, Unavailable
from touchline.core.statements import sentence_in

HEADER = struct.Struct("<BII")
LENGTH = struct.Struct("<I")
START, ANSWER, FIRST_KIND = range(3)
MAX_BODY = 256 << 20  # a still of 50 megapixels as PNG
KINDS: dict[str, type[TouchlineError]] = {
    kind.__name__: kind for kind in (BadInput, NotFound, Unavailable)
}


class Message(NamedTuple):
    """One message. body: bytes, or what the receiver allocates."""

    kind: int
    number: int
    body: Any


def encode_body(head: Mapping[str, Any], payload: bytes = b"", members: bytes = b"") -> bytes:
    """Return a body. members: JSON text of further members, ready made, such as b'"overlays":{…}'."""
    text = json.dumps(head, allow_nan=False, separators=(",", ":")).encode("ascii")
    if members:
        text = text[:-1] + b"," + members + b"}"
    return LENGTH.pack(len(text)) + text + payload


def decode_body(body: bytes) -> tuple[dict[str, Any], memoryview]:
    """Return a body's JSON and its payload; ConnectionResetError for one that is broken."""
    text, payload = split_body(body)
    try:
        head = json.loads(bytes(text))
    except (ValueError, RecursionError):
        head = None
    if not isinstance(head, dict):
        raise ConnectionResetError
    return head, payload


def split_body(body: bytes) -> tuple[memoryview, memoryview]:
    """Return a body's JSON, not parsed, and its payload, without a copy; ConnectionResetError for one too short."""
    if len(body) < LENGTH.size:
        raise ConnectionResetError
    (length,) = LENGTH.unpack_from(body)
    view = memoryview(body)[LENGTH.size :]
    return view[:length], view[length:]


class Connection:
    """One end of a socket. Any thread may send; one thread receives.

    allocate: makes room for a body of so many bytes. max_body: more is refused like a connection that broke.
    """

    def __init__(
        self,
        line: socket.socket,
        allocate: Callable[[int], Any] = bytearray,
        max_body: int = MAX_BODY,
    ) -> None:
        self._socket = line
        self._allocate = allocate
        self._max_body = max_body
        self._sending = threading.Lock()
        self._header: tuple[int, int] | None = None  # kind and number, while the body is received
        self._part, self._filled = bytearray(HEADER.size), 0

    def send(self, kind: int, number: int, *parts: Any, timeout_s: float | None = None) -> None:
        """Send a message whose body is these bytes, one after the other; OSError when the other end has gone."""
        with self._sending:
            self._socket.settimeout(timeout_s)
            self._socket.sendall(HEADER.pack(kind, number, sum(len(part) for part in parts)))
            for part in parts:
                self._socket.sendall(part)

    @overload
    def receive(self) -> Message: ...
    @overload
    def receive(self, timeout_s: float | None) -> Message | None: ...
    def receive(self, timeout_s: float | None = None) -> Message | None:
        """Return the next message; None where it is not whole in time: the next call goes on with what has come.

        OSError when the other end has gone.
        """
        deadline = None if timeout_s is None else time.monotonic() + timeout_s
        while True:
            if not self._fill(deadline):
                return None
            part, self._filled = self._part, 0
            if self._header is None:
                kind, number, length = HEADER.unpack(part)
                if length > self._max_body:
                    raise ConnectionResetError
                self._header, self._part = (kind, number), self._allocate(length)
            else:
                header, self._header, self._part = self._header, None, bytearray(HEADER.size)
                return Message(*header, part)

    def close(self) -> None:
        self._socket.close()

    def _fill(self, deadline: float | None) -> bool:
        """Receive the rest of the header or body; False where the time is up."""
        view = memoryview(self._part)
        while self._filled < len(view):
            left_s = None if deadline is None else deadline - time.monotonic()
            if left_s is not None and left_s <= 0:
                return False
            self._socket.settimeout(left_s)
            try:
                count = self._socket.recv_into(view[self._filled :])
            except TimeoutError:
                return False
            if count == 0:
                raise ConnectionResetError
            self._filled += count
        return True


class CrossingProblem(ProblemJson):
    kind: str


def problem_json(error: TouchlineError) -> CrossingProblem:
    return {"kind": type(error).__name__, **error.to_json()}


def error_from_json(problem: Mapping[str, Any]) -> TouchlineError:
    """Return the error to raise in the parent; Unavailable for a kind that does not cross."""
    kind = KINDS.get(problem.get("kind", ""), Unavailable)
    return kind(sentence_in(problem, "what"), sentence_in(problem, "fix"), reason=problem["reason"])


def answer(
    connection: Connection, number: int, action: Callable[[], tuple[dict[str, Any], bytes]]
) -> None:
    """Answer a request with what the action returns, JSON and payload, or with its refusal."""
    try:
        head, payload = action()
    except TouchlineError as error:
        head, payload = {"problem": problem_json(error)}, b""
    connection.send(ANSWER, number, encode_body(head, payload))
