"""Two threads on the league's multicast group: one sends our geometry, one keeps the newest of other publishers.

Geometry is sent every few seconds, and at once after a change; failures are retried.
"""

import logging
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from touchline.core.errors import BadInput, TouchlineError, Unavailable
from touchline.core.field import Field
from touchline.core.json_values import JsonObject
from touchline.core.records import Calibration
from touchline.core.sentences import TRIES_AGAIN
from touchline.core.statements import say
from touchline.league.packet import (
    NO_FIELDS,
    FitPacketCamera,
    PassedOn,
    PublishedCamera,
    PublishingConfig,
    geometry_packet,
    published_cameras,
)
from touchline.league.received import RemotePublisher
from touchline.network.listener import JOIN_S, MulticastListener
from touchline.network.multicast import MulticastSender
from touchline.ssl_protocol.protobuf import decode
from touchline.ssl_protocol.ssl_vision_pb2 import GeometryPacket

log = logging.getLogger("touchline")
RETRY_S = 1.0  # after a failure, or sooner where the interval of publishing is shorter
MAX_CAMERAS = 64  # of one sender; the league has at most eight
HELD_S = 0.25  # between two looks at whether it may be sent now
# why a packet is not sent yet: who else sends is not known yet, or is and somebody has to decide
Held = Literal["listening", "asking"]


@dataclass(frozen=True)
class PublishStatus:
    """What was sent so far. packet: the newest; last_s: its time.monotonic(); failures: since then.

    held: why the newest packet waits.
    """

    packets: int = 0
    packet: bytes = b""
    last_s: float | None = None
    failures: int = 0
    problem: TouchlineError | None = None
    cameras: tuple[PublishedCamera, ...] = ()
    held: Held | None = None

    @property
    def on_air(self) -> tuple[PublishedCamera, ...]:
        """The cameras that go out now: none where there is no packet, it waits, or it cannot be sent."""
        return self.cameras if self.packet and self.problem is None and self.held is None else ()

    def to_json(self) -> JsonObject:
        age_s = None if self.last_s is None else round(time.monotonic() - self.last_s, 3)
        return {
            "packets": self.packets,
            "bytes": len(self.packet),
            "age_s": age_s,
            "failures": self.failures,
        }


class Publisher:
    """A thread that publishes until it is closed.

    active: returns the active calibrations. fit: fits a calibration's packet camera. fields: as they are now, by name.
    passed_on: returns what another publisher's geometry adds. held: returns why a packet may not be sent yet, None
    where it may. sender: open to other packets as well.
    """

    def __init__(
        self,
        config: PublishingConfig,
        active: Callable[[], Sequence[Calibration]],
        fit: FitPacketCamera,
        fields: Mapping[str, Field] = NO_FIELDS,
        passed_on: Callable[[], PassedOn | None] = lambda: None,
        held: Callable[[bytes], Held | None] = lambda packet: None,
        sender: MulticastSender | None = None,
    ) -> None:
        self.config = config
        self.sender = sender or MulticastSender(config.address)
        self.status = PublishStatus()
        self._active, self._fit, self._fields = active, fit, fields
        self._passed_on, self._held = passed_on, held
        self._wakened = threading.Event()
        self._ended = False
        self._thread = threading.Thread(target=self._run, name="publisher", daemon=True)
        self._thread.start()

    def wake(self) -> None:
        """Publish now: something has changed."""
        self._wakened.set()

    def close(self) -> None:
        """End the thread; no packet leaves afterwards."""
        self._ended = True
        self._wakened.set()
        self._thread.join(JOIN_S)
        self.sender.close()

    def _run(self) -> None:
        while not self._ended:
            # before looking: what changes meanwhile is sent in the next round
            self._wakened.clear()
            self.status = self._publish()
            wait_s = self.config.interval_s
            if self.status.held is not None:
                wait_s = min(HELD_S, wait_s)
            elif self.status.problem is not None:
                wait_s = min(RETRY_S, wait_s)
            self._wakened.wait(wait_s)

    def _publish(self) -> PublishStatus:
        before, cameras = self.status, self.status.cameras
        try:
            cameras = published_cameras(self._active(), self.config, self._fit, self._fields)
            packet = geometry_packet(
                cameras, self._fields, self._passed_on(), self.config.ball_models
            )
            held = None if packet is None else self._held(packet)
            if self._ended or packet is None or held is not None:
                return replace(
                    before,
                    packet=packet or b"",
                    failures=0,
                    problem=None,
                    cameras=cameras,
                    held=held,
                )
            self.sender.send(packet)
            return PublishStatus(before.packets + 1, packet, time.monotonic(), cameras=cameras)
        except TouchlineError as error:
            problem = error
        except Exception:
            log.exception("geometry could not be published")
            problem = Unavailable(
                say("publishing.failed", "The geometry cannot be published."),
                TRIES_AGAIN,
                reason="publishing-failed",
            )
        return replace(before, failures=before.failures + 1, problem=problem, cameras=cameras)


class GeometryListener(MulticastListener[RemotePublisher]):
    """Keeps the newest geometry of each sender."""

    NAME = "geometry listener"

    def first(self, address: str, port: int, now_s: float) -> RemotePublisher:
        return RemotePublisher(address, port, now_s)

    def is_useful(self, sender: RemotePublisher) -> bool:
        return sender.geometry is not None

    def accept(self, sender: RemotePublisher, data: bytes) -> RemotePublisher:
        packet = decode(GeometryPacket, data)
        if not packet.HasField("geometry"):
            return replace(
                sender, source=packet.source if packet.HasField("source") else sender.source
            )
        if len(packet.geometry.calib) > MAX_CAMERAS:
            raise BadInput(
                say(
                    "packet.too-many-cameras",
                    "The packet has {cameras} cameras, which is too many.",
                    cameras=len(packet.geometry.calib),
                ),
                say("packet.fewer-cameras", "Send fewer cameras."),
                reason="bad-protobuf",
            )
        return replace(
            sender,
            geometries=sender.geometries + 1,
            geometry=packet.geometry,
            data=data,
            source=packet.source,
            geometry_s=time.monotonic(),
            geometry_at=time.time(),
        )
