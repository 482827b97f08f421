"""v4l2://0: a camera plugged into this machine, through Video4Linux and OpenCV: how it is found, read and set.

Linux lists cameras in /sys, with their identity and port. OpenCV hands on the driver's own numbers, but neither their
ranges nor the sizes there are: a value is tried, and what the camera made of it is read back.
"""

import contextlib
import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Self

import cv2
import numpy as np

from touchline.core.errors import BadImage, BadInput, NotFound, Unavailable
from touchline.core.geometry import Pixels
from touchline.core.options import Option
from touchline.core.records import Frame
from touchline.core.sentences import SENDS_NO_IMAGES
from touchline.core.statements import say
from touchline.sources import BaseSource, Control, Identity, SourceContext
from touchline.sources.lifecycle import is_number, refused_value, require_open, unknown_control

NAMED = re.compile(r"/dev/(video\d{1,3}|v4l/by-(?:id|path)/[A-Za-z0-9_.:+,@%-]{1,200})")
# What makers of cheap cameras write where a serial number should stand; the same on every piece.
NO_SERIALS = {
    "sn0001",
    "0123456789",
    "123456789",
    "12345678",
    "1234567890",
    "0123456789abcdef",
    "200901010001",
    "01.00.00",
    "aabbccdd",
    "default",
    "none",
    "unknown",
}

SIZE = re.compile(r"([1-9][0-9]{1,3})x([1-9][0-9]{1,3})", re.ASCII)
USUAL_SIZES = (
    "640x480",
    "800x600",
    "1280x720",
    "1280x960",
    "1280x1024",
    "1600x1200",
    "1920x1080",
    "2560x1440",
    "3840x2160",
)
EXPOSURE_STEP_US = 100  # V4L2_CID_EXPOSURE_ABSOLUTE counts in these
# V4L2's exposure modes; webcams know 3, "aperture priority", as their automatic
MANUAL, AUTOMATIC = 1, (3, 0)
UNSUPPORTED = -1  # what OpenCV says of a property that the device lacks

JPEG_BEGINS = b"\xff\xd8"
MAX_BAD_FRAMES = 30  # one after the other
MJPG_FROM_PX = 1280 * 720  # above it, USB 2 has no room for raw pixels at a useful rate


@dataclass(frozen=True)
class VideoDevice:
    """One camera. node: /dev/videoN. serial: "" where it has none of its own. port: the plug, not the camera."""

    node: str
    model: str
    serial: str = ""
    port: str = ""
    links: tuple[str, ...] = ()  # lasting names, /dev/v4l/by-id/… first

    @property
    def address(self) -> str:
        """The most lasting address: by identity, by port, and only then by number."""
        lasting = (
            self.links[0] if self.links and (self.serial or "by-path" in self.links[0]) else None
        )
        return f"v4l2://{lasting or next((link for link in self.links if 'by-path' in link), self.node)}"

    @property
    def identity(self) -> Identity:
        return Identity(self.address, self.serial, self.port, self.model)


def list_devices(root: Path = Path("/")) -> tuple[VideoDevice, ...]:
    """Return every camera that gives pictures, by number. root: contains dev and sys."""
    found = sorted(
        (root / "sys/class/video4linux").glob("video*"), key=lambda path: int(path.name[5:] or 0)
    )
    links = {
        path: Path(path).resolve()
        for kind in ("by-id", "by-path")
        for path in sorted(map(str, (root / "dev/v4l" / kind).glob("*")))
    }
    # the others carry a camera's metadata
    nodes = [path for path in found if _text(path / "index") in ("", "0")]
    usb = [_usb_device(path) for path in nodes]
    serials = [_text(place / "serial") if place else "" for place in usb]
    return tuple(
        _device(
            root, path, place, serial if _own(serial) and serials.count(serial) == 1 else "", links
        )
        for path, place, serial in zip(nodes, usb, serials, strict=True)
    )


def find_device(target: str, root: Path = Path("/")) -> VideoDevice:
    """Find the camera named 0, /dev/video0 or /dev/v4l/by-…/NAME; BadInput for another path, NotFound if it is off."""
    path = f"/dev/video{target}" if re.fullmatch(r"[0-9]{1,3}", target) else target
    if not NAMED.fullmatch(path) or "/../" in path or path.endswith("/.."):
        raise BadInput(
            say("v4l2.not-an-address", "The address does not name a camera on this machine."),
            say(
                "v4l2.address-form",
                "Use v4l2://0, or v4l2:///dev/v4l/by-id/NAME with a name from that folder.",
            ),
            reason="bad-source",
        )
    known = list_devices(root)
    try:
        node = "/" + str((root / path[1:]).resolve().relative_to(root.resolve()))
    except ValueError:
        node = ""
    for device in known:
        if device.node == node:
            return device
    there = [f"{device.address} ({device.model})" for device in known]
    raise NotFound(
        say("v4l2.not-found", "There is no camera {name!r} on this machine.", name=target),
        say("v4l2.connected", "Connected cameras: {cameras}.", cameras=there)
        if there
        else say("v4l2.none-connected", "Connected cameras: none."),
        reason="unknown-camera",
    )


def _device(
    root: Path, path: Path, usb: Path | None, serial: str, links: dict[str, Path]
) -> VideoDevice:
    here = (root / "dev" / path.name).resolve()
    ours = tuple(
        "/" + str(Path(link).relative_to(root)) for link, target in links.items() if target == here
    )
    by_path = next((Path(link).name for link in ours if "/by-path/" in link), "")
    product = (
        ":".join(filter(None, (_text(usb / "idVendor"), _text(usb / "idProduct")))) if usb else ""
    )
    model = " ".join(filter(None, (_text(path / "name"), f"({product})" if product else "")))
    port = by_path or (usb.name if usb else (path / "device").resolve().name)
    return VideoDevice(f"/dev/{path.name}", model, serial, port, ours)


def _usb_device(path: Path) -> Path | None:
    """The USB device that a video node belongs to: the nearest folder above that names its maker."""
    place = (path / "device").resolve()
    return next((one for one in (place, *place.parents) if (one / "idVendor").is_file()), None)


def _own(serial: str) -> bool:
    """Tell whether a serial number can be unique."""
    return len(set(serial.strip("0"))) > 1 and serial.lower() not in NO_SERIALS


def _text(path: Path) -> str:
    """Read a line of the kernel's; "" where there is none."""
    try:
        return " ".join(path.read_text("utf-8", "replace").split())[:100]
    except OSError:
        return ""


@dataclass(frozen=True)
class NumericProperty:
    """One property that is a number. scale: of ours to the driver's. auto: the property that hands it to the camera."""

    name: str
    label: str
    prop: int
    unit: str
    range: tuple[float, float]  # of what is sent at all; the camera's own is narrower
    scale: float = 1.0
    auto: int | None = None
    is_auto: Callable[[float], bool] = bool
    auto_modes: tuple[float, ...] = (1,)
    manual_mode: float = 0


PROPERTIES = {
    one.name: one
    for one in (
        NumericProperty(
            "exposure",
            "Exposure time",
            cv2.CAP_PROP_EXPOSURE,
            "µs",
            (100, 10_000_000),
            EXPOSURE_STEP_US,
            cv2.CAP_PROP_AUTO_EXPOSURE,
            lambda mode: mode in AUTOMATIC,
            AUTOMATIC,
            MANUAL,
        ),
        NumericProperty("gain", "Gain", cv2.CAP_PROP_GAIN, "", (0, 10_000)),
        NumericProperty(
            "white_balance",
            "White balance",
            cv2.CAP_PROP_WB_TEMPERATURE,
            "K",
            (1000, 20_000),
            1.0,
            cv2.CAP_PROP_AUTO_WB,
        ),
        NumericProperty("frame_rate", "Frame rate", cv2.CAP_PROP_FPS, "Hz", (0.1, 240)),
    )
}


def read_controls(device: cv2.VideoCapture) -> tuple[Control, ...]:
    """Return every control that this device has, as it is now."""
    found = [_number(device, one) for one in PROPERTIES.values()]
    return (*(control for control in found if control is not None), _resolution(device))


def set_control(device: cv2.VideoCapture, name: str, value: Any) -> Control:
    """Set one control and return it as read back."""
    if name == "resolution":
        return _set_resolution(device, value)
    one = PROPERTIES.get(name)
    control = _number(device, one) if one else None
    if one is None or control is None:
        raise unknown_control(name, (control.name for control in read_controls(device)))
    if value == "auto":
        if one.auto is None or control.automatic is None:
            raise refused_value(one.label, repr(value)[:40], _allowed(one))
        for mode in one.auto_modes:
            device.set(one.auto, mode)
            if one.is_auto(device.get(one.auto)):
                break
    else:
        if not is_number(value, *one.range):
            allowed = _allowed(one) + ', or "auto"' * (control.automatic is not None)
            raise refused_value(one.label, repr(value)[:40], allowed)
        if one.auto is not None and control.automatic:
            device.set(one.auto, one.manual_mode)
        device.set(one.prop, value / one.scale)
    return _number(device, one) or control


def _number(device: cv2.VideoCapture, one: NumericProperty) -> Control | None:
    raw = device.get(one.prop)
    if raw == UNSUPPORTED or not abs(raw) < 1e9 or (one.name == "frame_rate" and raw <= 0):
        return None
    mode = device.get(one.auto) if one.auto is not None else UNSUPPORTED
    automatic = None if mode == UNSUPPORTED else bool(one.is_auto(mode))
    return Control(one.name, one.label, "float", raw * one.scale, one.unit, None, (), automatic)


def _resolution(device: cv2.VideoCapture) -> Control:
    now = f"{device.get(cv2.CAP_PROP_FRAME_WIDTH):.0f}x{device.get(cv2.CAP_PROP_FRAME_HEIGHT):.0f}"
    return Control(
        "resolution",
        "Resolution",
        "choice",
        now,
        "px",
        None,
        tuple(dict.fromkeys((now, *USUAL_SIZES))),
    )


def _set_resolution(device: cv2.VideoCapture, value: Any) -> Control:
    found = SIZE.fullmatch(value) if isinstance(value, str) else None
    if not found:
        raise refused_value("Resolution", repr(value)[:40], "width x height, such as 1280x720")
    width, height = int(found[1]), int(found[2])
    before = _resolution(device).value
    device.set(cv2.CAP_PROP_FRAME_WIDTH, width)
    device.set(cv2.CAP_PROP_FRAME_HEIGHT, height)
    control = _resolution(device)
    if control.value == before != value:
        raise BadInput(
            say(
                "v4l2.resolution-refused",
                "The camera does not accept {wanted}. The resolution is still {resolution}.",
                wanted=value,
                resolution=before,
            ),
            say("v4l2.another-resolution", "Try another resolution."),
            reason="bad-control",
        )
    return control


def _allowed(one: NumericProperty) -> str:
    return f"a number from {one.range[0]:g} to {one.range[1]:g}"


# OpenCV waits ten seconds for a frame unless told otherwise, in whole seconds, before it is first used.
os.environ.setdefault("OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT", "2")


class V4l2Source(BaseSource):
    """One device. What was asked for is set in the order that drivers need: format, size, rate."""

    TITLE: ClassVar = "Camera on this machine"
    HELP: ClassVar = "A webcam or a capture card, connected to the machine that runs Touchline."
    TARGET: ClassVar = "its number, or its permanent name under /dev/v4l/by-id or by-path"
    OPTIONS: ClassVar = (
        Option(
            "size", "text", "", "Width and height. If not set: the camera's default.", unit="px"
        ),
        Option(
            "fps", "float", None, "Frames per second. If not set: the camera's default.", (0.1, 240)
        ),
        Option(
            "format",
            "choice",
            "auto",
            "Pixel format: compressed (MJPG) or raw (YUYV). Automatic uses MJPG from "
            "1280 × 720 upwards.",
            choices=("auto", "MJPG", "YUYV"),
        ),
    )
    root: ClassVar[Path] = Path("/")
    opener: ClassVar = staticmethod(lambda node: cv2.VideoCapture(node, cv2.CAP_V4L2))

    def __init__(
        self,
        capture: cv2.VideoCapture,
        identity: Identity,
        read_image: Callable[[bytes], Frame] | None = None,
    ) -> None:
        self._capture: cv2.VideoCapture | None = capture
        self._identity = identity
        # None where the pixels come decoded
        self._read_image = (
            read_image if read_image is not None and _keeps_compressed(capture) else None
        )

    @classmethod
    def open(cls, target: str, options: Mapping[str, Any], context: SourceContext) -> Self:
        size = _size(options["size"]) if options["size"] else None
        device = find_device(target, cls.root)
        capture = cls.opener(device.node)
        if not capture.isOpened():
            capture.release()
            raise Unavailable(
                say(
                    "v4l2.cannot-open",
                    "The camera {node} ({model}) cannot be opened.",
                    node=device.node,
                    model=device.model,
                ),
                say(
                    "v4l2.close-others",
                    "Close other programs that use it, and add Touchline's user "
                    "to the group video.",
                ),
                reason="camera-busy",
            )
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
            # the driver decodes after all, or sends something else
            if not data.startswith(JPEG_BEGINS):
                self._read_image = None
                capture.set(cv2.CAP_PROP_CONVERT_RGB, 1)
                continue
            with contextlib.suppress(BadImage):  # USB loses a part now and then
                return self._read_image(data)
        raise Unavailable(
            SENDS_NO_IMAGES,
            say("v4l2.check-plug", "Check its plug and its cable."),
            reason="camera-silent",
        )

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


def _begin(
    capture: cv2.VideoCapture, size: tuple[int, int] | None, fps: float | None, format: str
) -> None:
    width, height = size or (
        capture.get(cv2.CAP_PROP_FRAME_WIDTH),
        capture.get(cv2.CAP_PROP_FRAME_HEIGHT),
    )
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
        raise BadInput(
            say("v4l2.not-a-size", "{text!r} is not a size.", text=text[:40]),
            say("v4l2.enter-size", "Enter width x height, such as 1280x720."),
            reason="bad-option",
        )
    return int(found[1]), int(found[2])
