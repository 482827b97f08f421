"""Two threads on the league's multicast group: one sends our geometry, one keeps the newest of other publishers.

Geometry is sent every few seconds, and at once after a change; failures are retried. Anybody may send to the group, so
everything that is received is bounded: how many senders are remembered, how much time their packets may take, how long
a packet is. What is no whole packet is counted and ignored.
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
from touchline.network.address import MulticastAddress
from touchline.network.multicast import (
    Datagram,
    MulticastReceiver,
    MulticastSender,
)
from touchline.ssl_protocol.protobuf import decode
from touchline.ssl_protocol.ssl_vision_pb2 import GeometryPacket

log = logging.getLogger("touchline")
RETRY_S = 1.0  # after a failure, or sooner where the interval of publishing is shorter
JOIN_S = 5.0
MAX_SENDERS = 32
MAX_CAMERAS = 64  # of one sender; the league has at most eight
RECEIVE_S = 0.25
# of silence: an interface that came back, or a switch that lost us, needs a new join
REJOIN_S = 5.0
# of one core's time for decoding: all senders together, and one
CPU_SHARE, CPU_SHARE_PER_SENDER = 0.2, 0.05
PAUSE_S = 0.002  # between packets that are skipped: a flood must not occupy the process
FORGET_S = 600.0
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


class _Budget:
    """A token bucket of CPU time: a share of each second, at most one second's in advance."""

    def __init__(self, share: float) -> None:
        self._share, self._left, self._at = share, share, time.monotonic()

    def has(self) -> bool:
        now = time.monotonic()
        self._left = min(self._share, self._left + (now - self._at) * self._share)
        self._at = now
        return self._left > 0

    def spend(self, seconds: float) -> None:
        self._left -= seconds


class GeometryListener:
    """A thread that listens until it is closed. own: recognises our own packets by address and port."""

    def __init__(
        self,
        address: MulticastAddress,
        own: Callable[[str, int], bool] = lambda address, port: False,
    ) -> None:
        self.address = address
        self.problem: TouchlineError | None = None
        self.since_s = time.monotonic()
        self.datagrams = self.own = 0
        self._is_own = own
        self._publishers: dict[tuple[str, int], RemotePublisher] = {}
        self._budgets: dict[tuple[str, int], _Budget] = {}
        self._budget = _Budget(CPU_SHARE)
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self.joined = threading.Event()
        self._thread = threading.Thread(target=self._run, name="geometry listener", daemon=True)
        self._thread.start()

    @property
    def publishers(self) -> tuple[RemotePublisher, ...]:
        """Everybody who sent lately, with each one's newest geometry; a new one once its first packet was read."""
        with self._lock:
            return tuple(publisher for publisher in self._publishers.values() if publisher.packets)

    def get(self, id: str) -> RemotePublisher | None:
        return next((sender for sender in self.publishers if sender.id == id), None)

    def close(self) -> None:
        self._ended.set()
        self._thread.join(JOIN_S)

    def _run(self) -> None:
        while not self._ended.is_set():
            try:
                self._listen()
            except TouchlineError as refused:
                self.problem = refused
            except OSError as error:
                self.problem = self.address.network_error(error)
            except Exception:
                log.exception("the group could not be listened to")
                self.problem = Unavailable(
                    say("receiving.failed", "The multicast group cannot be received."),
                    TRIES_AGAIN,
                    reason="absorbing-failed",
                )
            self._ended.wait(RETRY_S)

    def _listen(self) -> None:
        receiver = MulticastReceiver(self.address)
        try:
            self.problem = None
            self.joined.set()
            last_s = time.monotonic()
            while not self._ended.is_set():
                datagram = receiver.receive(RECEIVE_S)
                now = time.monotonic()
                if datagram is not None:
                    self._receive(datagram)
                    last_s = now
                elif now - last_s > REJOIN_S:
                    # before the old one goes, so that nothing is missed
                    fresh = MulticastReceiver(self.address)
                    receiver.close()
                    receiver, last_s = fresh, now
        finally:
            receiver.close()

    def _receive(self, datagram: Datagram) -> None:
        self.datagrams += 1
        if self._is_own(datagram.address, datagram.port):
            self.own += 1
            return
        key, now = (datagram.address, datagram.port), time.monotonic()
        before = self._publishers.get(key) or self._add(key, now)
        before = replace(before, packets=before.packets + 1, last_s=now)
        budget = self._budgets[key]
        if budget.has() and self._budget.has():
            begun = time.thread_time()  # CPU time, so that a busy machine ignores nobody
            after = self._read(before, datagram.data)
            spent = time.thread_time() - begun
            budget.spend(spent)
            self._budget.spend(spent)
        else:
            after = replace(before, skipped=before.skipped + 1)
            self._ended.wait(PAUSE_S)
        with self._lock:
            self._publishers[key] = after

    def _read(self, sender: RemotePublisher, data: bytes) -> RemotePublisher:
        try:
            if not data:
                raise BadInput(
                    say("packet.empty", "The packet is empty."),
                    say("packet.send", "Send a packet."),
                    reason="bad-protobuf",
                )
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
        except BadInput as refused:
            return replace(sender, refused=sender.refused + 1, refusal=refused.what)
        return replace(
            sender,
            geometries=sender.geometries + 1,
            geometry=packet.geometry,
            data=data,
            source=packet.source,
            geometry_s=time.monotonic(),
            geometry_at=time.time(),
        )

    def _add(self, key: tuple[str, int], now: float) -> RemotePublisher:
        """Add a sender; evict the silent, else those without geometry, else who was silent longest."""
        with self._lock:
            for other, publisher in list(self._publishers.items()):
                if now - publisher.last_s > FORGET_S:
                    self._forget(other)
            while len(self._publishers) >= MAX_SENDERS:
                self._forget(min(self._publishers, key=self._worth))
            self._publishers[key] = RemotePublisher(*key, now)
            self._budgets[key] = _Budget(CPU_SHARE_PER_SENDER)
            return self._publishers[key]

    def _worth(self, key: tuple[str, int]) -> tuple[bool, float]:
        """Order senders by what it costs to forget them, the least first."""
        publisher = self._publishers[key]
        return publisher.geometry is not None, publisher.last_s

    def _forget(self, key: tuple[str, int]) -> None:
        del self._publishers[key], self._budgets[key]
