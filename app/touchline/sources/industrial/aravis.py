"""aravis://SERIAL: a GigE Vision or USB3 Vision camera of any maker, without the maker's software, through Aravis.

Whether a GigE Vision camera answers is asked before the library waits for it, by its control protocol (GVCP): eight
bytes ask who is there, and every camera answers on port 3956.
"""

import ctypes
import ipaddress
import socket
import struct
import threading
import time
from collections.abc import Mapping
from contextlib import suppress
from ctypes import byref, c_int, c_size_t
from typing import Any, ClassVar, Self
from urllib.parse import quote

from touchline.core.errors import NotFound, Unavailable
from touchline.core.sentences import CHECK_CABLE_AND_POWER
from touchline.core.statements import join, say
from touchline.sources import Identity, SourceContext
from touchline.sources.industrial.aravis_library import (
    Aravis,
    AravisError,
    AravisNodes,
    aravis,
    text,
)
from touchline.sources.industrial.camera import (
    CANNOT_OPEN,
    DOES_NOT_START,
    FPS,
    MAX_PAYLOAD,
    PIXEL_FORMAT,
    SMALLER_SIZE,
    DiscoveredCamera,
    IndustrialSource,
    Pixels,
    bgr_from_raw,
    find_camera,
    images_too_large,
    known_cameras,
)
from touchline.sources.industrial.features import NodeMap

PORT = 3956
# key, answer wanted, discovery, no payload, number
ASK = struct.pack(">BBHHH", 0x42, 0x01, 0x0002, 0, 1)
ANSWER = struct.pack(">H", 0x0003)
WAITS_S = (0.3, 0.6)  # asked twice, since UDP may lose one

BUFFERS = 6  # pictures under way; with fewer, a short pause of this process loses some
MAX_CAMERAS = 64
SUCCESS = 0  # of a buffer's states
WITH_IMAGE = (1, 4, 5, 10)  # payload types: image, chunk data, extended chunk data, several parts
FAKE = "Fake_"  # names of the cameras that the library itself simulates


def is_ip(target: str) -> bool:
    try:
        return bool(ipaddress.IPv4Address(target))  # GigE Vision has no other
    except ValueError:
        return False


def responds(ip: str) -> bool:
    """True as soon as it does; False after 0.9 s."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        try:
            line.connect((ip, PORT))
            for wait_s in WAITS_S:
                line.send(ASK)
                if _answered(line, time.monotonic() + wait_s):
                    return True
        except OSError:  # no way there, or nobody listens on that port
            pass
    return False


def _answered(line: socket.socket, until: float) -> bool:
    while (left := until - time.monotonic()) > 0:
        line.settimeout(left)
        try:
            answer = line.recv(1024)
        except TimeoutError:
            return False
        if answer[2:4] == ANSWER:
            return True
    return False


class AravisSource(IndustrialSource):
    """One camera; a thread of the library receives its packets."""

    TITLE: ClassVar = "GigE or USB3 Vision camera"
    HELP: ClassVar = "An industrial camera (GigE or USB3 Vision), through the free library Aravis."
    TARGET: ClassVar = "the camera's serial number, its IP address, or its name in the list"
    OPTIONS: ClassVar = (PIXEL_FORMAT, FPS)

    @classmethod
    def open(cls, target: str, options: Mapping[str, Any], context: SourceContext) -> Self:
        return cls.start(AravisDevice(target, aravis()), options)


def discover_cameras(library: Aravis) -> list[DiscoveredCamera]:
    """Return every camera that answers; takes about a second, in which cameras on the networks may."""
    library.call("update_device_list")
    found = []
    for i in range(min(library.call("get_n_devices"), MAX_CAMERAS)):
        id, serial, hardware, address, vendor, model, protocol = (
            text(library.call(f"get_device_{what}", i))
            for what in (
                "id",
                "serial_nbr",
                "physical_id",
                "address",
                "vendor",
                "model",
                "protocol",
            )
        )
        # By its name, a camera that answers on two network cards is opened through either, and may send its pictures to
        # the other; by its address, through the one that it is connected to.
        opened_by = address if protocol == "GigEVision" and is_ip(address) else id
        found.append(DiscoveredCamera(id, serial, hardware, vendor, model, opened_by))
    return found


def address_of(target: str) -> str:
    return f"aravis://{quote(target)}"


def resolve_target(target: str, library: Aravis) -> tuple[str, str]:
    """Return what the library opens, and the camera's whole name; NotFound lists the cameras there are."""
    if target.startswith(FAKE):
        library.call("enable_interface", b"Fake")
        return target, target
    if is_ip(target):  # asked directly, which reaches cameras beyond the next router as well
        if not responds(target):
            raise Unavailable(
                say(
                    "industrial.no-response",
                    "No camera is responding at {address}.",
                    address=target,
                ),
                say("industrial.check-address", "Check its cable, its power and its address."),
                reason="camera-off",
            )
        return target, target
    cameras = discover_cameras(library)
    if (found := find_camera(cameras, target)) is not None:
        return found.handle, found.id
    raise NotFound(
        say("industrial.not-found", "No camera called {name!r} is responding.", name=target[:60]),
        known_cameras(cameras),
        reason="unknown-device",
    )


class AravisDevice:
    """An IndustrialDevice over an ArvCamera and its stream."""

    def __init__(self, target: str, library: Aravis) -> None:
        self.incomplete = 0
        self._library = library
        self._stream: Any = None
        opened_by, port = resolve_target(target, library)
        try:
            self._camera = library.call("camera_new", opened_by.encode())
        except AravisError as error:
            raise Unavailable(
                CANNOT_OPEN,
                join(CHECK_CABLE_AND_POWER, _driver_message(error)),
                reason="camera-off",
            ) from None
        if not self._camera:
            raise Unavailable(CANNOT_OPEN, CHECK_CABLE_AND_POWER, reason="camera-off")
        self._ip = opened_by if is_ip(opened_by) else ""
        self.nodes: NodeMap = AravisNodes(library, library.call("camera_get_device", self._camera))
        serial, vendor, model = (
            self._name(what) for what in ("device_serial_number", "vendor_name", "model_name")
        )
        self.identity = Identity(address_of(target), serial, port, f"{vendor} {model}".strip())

    def start(self) -> None:
        call = self._library.call
        try:
            payload = call("camera_get_payload", self._camera)
            if not 0 < payload <= MAX_PAYLOAD:
                raise Unavailable(images_too_large(payload), SMALLER_SIZE, reason="too-large")
            self._stream = call("camera_create_stream", self._camera, None, None, None)
            if not self._stream:
                raise AravisError
            for _ in range(BUFFERS):
                call("stream_push_buffer", self._stream, call("buffer_new_allocate", payload))
            call("camera_start_acquisition", self._camera)
        except AravisError as error:
            close = say(
                "industrial.close-or-wait",
                "Close the other program that uses it, or wait until that program releases it.",
            )
            raise Unavailable(
                DOES_NOT_START, join(close, _driver_message(error)), reason="camera-busy"
            ) from None

    def stop(self) -> None:
        if self._stream is None:
            return
        with suppress(AravisError):  # it is gone already
            self._library.call("camera_stop_acquisition", self._camera)
        self._library.unref(self._stream)
        self._stream = None

    def take(self, timeout_s: float) -> Pixels | None:
        if self._stream is None:
            return None
        buffer = self._library.call(
            "stream_timeout_pop_buffer", self._stream, max(0, int(timeout_s * 1e6))
        )
        if not buffer:
            return None
        try:
            pixels = self._pixels(buffer)
        finally:
            self._library.call("stream_push_buffer", self._stream, buffer)
        self.incomplete += pixels is None
        return pixels

    def close(self) -> None:
        if self._camera is None:
            return
        if self._ip and not responds(self._ip):
            # The library would say good-bye to a camera that is gone for 12 s, and nobody need wait for that.
            threading.Thread(target=self._release, name="aravis-goodbye", daemon=True).start()
        else:
            self._release()

    def _release(self) -> None:
        self.stop()
        camera, self._camera = self._camera, None
        self._library.unref(camera)

    def _pixels(self, buffer: Any) -> Pixels | None:
        call = self._library.call
        if (
            call("buffer_get_status", buffer) != SUCCESS
            or call("buffer_get_payload_type", buffer) not in WITH_IMAGE
        ):
            return None
        length, padding = c_size_t(), c_int()
        data = call("buffer_get_image_data", buffer, byref(length))
        if not data:
            return None
        call("buffer_get_image_padding", buffer, byref(padding), byref(c_int()))
        # The bytes belong to the buffer, which goes back to the camera: what comes out is a copy.
        return bgr_from_raw(
            (ctypes.c_uint8 * length.value).from_address(data),
            call("buffer_get_image_width", buffer),
            call("buffer_get_image_height", buffer),
            call("buffer_get_image_pixel_format", buffer),
            padding.value,
        )

    def _name(self, what: str) -> str:
        try:
            return text(self._library.call(f"camera_get_{what}", self._camera))
        except AravisError:
            return ""


def _driver_message(error: AravisError) -> str:
    message = str(error).rstrip(".")
    return (
        say("industrial.message", "Aravis message: {message}.", message=message)
        if str(error)
        else ""
    )
