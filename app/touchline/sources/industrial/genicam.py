"""genicam://SERIAL: a camera of any maker whose GenTL producer is installed, through harvesters."""

import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, ClassVar, Self
from urllib.parse import quote

from touchline.core.errors import NotFound, Unavailable
from touchline.core.options import Option
from touchline.core.statements import say
from touchline.sources import SourceContext
from touchline.sources.industrial.camera import (
    CANNOT_OPEN,
    DOES_NOT_START,
    FPS,
    MAX_PAYLOAD,
    PIXEL_FORMAT,
    SMALLER_SIZE,
    DiscoveredCamera,
    IndustrialSource,
    find_camera,
    images_too_large,
    known_cameras,
)
from touchline.sources.industrial.features import NodeMap
from touchline.sources.industrial.genicam_producers import (
    GenApiNodes,
    close_harvester,
    list_cameras,
    open_harvester,
    preserve_sigint,
    select_producers,
)
from touchline.sources.industrial.pixel_formats import Pixels, bgr_from_raw

POLL_MS = 1  # GenTL's Python binding waits with the interpreter locked: never for long …
PAUSE_S = 0.002  # … and with a rest, or the other threads of this process starve


class GenicamSource(IndustrialSource):
    """One camera; its buffers are announced to the producer once and go round."""

    TITLE: ClassVar = "GenICam camera"
    HELP: ClassVar = "An industrial camera (USB3 or GigE), through its vendor's software (a GenTL producer)."
    TARGET: ClassVar = "the camera's serial number, its name, or its position in the list, from 0"
    OPTIONS: ClassVar = (
        Option("producer", "text", "", "File name of the producer. If not set: all installed producers."),
        PIXEL_FORMAT, FPS)

    @classmethod
    def open(cls, target: str, options: Mapping[str, Any], context: SourceContext) -> Self:
        producers = select_producers(context.producers, options["producer"])
        return cls.start(HarvestersDevice(target, producers, address_of(target, options["producer"])), options)


def address_of(target: str, producer: str) -> str:
    return f"genicam://{quote(target)}" + f"?producer={quote(producer)}" * bool(producer)


class HarvestersDevice:
    """An IndustrialDevice over harvesters' image acquirer."""

    def __init__(self, target: str, producers: list[Path], address: str) -> None:
        self.incomplete = 0
        self._acquirer: Any = None
        self._harvester = open_harvester(producers)
        from genicam import genapi, gentl
        self._errors = (gentl.GenericException, genapi.GenericException)
        try:
            camera = _find_camera(target, list_cameras(self._harvester))
            with preserve_sigint():
                self._acquirer = self._harvester.create(camera.handle)
        except self._errors as error:
            self.close()
            raise Unavailable(CANNOT_OPEN,
                              say("industrial.close-or-reconnect", "Close the other program that uses it, or "
                                  "reconnect it. Driver message: {message}", message=_driver_message(error)),
                              reason="camera-busy") from None
        except BaseException:
            self.close()
            raise
        self._acquirer.timeout_period_on_update_event_data_call = POLL_MS
        self._acquirer.add_callback(self._acquirer.Events.INCOMPLETE_BUFFER, _counter(self))
        self._map = self._acquirer.remote_device.node_map
        self.nodes: NodeMap = GenApiNodes(self._map)
        self.identity = camera.identity(address)

    def start(self) -> None:
        payload = self.nodes.get("PayloadSize")
        if payload is not None and payload.value > MAX_PAYLOAD:
            raise Unavailable(images_too_large(payload.value), SMALLER_SIZE, reason="too-large")
        try:
            self._acquirer.start()
        except self._errors as error:
            raise Unavailable(DOES_NOT_START,
                              say("industrial.driver-message", "Driver message: {message}",
                                  message=_driver_message(error)), reason="camera-busy") from None

    def stop(self) -> None:
        with suppress(*self._errors):  # it is gone already
            self._acquirer.stop()

    def take(self, timeout_s: float) -> Pixels | None:
        until, incomplete = time.monotonic() + timeout_s, self.incomplete
        while time.monotonic() < until and self.incomplete == incomplete:
            buffer = self._buffer()
            if buffer is None:
                time.sleep(PAUSE_S)
                continue
            try:
                pixels = bgr_from_raw(buffer.raw_buffer, buffer.width, buffer.height, buffer.pixel_format,
                                      self._padding(buffer))
            except self._errors:
                pixels = None
            finally:
                self._requeue(buffer)
            self.incomplete += pixels is None
            return pixels
        return None

    def close(self) -> None:
        try:
            if self._acquirer is not None:
                # Both are watched by a finalizer that itself holds them: unless it is called, they outlive the camera.
                holders = (getattr(self._acquirer, "_chunk_adapter", None), self._acquirer)
                self._acquirer.destroy()
                for holder in holders:
                    if finalizer := getattr(holder, "_finalizer", None):
                        finalizer()
            close_harvester(self._harvester)
        except self._errors:
            pass

    def _buffer(self) -> Any:
        try:
            buffers = self._acquirer.try_fetch(timeout=POLL_MS / 1000, is_raw=True)
        except self._errors as error:
            raise _gone(error) from None
        several = [one for one in (buffers if isinstance(buffers, list) else [buffers]) if one is not None]
        for other in several[1:]:  # of a camera with several streams the first is the picture
            self._requeue(other)
        return several[0] if several else None

    def _requeue(self, buffer: Any) -> None:
        try:
            buffer.parent.queue_buffer(buffer)
        except self._errors as error:
            raise _gone(error) from None

    def _padding(self, buffer: Any) -> int:
        try:
            return int(buffer.padding_x)
        except self._errors:  # most producers do not say, and have none
            return 0


def _find_camera(target: str, cameras: list[DiscoveredCamera]) -> DiscoveredCamera:
    if (found := find_camera(cameras, target)) is not None:
        return found
    if target.isascii() and target.isdecimal() and len(target) < 3 and int(target) < len(cameras):
        return cameras[int(target)]
    raise NotFound(say("industrial.unknown-genicam", "There is no GenICam camera {name!r}.", name=target[:60]),
                   known_cameras(cameras), reason="unknown-device")


def _counter(device: HarvestersDevice) -> Any:
    from harvesters.core import Callback

    class Count(Callback):
        def emit(self, context: object | None = None) -> None:
            device.incomplete += 1
    return Count()


def _driver_message(error: Exception) -> str:
    return "".join(c for c in " ".join(str(error).split()) if c.isprintable())[:200]


def _gone(error: Exception) -> Unavailable:
    return Unavailable(say("industrial.disconnected", "The camera is disconnected."),
                       say("industrial.check-cable", "Check its cable. Driver message: {message}",
                           message=_driver_message(error)), reason="camera-silent")
