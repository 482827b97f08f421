"""Limit connections: headers must be complete in time and small, and one address has only so many.

uvicorn waits forever for the rest of a request's head, and httptools does not bound its size; an application is called
only afterwards. Hand the class to uvicorn.Config(http=…).
"""

import ipaddress
from asyncio import TimerHandle, Transport
from collections import Counter
from typing import Any

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from app.api.middleware.problems import problem

ABORT = "touchline.abort"  # where the state of a request's scope holds what drops its connection at once
MAX_HEAD_BYTES = 64 * 1024  # browsers send 2 kB, a large cookie makes it 8


def limited_connections(*, head_s: float = 10.0, per_address: int = 40) -> type[HttpToolsProtocol]:
    """Return the connection class for one server.

    head_s: from connecting, or from the first byte of a later request, to the end of its headers.
    per_address: open connections from one other machine; this one (and a proxy on it) has no such limit.
    """
    limits = {"head_s": head_s, "per_address": per_address, "open": Counter()}
    return type("ServerConnection", (LimitedConnection,), limits)


class LimitedConnection(HttpToolsProtocol):
    """An HTTP connection, closed when a request's head is late or too long. WebSockets leave at their upgrade."""

    head_s: float
    per_address: int
    open: Counter[str]

    def __init__(self, *args: Any, **more: Any) -> None:
        super().__init__(*args, **more)
        self._timer: TimerHandle | None = None
        self._in_head = True
        self._upgraded = False
        self._head_bytes = 0
        self._counted: str | None = None

    def connection_made(self, transport: Transport) -> None:  # type: ignore[override]  # as uvicorn's own
        super().connection_made(transport)
        address = self.client[0] if self.client else ""
        if not _is_this_machine(address):
            self._counted = address
            self.open[address] += 1
            if self.open[address] > self.per_address:
                return self._close(503, "too-many-connections",
                                   f"{self.per_address} connections are open from your address.",
                                   "Close some tabs or scripts, then try again.", {"Retry-After": "5"})
        self._start_timer()

    def connection_lost(self, exc: Exception | None) -> None:
        self._stop_timer()
        self._uncount()
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
            self._close(431, "headers-too-large", f"The headers have more than {MAX_HEAD_BYTES // 1024} kB.",
                        "Send fewer or shorter headers.")

    def on_message_begin(self) -> None:
        super().on_message_begin()
        self._in_head = True
        self._head_bytes = 0

    def on_headers_complete(self) -> None:
        self._in_head = False
        self._stop_timer()
        self.scope["state"][ABORT] = self.transport.abort  # for a stream whose viewer takes nothing any more
        super().on_headers_complete()

    def handle_websocket_upgrade(self) -> None:
        self._upgraded = True
        self._stop_timer()
        self._uncount()
        super().handle_websocket_upgrade()

    def _start_timer(self) -> None:
        if self._timer is None:
            self._timer = self.loop.call_later(self.head_s, self._late)

    def _stop_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _late(self) -> None:
        self._timer = None
        self._close(408, "too-slow", f"The request headers were incomplete after {self.head_s:g} s.",
                    "Send the complete request without delay.")

    def _close(self, status: int, reason: str, detail: str, fix: str, headers: dict[str, str] | None = None) -> None:
        if self.transport.is_closing():
            return
        answer = problem(status, reason, detail, fix, {"Connection": "close", **(headers or {})})
        lines = [b"HTTP/1.1 %d %s" % (status, reason.encode()), *(b": ".join(pair) for pair in answer.raw_headers)]
        self.transport.write(b"\r\n".join(lines) + b"\r\n\r\n" + answer.body)
        self.transport.close()

    def _uncount(self) -> None:
        if self._counted is not None:
            self.open[self._counted] -= 1
            if self.open[self._counted] <= 0:
                del self.open[self._counted]
            self._counted = None


def _is_this_machine(address: str) -> bool:
    try:
        ip = ipaddress.ip_address(address)
        return (getattr(ip, "ipv4_mapped", None) or ip).is_loopback
    except ValueError:
        return True  # a Unix socket has no address
