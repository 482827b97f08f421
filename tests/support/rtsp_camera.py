"""A small RTSP camera for tests: Motion JPEG over RTP (RFC 2435), interleaved in the RTSP connection (RFC 2326)."""

import contextlib
import re
import socket
import socketserver
import struct
import threading
import time
from base64 import b64encode
from hashlib import md5

import cv2
import numpy as np

PACKET = 1400
NONCE = "7e31f0"


def scene(n: int, width: int = 320, height: int = 240) -> np.ndarray:
    """The n-th picture: grey, and a bright bar whose place tells n."""
    picture = np.full((height, width, 3), 60, np.uint8)
    picture[:, 16 * (n % (width // 16)) :][:, :16] = 220
    return picture


class RtspCamera:
    """Serves until close(). The attributes may be set while it runs; each says what it does wrong."""

    def __init__(
        self,
        fps: float = 25.0,
        size: tuple[int, int] = (320, 240),
        login: str = "",
        *,
        host: str = "127.0.0.1",
    ) -> None:
        self.fps, self.size = fps, size
        self.login = login  # "", "basic" or "digest", as user "op", password "s3cret/"
        self.stalled = False  # connected, and no more pictures
        self.mute = False  # accepts connections, and never says anything
        self.half = False  # every picture without its second half
        self.trickle = False  # a byte a second
        self.garbage = 0  # so many of the next pictures are noise
        self.redirect = ""  # where it sends everybody
        self.connections = 0
        self.requests: list[tuple[str, str, dict[str, str]]] = []
        self._lines: set[socket.socket] = set()
        camera = self

        class Handler(socketserver.BaseRequestHandler):
            def handle(self) -> None:
                _Session(camera, self.request).run()

        class Server(socketserver.ThreadingTCPServer):
            daemon_threads = allow_reuse_address = True
            block_on_close = False

            def handle_error(self, request: object, client_address: object) -> None:
                """Those who hang up are no news."""

        self._server = Server((host, 0), Handler)
        self.port = self._server.server_address[1]
        threading.Thread(target=self._server.serve_forever, args=(0.05,), daemon=True).start()

    @property
    def url(self) -> str:
        return f"rtsp://127.0.0.1:{self.port}/live?channel=1&subtype=0"

    def drop(self) -> None:
        """End every connection, as a camera does that loses its power."""
        for line in list(self._lines):
            with contextlib.suppress(OSError):
                line.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        self._server.shutdown()
        self._server.server_close()
        self.drop()


class _Session:
    def __init__(self, camera: RtspCamera, line: socket.socket) -> None:
        self.camera, self.line = camera, line
        self.lock, self.over = threading.Lock(), threading.Event()

    def run(self) -> None:
        camera = self.camera
        camera.connections += 1
        camera._lines.add(self.line)
        try:
            if camera.mute:
                while self.line.recv(4096):
                    pass
                return
            with self.line.makefile("rb") as reader:
                while self.answered(reader):
                    pass
        except OSError:
            pass
        finally:
            self.over.set()
            camera._lines.discard(self.line)

    def answered(self, reader) -> bool:
        first = reader.read(1)
        if first == b"$":  # a report about what came
            reader.read(int.from_bytes(reader.read(3)[1:], "big"))
            return True
        line = (first + reader.readline()).decode().split()
        if not line:
            return bool(first)
        method, uri = line[0], line[1]
        headers = {}
        while text := reader.readline().decode().strip():
            name, _, value = text.partition(":")
            headers[name.lower()] = value.strip()
        self.camera.requests.append((method, uri, headers))
        say = {"CSeq": headers["cseq"]}
        if self.camera.redirect:
            return self.say("302 Moved", say | {"Location": self.camera.redirect})
        if not self.welcome(method, uri, headers.get("authorization", "")):
            asks = {"basic": 'Basic realm="cam"', "digest": f'Digest realm="cam", nonce="{NONCE}"'}
            return self.say("401 Unauthorized", say | {"WWW-Authenticate": asks[self.camera.login]})
        if method == "DESCRIBE":
            body = "\r\n".join(
                (
                    "v=0",
                    "o=- 0 0 IN IP4 0.0.0.0",
                    "s=t",
                    "c=IN IP4 0.0.0.0",
                    "t=0 0",
                    "m=video 0 RTP/AVP 26",
                    "a=control:1",
                    "",
                )
            )
            return self.say(
                "200 OK", say | {"Content-Type": "application/sdp", "Content-Base": uri + "/"}, body
            )
        if method == "SETUP":
            if "TCP" not in headers["transport"]:
                return self.say("461 Unsupported Transport", say)
            say |= {"Transport": "RTP/AVP/TCP;unicast;interleaved=0-1"}
        self.say("200 OK", say | {"Session": "1", "Public": "DESCRIBE, SETUP, PLAY, TEARDOWN"})
        if method == "PLAY":
            threading.Thread(target=self.play, daemon=True).start()
        return method != "TEARDOWN"

    def welcome(self, method: str, uri: str, said: str) -> bool:
        if self.camera.login == "basic":
            return said == "Basic " + b64encode(b"op:s3cret/").decode()
        if self.camera.login == "digest":
            who, what = (md5(t.encode()).hexdigest() for t in ("op:cam:s3cret/", f"{method}:{uri}"))
            right = md5(f"{who}:{NONCE}:{what}".encode()).hexdigest()
            return f'response="{right}"' in said and f'uri="{uri}"' in said
        return True

    def say(self, status: str, headers: dict[str, str], body: str = "") -> bool:
        head = "".join(
            f"{name}: {value}\r\n"
            for name, value in {**headers, "Content-Length": str(len(body))}.items()
        )
        with self.lock:
            self.line.sendall(f"RTSP/1.0 {status}\r\n{head}\r\n{body}".encode())
        return True

    def play(self) -> None:
        sequence, start = 0, time.monotonic()
        try:
            for n in range(1_000_000):
                while self.camera.stalled and not self.over.wait(0.02):
                    pass
                if self.over.wait(max(0, start + n / self.camera.fps - time.monotonic())):
                    return
                packets = packed(
                    scene(n, *self.camera.size), sequence, round(n * 90_000 / self.camera.fps)
                )
                sequence += len(packets)
                if self.camera.garbage:
                    self.camera.garbage -= 1
                    noise = np.random.default_rng(n)
                    packets = [
                        p[:20] + noise.integers(0, 256, len(p) - 20, dtype=np.uint8).tobytes()
                        for p in packets
                    ]
                data = b"".join(b"$\0" + struct.pack(">H", len(p)) + p for p in packets)
                if self.camera.half:
                    data = data[: len(data) // 2]
                    self.camera.stalled = True
                with self.lock:
                    if self.camera.trickle:
                        for byte in data:
                            self.line.sendall(bytes([byte]))
                            if self.over.wait(1.0):
                                return
                    self.line.sendall(data)
        except OSError:
            pass


def packed(picture: np.ndarray, sequence: int, timestamp: int) -> list[bytes]:
    """The RTP packets of one picture, its quantisation tables with it, so that it arrives bit for bit."""
    height, width = picture.shape[:2]
    coded = cv2.imencode(
        ".jpg",
        picture,
        [
            cv2.IMWRITE_JPEG_QUALITY,
            90,
            cv2.IMWRITE_JPEG_SAMPLING_FACTOR,
            cv2.IMWRITE_JPEG_SAMPLING_FACTOR_420,
        ],
    )[1].tobytes()
    tables = b"".join(
        coded[m.end() + 3 : m.end() + 67] for m in re.finditer(rb"\xff\xdb", coded[:600])
    )
    scan_at = coded.index(b"\xff\xda")
    scan = coded[scan_at + 2 + int.from_bytes(coded[scan_at + 2 : scan_at + 4], "big") : -2]
    packets: list[bytes] = []
    for at in range(0, len(scan), PACKET):
        last = at + PACKET >= len(scan)
        rtp = struct.pack(
            ">BBHII",
            0x80,
            26 | last << 7,
            (sequence + len(packets)) & 0xFFFF,
            timestamp & 0xFFFFFFFF,
            7,
        )
        jpeg = struct.pack(">IBBBB", at, 1, 255, width // 8, height // 8)
        jpeg += struct.pack(">BBH", 0, 0, len(tables)) + tables if at == 0 else b""
        packets.append(rtp + jpeg + scan[at : at + PACKET])
    return packets
