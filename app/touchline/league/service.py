"""Publishing while the server runs: publications with their saved settings, and which cameras belong to which.

A publication sends some cameras to one address and listens there. The server has one, and each rig that an operator
publishes separately has its own: two fields in one hall have two groups, ports or networks.
"""

import threading
from collections.abc import Mapping
from pathlib import Path

from touchline.core.errors import Conflict, NotFound, TouchlineError
from touchline.core.json_values import JsonObject, number
from touchline.core.records import Calibration, Warning
from touchline.core.statements import Sentence, join, say
from touchline.evaluate.claims import Claim
from touchline.league.claims import packet_claim, publishing_claim
from touchline.league.live import Publication
from touchline.league.packet import (
    PublishingConfig,
)
from touchline.league.packet_camera import PacketCameraCache
from touchline.services.container import IsAbandoned, Services
from touchline.services.running_part import RunningPart
from touchline.store.documents import Document

FILE = "publishing.json"
RECEIVED_FILE = "heard-geometry.json"  # what another publisher's geometry adds to ours
RIGS_FOLDER = "publishing"  # the same of each rig with its own
SERVER = ""  # in place of a rig's name: the cameras of no rig with its own


class PublishingService(RunningPart):
    """The publications of the server and of its rigs, from start() until close(). Thread-safe.

    packet_camera: of a calibration, as the packet has it.
    """

    def __init__(self, services: Services) -> None:
        self._settings, self._store = services.settings, services.store
        self._cameras, self._fields = services.cameras, services.fields
        self.packet_camera = PacketCameraCache()
        self._running = False
        self._lock = threading.RLock()
        # replaced and never changed, so that reading needs no lock
        self._rigs: Mapping[str, Publication] = {}
        self._rig_of: Mapping[str, str] = {}  # by camera, of the rigs with their own
        self._titles: Mapping[str, str] = {}  # of these
        self._server = self._publication(SERVER)
        for rig in self._store.rigs.all():
            if self._path(rig.name).exists():
                self._rigs = {**self._rigs, rig.name: self._publication(rig.name)}
        self._assign_cameras()

    def start(self) -> None:
        with self._lock:
            self._running = True
            for publication in self.publications.values():
                publication.start()

    def close(self) -> None:
        with self._lock:
            self._running = False
            for publication in self.publications.values():
                publication.close()

    def wake(self) -> None:
        for publication in self.publications.values():
            publication.wake()

    @property
    def warnings(self) -> tuple[Warning, ...]:
        return tuple(one for rig in self.publications for one in self._warnings_of(rig))

    def uses_of_field(self, name: str) -> list[Sentence]:
        return [
            say("field.used-by-publishing", "publishing")
            for publication in self.publications.values()
            if publication.config.field == name
        ][:1]

    def uses_of_rig(self, name: str) -> list[Sentence]:
        own = self._rigs.get(name)
        return [say("rig.used-by-publishing", "publishing")] if own and own.config.enabled else []

    def rig_changed(self, name: str) -> None:
        with self._lock:
            if name in self._rigs and not any(rig.name == name for rig in self._store.rigs.all()):
                self._end(name)
            self._assign_cameras()
        self.wake()

    @property
    def publications(self) -> Mapping[str, Publication]:
        """All by the name of their rig; the server's own, SERVER, first."""
        return {SERVER: self._server, **self._rigs}

    def of(self, rig: str) -> Publication:
        """Return a rig's own publication, or the server's; NotFound."""
        found = self.publications.get(rig)
        if found is None:
            title = self._store.rigs.get(rig).name
            raise NotFound(
                say("publishing.not-separate", "{rig} is not published separately.", rig=title),
                say("publishing.separate", "Publish it separately on the page Publishing."),
                reason="not-separate",
            )
        return found

    def of_camera(self, id: str) -> Publication:
        """Return the publication in which a camera is."""
        return self.publications[self._rig_of.get(id, SERVER)]

    def change(self, rig: str, changes: JsonObject, etag: str | None = None) -> None:
        """Change a publication, as Publication.change() does; a rig has its own from then on."""
        with self._store.references, self._lock:
            publication = self.publications.get(rig)
            if publication is not None:
                publication.change(changes, etag)
                return
            publication = self._publication(self._store.rigs.get(rig).name)
            publication.change(changes, etag)
            self._rigs = {**self._rigs, rig: publication}
            self._assign_cameras()
            if self._running:
                publication.start()
        self.wake()

    def end(self, rig: str, etag: str | None = None) -> None:
        """Publish a rig's cameras with all others again; NotFound, or Stale. etag: as for change()."""
        with self._store.references, self._lock:
            self.of(rig).check_etag(etag)
            self._end(rig)
            self._assign_cameras()
        self.wake()

    def status(self, rig: str) -> JsonObject:
        """Describe a publication, and which rigs have their own, as JSON."""
        return {
            **self.of(rig).status(),
            "rig": rig,
            "members": [
                one.id for one in self._cameras.all() if self._rig_of.get(one.id, SERVER) == rig
            ],
            "rigs": [
                {
                    "name": one.name,
                    "title": one.body["title"] or one.name,
                    "separate": one.name in self._rigs,
                }
                for one in self._store.rigs.all()
            ],
        }

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
        limit_mm = self.of_camera(calibration.camera or "").config.limit_mm
        return {
            "calibration": calibration.id,
            **found.to_json(),
            "asked": found.judged_mm > limit_mm,
            "warnings": [
                one.to_json() for one in found.warnings(calibration.camera or calibration.id)
            ],
            "problem": None,
        }

    def claims(self) -> list[Claim]:
        """Return whether teams receive what was calibrated, of each publication that has a camera or is on."""
        return [
            publishing_claim(
                publication.status()["state"],
                self._warnings_of(rig),
                rig,
                self._titles.get(rig, ""),
            )
            for rig, publication in self.publications.items()
            if not self._rigs or publication.config.enabled or self._calibrations(rig)
        ]

    def _warnings_of(self, rig: str) -> tuple[Warning, ...]:
        found = self.publications[rig].warnings
        if rig == SERVER:
            return found
        named = say("publishing.of-rig", "{rig}:", rig=self._titles.get(rig, rig))
        return tuple(Warning(one.reason, join(named, one.text), one.fix) for one in found)

    def _publication(self, rig: str) -> Publication:
        folder, base = self._settings.data, self._settings.publish.to_json()
        if rig == SERVER:
            path, received_path = folder / FILE, folder / RECEIVED_FILE
        else:
            # a rig begins switched off: on the server's address its packets would be among the others
            base = {**base, "enabled": False, "absorb": False}
            path, received_path = (
                self._path(rig),
                folder / RIGS_FOLDER / f"{rig}~heard.json",
            )  # no name has ~
        return Publication(
            path,
            received_path,
            base,
            self._store.failures,
            lambda: self._calibrations(rig),
            self.packet_camera,
            self._fields,
            lambda config: self._refuse_taken_address(rig, config),
        )

    def _path(self, rig: str) -> Path:
        return self._settings.data / RIGS_FOLDER / f"{rig}.json"

    def _calibrations(self, rig: str) -> list[Calibration]:
        """Return the active calibrations of a publication's cameras."""
        return [
            one
            for one in self._cameras.active_calibrations()
            if self._rig_of.get(one.camera or "", SERVER) == rig
        ]

    def _assign_cameras(self) -> None:
        """Note which camera belongs to which rig with its own publication: of several the first."""
        rigs = [rig for rig in self._store.rigs.all() if rig.name in self._rigs]
        self._titles = {rig.name: rig.body["title"] or rig.name for rig in rigs}
        self._rig_of = {id: rig.name for rig in reversed(rigs) for id in _cameras_of(rig)}

    def _refuse_taken_address(self, rig: str, config: PublishingConfig) -> None:
        """Conflict where a publication would send to where another one does."""
        for name, other in self.publications.items():
            if name == rig or not (config.enabled and other.config.enabled):
                continue
            if config.address.meets(other.config.address):
                raise Conflict(
                    say(
                        "publishing.address-taken",
                        "Group {group}, port {port} is already in use for {publication}.",
                        group=config.group,
                        port=config.port,
                        publication=self._titles.get(name)
                        or say("publishing.other-cameras", "the other cameras"),
                    ),
                    say(
                        "publishing.another-address",
                        "Enter another port or group, or the interface of another network.",
                    ),
                    reason="address-taken",
                )

    def _end(self, rig: str) -> None:
        self._rigs[rig].delete()
        self._rigs = {name: one for name, one in self._rigs.items() if name != rig}


def _cameras_of(rig: Document) -> list[str]:
    return [one["camera"] for one in rig.body["cameras"]]


async def packet_claims(
    services: Services, calibration: Calibration, _is_abandoned: IsAbandoned
) -> list[Claim]:
    """Judge what teams would receive of a version."""
    service = services.part(PublishingService)
    own_mm = number((calibration.report.get("verdict") or {}).get("mm"))
    return [packet_claim(await services.run_in_thread(service.packet_json, calibration), own_mm)]


def site_claims(services: Services) -> list[Claim]:
    """Return whether teams receive what was calibrated."""
    return services.part(PublishingService).claims()
