"""One HTTP request to a camera: to a pinned address, under a deadline, without redirections, with a login if asked for.

The standard library's client reads the answer; the bytes come to it through a reader that knows what time it is.
"""

import contextlib
import http.client
import io
import socket
import ssl
import time
from collections.abc import Iterator
from typing import Self

from app.core.errors import Unavailable
from app.sources.network.authentication import Login
from app.sources.network.camera_errors import broken, refused
from app.sources.network.endpoint import Place, connect

READ_BYTES = 1 << 18
LOGIN_TRIES = 3  # without, with, and once more with a fresh nonce


class HttpLine:
    """A connection to one camera; ask() as often as it stays open. Everything raises Unavailable or BadInput."""

    def __init__(self, place: Place, hosts: tuple[str, ...], trust_any: bool) -> None:
        self._place, self._hosts, self._trust_any = place, hosts, trust_any
        self._login = Login(place.user, place.password)
        self._client: http.client.HTTPConnection | None = None
        self._timed: _Timed | None = None
        self._answer: http.client.HTTPResponse | None = None
        self.socket: socket.socket | None = None

    def ask(self, deadline: float) -> str:
        """GET the place; the answer's Content-Type. Its body is read with read_some() or read_all()."""
        for _ in range(LOGIN_TRIES):
            answer = self._get(deadline)
            if answer.status == 401 and self._login.challenged(answer.headers.get_all("WWW-Authenticate", [])):
                self._drain(deadline)
                continue
            if answer.status != 200:
                raise refused(answer.status, "http", "nothing", "MJPEG")
            return answer.headers.get("Content-Type", "")
        raise refused(401, "http", "nothing", "MJPEG")

    def read_some(self, deadline: float) -> bytes:
        """What came of the body, at least a byte; b"" at its end."""
        with self._watched(deadline):
            return self._answer.read1(READ_BYTES)

    def read_all(self, most: int, deadline: float) -> bytes:
        """The rest of the body, at most so many bytes and one."""
        with self._watched(deadline):
            return self._answer.read(most + 1)

    def close(self) -> None:
        for thing in (self._answer, self._client, self.socket):
            if thing is not None:
                with contextlib.suppress(OSError, http.client.HTTPException):
                    thing.close()
        self._answer = self._client = self._timed = self.socket = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _get(self, deadline: float) -> http.client.HTTPResponse:
        place = self._place
        headers = {"Host": place.authority, "Accept": "multipart/x-mixed-replace, image/*", "User-Agent": "Touchline"}
        if (login := self._login.header("GET", place.resource)) is not None:
            headers["Authorization"] = login
        for fresh in (False, True):
            used = self._client is not None
            if not used:
                self._connect(deadline)
            try:
                with self._watched(deadline):
                    self._client.request("GET", place.resource, headers=headers)
                    self._answer = self._client.getresponse()
                    return self._answer
            except Unavailable:
                self.close()
                if fresh or not used or time.monotonic() > deadline:  # a kept connection may have been closed meanwhile
                    raise
        raise AssertionError

    def _connect(self, deadline: float) -> None:
        place = self._place
        line = connect(place, self._hosts, deadline)
        if place.scheme == "https":
            context = ssl.create_default_context()
            if self._trust_any:
                context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
            line.settimeout(max(0.01, deadline - time.monotonic()))
            try:
                line = context.wrap_socket(line, server_hostname=place.host)
            except ssl.SSLCertVerificationError:
                line.close()
                raise Unavailable("The camera's certificate is not one that this machine trusts.",
                                  "Install its certificate here, or write #trust=any behind the address.",
                                  reason="camera-certificate") from None
            except (OSError, ValueError):
                line.close()
                raise broken() from None
        self.socket = line
        self._timed = _Timed(line)
        self._client = http.client.HTTPConnection(place.host, place.port)
        self._client.auto_open = 0  # it would connect by itself, to wherever the name leads by then
        self._client.sock = self._timed

    def _drain(self, deadline: float) -> None:
        """Get past a refusal's text, or past the connection where there is too much of it."""
        if len(self.read_all(65_536, deadline)) > 65_536 or self._answer.will_close:
            self.close()

    @contextlib.contextmanager
    def _watched(self, deadline: float) -> Iterator[None]:
        self._timed.deadline = deadline
        try:
            yield
        except TimeoutError:
            raise Unavailable("The camera sends no pictures any more.", "Look at the camera and its network.",
                              reason="camera-silent") from None
        except (OSError, http.client.HTTPException, ValueError):
            raise broken() from None


class _Timed:
    """What http.client needs of a socket, every call ended by one deadline, however slowly the bytes trickle."""

    def __init__(self, line: socket.socket) -> None:
        self._line = line
        self.deadline = 0.0

    def sendall(self, data: bytes) -> None:
        self._limit()
        self._line.sendall(data)

    def makefile(self, _mode: str) -> io.BufferedReader:
        return io.BufferedReader(_Reader(self), READ_BYTES)

    def recv_into(self, buffer: memoryview) -> int:
        self._limit()
        return self._line.recv_into(buffer)

    def close(self) -> None:
        """The client lets go after a last answer whose body is still to be read: HttpLine closes the socket."""

    def _limit(self) -> None:
        left_s = self.deadline - time.monotonic()
        if left_s <= 0:
            raise TimeoutError
        self._line.settimeout(left_s)


class _Reader(io.RawIOBase):
    def __init__(self, timed: _Timed) -> None:
        self._timed = timed

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: memoryview) -> int:
        return self._timed.recv_into(buffer)
