"""http://host/path: a network camera's MJPEG stream, or a single picture that is asked for again and again.

Each part of multipart/x-mixed-replace is --boundary, header lines, an empty line, a picture. Some cameras write the
boundary with two dashes more or fewer than they announce, some leave the length out, some get it wrong.

We take the stream apart ourselves: FFmpeg would end it at the first odd part. Each picture is screened on its own, so
its size is its own header's, and decoded by whoever wants its pixels.
"""

import contextlib
import re
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any, ClassVar, Self

from touchline.core.errors import BadImage, Unavailable
from touchline.core.options import Option
from touchline.core.records import Frame
from touchline.core.statements import say
from touchline.sources import BaseSource, SourceContext
from touchline.sources.lifecycle import Pacer, PictureReader, require_decoder, require_open
from touchline.sources.network.endpoint import CHECK_SWITCHED_ON, Endpoint
from touchline.sources.network.http_client import HttpConnection

MAX_PART = 8_000_000  # bytes; a camera's JPEG of 50 megapixels has fewer
MAX_HEAD = 16 * 1024
LENGTH = re.compile(rb"^content-length\s*:\s*(\d{1,12})\s*$", re.IGNORECASE | re.MULTILINE)
BOUNDARY = re.compile(r'boundary\s*=\s*(?:"([^"]{1,200})"|([^\s;,"]{1,200}))', re.IGNORECASE)

OPEN_S = 2.0
READ_S = 1.5
MAX_BAD_PARTS = 30  # broken parts one after the other, then it is no stream of pictures


class PartTooLarge(Exception):
    """A part, or what stands where one should begin, is larger than any picture."""


def boundary_of(content_type: str) -> bytes | None:
    """Return a Content-Type's boundary without leading dashes; None where it is no multipart."""
    if not content_type.lower().lstrip().startswith("multipart/"):
        return None
    found = BOUNDARY.search(content_type)
    named = (found[1] or found[2]).strip().lstrip("-") if found else ""
    return named.encode("latin-1", "replace") or None


class MultipartParser:
    """feed() takes bytes and yields each part's content once it is whole."""

    def __init__(self, boundary: bytes) -> None:
        self._mark = b"--" + boundary
        self._data = bytearray()
        self._looked = 0  # so far no mark has been found
        self._in_part = False
        self._length: int | None = None

    def feed(self, data: bytes) -> Iterator[bytes]:
        """Yield the parts that are whole now. PartTooLarge where one grows beyond MAX_PART."""
        self._data += data
        while (part := self._next()) is not None:
            yield part

    def pending_jpeg(self) -> bytes | None:
        """Return the part so far, if it has no stated length and ends as a JPEG does: it may be whole."""
        if not self._in_part or self._length is not None or not self._data.startswith(b"\xff\xd8"):
            return None
        return bytes(self._data) if self._data[-4:].rstrip(b"\r\n").endswith(b"\xff\xd9") else None

    def take_pending(self) -> None:
        """Drop the pending part after use; the next boundary is looked for."""
        self._data.clear()
        self._in_part, self._looked = False, 0

    def _next(self) -> bytes | None:
        if not self._in_part and not self._enter():
            return None
        if self._length is not None:
            if len(self._data) < self._length:
                return None
            part = bytes(self._data[: self._length])
            self._leave(self._length)
            return part
        at = self._find_mark()
        if at < 0:
            return None
        part = bytes(self._data[:at])
        self._leave(at)
        if at > MAX_PART:
            raise PartTooLarge
        return part.rstrip(b"-").removesuffix(b"\n").removesuffix(b"\r")

    def _enter(self) -> bool:
        """Go past the next mark and the header lines behind it."""
        at = self._find_mark()
        if at < 0:
            return False
        head = at + len(self._mark)
        ends = [
            (end, end + len(gap))
            for gap in (b"\r\n\r\n", b"\n\n")
            if (end := self._data.find(gap, head)) >= 0
        ]
        if not ends:
            self._looked = at
            if len(self._data) - head > MAX_HEAD:
                self._drop()
            return False
        end, start = min(ends)
        stated = LENGTH.search(bytes(self._data[head:end]).replace(b"\r", b""))
        self._length = int(stated[1]) if stated and int(stated[1]) else None
        if self._length is not None and self._length > MAX_PART:
            self._drop()
        del self._data[:start]
        self._in_part, self._looked = True, 0
        return True

    def _find_mark(self) -> int:
        at = self._data.find(self._mark, self._looked)
        if at < 0 and len(self._data) > MAX_PART:
            self._drop()
        self._looked = max(0, len(self._data) - len(self._mark)) if at < 0 else at
        return at

    def _leave(self, at: int) -> None:
        del self._data[:at]
        self._in_part, self._looked, self._length = False, 0, None

    def _drop(self) -> None:
        self._data.clear()
        self._leave(0)
        raise PartTooLarge


class HttpSource(BaseSource):
    """One picture at a time. skipped: parts so far that were no picture."""

    TITLE: ClassVar = "Network camera, MJPEG over HTTP"
    HELP: ClassVar = "A stream of JPEG images, or a single image that is requested repeatedly."
    TARGET: ClassVar = "user:password@host:port/path"
    OPTIONS: ClassVar = (
        Option(
            "fps",
            "float",
            5.0,
            "Frames per second, if the address returns a single image.",
            (0.1, 240),
        ),
        Option(
            "trust",
            "choice",
            "known",
            "Accepted certificates: only those that this machine trusts, or any.",
            choices=("known", "any"),
        ),
    )
    SCHEME: ClassVar = "http"

    def __init__(
        self, line: HttpConnection, fps: float, read_image: Callable[[bytes], Frame]
    ) -> None:
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
        line = HttpConnection(
            Endpoint.of(cls.SCHEME, target), context.hosts, options["trust"] == "any"
        )
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
            raise Unavailable(
                say(
                    "network.no-mjpeg", "The address returns neither an MJPEG stream nor an image."
                ),
                say("network.mjpeg-path", "See the camera's manual for its MJPEG path."),
                reason="unknown-stream",
            )
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
                    return (
                        self._from_stream(line, self._parts, deadline)
                        if self._parts
                        else self._single_picture(line)
                    )
                except (BadImage, PartTooLarge):
                    self.skipped += 1
        except Unavailable:
            if self.skipped == before:
                raise
        raise Unavailable(
            say("network.bad-images", "The camera sends images in an unsupported format."),
            say("network.set-mjpeg", "Set it to MJPEG, or check its network."),
            reason="bad-pictures",
        )

    def close(self) -> None:
        if self._line is not None:
            self._line.close()
        self._line = None

    def _from_stream(self, line: HttpConnection, parts: MultipartParser, deadline: float) -> Frame:
        """The next part. BadImage or PartTooLarge where it is no picture."""
        while not self._waiting:
            some = line.read_some(deadline)
            if not some:
                raise Unavailable(
                    say("network.stream-ended", "The camera ended the stream."),
                    CHECK_SWITCHED_ON,
                    reason="camera-gone",
                )
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
