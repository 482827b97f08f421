"""A publication: geometry of some cameras to one address, with the threads that send it and listen who else does.

Geometry is sent every few seconds, and at once after a change; failures are retried.
"""

import logging
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from touchline.core.errors import BadInput, Conflict, NotFound, TouchlineError, Unavailable
from touchline.core.field import Field
from touchline.core.json_values import JsonObject
from touchline.core.records import Calibration, Warning
from touchline.core.sentences import TRIES_AGAIN
from touchline.core.statements import say
from touchline.formats import vision_processor
from touchline.formats.ssl_settings_update import UpdatedSettings, updated_settings
from touchline.league import claims
from touchline.league.packet import (
    NO_FIELDS,
    FitPacketCamera,
    PassedOn,
    PublishedCamera,
    PublishingConfig,
    geometry_packet,
    published_cameras,
    published_field,
)
from touchline.league.packet_camera import PacketCameraCache
from touchline.league.received import (
    CameraValues,
    RemotePublisher,
    geometry_to_pass_on,
    received_json,
    says_the_same,
    sent_values,
)
from touchline.league.store import SavedPassedOn
from touchline.network.address import interfaces
from touchline.network.listener import JOIN_S, MulticastListener
from touchline.network.multicast import MulticastSender
from touchline.services.saved_settings import SavedSettings
from touchline.ssl_protocol.protobuf import decode
from touchline.ssl_protocol.ssl_vision_pb2 import GeometryPacket, SSL_GeometryData
from touchline.store.files import RecentFailures
from touchline.store.repository import check_etag

log = logging.getLogger("touchline")
MERGED = ("numbers", "approved")  # by camera: those not named stay, null removes one
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

    def state(self, has_camera: bool) -> str:
        """Return the state in a word. has_camera: whether there is one that can be sent."""
        if self.problem is not None:
            return "failing"
        if not has_camera:
            return "silent"
        if self.held == "asking":
            return "asking"
        return "on-air" if self.packets and self.held is None else "starting"

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


class Publication:
    """Publishes and listens as configured, from start() until close(). Thread-safe.

    path: of the settings that operators have changed; they are saved over a restart and win over base by name.
    active: returns the active calibrations of its cameras. check: refuses a configuration that others rule out; called
    before anything is saved.
    """

    def __init__(
        self,
        path: Path,
        received_path: Path,
        base: JsonObject,
        failures: RecentFailures,
        active: Callable[[], Sequence[Calibration]],
        packet_camera: PacketCameraCache,
        fields: Mapping[str, Field],
        check: Callable[[PublishingConfig], None] = lambda config: None,
    ) -> None:
        self._active, self._fields, self._check = active, fields, check
        self._packet_camera, self._failures = packet_camera, failures
        self._lock = threading.Lock()
        self._settings = SavedSettings(path, base, PublishingConfig, failures, MERGED)
        self._saved_passed_on = SavedPassedOn(received_path, failures)
        self._passed_on = self._saved_passed_on.read()
        self._sent_cameras: set[CameraValues] = set()
        # whether to look who else sends before the first packet: after an operator's change, not after a restart
        # in the middle of a match
        self._looks_first = False
        # now and before, whose last packets may still be received
        self._senders: tuple[MulticastSender, ...] = ()
        self._publisher: Publisher | None = None
        self._listener: GeometryListener | None = None
        self._running = False

    @property
    def config(self) -> PublishingConfig:
        return self._settings.config

    @property
    def etag(self) -> str:
        """The ETag of the settings."""
        return self._settings.etag

    @property
    def sender(self) -> MulticastSender | None:
        """The publisher's sender, for other packets to the same group; None while publishing is off."""
        publisher = self._publisher
        return None if publisher is None else publisher.sender

    @property
    def warnings(self) -> tuple[Warning, ...]:
        """What an operator should see on every page."""
        publisher, listener = self._publisher, self._listener
        found: list[Warning] = []
        if self._settings.is_damaged:  # nothing is sent until somebody has looked
            found.append(claims.damaged_settings(self._settings.path.name))
        if publisher is not None:
            status = publisher.status
            asking_about = self._others(status.packet) if status.held == "asking" else []
            found += claims.of_publisher(status.problem, status.cameras, asking_about)
        if listener is not None:
            if (problem := listener.problem) is not None:
                found.append(claims.of_listener(problem))
            on_air = () if publisher is None else publisher.status.on_air
            found += claims.of_senders(listener.senders, on_air, time.monotonic())
        return tuple(found)

    def start(self) -> None:
        with self._lock:
            self._running = True
            self._follow(self.config)

    def close(self) -> None:
        with self._lock:
            self._running = False
            self._follow(PublishingConfig())

    def delete(self) -> None:
        """Delete what is saved of it, and end it; nothing has changed where the files cannot be deleted."""
        with self._lock, self._failures.noted("The deletion"):
            for path in (self._saved_passed_on.path, self._settings.path):
                path.unlink(missing_ok=True)
        self.close()

    def wake(self) -> None:
        """Publish at once: a calibration was activated, or a camera or a field changed."""
        if (publisher := self._publisher) is not None:
            publisher.wake()

    def check_etag(self, etag: str | None) -> None:
        """Stale where the settings are others than those of the ETag."""
        check_etag(
            etag,
            self.etag,
            say(
                "stale.publishing",
                "Another user has changed the publishing settings since you opened them.",
            ),
            "stale-publishing",
            self.config.to_json(),
        )

    def change(self, changes: JsonObject, etag: str | None = None) -> None:
        """Save and follow; BadInput, NotFound, or NetworkError for what this network does not carry now.

        etag: of the settings that the caller saw; Stale if they are others by now. Nothing is saved or followed where
        anything is refused.
        """
        with self._lock:
            if (field := changes.get("field")) is not None:
                _ = self._fields[field]
            self.check_etag(etag)
            before = self.config
            saved, config = self._settings.after(changes)
            self._check(config)
            self._check_network(config)
            self._settings.save(saved, config)
            if config != before:
                if not before.enabled or config.address != before.address:
                    self._looks_first = True
                if self._running:
                    self._follow(config)

    def publish_anyway(self) -> None:
        """Publish now, where that waits for a decision because another program does."""
        publisher = self._publisher
        if publisher is not None and publisher.status.held == "asking":
            self._looks_first = False
            publisher.wake()

    def geometry_file(self) -> bytes:
        """Return the cameras that are published, or would be, as a geometry.yml; Conflict where there is none."""
        field, sent, _ = self._geometry()
        models = sent.models if sent.HasField("models") else None
        return vision_processor.geometry(field, sent.calib, models).encode()

    def ssl_vision_settings(self, data: bytes) -> UpdatedSettings:
        """Return ssl-vision's settings with our cameras, and the field and ball models that are sent with them.

        As geometry_file() and updated_settings() refuse.
        """
        _, sent, ours = self._geometry()
        models = sent.models if sent.HasField("models") else None
        cameras = [one for one in sent.calib if one.camera_id in ours]
        return updated_settings(data, sent.field, cameras, models)

    def _geometry(self) -> tuple[Field, SSL_GeometryData, set[int]]:
        """Return the field and the geometry that is sent, or would be, and the numbers of our cameras in it."""
        cameras = self._cameras()
        field = published_field(cameras, self._fields)
        passed_on = self._passed_on if self.config.pass_on else None
        packet = geometry_packet(cameras, self._fields, passed_on, self.config.ball_models)
        if field is None or packet is None:
            raise Conflict(
                say("publishing.nothing", "No camera can be published."),
                say(
                    "publishing.activate-first",
                    "Activate a calibration. GET /api/v1/publishing states what excludes a camera.",
                ),
                reason="nothing-published",
            )
        ours = {one.number for one in cameras if one.sent is not None}
        return field, decode(GeometryPacket, packet).geometry, ours

    def status(self) -> JsonObject:
        """Return configuration, state and cameras as JSON; takes as long as approximating new calibrations does."""
        publisher, cameras = self._publisher, self._cameras()
        sent = None if publisher is None else publisher.status
        problem = None if sent is None else sent.problem
        return {
            **self.config.to_json(),
            "state": "off" if sent is None else sent.state(any(one.sent for one in cameras)),
            "problem": problem and problem.to_json(),
            "said": None if sent is None else sent.to_json(),
            "passed_on": self._passed_on_json(cameras),
            "cameras": [one.to_json() for one in cameras],
            "interfaces": interfaces(),
        }

    def received(self) -> JsonObject:
        """Describe the other publishers as JSON."""
        listener, publisher = self._listener, self._publisher
        if listener is None:
            return {"listening": False, "problem": None, "datagrams": 0, "own": 0, "items": []}
        now_s, fields, problem = time.monotonic(), tuple(self._fields.values()), listener.problem
        sent = PublishStatus() if publisher is None else publisher.status
        packet = decode(GeometryPacket, sent.packet).geometry if sent.packet else None
        ours = sent.cameras if sent.held else sent.on_air
        items = sorted(
            (received_json(one, now_s, fields, ours, packet) for one in listener.senders),
            key=lambda one: one["id"],
        )
        return {
            "listening": listener.joined.is_set() and problem is None,
            "problem": problem and problem.to_json(),
            "datagrams": listener.datagrams,
            "own": listener.own,
            "items": items,
        }

    def remote_publisher(self, id: str) -> RemotePublisher:
        """Return one that has sent geometry; NotFound, or Conflict."""
        found = None if self._listener is None else self._listener.get(id)
        if found is None:
            raise NotFound(
                say(
                    "receiving.unknown-sender", "No geometry was received from {sender}.", sender=id
                ),
                "See GET /api/v1/publishing/heard, with absorb enabled.",
                reason="unknown-sender",
            )
        if found.geometry is None:
            raise Conflict(
                say("receiving.no-geometry", "{sender} has sent no geometry yet.", sender=id),
                say(
                    "receiving.wait-for-geometry",
                    "Wait until it sends geometry. The league software sends it every few seconds.",
                ),
                reason="no-geometry",
            )
        return found

    def _cameras(self) -> tuple[PublishedCamera, ...]:
        return published_cameras(self._active(), self.config, self._packet_camera, self._fields)

    def _follow(self, config: PublishingConfig) -> None:
        """Exchange publisher and listener where the configuration asks for others."""
        publisher, listener = self._publisher, self._listener
        if publisher is not None and (not config.enabled or publisher.config != config):
            self._publisher = None
            publisher.close()
        if config.enabled and self._publisher is None:
            # known as ours before it sends
            self._senders = (*self._senders[-1:], MulticastSender(config.address))
            self._publisher = Publisher(
                config,
                self._active,
                self._packet_camera,
                self._fields,
                self._newest_passed_on,
                self._why_held,
                self._senders[-1],
            )
        listens = config.absorb or config.enabled  # who publishes must know who else does
        if listener is not None and (not listens or listener.address != config.address):
            self._listener = None
            listener.close()
        if listens and self._listener is None:
            self._listener = GeometryListener(config.address, self._is_own)

    def _check_network(self, config: PublishingConfig) -> None:
        """NetworkError where this network cannot do now what the configuration newly switches on."""
        now, moved = self.config, config.address != self.config.address
        if (config.enabled and (moved or not now.enabled)) or (
            config.absorb and (moved or not now.absorb)
        ):
            MulticastSender(config.address).check()

    def _is_own(self, address: str, port: int) -> bool:
        return any(sender.is_own_packet(address, port) for sender in self._senders)

    def _others(self, packet: bytes) -> list[RemotePublisher]:
        """List who sends other geometry than that packet of ours now."""
        now_s, listener = time.monotonic(), self._listener
        return [
            one
            for one in (() if listener is None else listener.senders)
            if one.is_current(now_s) and not says_the_same(one, packet)
        ]

    def _why_held(self, packet: bytes) -> Held | None:
        """Say why a packet waits, until it was listened for long enough; from then on it is sent, whoever comes."""
        if not self._looks_first:
            return None
        if self._others(packet):
            return "asking"
        listener = self._listener
        if listener is None or time.monotonic() - listener.since_s < self.config.listen_first_s:
            return "listening"
        self._looks_first = False
        return None

    def _newest_passed_on(self) -> PassedOn | None:
        """Return what is passed on, and save it; None where that is switched off."""
        if not self.config.pass_on:
            return None
        if (publisher := self._publisher) is not None:
            self._sent_cameras.update(map(sent_values, publisher.status.on_air))
        if (listener := self._listener) is not None:
            self._passed_on = geometry_to_pass_on(
                listener.senders, time.monotonic(), self._passed_on, self._sent_cameras
            )
        if self._passed_on is not None:
            self._saved_passed_on.save(self._passed_on)
        return self._passed_on

    def _passed_on_json(self, cameras: Sequence[PublishedCamera]) -> JsonObject | None:
        found, field = self._passed_on, published_field(cameras, self._fields)
        return (
            found.to_json()
            if self.config.pass_on and found and field is not None and found.is_of(field)
            else None
        )
