"""Sources of frames: the contract, the table, and the addresses that name a source.

A source is named by an address, scheme://target?option=value&…, such as sim://ssl-div-b?lens=strong&tilt=12. Its
scheme picks the class from SOURCES; target and options are the class's own (address.py).

To add one: write sources/NAME.py with a class that follows Source, and add its line to SOURCES; the tests walk
the table, by an address of each (tests/support/peers.py). Derive from BaseSource where nothing can be set while it
runs. OPTIONS describe what follows the ?: the text is checked against them before open(), and the forms in the browser
are made of them. lifecycle.py keeps a frame rate, refuses to read after close() and words refusals of
set_control(), industrial/camera.py does all but the driver of an industrial camera, network/endpoint.py connects to
addresses that an untrusted user may name.

read() may block, and a bad source may hang or crash: live pictures are read in a process per camera, which keeps only
the newest frame.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from dataclasses import field as member
from pathlib import Path
from typing import Any, ClassVar, Protocol, Self, runtime_checkable

from typing_extensions import TypedDict

from touchline.core.errors import NotFound
from touchline.core.field import Field
from touchline.core.options import Option
from touchline.core.records import Frame
from touchline.core.registry import Registry
from touchline.core.sentences import unknown_field, use_one_of
from touchline.core.statements import Sentence, say
from touchline.sources.address import device_of, read_query, split_address, without_password

__all__ = [
    "SOURCES",
    "BaseSource",
    "Control",
    "Identity",
    "Source",
    "SourceContext",
    "device_of",
    "named_field",
    "source_class",
    "source_from_url",
    "split_address",
    "without_password",
]

UNKNOWN = say("camera-differs.unknown", "unknown")
UNKNOWN_PORT = say("camera-differs.unknown-port", "an unknown port")


@dataclass(frozen=True)
class SourceContext:
    """What a source may use of its surroundings; handed in, since a source imports no package beside it.

    fields: every known field by name. decode: safely turns an image file's bytes into a Frame. pictures: the only
    folder from which pictures, folders of them and videos are read. hosts: names and addresses of network cameras that
    the operator's settings allow although they lie where no camera should (this machine, link-local, multicast).
    read: as decode, for a camera's picture, but a JPEG is decoded when its pixels are wanted, and may be refused then.
    """

    fields: Mapping[str, Field] = member(default_factory=dict)
    decode: Callable[[bytes], Frame] | None = None
    pictures: Path | None = None
    hosts: tuple[str, ...] = ()
    read: Callable[[bytes], Frame] | None = None


class IdentityJson(TypedDict):
    address: str
    serial: str
    port: str
    model: str


@dataclass(frozen=True)
class Identity:
    """What distinguishes one camera from another; "" where the source does not know.

    A calibration belongs to a serial number; without one, to a port and a model; without those, to an address.
    address never holds a password.
    """

    address: str
    serial: str = ""
    port: str = ""
    model: str = ""

    def to_json(self) -> IdentityJson:
        return {
            "address": self.address,
            "serial": self.serial,
            "port": self.port,
            "model": self.model,
        }

    def differs_from(self, other: "Identity") -> Sentence | None:
        """Return in words why this may be another camera; None where the evidence agrees."""
        if self.serial != other.serial:
            return say(
                "camera-differs.serial",
                "its serial number is {now}, not {before}",
                now=self.serial or UNKNOWN,
                before=other.serial or UNKNOWN,
            )
        if self.model != other.model:
            return say(
                "camera-differs.model",
                "its model is {now}, not {before}",
                now=self.model or UNKNOWN,
                before=other.model or UNKNOWN,
            )
        if not self.serial and self.port != other.port:
            return say(
                "camera-differs.port",
                "it is connected to {now}, not {before}",
                now=self.port or UNKNOWN_PORT,
                before=other.port or UNKNOWN_PORT,
            )
        before = without_password(other.address)  # an earlier version may have left more of it
        if not self.serial and not self.port and self.address != before:
            return say(
                "camera-differs.address",
                "its address is {now}, not {before}",
                now=self.address,
                before=before,
            )
        return None


@dataclass(frozen=True)
class Control:
    """One setting of a camera, as read back from it: exposure, gain, white balance, resolution, frame rate.

    kind: "float", "int", "bool" or "choice". value: what the camera says it is now. range: least and most. automatic:
    whether the camera sets it by itself now; None where it has no such mode.
    """

    name: str
    label: str
    kind: str
    value: float | int | bool | str
    unit: str = ""
    range: tuple[float, float] | None = None
    choices: tuple[str, ...] = ()
    automatic: bool | None = None


@runtime_checkable
class Source(Protocol):
    """One camera, or what stands in for one: open, read any number of times, close."""

    TITLE: ClassVar[str]
    HELP: ClassVar[str]
    TARGET: ClassVar[str]  # what stands between :// and ?, in words
    OPTIONS: ClassVar[tuple[Option, ...]]
    CAN_REST: ClassVar[bool]  # whether it makes its pictures itself, and no more than are needed

    @classmethod
    def open(cls, target: str, options: Mapping[str, Any], context: SourceContext) -> Self:
        """Open the source. BadInput or NotFound for a bad target or option, Unavailable if it is off."""

    def read(self) -> Frame:
        """Wait for and return the next frame, its pixels read-only. Unavailable when there will be none."""

    def pass_over(self, seconds: float) -> None:
        """Let the time go by in which nobody needed a frame; only where it CAN_REST."""

    def close(self) -> None:
        """Release everything; may be called again."""

    def identity(self) -> Identity:
        """Return which camera this is."""

    def controls(self) -> tuple[Control, ...]:
        """Return what can be set while it runs, with the current values; empty where nothing can."""

    def set_control(self, name: str, value: Any) -> Control:
        """Set one control and return it as read back. "auto" leaves it to the camera where it has such a mode.

        NotFound for an unknown name, BadInput for a value it cannot have. read() goes on with the new setting, at a
        new size if that changed. Only the thread that reads calls this, or before the first read.
        """


class BaseSource:
    """A source that has nothing to set.

    Without an identity of its own it is identified by its address, or by a network camera's MAC address.
    """

    CAN_REST: ClassVar[bool] = False
    _identity: Identity | None = None
    _address = ""
    _hardware = ""  # a network camera's MAC address, where it is known

    def identity(self) -> Identity:
        return self._identity or Identity(
            self._address, serial=self._hardware and f"MAC {self._hardware}"
        )

    def pass_over(self, seconds: float) -> None:
        pass

    def controls(self) -> tuple[Control, ...]:
        return ()

    def set_control(self, name: str, value: Any) -> Control:
        raise NotFound(
            say(
                "source.unknown-setting",
                "This source has no setting called {setting!r}.",
                setting=name,
            ),
            say(
                "source.no-settings", "It has no settings that can be changed while it is running."
            ),
            reason="unknown-control",
        )


SOURCES: Registry[type[Source]] = Registry(
    "source",
    {
        # a rendered field through a real lens model, with exact truth
        "sim": "touchline.sources.sim.source:SimSource",
        "picture": "touchline.sources.files:PictureSource",  # a picture file, again and again
        "folder": "touchline.sources.files:FolderSource",  # pictures of a folder, in name order
        # a film, at its own pace or as fast as possible
        "video": "touchline.sources.video:VideoSource",
        "v4l2": "touchline.sources.v4l2:V4l2Source",  # a webcam or a capture card in this machine
        "rtsp": "touchline.sources.network.rtsp:RtspSource",  # a network camera: H.264, H.265, MJPEG
        # H.264 that a program sends to a multicast group or to this machine: RTP, MPEG-TS, bare
        "rtp": "touchline.sources.network.datagrams:RtpSource",
        "udp": "touchline.sources.network.datagrams:UdpSource",
        # a network camera: MJPEG, or single pictures
        "http": "touchline.sources.network.http_mjpeg:HttpSource",
        "https": "touchline.sources.network.http_mjpeg:HttpsSource",
        "aravis": "touchline.sources.industrial.aravis:AravisSource",  # industrial, through Aravis
    },
)


def source_class(scheme: str) -> type[Source]:
    """Return the class that opens addresses of a scheme; NotFound, which says what took the place of a former one."""
    if scheme == "genicam":  # in data folders and archives of earlier versions
        raise NotFound(
            say(
                "source.genicam-removed",
                "Cameras are no longer read through their vendors' GenTL producers.",
            ),
            say(
                "source.use-aravis",
                "If it is a GigE Vision or USB3 Vision camera, enter aravis:// and its "
                "serial number.",
            ),
            reason="genicam-removed",
        )
    return SOURCES[scheme]


def source_from_url(url: str, context: SourceContext) -> Source:
    """Open the source that an address names."""
    scheme, target, given = split_address(url)
    source = source_class(scheme)
    opened = source.open(target, read_query(source.OPTIONS, given), context)
    if isinstance(opened, BaseSource):
        opened._address = without_password(f"{scheme}://{target}")
    return opened


def named_field(context: SourceContext, name: str) -> Field:
    """Return a field by name; NotFound lists those there are."""
    try:
        return context.fields[name]
    except KeyError:
        raise NotFound(
            unknown_field(name), use_one_of(context.fields), reason="unknown-field"
        ) from None
