"""http://host/path: a network camera's MJPEG stream, or a single picture that is asked for again and again.

We take the stream apart ourselves: FFmpeg would end it at the first odd part. Each picture is screened on its own, so
its size is its own header's, and decoded by whoever wants its pixels.
"""

import contextlib
import time
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Self

from touchline.core.errors import BadImage, Unavailable
from touchline.core.options import Option
from touchline.core.records import Frame
from touchline.core.statements import say
from touchline.sources import BaseSource, SourceContext
from touchline.sources.lifecycle import Pacer, PictureReader, require_decoder, require_open
from touchline.sources.network.camera_errors import CHECK_SWITCHED_ON
from touchline.sources.network.endpoint import Endpoint
from touchline.sources.network.http_client import HttpConnection
from touchline.sources.network.multipart import MAX_PART, MultipartParser, PartTooLarge, boundary_of

OPEN_S = 2.0
READ_S = 1.5
MAX_BAD_PARTS = 30  # broken parts one after the other, then it is no stream of pictures


class HttpSource(BaseSource):
    """One picture at a time. skipped: parts so far that were no picture."""

    TITLE: ClassVar = "Network camera, MJPEG over HTTP"
    HELP: ClassVar = "A stream of JPEG images, or a single image that is requested repeatedly."
    TARGET: ClassVar = "user:password@host:port/path"
    OPTIONS: ClassVar = (
        Option("fps", "float", 5.0, "Frames per second, if the address returns a single image.", (0.1, 240)),
        Option("trust", "choice", "known", "Accepted certificates: only those that this machine trusts, or any.",
               choices=("known", "any")),
    )
    SCHEME: ClassVar = "http"

    def __init__(self, line: HttpConnection, fps: float, read_image: Callable[[bytes], Frame]) -> None:
        self._fps = fps
        self._pictures = PictureReader(read_image)
        self._line: HttpConnection | None = line
        self._parts: MultipartParser | None = None  # None: one picture at a time
        self._waiting: list[bytes] = []
        self._answered = False  # there is an answer whose picture has not been read yet
        self._pacer = Pacer()
        self.skipped = 0

    @classmethod
    def open(cls, target: str, options: Mapping[str, Any], context: SourceContext) -> Self:
        read_image = require_decoder(context.read)
        line = HttpConnection(Endpoint.of(cls.SCHEME, target), context.hosts, options["trust"] == "any")
        opened = cls(line, options["fps"], read_image)
        try:
            kind = line.request(time.monotonic() + OPEN_S)
            opened._hardware = line.hardware
        except BaseException:
            opened.close()
            raise
        boundary = boundary_of(kind)
        if boundary is None and not kind.lower().startswith("image/"):
            opened.close()
            raise Unavailable(say("network.no-mjpeg", "The address returns neither an MJPEG stream nor an image."),
                              say("network.mjpeg-path", "See the camera's manual for its MJPEG path."),
                              reason="unknown-stream")
        opened._parts = MultipartParser(boundary) if boundary else None
        opened._answered = True
        return opened

    def read(self) -> Frame:
        line = require_open(self._line)
        before = self.skipped
        deadline = time.monotonic() + READ_S
        try:
            while self.skipped - before < MAX_BAD_PARTS:
                try:
                    return self._from_stream(line, self._parts, deadline) if self._parts else self._single_picture(line)
                except (BadImage, PartTooLarge):
                    self.skipped += 1
        except Unavailable:
            if self.skipped == before:
                raise
        raise Unavailable(say("network.bad-images", "The camera sends images in an unsupported format."),
                          say("network.set-mjpeg", "Set it to MJPEG, or check its network."), reason="bad-pictures")

    def close(self) -> None:
        if self._line is not None:
            self._line.close()
        self._line = None

    def _from_stream(self, line: HttpConnection, parts: MultipartParser, deadline: float) -> Frame:
        """The next part. BadImage or PartTooLarge where it is no picture."""
        while not self._waiting:
            some = line.read_some(deadline)
            if not some:
                raise Unavailable(say("network.stream-ended", "The camera ended the stream."), CHECK_SWITCHED_ON,
                                  reason="camera-gone")
            self._waiting += parts.feed(some)
            # Without a stated length the end of a part is marked only when the next one begins, a frame late.
            if not self._waiting and (maybe := parts.pending_jpeg()) is not None:
                with contextlib.suppress(BadImage):
                    frame = self._pictures.read(maybe)
                    parts.take_pending()
                    return frame
        return self._pictures.read(self._waiting.pop(0))

    def _single_picture(self, line: HttpConnection) -> Frame:
        """The picture of one answer, when it is due."""
        self._pacer.wait(self._fps)
        deadline = time.monotonic() + READ_S
        if not self._answered:
            line.request(deadline)
        self._answered = False
        data = line.read_all(MAX_PART, deadline)
        if len(data) > MAX_PART:
            line.close()
            raise PartTooLarge
        return self._pictures.read(data)


class HttpsSource(HttpSource):
    """The same behind TLS."""

    TITLE: ClassVar = "Network camera, MJPEG over HTTPS"
    SCHEME: ClassVar = "https"
