"""rtsp://host/path: a network camera's stream, read by FFmpeg through our own relay, which sees every packet first.

FFmpeg alone follows a camera's redirections to wherever they lead, and would know the password. Here the connection is
already made and pinned; requests get the camera's own name and the login put in; redirections end it. Only RTP
interleaved in the RTSP connection passes.
"""

import contextlib
import re
import secrets
import select
import socket
import threading
import time
from collections.abc import Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any, ClassVar, Self

from touchline.core.errors import BadImage, TouchlineError, Unavailable
from touchline.core.options import Option
from touchline.core.records import Frame
from touchline.core.statements import say
from touchline.sources import BaseSource, SourceContext
from touchline.sources.lifecycle import PictureReader, require_open
from touchline.sources.network.endpoint import (
    CHECK_SWITCHED_ON,
    Endpoint,
    Login,
    connect,
    connection_lost,
    hardware_address,
    silent,
    status_error,
)

if TYPE_CHECKING:
    from touchline.sources.ffmpeg import VideoDecoder


MAX_TEXT = 256 * 1024  # of one request or reply with its body
READ_BYTES = 1 << 18
LENGTH = re.compile(rb"^Content-Length:\s*(\d{1,9})", re.IGNORECASE | re.MULTILINE)
READ_S = 1.5


class RtspRelay:
    """Relays one connection of FFmpeg. Its thread ends when either side does, or on close().

    problem: why it ended, where it was the camera's doing.
    """

    def __init__(self, camera: socket.socket, endpoint: Endpoint, stall_s: float) -> None:
        self._camera, self._stall_s = camera, stall_s
        self._real = f"rtsp://{endpoint.authority}"
        self._login = Login(endpoint.user, endpoint.password)
        self._listener = socket.create_server(("127.0.0.1", 0), backlog=1)
        # Whoever else on this machine finds the port does not know the secret in the address.
        self._ours = f"rtsp://127.0.0.1:{self._listener.getsockname()[1]}/{secrets.token_hex(16)}"
        self.url = self._ours + endpoint.resource
        self._ffmpeg: socket.socket | None = None
        self._from_camera, self._from_ffmpeg = bytearray(), bytearray()
        # by our number: method, URI, rest, FFmpeg's number
        self._pending: dict[int, tuple[str, str, bytes, int]] = {}
        self._number = 0
        self._playing = False
        self._closing = False
        self.problem: TouchlineError | None = None
        self._thread = threading.Thread(target=self._run, name="rtsp relay", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End both connections and the thread; more than once does no harm."""
        self._closing = True
        if self._ffmpeg is not None:
            self._thread.join(0.5)  # FFmpeg's last word, if it had one, still reaches the camera
        for line in (self._camera, self._ffmpeg, self._listener):
            if line is not None:
                with contextlib.suppress(OSError):
                    line.shutdown(socket.SHUT_RDWR)
        self._thread.join(5)

    def _run(self) -> None:
        try:
            self._listener.settimeout(5)
            ffmpeg, _ = self._listener.accept()
            self._ffmpeg = ffmpeg
            self._listener.close()
            ffmpeg.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._forward(ffmpeg)
        except TouchlineError as error:
            self.problem = error
        except (OSError, ValueError, UnicodeError):
            if not self._closing:
                self.problem = connection_lost()
        finally:
            for line in (self._camera, self._ffmpeg, self._listener):
                if line is not None:
                    line.close()

    def _forward(self, ffmpeg: socket.socket) -> None:
        last_packet_s = time.monotonic()
        poll = select.poll()  # select() cannot watch descriptors above 1023
        for line in (self._camera, ffmpeg):
            line.setblocking(True)
            poll.register(line, select.POLLIN)
        while True:
            wait_s = (
                last_packet_s + self._stall_s - time.monotonic() if self._playing else self._stall_s
            )
            ready = {fd for fd, _ in poll.poll(max(0, wait_s) * 1000)}
            if ffmpeg.fileno() in ready:
                data = ffmpeg.recv(READ_BYTES)
                if not data:
                    return
                self._from_ffmpeg += data
                self._requests()
            if self._camera.fileno() in ready:
                data = self._camera.recv(READ_BYTES)
                if not data:
                    raise Unavailable(
                        say("network.connection-ended", "The camera ended the connection."),
                        CHECK_SWITCHED_ON,
                        reason="camera-gone",
                    )
                self._from_camera += data
                if self._packets(ffmpeg):
                    last_packet_s = time.monotonic()
            elif self._playing and time.monotonic() - last_packet_s > self._stall_s:
                raise silent()

    def _packets(self, ffmpeg: socket.socket) -> bool:
        """Forward what came whole from the camera; return whether anything did."""
        data, at, start = self._from_camera, 0, 0
        while at < len(data):
            if data[at] == 0x24:  # "$": channel, length, an RTP packet
                end = at + 4 + int.from_bytes(data[at + 2 : at + 4], "big")
                if len(data) < max(end, at + 4):
                    break
                at = end
                continue
            found = data.find(b"\r\n\r\n", at)
            stated = LENGTH.search(data, at, found) if found >= 0 else None
            length = int(stated[1]) if stated else 0
            end = found + 4 + length
            if max(len(data) - at, length) > MAX_TEXT and (found < 0 or length > MAX_TEXT):
                raise connection_lost()
            if found < 0 or len(data) < end:
                break
            ffmpeg.sendall(memoryview(data)[start:at].tobytes())
            self._reply(
                ffmpeg, data[at:found].decode("utf-8", "replace"), bytes(data[found + 4 : end])
            )
            start = at = end
        if at > start:
            ffmpeg.sendall(data[start:at])
        del data[:at]
        return at > 0

    def _requests(self) -> None:
        """Forward FFmpeg's requests under the camera's own name, and its RTP reports as they are."""
        data = self._from_ffmpeg
        while data:
            if data[0] == 0x24:
                end = 4 + int.from_bytes(data[2:4], "big")
                if len(data) < max(4, end):
                    return
                self._camera.sendall(data[:end])
                del data[:end]
                continue
            end = data.find(b"\r\n\r\n")
            if end < 0:
                if len(data) > MAX_TEXT:
                    raise connection_lost()
                return
            text = data[:end].decode("ascii", "replace")
            del data[: end + 4]
            first, _, rest = text.partition("\r\n")
            method, uri, _ = first.split(" ", 2)
            number = re.search(r"(?mi)^CSeq:\s*(\d+)", text)
            if number is not None and uri.startswith(self._ours):
                uri = self._real + uri.removeprefix(self._ours)
            elif number is None or not uri.startswith("rtsp://") or self._number == 0:
                raise connection_lost()  # a stranger on this machine
            self._ask(
                method, uri, re.sub(r"(?mi)^CSeq:.*\r?\n?", "", rest).encode(), int(number[1])
            )

    def _ask(self, method: str, uri: str, rest: bytes, theirs: int) -> None:
        self._number += 1
        self._pending[self._number] = (method, uri, rest, theirs)
        login = self._login.header(method, uri)
        lines = [
            f"{method} {uri} RTSP/1.0",
            f"CSeq: {self._number}",
            *([f"Authorization: {login}"] if login else []),
        ]
        self._camera.sendall(
            "\r\n".join(lines).encode() + b"\r\n" + rest.strip() + b"\r\n\r\n"
            if rest.strip()
            else "\r\n".join(lines).encode() + b"\r\n\r\n"
        )

    def _reply(self, ffmpeg: socket.socket, head: str, body: bytes) -> None:
        """Forward a reply, or act on one that is not for FFmpeg."""
        status = re.match(r"RTSP/1\.\d (\d{3})", head)
        found = re.search(r"(?mi)^CSeq:\s*(\d+)", head)
        # a request of the camera's own; a camera that asks whether we live gets a yes
        if status is None:
            if found:
                self._camera.sendall(f"RTSP/1.0 200 OK\r\nCSeq: {found[1]}\r\n\r\n".encode())
            return
        request = self._pending.pop(int(found[1]), None) if found else None
        if request is None:
            return
        code = int(status[1])
        if code == 401 and self._login.accept_challenge(
            re.findall(r"(?mi)^WWW-Authenticate:\s*(.*?)\s*$", head)
        ):
            self._ask(*request)
            return
        if 300 <= code <= 401 or (code > 401 and request[0] in ("DESCRIBE", "SETUP", "PLAY")):
            raise status_error(code, "rtsp")
        self._playing = self._playing or request[0] == "PLAY"
        head = re.sub(r"(?mi)^CSeq:[^\r\n]*", f"CSeq: {request[3]}", head)
        ffmpeg.sendall(head.encode() + b"\r\n\r\n" + body)


class RtspSource(BaseSource):
    """Each frame has its own size; a JPEG is passed on as it came."""

    TITLE: ClassVar = "Network camera, RTSP"
    HELP: ClassVar = "A stream of H.264, H.265 or MJPEG, supported by most network cameras."
    TARGET: ClassVar = "user:password@host:port/path"
    OPTIONS: ClassVar = (
        Option(
            "open_s",
            "float",
            2.0,
            "Time limit for opening the stream. Increase it for a camera that sends a key "
            "frame only every few seconds.",
            (0.5, 30),
            "s",
        ),
    )

    def __init__(self, endpoint: Endpoint, open_s: float, context: SourceContext) -> None:
        self._endpoint, self._open_s, self._hosts = endpoint, open_s, context.hosts
        self._pictures = None if context.read is None else PictureReader(context.read)
        self._relay: RtspRelay | None = None
        self._decoder: VideoDecoder | None = None

    @classmethod
    def open(cls, target: str, options: Mapping[str, Any], context: SourceContext) -> Self:
        opened = cls(Endpoint.of("rtsp", target), options["open_s"], context)
        opened._connect()
        return opened

    def read(self) -> Frame:
        decoder, relay = require_open(self._decoder), require_open(self._relay)
        if self._pictures is None or not decoder.has_jpegs:
            frame = decoder.read()
            if frame is not None:
                return frame
        else:
            until = time.monotonic() + READ_S
            while time.monotonic() < until and (jpeg := decoder.read_jpeg()) is not None:
                with suppress(BadImage):
                    return self._pictures.read(jpeg)
        raise relay.problem or silent()

    def close(self) -> None:
        if self._decoder is not None:
            self._decoder.close()
        if self._relay is not None:
            self._relay.close()
        self._relay = self._decoder = None

    def _connect(self) -> None:
        from touchline.sources.ffmpeg import VideoDecoder

        deadline = time.monotonic() + self._open_s
        line = connect(self._endpoint, self._hosts, deadline)
        self._hardware = hardware_address(line)
        self._relay = relay = RtspRelay(line, self._endpoint, stall_s=READ_S)
        # A camera may take as long to its first whole picture as to open; later the relay is the stricter one.
        self._decoder = VideoDecoder.open(
            relay.url,
            open_s=max(0.1, deadline - time.monotonic()),
            read_s=max(READ_S, self._open_s - 0.5),
            threads=1,
        )
        if self._decoder is None:
            problem = relay.problem
            self.close()
            raise problem or Unavailable(
                say("network.no-stream-in-time", "The camera did not send a stream in time."),
                say("network.check-path", "Check its path, or allow more time: #open_s=5."),
                reason="camera-silent",
            )
