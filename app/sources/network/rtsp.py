"""rtsp://host/path: a network camera's stream, decoded by OpenCV's FFmpeg, reached through our own relay."""

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Self

import cv2

from app.core.errors import Unavailable
from app.core.options import Option
from app.core.records import Frame
from app.sources import Identity, PlainSource, Surroundings
from app.sources.ffmpeg import open_capture
from app.sources.network.endpoint import Place, connect, hardware_address
from app.sources.network.rtsp_relay import Relay

READ_S = 1.5


class RtspSource(PlainSource):
    """Follows a change of size by opening the stream anew, where the codec tells it (rtp_sizes.py)."""

    TITLE: ClassVar = "Network camera, RTSP"
    HELP: ClassVar = "A stream of H.264, H.265 or MJPEG, as most network cameras have it."
    TARGET: ClassVar = "user:password@host:port/path"
    OPTIONS: ClassVar = (
        Option("open_s", "float", 2.0, "How long the stream may take to open; more for a camera that sends a whole "
               "picture only every few seconds.", (0.5, 30), "s"),
    )

    def __init__(self, place: Place, options: Mapping[str, Any], hosts: tuple[str, ...]) -> None:
        self._place, self._open_s, self._hosts = place, options["open_s"], hosts
        self._relay: Relay | None = None
        self._capture: cv2.VideoCapture | None = None
        self._hardware = ""

    @classmethod
    def open(cls, target: str, options: Mapping[str, Any], around: Surroundings) -> Self:
        opened = cls(Place.of("rtsp", target), options, around.hosts)
        opened._connect()
        return opened

    def read(self) -> Frame:
        if self._capture is None:
            raise Unavailable("This camera is closed.", "Open it again.", reason="source-closed")
        came, pixels = self._capture.read()
        if not came and self._relay.changed:
            self._connect()
            came, pixels = self._capture.read()
        if not came:
            raise self._relay.problem or Unavailable("The camera sends no pictures any more.",
                                                     "Look at the camera and its network.", reason="camera-silent")
        pixels.setflags(write=False)
        return Frame(pixels)

    def close(self) -> None:
        if self._capture is not None:
            self._capture.release()
        if self._relay is not None:
            self._relay.close()
        self._relay = self._capture = None

    def identity(self) -> Identity:
        return Identity(self._address, serial=self._hardware and f"MAC {self._hardware}")

    @property
    def sees_sizes(self) -> bool:
        """Whether a change of the picture's size would be noticed."""
        return self._relay is not None and self._relay.sees_sizes

    @classmethod
    def example(cls, folder: Path) -> str:
        """Only its form: a real one needs a camera at the other end."""
        return "rtsp://user:password@camera.local:554/stream"

    def _connect(self) -> None:
        self.close()
        deadline = time.monotonic() + self._open_s
        line = connect(self._place, self._hosts, deadline)
        self._hardware = hardware_address(line)
        self._relay = Relay(line, self._place, stall_s=READ_S)
        # A camera may take as long to its first whole picture as to open; later the relay is the stricter one.
        self._capture = open_capture(self._relay.url, open_s=max(0.1, deadline - time.monotonic()),
                                     read_s=max(READ_S, self._open_s - 0.5), threads=1)
        if self._capture is None:
            problem = self._relay.problem
            self.close()
            raise problem or Unavailable("The camera gives no stream in time.",
                                         "Look at its path, or give it longer: #open_s=5.", reason="camera-silent")
