"""Limit connections: headers complete in time and small, so many open at once, and which of them go first.

A connection that waits, idle or with half a head, keeps no request from being answered: it is closed, the longest
waiting first, where another needs its place. What is being answered, and a WebSocket, counts until its end.

uvicorn waits forever for the rest of a request's head, and httptools does not bound its size; an application is called
only afterwards. Hand the class to uvicorn.Config(http=…).
"""

import ipaddress
from asyncio import TimerHandle, Transport
from collections import Counter
from collections.abc import Callable
from typing import Any, Protocol

from starlette.datastructures import Headers
from starlette.responses import Response
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from touchline.api.middleware.problems import problem

RESERVE = 64  # beyond the limit, for this machine and for who has the token: until its head says so

# where the state of a request's scope holds what drops its connection at once
ABORT = "touchline.abort"
RETRY = {"Retry-After": "5"}
OVERLOADED = problem(
    503,
    "too-many-connections",
    "The server has too many connections.",
    "Try again in some seconds.",
    {"Connection": "close", **RETRY},
)
MAX_HEAD_BYTES = 64 * 1024  # browsers send 2 kB, a large cookie makes it 8


class Counted(Protocol):
    """A connection. address: of the other machine; None for this one, and for a proxy on it."""

    address: str | None

    def make_room(self) -> None:
        """Close it without an answer."""


class OpenConnections:
    """Of one server, whose event loop alone calls it. most: at once; per_address: from one other machine."""

    def __init__(self, most: int = 256, per_address: int = 40) -> None:
        self.most = most
        self.per_address = per_address
        self._open: set[Counted] = set()
        self._by_address: Counter[str] = Counter()
        self._waiting: dict[Counted, None] = {}  # the longest waiting first

    def add(self, one: Counted) -> bool:
        """Count a new connection, which waits, and close another where it takes its place; False without a place."""
        if one.address is not None and self._by_address[one.address] >= self.per_address:
            if not self._close_longest_waiting(one.address):
                return False
        elif (
            len(self._open) >= self.most
            and not self._close_longest_waiting()
            and len(self._open) >= self.most + RESERVE
            and one.address is not None
        ):
            return False
        self._open.add(one)
        self._by_address.update([one.address] if one.address is not None else [])
        self._waiting[one] = None
        return True

    def wait(self, one: Counted) -> None:
        """Note that it waits for its next request."""
        if one in self._open:
            self._waiting.pop(one, None)
            self._waiting[one] = None

    def work(self, one: Counted) -> None:
        """Note that it has sent its whole head."""
        self._waiting.pop(one, None)

    def is_beyond(self, one: Counted) -> bool:
        """Tell whether it lives on the reserve, which is for this machine and who has the token."""
        return one.address is not None and len(self._open) > self.most

    def remove(self, one: Counted) -> None:
        """Note that it has ended; it may have been refused before."""
        self._waiting.pop(one, None)
        if one not in self._open:
            return
        self._open.discard(one)
        if one.address is not None:
            self._by_address[one.address] -= 1
            if self._by_address[one.address] <= 0:
                del self._by_address[one.address]

    def _close_longest_waiting(self, address: str | None = None) -> bool:
        """Close the longest waiting of an address, else of all: of other machines before those of this one."""
        waiting = [one for one in self._waiting if address is None or one.address == address]
        found = next(
            (one for one in waiting if one.address is not None), waiting[0] if waiting else None
        )
        if found is None:
            return False
        found.make_room()
        self.remove(found)
        return True


def limited_connections(
    *,
    head_s: float = 10.0,
    most: int = 256,
    per_address: int = 40,
    is_known: Callable[[Headers], bool] = lambda _: False,
) -> type[HttpToolsProtocol]:
    """Return the connection class for one server.

    head_s: from connecting, or from the first byte of a later request, to the end of its headers.
    most: open connections at once; per_address: of one other machine; this one (and a proxy on it) has no such limit.
    is_known: whether a request has the token; it is answered where others find no place any more.
    """
    limits = {
        "head_s": head_s,
        "open": OpenConnections(most, per_address),
        "is_known": staticmethod(is_known),
    }
    return type("ServerConnection", (LimitedConnection,), limits)


class LimitedConnection(HttpToolsProtocol):
    """An HTTP connection, closed when a request's head is late or too long; a WebSocket is counted to its end."""

    head_s: float
    open: OpenConnections
    is_known: Callable[[Headers], bool]

    def __init__(self, *args: Any, **more: Any) -> None:
        super().__init__(*args, **more)
        self._timer: TimerHandle | None = None
        self._in_head = True
        self._upgraded = False
        self._head_bytes = 0
        self.address: str | None = None

    def connection_made(self, transport: Transport) -> None:  # type: ignore[override]  # as uvicorn's own
        super().connection_made(transport)
        address = self.client[0] if self.client else ""
        self.address = None if _is_this_machine(address) else address
        if self.open.add(self):
            return self._start_timer()
        self._close(
            503,
            "too-many-connections",
            "Too many connections are open, here or from your address.",
            "Close some tabs or scripts, then try again.",
            RETRY,
        )

    def connection_lost(self, exc: Exception | None) -> None:
        self._stop_timer()
        self.open.remove(self)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        if self.transport.is_closing():
            return
        super().data_received(data)
        between = self.cycle is None or self.cycle.response_complete
        if self._upgraded or not (self._in_head or between) or self.transport.is_closing():
            return
        self._start_timer()
        self._head_bytes += len(data)
        if self._in_head and self._head_bytes > MAX_HEAD_BYTES:
            self._close(
                431,
                "headers-too-large",
                f"The headers have more than {MAX_HEAD_BYTES // 1024} kB.",
                "Send fewer or shorter headers.",
            )

    def on_message_begin(self) -> None:
        super().on_message_begin()
        self._in_head = True
        self._head_bytes = 0

    def on_headers_complete(self) -> None:
        self._in_head = False
        self._stop_timer()
        self.open.work(self)
        if self.open.is_beyond(self) and not self.is_known(
            Headers(raw=list(self.scope["headers"]))
        ):
            self.app = OVERLOADED
        # for a stream whose viewer takes nothing any more
        self.scope["state"][ABORT] = self.transport.abort
        super().on_headers_complete()

    def on_response_complete(self) -> None:
        super().on_response_complete()
        if self.cycle.response_complete and not self.pipeline:
            self.open.wait(self)

    def handle_websocket_upgrade(self) -> None:
        self._upgraded = True
        self._stop_timer()
        if self.app is OVERLOADED:
            return self._send(OVERLOADED)
        super().handle_websocket_upgrade()
        # uvicorn's, which has the connection from now on
        socket: Any = self.transport.get_protocol()
        ended = socket.connection_lost

        def connection_lost(exc: Exception | None) -> None:
            self.open.remove(self)
            ended(exc)

        socket.connection_lost = connection_lost

    def make_room(self) -> None:
        """Close it without an answer: it waits, and another needs its place."""
        self._stop_timer()
        self.transport.abort()

    def _start_timer(self) -> None:
        if self._timer is None:
            self._timer = self.loop.call_later(self.head_s, self._late)

    def _stop_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _late(self) -> None:
        self._timer = None
        self._close(
            408,
            "too-slow",
            f"The request headers were incomplete after {self.head_s:g} s.",
            "Send the complete request without delay.",
        )

    def _close(
        self, status: int, reason: str, detail: str, fix: str, headers: dict[str, str] | None = None
    ) -> None:
        if self.transport.is_closing():
            return
        self._send(problem(status, reason, detail, fix, {"Connection": "close", **(headers or {})}))

    def _send(self, answer: Response) -> None:
        """Send what no application sends, and close."""
        lines = [
            b"HTTP/1.1 %d Refused" % answer.status_code,
            *(b": ".join(pair) for pair in answer.raw_headers),
        ]
        self.transport.write(b"\r\n".join(lines) + b"\r\n\r\n" + answer.body)
        self.transport.close()


def _is_this_machine(address: str) -> bool:
    try:
        ip = ipaddress.ip_address(address)
        return (getattr(ip, "ipv4_mapped", None) or ip).is_loopback
    except ValueError:
        return True  # a Unix socket has no address
