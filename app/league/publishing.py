"""Publishing and listening together, switched by one configuration that may change at any time."""

import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from app.core.errors import Conflict, NotFound
from app.core.field import Field
from app.core.records import Calibration, Warning
from app.core.statements import join, say
from app.league.config import PublishingConfig
from app.league.geometry_listener import GeometryListener, RemotePublisher
from app.league.geometry_packet import NO_FIELDS, PublishedCamera, WireCameraCache, published_cameras
from app.league.multicast import MulticastSender
from app.league.multicast_address import interfaces
from app.league.publisher import Publisher
from app.league.received import contradictions, received_json


class Publishing:
    """Publishes and listens as configured, from start() until close().

    active: returns every camera's active calibration; it may block. fields: those known to this server, by name, as
    they are now.
    """

    def __init__(self, config: PublishingConfig, active: Callable[[], Sequence[Calibration]],
                 fields: Mapping[str, Field] = NO_FIELDS) -> None:
        self.config = config
        self._active, self._fields = active, fields
        self._encode = WireCameraCache()
        self._lock = threading.Lock()
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
        return published_cameras(self._active(), self.config, self._encode, self._fields)

    def status(self) -> dict[str, Any]:
        """Return configuration, state and cameras as JSON; takes as long as approximating new calibrations does."""
        publisher, cameras = self._publisher, self.cameras()
        sent = None if publisher is None else publisher.status
        problem = None if sent is None else sent.problem
        state = ("off" if sent is None else "failing" if problem is not None else
                 "silent" if not any(one.sent for one in cameras) else "on-air" if sent.packets else "starting")
        return {**self.config.to_json(), "state": state, "problem": problem and problem.to_json(),
                "said": None if sent is None else sent.to_json(),
                "cameras": [one.to_json() for one in cameras], "interfaces": interfaces()}

    def received(self) -> dict[str, Any]:
        """Describe the other publishers as JSON."""
        listener, publisher = self._listener, self._publisher
        if listener is None:
            return {"listening": False, "problem": None, "datagrams": 0, "own": 0, "items": []}
        fields, problem = tuple(self._fields.values()), listener.problem
        ours = () if publisher is None else publisher.status.cameras
        items = sorted((received_json(one, fields, ours) for one in listener.publishers), key=lambda one: one["id"])
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
            self._publisher = Publisher(config, self._active, self._encode, self._fields)
        if listener is not None and (not config.absorb or listener.address != config.address):
            self._listener = None
            listener.close()
        if config.absorb and self._listener is None:
            self._listener = GeometryListener(config.address, self._is_own)

    def _is_own(self, address: str, port: int) -> bool:
        sender = self.sender
        return sender is not None and sender.is_own_packet(address, port)
