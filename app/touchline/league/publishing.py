"""Publishing and listening together, switched by one configuration that may change at any time."""

import threading
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from touchline.core.errors import Conflict, NotFound
from touchline.core.field import Field
from touchline.core.records import Calibration, Warning
from touchline.core.statements import join, say
from touchline.league.config import PublishingConfig
from touchline.league.geometry_listener import GeometryListener, RemotePublisher
from touchline.league.geometry_packet import NO_FIELDS, PublishedCamera, published_cameras, published_field
from touchline.league.multicast import MulticastSender
from touchline.league.multicast_address import interfaces
from touchline.league.packet_camera import PacketCameraCache
from touchline.league.passed_on import PassedOn, heard_geometry
from touchline.league.publisher import Publisher, PublishStatus
from touchline.league.received import contradictions, received_json
from touchline.ssl_protocol.protobuf import decode
from touchline.ssl_protocol.ssl_vision_pb2 import GeometryPacket


class Publishing:
    """Publishes and listens as configured, from start() until close().

    active: returns every camera's active calibration; it may block. fields: those known to this server, by name, as
    they are now. passed_on: what another publisher's geometry added before; keep: saves it.
    """

    def __init__(self, config: PublishingConfig, active: Callable[[], Sequence[Calibration]],
                 fields: Mapping[str, Field] = NO_FIELDS, passed_on: PassedOn | None = None,
                 keep: Callable[[PassedOn], None] = lambda found: None) -> None:
        self.config = config
        self.packet_camera = PacketCameraCache()
        self._active, self._fields = active, fields
        self._passed_on, self._kept, self._keep = passed_on, passed_on, keep
        self._lock = threading.Lock()
        self._senders: tuple[MulticastSender, ...] = ()  # now and before, whose last packets may still be heard
        self._publisher: Publisher | None = None
        self._listener: GeometryListener | None = None
        self._running = False

    def start(self) -> None:
        with self._lock:
            self._running = True
            self._apply(self.config)

    def close(self) -> None:
        with self._lock:
            self._running = False
            self._apply(PublishingConfig())

    def check(self, config: PublishingConfig) -> None:
        """NetworkError where this network cannot do now what the configuration newly switches on."""
        now, moved = self.config, config.address != self.config.address
        if (config.enabled and (moved or not now.enabled)) or (config.absorb and (moved or not now.absorb)):
            MulticastSender(config.address).check()

    def apply(self, config: PublishingConfig) -> None:
        """Replace the configuration."""
        with self._lock:
            self.config = config
            if self._running:
                self._apply(config)

    def wake(self) -> None:
        """Publish at once: a calibration was activated, or a camera changed."""
        if (publisher := self._publisher) is not None:
            publisher.wake()

    @property
    def sender(self) -> MulticastSender | None:
        """The publisher's sender, for other packets to the same group; None while publishing is off."""
        publisher = self._publisher
        return None if publisher is None else publisher.sender

    def cameras(self) -> tuple[PublishedCamera, ...]:
        """Compute what is sent of each camera, or would be."""
        return published_cameras(self._active(), self.config, self.packet_camera, self._fields)

    def status(self) -> dict[str, Any]:
        """Return configuration, state and cameras as JSON; takes as long as approximating new calibrations does."""
        publisher, cameras = self._publisher, self.cameras()
        sent = None if publisher is None else publisher.status
        problem = None if sent is None else sent.problem
        state = ("off" if sent is None else "failing" if problem is not None else
                 "silent" if not any(one.sent for one in cameras) else "on-air" if sent.packets else "starting")
        return {**self.config.to_json(), "state": state, "problem": problem and problem.to_json(),
                "said": None if sent is None else sent.to_json(), "passed_on": self._passed_on_json(cameras),
                "cameras": [one.to_json() for one in cameras], "interfaces": interfaces()}

    def received(self) -> dict[str, Any]:
        """Describe the other publishers as JSON."""
        listener, publisher = self._listener, self._publisher
        if listener is None:
            return {"listening": False, "problem": None, "datagrams": 0, "own": 0, "items": []}
        fields, problem = tuple(self._fields.values()), listener.problem
        sent = PublishStatus() if publisher is None else publisher.status
        packet = decode(GeometryPacket, sent.packet).geometry if sent.packet else None
        items = sorted((received_json(one, fields, sent.cameras, packet) for one in listener.publishers),
                       key=lambda one: one["id"])
        return {"listening": listener.joined.is_set() and problem is None, "problem": problem and problem.to_json(),
                "datagrams": listener.datagrams, "own": listener.own, "items": items}

    def remote_publisher(self, id: str) -> RemotePublisher:
        """Return one that has sent geometry; NotFound, or Conflict."""
        found = None if self._listener is None else self._listener.get(id)
        if found is None:
            raise NotFound(say("receiving.unknown-sender", "No geometry was received from {sender}.", sender=id),
                           "See GET /api/v1/publishing/heard, with absorb enabled.", reason="unknown-sender")
        if found.geometry is None:
            raise Conflict(say("receiving.no-geometry", "{sender} has sent no geometry yet.", sender=id),
                           say("receiving.wait-for-geometry", "Wait until it sends geometry. The league software "
                               "sends it every few seconds."), reason="no-geometry")
        return found

    @property
    def warnings(self) -> tuple[Warning, ...]:
        """What an operator should see on every page: nothing goes out, or two publishers contradict each other."""
        publisher, listener = self._publisher, self._listener
        found = []
        if publisher is not None and (problem := publisher.status.problem) is not None:
            found.append(Warning("publishing", join(
                say("publishing.not-published", "The geometry is not published:"), problem.what), problem.fix))
        found += [] if publisher is None else _left_out(publisher.status.cameras)
        if listener is not None and (problem := listener.problem) is not None:
            found.append(Warning("absorbing", join(
                say("receiving.no-geometry-received", "No geometry is received:"), problem.what), problem.fix))
        if publisher is not None and listener is not None:
            for other, one in contradictions(listener.publishers, publisher.status.cameras):
                found.append(Warning("two-publishers",
                                     say("receiving.two-publishers", "{address} also publishes camera {number}, which "
                                         "is {camera}, with another calibration.", address=other.address,
                                         number=one.number, camera=one.name),
                                     say("receiving.stop-one", "Only one program may publish: stop one of them, or "
                                         "import the other calibration.")))
        return tuple(found)

    def _apply(self, config: PublishingConfig) -> None:
        publisher, listener = self._publisher, self._listener
        if publisher is not None and (not config.enabled or publisher.config != config):
            self._publisher = None
            publisher.close()
        if config.enabled and self._publisher is None:
            self._senders = (*self._senders[-1:], MulticastSender(config.address))  # known as ours before it sends
            self._publisher = Publisher(config, self._active, self.packet_camera, self._fields, self._newest_passed_on,
                                        self._senders[-1])
        listens = config.absorb or config.enabled  # who publishes must know who else does
        if listener is not None and (not listens or listener.address != config.address):
            self._listener = None
            listener.close()
        if listens and self._listener is None:
            self._listener = GeometryListener(config.address, self._is_own)

    def _newest_passed_on(self) -> PassedOn | None:
        """Return what is passed on, and keep it; None where that is switched off."""
        if not self.config.pass_on:
            return None
        if (listener := self._listener) is not None:
            self._passed_on = heard_geometry(listener.publishers, time.monotonic(), self._passed_on)
        if (found := self._passed_on) is not None and found.needs_saving(self._kept):
            self._keep(found)
            self._kept = found
        return self._passed_on

    def _passed_on_json(self, cameras: Sequence[PublishedCamera]) -> dict[str, Any] | None:
        found, field = self._passed_on, published_field(cameras, self._fields)
        return found.to_json() if self.config.pass_on and found and field is not None and found.is_of(field) else None

    def _is_own(self, address: str, port: int) -> bool:
        return any(sender.is_own_packet(address, port) for sender in self._senders)


def _left_out(cameras: Iterable[PublishedCamera]) -> list[Warning]:
    """Say which cameras teams do not receive, and why: the page of publishing is seldom open."""
    return [Warning("camera-not-published", join(say("publishing.camera-left-out", "{camera} is not published:",
                                                     camera=one.name), one.problem.what), one.problem.fix)
            for one in cameras if one.problem is not None]
