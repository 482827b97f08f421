"""http://host/path: a network camera's MJPEG stream, or a single picture that is asked for again and again.

We take the stream apart ourselves: FFmpeg would end it at the first odd part, and keep the first size for good. Each
picture is screened and decoded on its own, so its size is its own header's.
"""

import contextlib
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Self

from app.core.errors import BadImage, Unavailable
from app.core.options import Option
from app.core.records import Frame
from app.sources import Identity, PlainSource, Surroundings
from app.sources.network.endpoint import Place, hardware_address
from app.sources.network.http_client import HttpLine
from app.sources.network.multipart import MAX_PART, Multipart, TooMuch, boundary_of

OPEN_S = 2.0
READ_S = 1.5
MOST_BAD = 30  # broken parts one after the other, then it is no stream of pictures


class HttpSource(PlainSource):
    """One picture at a time. skipped: parts so far that were no picture."""

    TITLE: ClassVar = "Network camera, MJPEG over HTTP"
    HELP: ClassVar = "A stream of JPEG pictures, or one picture asked for again and again."
    TARGET: ClassVar = "user:password@host:port/path"
    OPTIONS: ClassVar = (
        Option("fps", "float", 5.0, "Frames a second, where the address gives one picture at a time.", (0.1, 240)),
        Option("trust", "choice", "known", "Whose certificate is taken: only those this machine knows, or any.",
               choices=("known", "any")),
    )
    SCHEME: ClassVar = "http"

    def __init__(self, place: Place, options: Mapping[str, Any], around: Surroundings) -> None:
        self._fps = options["fps"]
        self._decode = around.decode
        self._line: HttpLine | None = HttpLine(place, around.hosts, options["trust"] == "any")
        self._parts: Multipart | None = None  # None: one picture at a time
        self._waiting: list[bytes] = []
        self._asked = False  # there is an answer whose picture has not been read yet
        self._due = time.monotonic()
        self._hardware = ""
        self.skipped = 0

    @classmethod
    def open(cls, target: str, options: Mapping[str, Any], around: Surroundings) -> Self:
        if around.decode is None:
            raise Unavailable("Pictures cannot be decoded here.", "Restart Touchline.", reason="no-decoder")
        opened = cls(Place.of(cls.SCHEME, target), options, around)
        try:
            kind = opened._line.ask(time.monotonic() + OPEN_S)
            opened._hardware = hardware_address(opened._line.socket)
        except BaseException:
            opened.close()
            raise
        boundary = boundary_of(kind)
        if boundary is None and not kind.lower().startswith("image/"):
            opened.close()
            raise Unavailable("The address gives neither an MJPEG stream nor a picture.",
                              "Look in the camera's manual for its MJPEG path.", reason="unknown-stream")
        opened._parts = Multipart(boundary) if boundary else None
        opened._asked = True
        return opened

    def read(self) -> Frame:
        if self._line is None:
            raise Unavailable("This camera is closed.", "Open it again.", reason="source-closed")
        before = self.skipped
        deadline = time.monotonic() + READ_S
        try:
            while self.skipped - before < MOST_BAD:
                try:
                    return self._from_stream(deadline) if self._parts else self._asked_for()
                except (BadImage, TooMuch):
                    self.skipped += 1
        except Unavailable:
            if self.skipped == before:
                raise
        raise Unavailable("What the camera sends are no pictures that are read here.",
                          "Set it to MJPEG, or look at its network.", reason="bad-pictures")

    def close(self) -> None:
        if self._line is not None:
            self._line.close()
        self._line = None

    def identity(self) -> Identity:
        return Identity(self._address, serial=self._hardware and f"MAC {self._hardware}")

    @classmethod
    def example(cls, folder: Path) -> str:
        """Only its form: a real one needs a camera at the other end."""
        return f"{cls.SCHEME}://user:password@camera.local/video.mjpg"

    def _from_stream(self, deadline: float) -> Frame:
        """The next part. BadImage or TooMuch where it is no picture."""
        while not self._waiting:
            some = self._line.read_some(deadline)
            if not some:
                raise Unavailable("The camera has ended the stream.", "Look whether it is on.", reason="camera-gone")
            self._waiting += self._parts.feed(some)
            # Without a stated length the end of a part is marked only when the next one begins, a frame late.
            if not self._waiting and (maybe := self._parts.pending_jpeg()) is not None:
                with contextlib.suppress(BadImage):
                    frame = self._decode(maybe)
                    self._parts.take_pending()
                    return frame
        return self._decode(self._waiting.pop(0))

    def _asked_for(self) -> Frame:
        """The picture of one answer, when it is due."""
        time.sleep(max(0.0, self._due - time.monotonic()))
        self._due = max(self._due + 1 / self._fps, time.monotonic())
        deadline = time.monotonic() + READ_S
        if not self._asked:
            self._line.ask(deadline)
        self._asked = False
        data = self._line.read_all(MAX_PART, deadline)
        if len(data) > MAX_PART:
            self._line.close()
            raise TooMuch
        return self._decode(data)


class HttpsSource(HttpSource):
    """The same behind TLS."""

    TITLE: ClassVar = "Network camera, MJPEG over HTTPS"
    SCHEME: ClassVar = "https"
