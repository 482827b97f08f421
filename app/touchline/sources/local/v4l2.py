"""v4l2://0: a camera plugged into this machine, through Video4Linux and OpenCV."""

import contextlib
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ClassVar, Self

# OpenCV waits ten seconds for a frame unless told otherwise, in whole seconds, before it is first used.
os.environ.setdefault("OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT", "2")

import cv2
import numpy as np

from touchline.core.errors import BadImage, BadInput, Unavailable
from touchline.core.geometry import Pixels
from touchline.core.options import Option
from touchline.core.records import Frame
from touchline.core.sentences import SENDS_NO_IMAGES
from touchline.core.statements import say
from touchline.sources import BaseSource, Control, Identity, SourceContext
from touchline.sources.lifecycle import require_open
from touchline.sources.local.v4l2_controls import SIZE, read_controls, set_control
from touchline.sources.local.v4l2_devices import find_device

JPEG_BEGINS = b"\xff\xd8"
MAX_BAD_FRAMES = 30  # one after the other
MJPG_FROM_PX = 1280 * 720  # above it, USB 2 has no room for raw pixels at a useful rate


class V4l2Source(BaseSource):
    """One device. What was asked for is set in the order that drivers need: format, size, rate."""

    TITLE: ClassVar = "Camera on this machine"
    HELP: ClassVar = "A webcam or a capture card, connected to the machine that runs Touchline."
    TARGET: ClassVar = "its number, or its permanent name under /dev/v4l/by-id or by-path"
    OPTIONS: ClassVar = (
        Option("size", "text", "", "Width and height. If not set: the camera's default.", unit="px"),
        Option("fps", "float", None, "Frames per second. If not set: the camera's default.", (0.1, 240)),
        Option("format", "choice", "auto", "Pixel format: compressed (MJPG) or raw (YUYV). Automatic uses MJPG from "
                                           "1280 × 720 upwards.", choices=("auto", "MJPG", "YUYV")),
    )
    root: ClassVar[Path] = Path("/")
    opener: ClassVar = staticmethod(lambda node: cv2.VideoCapture(node, cv2.CAP_V4L2))

    def __init__(self, capture: cv2.VideoCapture, identity: Identity,
                 read_image: Callable[[bytes], Frame] | None = None) -> None:
        self._capture: cv2.VideoCapture | None = capture
        self._identity = identity
        # None where the pixels come decoded
        self._read_image = read_image if read_image is not None and _keeps_compressed(capture) else None

    @classmethod
    def open(cls, target: str, options: Mapping[str, Any], context: SourceContext) -> Self:
        size = _size(options["size"]) if options["size"] else None
        device = find_device(target, cls.root)
        capture = cls.opener(device.node)
        if not capture.isOpened():
            capture.release()
            raise Unavailable(say("v4l2.cannot-open", "The camera {node} ({model}) cannot be opened.", node=device.node,
                                  model=device.model),
                              say("v4l2.close-others", "Close other programs that use it, and add Touchline's user "
                                  "to the group video."), reason="camera-busy")
        _begin(capture, size, options["fps"], options["format"])
        return cls(capture, device.identity, context.read)

    def read(self) -> Frame:
        for _ in range(MAX_BAD_FRAMES):
            capture = require_open(self._capture)
            came, pixels = capture.read()
            if not came or pixels is None:
                break
            if self._read_image is None:
                return _decoded(np.asarray(pixels, np.uint8))
            data = pixels.tobytes()
            if not data.startswith(JPEG_BEGINS):  # the driver decodes after all, or sends something else
                self._read_image = None
                capture.set(cv2.CAP_PROP_CONVERT_RGB, 1)
                continue
            with contextlib.suppress(BadImage):  # USB loses a part now and then
                return self._read_image(data)
        raise Unavailable(SENDS_NO_IMAGES, say("v4l2.check-plug", "Check its plug and its cable."),
                          reason="camera-silent")

    def close(self) -> None:
        if self._capture is not None:
            self._capture.release()
        self._capture = None

    def controls(self) -> tuple[Control, ...]:
        return read_controls(require_open(self._capture))

    def set_control(self, name: str, value: Any) -> Control:
        return set_control(require_open(self._capture), name, value)


def _keeps_compressed(capture: cv2.VideoCapture) -> bool:
    """Have what comes as MJPG left as it is, if it comes so at all; return whether it will be."""
    is_jpeg = int(capture.get(cv2.CAP_PROP_FOURCC)) == cv2.VideoWriter.fourcc(*"MJPG")
    return is_jpeg and bool(capture.set(cv2.CAP_PROP_CONVERT_RGB, 0))


def _decoded(pixels: Pixels) -> Frame:
    bgr = cv2.cvtColor(pixels, cv2.COLOR_GRAY2BGR) if pixels.ndim == 2 else pixels
    pixels = np.ascontiguousarray(bgr, np.uint8)
    pixels.setflags(write=False)
    return Frame(pixels)


def _begin(capture: cv2.VideoCapture, size: tuple[int, int] | None, fps: float | None, format: str) -> None:
    width, height = size or (capture.get(cv2.CAP_PROP_FRAME_WIDTH), capture.get(cv2.CAP_PROP_FRAME_HEIGHT))
    if format == "auto" and width * height >= MJPG_FROM_PX:
        format = "MJPG"
    if format != "auto":
        capture.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*format))
    if size:
        capture.set(cv2.CAP_PROP_FRAME_WIDTH, size[0])
        capture.set(cv2.CAP_PROP_FRAME_HEIGHT, size[1])
    if fps:
        capture.set(cv2.CAP_PROP_FPS, fps)


def _size(text: str) -> tuple[int, int]:
    found = SIZE.fullmatch(text)
    if not found:
        raise BadInput(say("v4l2.not-a-size", "{text!r} is not a size.", text=text[:40]),
                       say("v4l2.enter-size", "Enter width x height, such as 1280x720."), reason="bad-option")
    return int(found[1]), int(found[2])
