"""Publishing while the server runs: its saved settings, publisher and listener that follow them, and its claims."""

import json
import logging
import threading
import time
from collections.abc import Iterable, Sequence

from touchline.core.errors import Conflict, NotFound, TouchlineError
from touchline.core.json_values import JsonObject, number
from touchline.core.records import Calibration, Warning
from touchline.core.statements import Sentence, join, say
from touchline.evaluate.claims import Claim
from touchline.formats import vision_processor
from touchline.league.claims import packet_claim, publishing_claim
from touchline.league.live import GeometryListener, Held, Publisher, PublishStatus
from touchline.league.packet import (
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
    contradictions,
    doubled_cameras,
    geometry_to_pass_on,
    received_json,
    says_the_same,
    sent_values,
)
from touchline.network.address import interfaces
from touchline.network.multicast import MulticastSender
from touchline.services.container import IsAbandoned, Services
from touchline.services.running_part import RunningPart
from touchline.services.saved_settings import SavedSettings, read_object
from touchline.ssl_protocol.protobuf import decode
from touchline.ssl_protocol.ssl_vision_pb2 import GeometryPacket
from touchline.store.files import write_atomically
from touchline.store.repository import check_etag

FILE = "publishing.json"
RECEIVED_FILE = "heard-geometry.json"  # what another publisher's geometry adds to ours
MERGED = ("numbers", "approved")  # by camera: those not named stay, null removes one
log = logging.getLogger("touchline")


class PublishingService(RunningPart):
    """Publishes and listens as configured, from start() until close(). Thread-safe.

    Settings that operators have changed are saved over a restart; they win over the settings file by name.
    packet_camera: of a calibration, as the packet has it.
    """

    def __init__(self, services: Services) -> None:
        settings, store = services.settings, services.store
        self._received_path = settings.data / RECEIVED_FILE
        self._failures, self._references = store.failures, store.references
        self._active, self._fields = services.cameras.active_calibrations, services.fields
        self._lock = threading.Lock()
        self._settings = SavedSettings(
            settings.data / FILE,
            settings.publish.to_json(),
            PublishingConfig,
            self._failures,
            MERGED,
        )
        self.packet_camera = PacketCameraCache()
        self._passed_on = self._saved_passed_on = self._read_passed_on()
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

    def start(self) -> None:
        with self._lock:
            self._running = True
            self._follow(self.config)

    def close(self) -> None:
        with self._lock:
            self._running = False
            self._follow(PublishingConfig())

    def wake(self) -> None:
        """Publish at once: a calibration was activated, or a camera or a field changed."""
        if (publisher := self._publisher) is not None:
            publisher.wake()

    def uses_of_field(self, name: str) -> list[Sentence]:
        return [say("field.used-by-publishing", "publishing")] if self.config.field == name else []

    @property
    def warnings(self) -> tuple[Warning, ...]:
        """What an operator should see on every page: nothing goes out, or two publishers contradict each other."""
        publisher, listener = self._publisher, self._listener
        # nothing is sent until somebody has looked
        found = [_damaged(self._settings.path.name)] if self._settings.is_damaged else []
        if publisher is not None and (problem := publisher.status.problem) is not None:
            found.append(
                Warning(
                    "publishing",
                    join(
                        say("publishing.not-published", "The geometry is not published:"),
                        problem.what,
                    ),
                    problem.fix,
                )
            )
        found += [] if publisher is None else _left_out(publisher.status.cameras)
        if listener is not None and (problem := listener.problem) is not None:
            found.append(
                Warning(
                    "absorbing",
                    join(
                        say("receiving.no-geometry-received", "No geometry is received:"),
                        problem.what,
                    ),
                    problem.fix,
                )
            )
        if publisher is not None and publisher.status.held == "asking":
            found.append(
                Warning(
                    "another-publisher",
                    say(
                        "publishing.another-publisher",
                        "The geometry is not published yet: {others} already publishes geometry.",
                        others=[one.address for one in self._others(publisher.status.packet)],
                    ),
                    say(
                        "publishing.decide",
                        "Decide on the page Publishing whether both publish.",
                    ),
                )
            )
        if listener is not None:
            for number, a, b in doubled_cameras(listener.senders, time.monotonic()):
                found.append(
                    Warning(
                        "two-publishers",
                        say(
                            "receiving.doubled-camera",
                            "{a} and {b} both publish camera {number}, with different "
                            "calibrations.",
                            a=a.address,
                            b=b.address,
                            number=number,
                        ),
                        say(
                            "receiving.stop-one-of-them",
                            "Only one program may publish a camera: stop one of them.",
                        ),
                    )
                )
        if publisher is not None and listener is not None:
            for other, one in contradictions(
                listener.senders, publisher.status.on_air, time.monotonic()
            ):
                found.append(
                    Warning(
                        "two-publishers",
                        say(
                            "receiving.two-publishers",
                            "{address} also publishes camera {number}, which "
                            "is {camera}, with another calibration.",
                            address=other.address,
                            number=one.number,
                            camera=one.name,
                        ),
                        say(
                            "receiving.stop-one",
                            "Only one program may publish: stop one of them, or "
                            "import the other calibration.",
                        ),
                    )
                )
        return tuple(found)

    @property
    def sender(self) -> MulticastSender | None:
        """The publisher's sender, for other packets to the same group; None while publishing is off."""
        publisher = self._publisher
        return None if publisher is None else publisher.sender

    @property
    def etag(self) -> str:
        """The ETag of the settings."""
        return self._settings.etag

    def change(self, changes: JsonObject, etag: str | None = None) -> None:
        """Save and follow; BadInput, NotFound, or NetworkError for what this network does not carry now.

        etag: of the settings that the caller saw; Stale if they are others by now. Nothing is saved or followed where
        anything is refused.
        """
        with self._references, self._lock:
            if (field := changes.get("field")) is not None:
                _ = self._fields[field]
            before = self.config
            check_etag(
                etag,
                self.etag,
                say(
                    "stale.publishing",
                    "Another user has changed the publishing settings since you opened them.",
                ),
                "stale-publishing",
                before.to_json(),
            )
            saved, config = self._settings.after(changes)
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
        cameras = published_cameras(self._active(), self.config, self.packet_camera, self._fields)
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
        sent = decode(GeometryPacket, packet).geometry
        models = sent.models if sent.HasField("models") else None
        return vision_processor.geometry(field, sent.calib, models).encode()

    def status(self) -> JsonObject:
        """Return configuration, state and cameras as JSON; takes as long as approximating new calibrations does."""
        publisher = self._publisher
        cameras = published_cameras(self._active(), self.config, self.packet_camera, self._fields)
        sent = None if publisher is None else publisher.status
        problem = None if sent is None else sent.problem
        state = (
            "off"
            if sent is None
            else "failing"
            if problem is not None
            else "silent"
            if not any(one.sent for one in cameras)
            else "asking"
            if sent.held == "asking"
            else "on-air"
            if sent.packets and sent.held is None
            else "starting"
        )
        return {
            **self.config.to_json(),
            "state": state,
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

    def packet_json(self, calibration: Calibration) -> JsonObject:
        """Return what teams receive of a version, sent or not: as GET /calibrations/{id}/packet answers."""
        found = self.packet_camera(calibration)
        if isinstance(found, TouchlineError):
            nothing = {
                "exact": False,
                "loss": None,
                "expected": None,
                "fit_expected": None,
                "level": None,
            }
            return {
                "calibration": calibration.id,
                **nothing,
                "asked": False,
                "warnings": [],
                "problem": found.to_json(),
            }
        return {
            "calibration": calibration.id,
            **found.to_json(),
            "asked": found.judged_mm > self.config.limit_mm,
            "warnings": [
                one.to_json() for one in found.warnings(calibration.camera or calibration.id)
            ],
            "problem": None,
        }

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
                self.packet_camera,
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
        if (found := self._passed_on) is not None and found.needs_saving(self._saved_passed_on):
            try:
                with self._failures.noted("The heard geometry"):
                    write_atomically(self._received_path, json.dumps(found.saved()).encode())
            except TouchlineError as problem:  # it is passed on all the same, until the next start
                log.warning("%s", problem)
            self._saved_passed_on = found
        return self._passed_on

    def _passed_on_json(self, cameras: Sequence[PublishedCamera]) -> JsonObject | None:
        found, field = self._passed_on, published_field(cameras, self._fields)
        return (
            found.to_json()
            if self.config.pass_on and found and field is not None and found.is_of(field)
            else None
        )

    def _read_passed_on(self) -> PassedOn | None:
        try:
            return PassedOn.from_saved(read_object(self._received_path), time.time())
        except (ValueError, RecursionError, OSError):
            return None


async def packet_claims(
    services: Services, calibration: Calibration, _is_abandoned: IsAbandoned
) -> list[Claim]:
    """Judge what teams would receive of a version."""
    service = services.part(PublishingService)
    own_mm = number((calibration.report.get("verdict") or {}).get("mm"))
    return [packet_claim(await services.run_in_thread(service.packet_json, calibration), own_mm)]


def site_claims(services: Services) -> list[Claim]:
    """Return whether teams receive what was calibrated."""
    service = services.part(PublishingService)
    return [publishing_claim(service.status()["state"], service.warnings)]


def _left_out(cameras: Iterable[PublishedCamera]) -> list[Warning]:
    """Say which cameras teams do not receive, and why: the page of publishing is seldom open."""
    return [
        Warning(
            "camera-not-published",
            join(
                say("publishing.camera-left-out", "{camera} is not published:", camera=one.name),
                one.problem.what,
            ),
            one.problem.fix,
        )
        for one in cameras
        if one.problem is not None
    ]


def _damaged(file: str) -> Warning:
    return Warning(
        "publishing-damaged",
        say(
            "publishing.damaged",
            "{file} in the data folder cannot be read. Nothing is published.",
            file=file,
        ),
        say(
            "publishing.restore-settings",
            "Enter the publishing settings again, or correct the file and restart the server.",
        ),
    )
