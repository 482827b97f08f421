"""A small HTTP camera for tests: MJPEG at /video, single pictures at /shot.jpg, and whatever it is told to do wrong."""

import contextlib
import itertools
import socket
import socketserver
import ssl
import threading
import time
from base64 import b64encode
from collections.abc import Callable, Iterable
from hashlib import md5
from pathlib import Path

import cv2
import numpy as np

NONCE = "b3a1"
BOUNDARY = "frame-42"
CERTIFICATE = Path(__file__).with_name("camera_certificate.pem")


def coded(n: int, size: tuple[int, int] = (320, 240)) -> bytes:
    """The n-th picture as JPEG: grey, and a bright bar whose place tells n."""
    picture = np.full((size[1], size[0], 3), 60, np.uint8)
    picture[:, 16 * (n % (size[0] // 16)) :][:, :16] = 220
    return cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 90])[1].tobytes()


class MjpegCamera:
    """Serves until close(). The attributes may be set while it runs."""

    def __init__(
        self, fps: float = 25.0, *, host: str = "127.0.0.1", port: int = 0, tls: bool = False
    ) -> None:
        self.fps, self.size = fps, (320, 240)
        self.login = ""  # "", "basic" or "digest", as user "op", password "s3cret/"
        self.announced = f"multipart/x-mixed-replace; boundary={BOUNDARY}"
        self.mark, self.with_length, self.chunked = f"--{BOUNDARY}", True, False
        self.stalled = False  # connected, and no more pictures
        self.mute = False  # accepts connections, and never says anything
        self.half = False  # the next picture ends in its middle
        self.trickle = False  # a byte a second
        self.hangs_up = False  # after every single picture
        self.redirect = ""
        self.status = "200 OK"
        # what is sent for the n-th
        self.parts: Callable[[int], Iterable[bytes]] = lambda n: [coded(n, self.size)]
        self.connections = 0
        self.requests: list[tuple[str, dict[str, str]]] = []
        self._lines: set[socket.socket] = set()
        self._closed = threading.Event()
        camera = self

        class Handler(socketserver.StreamRequestHandler):
            def handle(self) -> None:
                camera._lines.add(self.connection)
                camera.connections += 1
                try:
                    while camera._answered(self):
                        pass
                except OSError:
                    pass
                finally:
                    camera._lines.discard(self.connection)

        class Server(socketserver.ThreadingTCPServer):
            daemon_threads = allow_reuse_address = True
            block_on_close = False

            def handle_error(self, request: object, client_address: object) -> None:
                """Those who hang up are no news."""

        self._server = Server((host, port), Handler)
        self.scheme = "https" if tls else "http"
        if tls:
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            context.load_cert_chain(CERTIFICATE)
            self._server.socket = context.wrap_socket(self._server.socket, server_side=True)
        self.port = self._server.server_address[1]
        threading.Thread(target=self._server.serve_forever, args=(0.05,), daemon=True).start()

    @property
    def url(self) -> str:
        return f"{self.scheme}://127.0.0.1:{self.port}/video?resolution=320x240"

    @property
    def picture_url(self) -> str:
        return f"{self.scheme}://127.0.0.1:{self.port}/shot.jpg"

    def drop(self) -> None:
        """End every connection."""
        for line in list(self._lines):
            with contextlib.suppress(OSError):
                line.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        self._closed.set()
        self._server.shutdown()
        self._server.server_close()
        self.drop()

    def _answered(self, handler: socketserver.StreamRequestHandler) -> bool:
        line = handler.rfile.readline().decode().split()
        if not line:
            return False
        headers = {}
        while text := handler.rfile.readline().decode().strip():
            name, _, value = text.partition(":")
            headers[name.lower()] = value.strip()
        self.requests.append((line[1], headers))
        say = handler.wfile.write
        if self.mute:
            return bool(handler.rfile.read())
        if self.redirect:
            say(
                f"HTTP/1.1 302 Found\r\nLocation: {self.redirect}\r\nContent-Length: 0\r\n\r\n".encode()
            )
            return True
        if not self._welcome(line[1], headers.get("authorization", "")):
            asks = {
                "basic": 'Basic realm="cam"',
                "digest": f'Digest realm="cam", nonce="{NONCE}", qop="auth", opaque="o"',
            }[self.login]
            say(
                f"HTTP/1.1 401 Unauthorized\r\nWWW-Authenticate: {asks}\r\nContent-Length: 2\r\n\r\nno".encode()
            )
            return True
        if self.status != "200 OK":
            say(f"HTTP/1.1 {self.status}\r\nContent-Length: 0\r\n\r\n".encode())
            return True
        if line[1].startswith("/shot"):
            picture = coded(len(self.requests), self.size)
            length = f"Content-Length: {len(picture)}" + "\r\nConnection: close" * self.hangs_up
            say(
                f"HTTP/1.1 200 OK\r\nContent-Type: image/jpeg\r\n{length}\r\n\r\n".encode()
                + picture
            )
            return not self.hangs_up
        chunked = "Transfer-Encoding: chunked\r\n" if self.chunked else "Connection: close\r\n"
        say(f"HTTP/1.1 200 OK\r\nContent-Type: {self.announced}\r\n{chunked}\r\n".encode())
        start = time.monotonic()
        for n in itertools.count():
            while self.stalled and not self._closed.wait(0.02):
                pass
            if self._closed.wait(max(0, start + n / self.fps - time.monotonic())):
                return False
            for part in self.parts(n):
                self._send(say, part)
        return False

    def _send(self, say: Callable[[bytes], object], part: bytes) -> None:
        length = f"Content-Length: {len(part)}\r\n" if self.with_length else ""
        data = f"{self.mark}\r\nContent-Type: image/jpeg\r\n{length}\r\n".encode() + part + b"\r\n"
        if self.half:
            data, self.stalled = data[: len(data) // 2], True
        for piece in [data[i : i + 1] for i in range(len(data))] if self.trickle else [data]:
            say(b"%x\r\n%s\r\n" % (len(piece), piece) if self.chunked else piece)
            if self.trickle:
                time.sleep(1.0)
                if not self.trickle:
                    return

    def _welcome(self, uri: str, said: str) -> bool:
        if self.login == "basic":
            return said == "Basic " + b64encode(b"op:s3cret/").decode()
        if self.login == "digest":
            fields = dict(
                pair.split("=", 1)
                for pair in said.removeprefix("Digest ").split(", ")
                if "=" in pair
            )
            fields = {name: value.strip('"') for name, value in fields.items()}
            who, what = (md5(t.encode()).hexdigest() for t in ("op:cam:s3cret/", f"GET:{uri}"))
            count, theirs = fields.get("nc", ""), fields.get("cnonce", "")
            right = md5(f"{who}:{NONCE}:{count}:{theirs}:auth:{what}".encode()).hexdigest()
            return (
                fields.get("response") == right
                and fields.get("uri") == uri
                and fields.get("opaque") == "o"
            )
        return True
