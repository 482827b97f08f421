"""One HTTP request to a camera: to a pinned address, under a deadline, without redirections, with a login if asked for.

The standard library's client reads the answer; the bytes reach it through a reader with a deadline.
"""

import contextlib
import http.client
import io
import socket
import ssl
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

from touchline.core.errors import Unavailable
from touchline.core.statements import say
from touchline.sources.lifecycle import require_open
from touchline.sources.network.endpoint import (
    Endpoint,
    Login,
    connect,
    connection_lost,
    hardware_address,
    silent,
    status_error,
)

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer

READ_BYTES = 1 << 18
MAX_REFUSAL = 65_536
LOGIN_TRIES = 3  # without, with, and once more with a fresh nonce


class HttpConnection:
    """A connection to one camera; request() any number of times. Everything raises Unavailable or BadInput."""

    def __init__(self, endpoint: Endpoint, hosts: tuple[str, ...], trust_any: bool) -> None:
        self._endpoint, self._hosts, self._trust_any = endpoint, hosts, trust_any
        self._login = Login(endpoint.user, endpoint.password)
        self._client: _Client | None = None
        self._answer: http.client.HTTPResponse | None = None

    @property
    def hardware(self) -> str:
        """The camera's MAC address; "" where it is not known."""
        return "" if self._client is None else hardware_address(self._client.line)

    def request(self, deadline: float) -> str:
        """Send a GET request and return the answer's Content-Type; read_some() or read_all() read its body."""
        for _ in range(LOGIN_TRIES):
            answer = self._get(deadline)
            if answer.status == 401 and self._login.accept_challenge(
                answer.headers.get_all("WWW-Authenticate", [])
            ):
                # The refusal's text is skipped; where there is too much of it, the connection is closed.
                if len(self.read_all(MAX_REFUSAL, deadline)) > MAX_REFUSAL or answer.will_close:
                    self.close()
                continue
            if answer.status != 200:
                raise status_error(answer.status, "http")
            return answer.headers.get("Content-Type", "")
        raise status_error(401, "http")

    def read_some(self, deadline: float) -> bytes:
        """Return what came of the body, at least a byte; b"" at its end."""
        client, answer = require_open(self._client), require_open(self._answer)
        with client.watched(deadline):
            return answer.read1(READ_BYTES)

    def read_all(self, most: int, deadline: float) -> bytes:
        """Return the rest of the body, at most so many bytes and one."""
        client, answer = require_open(self._client), require_open(self._answer)
        with client.watched(deadline):
            return answer.read(most + 1)

    def close(self) -> None:
        for thing in (self._answer, self._client, self._client and self._client.line):
            if thing is not None:
                with contextlib.suppress(OSError, http.client.HTTPException):
                    thing.close()
        self._answer = self._client = None

    def _get(self, deadline: float) -> http.client.HTTPResponse:
        endpoint = self._endpoint
        headers = {
            "Host": endpoint.authority,
            "Accept": "multipart/x-mixed-replace, image/*",
            "User-Agent": "Touchline",
        }
        if (login := self._login.header("GET", endpoint.resource)) is not None:
            headers["Authorization"] = login
        for fresh in (False, True):
            used = self._client is not None
            client = self._client or self._connect(deadline)
            try:
                with client.watched(deadline):
                    client.request("GET", endpoint.resource, headers=headers)
                    self._answer = client.getresponse()
                    return self._answer
            except Unavailable:
                self.close()
                # the server may have closed it meanwhile
                if fresh or not used or time.monotonic() > deadline:
                    raise
        raise AssertionError

    def _connect(self, deadline: float) -> "_Client":
        endpoint = self._endpoint
        line = connect(endpoint, self._hosts, deadline)
        if endpoint.scheme == "https":
            context = ssl.create_default_context()
            if self._trust_any:
                context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
            line.settimeout(max(0.01, deadline - time.monotonic()))
            try:
                line = context.wrap_socket(line, server_hostname=endpoint.host)
            except ssl.SSLCertVerificationError:
                line.close()
                raise Unavailable(
                    say(
                        "network.certificate",
                        "This machine does not trust the camera's certificate.",
                    ),
                    say(
                        "network.install-certificate",
                        "Install the certificate on this machine, or "
                        "add #trust=any to the end of the address.",
                    ),
                    reason="camera-certificate",
                ) from None
            except (OSError, ValueError):
                line.close()
                raise connection_lost() from None
        self._client = _Client(endpoint, line)
        return self._client


class _Client(http.client.HTTPConnection):
    """The library's client over a connection that is made already."""

    auto_open = 0  # it would connect by itself, to wherever the name leads by then

    def __init__(self, endpoint: Endpoint, line: socket.socket) -> None:
        super().__init__(endpoint.host, endpoint.port)
        self.line = line
        self.sock = self._timed = _DeadlineSocket(line)

    @contextlib.contextmanager
    def watched(self, deadline: float) -> Iterator[None]:
        self._timed.deadline = deadline
        try:
            yield
        except TimeoutError:
            raise silent() from None
        except (OSError, http.client.HTTPException, ValueError):
            raise connection_lost() from None


class _DeadlineSocket:
    """What http.client needs of a socket, every call ended by one deadline, however slowly the bytes trickle."""

    def __init__(self, line: socket.socket) -> None:
        self._line = line
        self.deadline = 0.0

    def sendall(self, data: bytes) -> None:
        self._limit()
        self._line.sendall(data)

    def makefile(self, _mode: str) -> io.BufferedReader:
        return io.BufferedReader(_Reader(self), READ_BYTES)

    def recv_into(self, buffer: "WriteableBuffer") -> int:
        self._limit()
        return self._line.recv_into(buffer)

    def close(self) -> None:
        """Do nothing: the client closes while its last answer is still unread; HttpConnection closes the socket."""

    def _limit(self) -> None:
        left_s = self.deadline - time.monotonic()
        if left_s <= 0:
            raise TimeoutError
        self._line.settimeout(left_s)


class _Reader(io.RawIOBase):
    def __init__(self, timed: _DeadlineSocket) -> None:
        self._timed = timed

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: "WriteableBuffer") -> int:
        return self._timed.recv_into(buffer)
