"""rtp://group:port, udp://group:port: H.264 in UDP packets that a program sends to a group or to this machine.

Which form it has is seen by its bytes: RTP, an MPEG transport stream (also inside RTP), or bare H.264. No session
description is needed. Nothing is ever sent, so what may be listened to needs no list; only what programs of this
machine send to one another is not shown to whoever may add a camera.

One sender is followed. A program that starts its encoder anew has a new SSRC, and is followed on at once; another
machine only once the first gives no pictures any more.
"""

import ipaddress
import time
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Self

from touchline.core.errors import BadInput, TouchlineError, Unavailable
from touchline.core.options import Option
from touchline.core.records import Frame
from touchline.core.statements import say
from touchline.network.address import MulticastAddress
from touchline.network.multicast import Datagram, MulticastReceiver, Receiver, UnicastReceiver
from touchline.sources import BaseSource, Control, SourceContext
from touchline.sources.address import NOT_VALID
from touchline.sources.lifecycle import refused_value, require_open, unknown_control
from touchline.sources.network.endpoint import (
    Endpoint,
    check_allowed,
    connection_lost,
    is_allowed,
)
from touchline.sources.network.mpegts import TransportStream, is_transport_stream
from touchline.sources.network.rtp import (
    DELIMITER,
    MPEG_TS,
    SPS,
    AccessUnit,
    H264Depacketiser,
    ReorderBuffer,
    RtpPacket,
    read_rtp,
)
from touchline.sources.network.vision_processor import is_computed_view

if TYPE_CHECKING:
    from av.video.frame import VideoFrame

READ_S = 1.5
# without a picture while another sends: more than vision-processor's second between key frames
SWITCH_S = 1.2
MAX_SENDERS = 8
FORM = (
    "Enter it as {scheme}://224.5.23.100:10100: group and port, or 0.0.0.0 and a port from 1024 for what is sent to "
    "this computer."
)
COMPUTED_VIEW = (
    say(
        "stream.computed-view",
        "vision-processor is showing an image that it has computed, not the camera's own.",
    ),
    say(
        "stream.raw-feed",
        "Set stream: raw_feed: true in its config.yml and restart it. Without it, the camera's own image comes for 20 "
        "of every 80 seconds. For a camera without colour that is mistaken for it, add ?views=all.",
    ),
)
Sender = tuple[str, int]  # address and SSRC; -1 without RTP


class Stream:
    """What one sender sends, taken apart. kind: of the RTP packets that belong to it."""

    def __init__(self, kind: int | None) -> None:
        from touchline.sources.ffmpeg import H264Decoder

        self.kind = kind
        self.order = ReorderBuffer()
        self.decoder = H264Decoder()
        self._pictures = H264Depacketiser()
        self._transport = TransportStream()

    def push(self, data: bytes, packet: RtpPacket | None) -> "list[VideoFrame]":
        """Return the pictures that are whole with this datagram."""
        return [
            picture for unit in self._units(data, packet) for picture in self.decoder.decode(unit)
        ]

    def _units(self, data: bytes, packet: RtpPacket | None) -> Iterable[AccessUnit]:
        if packet is not None:
            for ordered, lost in self.order.push(packet) if packet.kind == self.kind else ():
                if self.kind == MPEG_TS:
                    yield from self._transport.push(ordered.payload, lost)
                else:
                    yield from self._pictures.push(ordered, lost)
        elif is_transport_stream(data):
            yield from self._transport.push(data)
        elif self.kind is None:
            yield from self.decoder.parse(data)


class RtpSource(BaseSource):
    """Each frame has its own size."""

    TITLE: ClassVar = "Network stream, RTP"
    HELP: ClassVar = "H.264 that a program such as vision-processor sends to a multicast group or to this computer."
    TARGET: ClassVar = "group:port"
    OPTIONS: ClassVar = (
        Option(
            "interface",
            "text",
            "",
            "Network interface on which the group is joined, by name (eth1) or address. Empty: decided by the "
            "system's routes.",
        ),
        Option(
            "sender", "text", "", "Address of the only sender that is used. Empty: the first one."
        ),
        Option(
            "views",
            "choice",
            "raw",
            "Images used: only the camera's own, or also those that vision-processor has computed.",
            choices=("raw", "all"),
        ),
        Option(
            "open_s",
            "float",
            3.0,
            "Time limit for opening the stream. Increase it for a sender with a key frame only every few seconds.",
            (0.5, 30),
            "s",
        ),
    )
    SCHEME: ClassVar = "rtp"

    def __init__(self, endpoint: Endpoint, only: str, raw_only: bool) -> None:
        self._endpoint, self._only, self._raw_only = endpoint, only, raw_only
        self._group = ipaddress.IPv4Address(endpoint.host).is_multicast
        self._line: Receiver | None = None
        self._sender: Sender | None = None
        self._stream: Stream | None = None
        self._senders: dict[str, None] = {}  # in the order in which they were heard first
        self._local = True  # whether programs of this machine may send
        self._came = False  # whether anything did
        self._left: set[Sender] = set()  # followed once, and no more
        self._picture_s = 0.0  # when the followed one gave a picture last, or was begun with
        self._ready: list[VideoFrame] = []

    @classmethod
    def open(cls, target: str, options: Mapping[str, Any], context: SourceContext) -> Self:
        endpoint = _endpoint(cls.SCHEME, target)
        opened = cls(endpoint, options["sender"], options["views"] == "raw")
        interface = options["interface"]
        if opened._group:
            opened._line = MulticastReceiver(
                MulticastAddress(endpoint.host, endpoint.port, interface)
            )
        elif interface:
            raise BadInput(
                say("stream.no-group", "An interface can be chosen for a multicast group only."),
                say("stream.use-address", "Enter this interface's own address as the host."),
                reason="bad-option",
            )
        else:
            host, local = ipaddress.IPv4Address(endpoint.host), ipaddress.IPv4Address("127.0.0.1")
            if host.is_loopback:
                check_allowed(endpoint, host, context.hosts)
            opened._local = is_allowed(endpoint, local, context.hosts)
            opened._line = UnicastReceiver(endpoint.host, endpoint.port)
        try:
            opened._ready.insert(0, opened._next(options["open_s"]))
        except BaseException:
            opened.close()
            raise
        return opened

    def read(self) -> Frame:
        from touchline.sources.ffmpeg import frame_of

        return frame_of(self._next(READ_S))

    def close(self) -> None:
        if self._line is not None:
            self._line.close()
        self._line = self._stream = None

    def controls(self) -> tuple[Control, ...]:
        """The sender, with all that send there; set_control() follows another."""
        if self._sender is None:
            return ()
        return (
            Control("sender", "Sender", "choice", self._sender[0], choices=tuple(self._senders)),
        )

    def set_control(self, name: str, value: Any) -> Control:
        controls = self.controls()
        if name != "sender" or not controls:
            raise unknown_control(name, [one.name for one in controls])
        if value not in controls[0].choices:
            raise refused_value("Sender", repr(value)[:40], " or ".join(controls[0].choices))
        self._only, self._sender, self._ready = value, None, []
        self._ready.insert(0, self._next(READ_S))
        return self.controls()[0]

    def _next(self, timeout_s: float) -> "VideoFrame":
        """Return the next picture; Unavailable where none comes in time, or only computed ones."""
        line = require_open(self._line)
        until = time.monotonic() + timeout_s
        while not self._ready:
            left_s = until - time.monotonic()
            try:
                datagram = line.receive(left_s) if left_s > 0 else None
            except OSError:
                raise connection_lost() from None
            if datagram is not None:
                self._take(datagram)
            elif left_s <= 0:
                raise self._why_none()
        picture = self._ready.pop(0)
        if self._raw_only and is_computed_view(picture):
            raise Unavailable(*COMPUTED_VIEW, reason="computed-view")
        return picture

    def _take(self, datagram: Datagram) -> None:
        address, data = datagram.address, datagram.data
        if not self._local and address.startswith("127."):
            return
        self._came = True
        packet, now = read_rtp(data), time.monotonic()
        sender = (address, packet.ssrc if packet else -1)
        if sender != self._sender:
            if not self._may_follow(sender, data, packet, now):
                return
            if self._sender is not None:
                self._left.add(self._sender)
            if len(self._left) > MAX_SENDERS:
                self._left.clear()
            self._sender, self._picture_s = sender, now
            self._stream = Stream(packet.kind if packet else None)
        if self._stream is not None and (pictures := self._stream.push(data, packet)):
            self._picture_s = now
            self._ready += pictures

    def _may_follow(
        self, sender: Sender, data: bytes, packet: RtpPacket | None, now: float
    ) -> bool:
        """Whether to leave the followed sender, if there is one, for this."""
        if not (
            packet.carries_video
            if packet
            else is_transport_stream(data) or data.startswith((b"\0\0\0\1", b"\0\0\1"))
        ):
            return False
        if sender not in self._left:
            self._remember(sender[0])
        if sender[0] != (self._only or sender[0]):
            return False
        if self._sender is None or now - self._picture_s > SWITCH_S:
            return True
        # the same program with a new encoder; one that was left and still sends is another program
        return (
            sender[0] == self._sender[0]
            and sender not in self._left
            and packet is not None
            and packet.first_nal in (SPS, DELIMITER)
        )

    def _remember(self, address: str) -> None:
        """Note who sends, the newest last; a flood of made-up addresses drives out one another."""
        self._senders = {one: None for one in self._senders if one != address} | {address: None}
        if len(self._senders) > MAX_SENDERS:
            followed = self._sender[0] if self._sender else ""
            del self._senders[next(one for one in self._senders if one != followed)]

    def _why_none(self) -> TouchlineError:
        if not self._came:
            return Unavailable(
                say(
                    "stream.nothing",
                    "Nothing arrives at {address}.",
                    address=f"{self._endpoint.host}:{self._endpoint.port}",
                ),
                say(
                    "stream.check-sender",
                    "Check that the sender runs, and that address and port are right. On a computer with several "
                    "networks, name the one with the sender: ?interface=eth1.",
                ),
                reason="camera-silent",
            )
        stream = self._stream
        if stream is None or not stream.decoder.keys + stream.decoder.dropped + stream.order.lost:
            return Unavailable(
                say("stream.no-video", "Packets arrive, but no H.264 video in them."),
                say("stream.send-h264", "Send H.264, as RTP or as an MPEG transport stream."),
                reason="bad-pictures",
            )
        if stream.order.lost:
            return Unavailable(
                say(
                    "stream.lost",
                    "{percent:percent} % of the packets are lost, and no image is complete.",
                    percent=100 * stream.order.lost / (stream.order.lost + stream.order.received),
                ),
                say(
                    "stream.use-cable",
                    "Use a cable instead of Wi-Fi, or lower the bit rate of the sender.",
                ),
                reason="packets-lost",
            )
        return Unavailable(
            say("stream.no-key-frame", "No key frame has arrived in time."),
            say(
                "stream.more-key-frames",
                "Let the sender make one every second, or allow more time: ?open_s=10.",
            ),
            reason="camera-silent",
        )


class UdpSource(RtpSource):
    """The same: what arrives is recognised by its bytes."""

    TITLE: ClassVar = "Network stream, UDP"
    HELP: ClassVar = (
        "H.264 as FFmpeg sends it over UDP: an MPEG transport stream, RTP or bare H.264."
    )
    SCHEME: ClassVar = "udp"


def _endpoint(scheme: str, target: str) -> Endpoint:
    """Parse group or address, and port; BadInput. VLC's @ before the group is understood, and no host is any."""
    host, _, port = target.removeprefix("@").removesuffix("/").rpartition(":")
    try:
        number = int(port) if port.isascii() and port.isdecimal() else 0
        address = ipaddress.IPv4Address(host or "0.0.0.0")
    except ValueError:
        number = 0
    if not 1024 <= number <= 65535:
        raise BadInput(
            NOT_VALID,
            say("stream.form", FORM, scheme=scheme),
            reason="bad-source",
        )
    return Endpoint(scheme, str(address), number, "")
