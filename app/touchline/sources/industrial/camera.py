"""What a GenICam camera needs beside its driver: options, reading with a time limit, controls, pixel formats.

The driver (Aravis) provides an IndustrialDevice; everything else about the source is here. A camera states the format
of each picture as a number of GenICam's Pixel Format Naming Convention (PFNC 2.4).
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import BadInput, NotFound, Unavailable
from touchline.core.options import Option
from touchline.core.records import Frame
from touchline.core.sentences import CHECK_CABLE_AND_POWER
from touchline.core.statements import Sentence, join, say
from touchline.sources import BaseSource, Control, Identity
from touchline.sources.industrial.features import FEATURES, NodeMap, controls_of, write_control
from touchline.sources.lifecycle import require_open

Pixels = NDArray[np.uint8]  # (height, width, 3) BGR
SIDE_PX = (4, 32767)  # below, there is nothing to take colours from; above, OpenCV refuses

# What cameras made before the list call the same numbers.
OLD_NAMES = {
    "YUV422Packed": "YUV422_8_UYVY",
    "YUV422_YUYV_Packed": "YUV422_8",
    "BGR8Packed": "BGR8",
    "RGB8Packed": "RGB8",
    "BGRA8Packed": "BGRa8",
    "RGBA8Packed": "RGBa8",
}

CANNOT_OPEN = say("industrial.cannot-open", "The camera cannot be opened.")
DOES_NOT_START = say("industrial.does-not-start", "The camera does not start.")
SMALLER_SIZE = say("industrial.smaller-size", "Set a smaller width and height.")
READ_S = 1.5  # longer without a picture, and the camera counts as off
MAX_PAYLOAD = 128 * 1024 * 1024  # bytes of one picture, as a camera announces them before any comes
FPS = Option(
    "fps", "float", None, "Frames per second. If not set: as set in the camera.", (0.1, 240)
)


@dataclass(frozen=True)
class PixelFormat:
    """One format. code: its number in the list; bytes_per_pixel: of one row, without padding."""

    name: str
    code: int
    bytes_per_pixel: int
    bgr: Callable[[Any], Any]  # (height, width, bytes_per_pixel) → (height, width, 3)


def _by(code: int) -> Callable[[Any], Any]:
    return lambda raw: cv2.cvtColor(raw, code)


def _from_422(code: int, luma: int) -> Callable[[Any], Any]:
    """Two pixels share their colour. These formats use all of 0 to 255, where OpenCV's code expects television's range.

    luma: which of a pixel's two bytes is its brightness.
    """
    full = np.arange(256)
    narrow = np.empty((1, 256, 2), np.uint8)
    narrow[0, :, luma] = np.rint(16 + full * 219 / 255)
    narrow[0, :, 1 - luma] = np.rint(128 + (full - 128) * 224 / 255)

    def bgr(raw: Any) -> Any:
        # an odd last column has only half a colour
        even = np.ascontiguousarray(raw[:, : raw.shape[1] // 2 * 2])
        return cv2.cvtColor(cv2.LUT(even, narrow), code)

    return bgr


# In the order in which we would rather have them: colour in few bytes first, since a network is soon full.
PIXEL_FORMATS = {
    one.name: one
    for one in (
        PixelFormat("BayerRG8", 0x01080009, 1, _by(cv2.COLOR_BayerRGGB2BGR)),
        PixelFormat("BayerGB8", 0x0108000A, 1, _by(cv2.COLOR_BayerGBRG2BGR)),
        PixelFormat("BayerGR8", 0x01080008, 1, _by(cv2.COLOR_BayerGRBG2BGR)),
        PixelFormat("BayerBG8", 0x0108000B, 1, _by(cv2.COLOR_BayerBGGR2BGR)),
        PixelFormat("YUV422_8", 0x02100032, 2, _from_422(cv2.COLOR_YUV2BGR_YUY2, 0)),
        PixelFormat("YUV422_8_UYVY", 0x0210001F, 2, _from_422(cv2.COLOR_YUV2BGR_UYVY, 1)),
        PixelFormat("YCbCr422_8", 0x0210003B, 2, _from_422(cv2.COLOR_YUV2BGR_YUY2, 0)),
        PixelFormat("YCbCr422_8_CbYCrY", 0x02100043, 2, _from_422(cv2.COLOR_YUV2BGR_UYVY, 1)),
        PixelFormat("BGR8", 0x02180015, 3, lambda raw: raw.copy()),
        PixelFormat("RGB8", 0x02180014, 3, _by(cv2.COLOR_RGB2BGR)),
        PixelFormat("BGRa8", 0x02200017, 4, _by(cv2.COLOR_BGRA2BGR)),
        PixelFormat("RGBa8", 0x02200016, 4, _by(cv2.COLOR_RGBA2BGR)),
        PixelFormat("Mono8", 0x01080001, 1, _by(cv2.COLOR_GRAY2BGR)),
    )
}
_BY_CODE = {one.code: one for one in PIXEL_FORMATS.values()}


def canonical_name(name: str) -> str | None:
    """Our name of a camera's format; None for one that we cannot read."""
    name = OLD_NAMES.get(name, name)
    return name if name in PIXEL_FORMATS else None


def best_format(offered: Sequence[str]) -> str | None:
    """Of the formats that a camera offers the one that we would rather have, as the camera calls it."""
    ours = [name for name in offered if canonical_name(name)]
    order = list(PIXEL_FORMATS)
    return min(ours, key=lambda name: order.index(canonical_name(name) or ""), default=None)


def bgr_from_raw(data: Any, width: int, height: int, code: int, padding: int = 0) -> Pixels | None:
    """One picture's bytes as BGR, a copy that is read-only; None where they are fewer than the picture needs.

    data: anything with a buffer, longer if it likes. padding: bytes after each row. Unavailable for a format that we
    do not read.
    """
    form = _BY_CODE.get(code)
    if form is None:
        raise Unavailable(
            say(
                "industrial.unknown-format",
                "The camera sends an unsupported pixel format (number {number:#010x}).",
                number=code,
            ),
            say(
                "industrial.set-format", "Set it to one of: {formats}.", formats=list(PIXEL_FORMATS)
            ),
            reason="pixel-format",
        )
    least, most = SIDE_PX
    if not (least <= width <= most and least <= height <= most and padding >= 0):
        return None
    row = width * form.bytes_per_pixel
    flat = np.frombuffer(data, np.uint8)
    stride = row + padding
    if len(flat) < stride * height - padding:  # the last row may lack its padding
        return None
    rows = np.lib.stride_tricks.as_strided(flat, (height, row), (stride, 1), writeable=False)
    pixels = form.bgr(np.ascontiguousarray(rows).reshape(height, width, form.bytes_per_pixel))
    pixels.setflags(write=False)
    return pixels


PIXEL_FORMAT = Option(
    "pixel_format",
    "choice",
    None,
    "Pixel format. If not set: the best format that both support.",
    choices=tuple(PIXEL_FORMATS),
)


def images_too_large(size_bytes: float) -> Sentence:
    return say(
        "industrial.images-too-large",
        "The camera reports images of {mb:.0f} MB.",
        mb=size_bytes / 1e6,
    )


@dataclass(frozen=True)
class DiscoveredCamera:
    """One camera. name: set by its user, or its hardware id. handle: what its driver opens."""

    id: str
    serial: str
    name: str
    vendor: str
    model: str
    handle: Any

    def identity(self, address: str) -> Identity:
        return Identity(address, self.serial, self.id, f"{self.vendor} {self.model}".strip())


def find_camera(cameras: Sequence[DiscoveredCamera], target: str) -> DiscoveredCamera | None:
    """Return the camera with this id, else serial number, else name. BadInput where two have the same."""
    for key in ("id", "serial", "name"):
        found = [camera for camera in cameras if getattr(camera, key) == target]
        if len(found) > 1:
            raise BadInput(
                say(
                    "industrial.ambiguous",
                    "{cameras} cameras are called {name!r}.",
                    cameras=len(found),
                    name=target,
                ),
                say("industrial.longer-name", "Use the longer name from the list of cameras."),
                reason="bad-source",
            )
        if found:
            return found[0]
    return None


def known_cameras(cameras: Sequence[DiscoveredCamera]) -> Sentence:
    """List the cameras in a sentence, for an error."""
    names = [camera.serial or camera.id for camera in cameras]
    return (
        say("industrial.cameras", "Cameras: {names}.", names=names)
        if names
        else say("industrial.no-cameras", "Cameras: none. Check cables and power.")
    )


class IndustrialDevice(Protocol):
    """A camera that a driver has opened. Every failure raises Unavailable."""

    nodes: NodeMap
    identity: Identity
    incomplete: int  # pictures that came with parts missing, since it was opened

    def start(self) -> None:
        """Start sending pictures, of the size that is set now."""

    def stop(self) -> None:
        """Stop sending; may be called again."""

    def take(self, timeout_s: float) -> Pixels | None:
        """Return the next picture; None when none came, or an incomplete one, which is counted."""

    def close(self) -> None:
        """Stop, and release the camera and all memory."""


class IndustrialSource(BaseSource):
    """A source that reads an IndustrialDevice."""

    TITLE: ClassVar[str]

    def __init__(self, device: IndustrialDevice) -> None:
        self._device: IndustrialDevice | None = device
        self._identity = device.identity

    @classmethod
    def start(cls, device: IndustrialDevice, options: Mapping[str, Any]) -> Self:
        """Configure the camera and start it; close it again when that fails."""
        try:
            set_up(device.nodes, options)
            device.start()
        except BaseException:
            device.close()
            raise
        return cls(device)

    def read(self) -> Frame:
        device = require_open(self._device)
        until, missing_before = time.monotonic() + READ_S, device.incomplete
        while (left := until - time.monotonic()) > 0:
            pixels = device.take(left)
            if pixels is not None:
                return Frame(pixels)
        if missing := device.incomplete - missing_before:
            raise Unavailable(
                say(
                    "industrial.images-incomplete",
                    "The camera sent {images} images in {seconds:g} s, "
                    "and parts of each were missing.",
                    images=missing,
                    seconds=READ_S,
                ),
                say(
                    "industrial.separate-port",
                    "Use a separate network port or USB controller for it, "
                    "or lower its frame rate.",
                ),
                reason="camera-silent",
            )
        raise Unavailable(
            say(
                "industrial.no-image", "The camera sent no image for {seconds:g} s.", seconds=READ_S
            ),
            CHECK_CABLE_AND_POWER,
            reason="camera-silent",
        )

    def controls(self) -> tuple[Control, ...]:
        return controls_of(require_open(self._device).nodes)

    def set_control(self, name: str, value: Any) -> Control:
        device = require_open(self._device)
        if name not in FEATURES or not FEATURES[name].resizes:
            return write_control(device.nodes, name, value)
        device.stop()
        try:
            return write_control(device.nodes, name, value)
        finally:
            device.start()

    def close(self) -> None:
        if self._device is not None:
            device, self._device = self._device, None
            device.close()


def set_up(nodes: NodeMap, options: Mapping[str, Any]) -> None:
    """Set continuous pictures, a pixel format that we read, and the requested rate."""
    _set_if(nodes, "AcquisitionMode", "Continuous")
    selector = nodes.get("TriggerSelector")
    for trigger in selector.choices if selector else ("",):
        if trigger:
            nodes.set("TriggerSelector", trigger)
        # else a camera that another program left waiting sends nothing, ever
        _set_if(nodes, "TriggerMode", "Off")
    _set_pixel_format(nodes, options["pixel_format"])
    if options["fps"] is not None:
        try:
            write_control(nodes, "frame_rate", options["fps"])
        except (BadInput, NotFound) as refused:
            raise BadInput(
                refused.what,
                join(refused.fix, say("industrial.or-remove-fps", "Or remove fps.")),
                reason="bad-option",
            ) from None


def _set_if(nodes: NodeMap, name: str, entry: str) -> None:
    node = nodes.get(name)
    if node is not None and node.writable and entry in node.choices and node.value != entry:
        nodes.set(name, entry)


def _set_pixel_format(nodes: NodeMap, wanted: str | None) -> None:
    node = nodes.get("PixelFormat")
    if node is None:
        return  # each picture says its own
    offered = [name for name in node.choices if canonical_name(name)]
    if wanted is None:
        chosen = node.value if canonical_name(node.value) else best_format(offered)
    else:
        chosen = next((name for name in offered if canonical_name(name) == wanted), None)
    if chosen is None and wanted:
        raise BadInput(
            say(
                "industrial.format-not-supported",
                "The camera does not support {format}.",
                format=wanted,
            ),
            say(
                "industrial.use-format",
                "Use one of: {formats}. Or remove pixel_format.",
                formats=list(canonical_name(n) or n for n in offered),
            ),
            reason="bad-option",
        )
    if chosen is None:
        raise Unavailable(
            say("industrial.no-format", "The camera has no supported pixel format."),
            say(
                "industrial.camera-with-format",
                "Use a camera with one of: {formats}.",
                formats=list(PIXEL_FORMATS),
            ),
            reason="pixel-format",
        )
    if chosen != node.value:
        nodes.set("PixelFormat", chosen)
