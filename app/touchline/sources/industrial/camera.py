"""What a GenICam camera needs beside its driver: options, reading with a time limit, controls.

The driver (Aravis) provides an IndustrialDevice; everything else about the source is here.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, Self

from touchline.core.errors import BadInput, NotFound, Unavailable
from touchline.core.options import Option
from touchline.core.records import Frame
from touchline.core.sentences import CHECK_CABLE_AND_POWER
from touchline.core.statements import Sentence, join, say
from touchline.sources import BaseSource, Control, Identity
from touchline.sources.industrial.features import FEATURES, NodeMap, controls_of, write_control
from touchline.sources.industrial.pixel_formats import PIXEL_FORMATS, Pixels, best_format, canonical_name
from touchline.sources.lifecycle import require_open

CANNOT_OPEN = say("industrial.cannot-open", "The camera cannot be opened.")
DOES_NOT_START = say("industrial.does-not-start", "The camera does not start.")
SMALLER_SIZE = say("industrial.smaller-size", "Set a smaller width and height.")
READ_S = 1.5  # longer without a picture, and the camera counts as off
MAX_PAYLOAD = 128 * 1024 * 1024  # bytes of one picture, as a camera announces them before any comes
FPS = Option("fps", "float", None, "Frames per second. If not set: as set in the camera.", (0.1, 240))
PIXEL_FORMAT = Option("pixel_format", "choice", None, "Pixel format. If not set: the best format that both support.",
                      choices=tuple(PIXEL_FORMATS))


def images_too_large(size_bytes: float) -> Sentence:
    return say("industrial.images-too-large", "The camera reports images of {mb:.0f} MB.", mb=size_bytes / 1e6)


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
            raise BadInput(say("industrial.ambiguous", "{cameras} cameras are called {name!r}.", cameras=len(found),
                               name=target),
                           say("industrial.longer-name", "Use the longer name from the list of cameras."),
                           reason="bad-source")
        if found:
            return found[0]
    return None


def known_cameras(cameras: Sequence[DiscoveredCamera]) -> Sentence:
    """List the cameras in a sentence, for an error."""
    names = [camera.serial or camera.id for camera in cameras]
    return (say("industrial.cameras", "Cameras: {names}.", names=names) if names
            else say("industrial.no-cameras", "Cameras: none. Check cables and power."))


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
            raise Unavailable(say("industrial.images-incomplete", "The camera sent {images} images in {seconds:g} s, "
                                  "and parts of each were missing.", images=missing, seconds=READ_S),
                              say("industrial.separate-port", "Use a separate network port or USB controller for it, "
                                  "or lower its frame rate."), reason="camera-silent")
        raise Unavailable(say("industrial.no-image", "The camera sent no image for {seconds:g} s.", seconds=READ_S),
                          CHECK_CABLE_AND_POWER, reason="camera-silent")

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
        _set_if(nodes, "TriggerMode", "Off")  # else a camera that another program left waiting sends nothing, ever
    _set_pixel_format(nodes, options["pixel_format"])
    if options["fps"] is not None:
        try:
            write_control(nodes, "frame_rate", options["fps"])
        except (BadInput, NotFound) as refused:
            raise BadInput(refused.what, join(refused.fix, say("industrial.or-remove-fps", "Or remove fps.")),
                           reason="bad-option") from None


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
        raise BadInput(say("industrial.format-not-supported", "The camera does not support {format}.", format=wanted),
                       say("industrial.use-format", "Use one of: {formats}. Or remove pixel_format.",
                           formats=list(canonical_name(n) or n for n in offered)), reason="bad-option")
    if chosen is None:
        raise Unavailable(say("industrial.no-format", "The camera has no supported pixel format."),
                          say("industrial.camera-with-format", "Use a camera with one of: {formats}.",
                              formats=list(PIXEL_FORMATS)), reason="pixel-format")
    if chosen != node.value:
        nodes.set("PixelFormat", chosen)
