"""rtsp://host/path: a network camera's stream, read by FFmpeg, reached through our own relay."""

import time
from collections.abc import Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any, ClassVar, Self

from touchline.core.errors import BadImage, Unavailable
from touchline.core.options import Option
from touchline.core.records import Frame
from touchline.core.statements import say
from touchline.sources import BaseSource, SourceContext
from touchline.sources.lifecycle import PictureReader, require_open
from touchline.sources.network.camera_errors import silent
from touchline.sources.network.endpoint import Endpoint, connect, hardware_address
from touchline.sources.network.rtsp_relay import RtspRelay

if TYPE_CHECKING:
    from touchline.sources.ffmpeg import VideoDecoder

READ_S = 1.5


class RtspSource(BaseSource):
    """Each frame has its own size; a JPEG is passed on as it came."""

    TITLE: ClassVar = "Network camera, RTSP"
    HELP: ClassVar = "A stream of H.264, H.265 or MJPEG, supported by most network cameras."
    TARGET: ClassVar = "user:password@host:port/path"
    OPTIONS: ClassVar = (
        Option("open_s", "float", 2.0, "Time limit for opening the stream. Increase it for a camera that sends a key "
                                       "frame only every few seconds.", (0.5, 30), "s"),
    )

    def __init__(self, endpoint: Endpoint, options: Mapping[str, Any], context: SourceContext) -> None:
        self._endpoint, self._open_s, self._hosts = endpoint, options["open_s"], context.hosts
        self._pictures = None if context.read is None else PictureReader(context.read)
        self._relay: RtspRelay | None = None
        self._decoder: VideoDecoder | None = None

    @classmethod
    def open(cls, target: str, options: Mapping[str, Any], context: SourceContext) -> Self:
        opened = cls(Endpoint.of("rtsp", target), options, context)
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
        self._decoder = VideoDecoder.open(relay.url, open_s=max(0.1, deadline - time.monotonic()),
                                          read_s=max(READ_S, self._open_s - 0.5), threads=1)
        if self._decoder is None:
            problem = relay.problem
            self.close()
            raise problem or Unavailable(say("network.no-stream-in-time", "The camera did not send a stream in time."),
                                         say("network.check-path", "Check its path, or allow more time: #open_s=5."),
                                         reason="camera-silent")
