"""The cameras there are: those that the settings name, and those that operators added; and what each needs to live."""

import asyncio
import logging
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from fastapi import FastAPI
from pydantic import ValidationError

from app.core.errors import BadInput, Conflict, NotFound, TouchlineError, Unavailable
from app.core.records import Calibration
from app.images import ImageLimits
from app.live import LiveCamera, LiveCameras
from app.settings import CameraSettings, Settings
from app.sources import SOURCES, Identity, SourceContext, read_query, split_address
from app.store import Store
from app.store.field_repository import FieldRepository

log = logging.getLogger("touchline")
TEST_S = 15.0  # a camera that is tried out gets so long to show a picture


class CameraShelf:
    """Cameras by id. What it asks of the store may block: call it from a thread where the loop must not wait."""

    def __init__(self, settings: Settings, store: Store, fields: FieldRepository, limits: ImageLimits) -> None:
        self._settings = settings
        self._store = store
        self._fields = fields
        self._limits = limits

    def all(self) -> list[CameraSettings]:
        """The settings' first, then those that were added, as they came."""
        named = list(self._settings.cameras)
        taken = {camera.id for camera in named}
        return named + [_read(added.name, added.body) for added in self._store.cameras.all() if added.name not in taken]

    def get(self, id: str) -> CameraSettings:
        """One; NotFound."""
        if (camera := self._from_settings(id)) is not None:
            return camera
        try:
            kept = self._store.cameras.get(id)
        except NotFound:
            known = ", ".join(camera.id for camera in self.all()) or "none: add one with POST /api/v1/cameras"
            raise NotFound(f"There is no camera called {id!r}.", f"Known cameras: {known}.",
                           reason="unknown-camera") from None
        return _read(id, kept.body)

    def etag(self, id: str) -> str | None:
        """Of one that was added; None for the settings' own, which only its file changes."""
        return None if self._from_settings(id) else self._store.cameras.get(id).etag

    def told(self, id: str) -> dict[str, str | None]:
        """When one that was added was changed last, and by whom; the settings' own say neither."""
        kept = None if self._from_settings(id) else self._store.cameras.get(id)
        return {"updated_at": kept.updated_at if kept else None, "updated_by": kept.updated_by if kept else None}

    def add(self, camera: CameraSettings, by: str) -> CameraSettings:
        if self._from_settings(camera.id):
            raise Conflict(f"There is already a camera called {camera.id!r}.", "Choose another id.",
                           reason="camera-exists")
        self._store.cameras.add(camera.id, camera.model_dump(exclude={"id"}), by)
        return camera

    def change(self, id: str, changes: Mapping[str, Any], etag: str, by: str) -> CameraSettings:
        self._refuse_settings(id)
        camera = _read(id, {**self._store.cameras.get(id).body, **changes})
        self._store.cameras.save(id, camera.model_dump(exclude={"id"}), etag, by)
        return camera

    def remove(self, id: str, etag: str | None) -> None:
        self._refuse_settings(id)
        self._store.cameras.delete(id, etag)

    def check_address(self, source: str) -> None:
        """BadInput or NotFound for an address that can never open: its form, its scheme, its options."""
        scheme, _, given = split_address(source)
        read_query(SOURCES[scheme].OPTIONS, given)

    def spec(self, id: str) -> dict[str, Any]:
        """What a camera's process must know, plain JSON."""
        return self.spec_of(self.get(id).source)

    def spec_of(self, source: str) -> dict[str, Any]:
        return {"source": source, "fields": {name: self._fields[name].to_json() for name in self._fields},
                "pictures": str(self._settings.shown_pictures), "hosts": list(self._settings.sources.allowed_hosts),
                "producers": [str(place) for place in self._settings.sources.known_producers],
                "limits": asdict(self._limits)}

    def surroundings(self) -> SourceContext:
        """For who looks for cameras in this process, and decodes nothing."""
        settings = self._settings
        return SourceContext(self._fields, None, settings.shown_pictures, settings.sources.allowed_hosts,
                            settings.sources.known_producers)

    def kept(self, id: str) -> tuple[Calibration | None, Identity | None]:
        """A camera's active calibration, and for which camera that was made or confirmed."""
        calibration = self._store.calibrations.active(id)
        if calibration is None:
            return None, None
        evidence = self._store.identities.get(calibration.id)
        if evidence is None and calibration.snapshot is not None:
            evidence = self._store.identities.get(calibration.snapshot)
        return calibration, Identity(**evidence) if evidence else None

    def picture(self, calibration: Calibration) -> dict[str, Any] | None:
        """Where the picture stands that it came from, for another process; None where there is none any more."""
        if calibration.snapshot is None:
            return None
        try:
            snapshot = self._store.snapshots.get(calibration.snapshot)
            return {"name": "the calibration's picture", "path": str(self._store.snapshots.path(snapshot)),
                    "sha256": snapshot.sha256}
        except TouchlineError:
            return None

    def confirm(self, calibration: Calibration, identity: Identity, by: str = "") -> None:
        """From now on the calibration is that camera's. by: the operator who says so."""
        self._store.identities.confirm(calibration.id, asdict(identity), by)

    def _from_settings(self, id: str) -> CameraSettings | None:
        return next((camera for camera in self._settings.cameras if camera.id == id), None)

    def _refuse_settings(self, id: str) -> None:
        if self._from_settings(id):
            raise Conflict(f"The camera {id!r} stands in the settings file.", "Change it there, and start anew.",
                           reason="camera-in-settings")


def live_cameras(app: FastAPI) -> LiveCameras:
    """The live cameras of an application that has a shelf; those with an active calibration are woken at once."""
    shelf: CameraShelf = app.state.camera_shelf
    trusting: set[asyncio.Task[None]] = set()

    def trust(calibration: Calibration, identity: Identity) -> None:
        task = asyncio.create_task(_trusted(shelf, calibration, identity))
        trusting.add(task)
        task.add_done_callback(trusting.discard)

    live = LiveCameras(shelf.spec, shelf.kept, trust, shelf.picture, app.state.seeing.wanted, app.state.seeing.publish)
    for camera in shelf.all():
        if shelf.kept(camera.id)[0] is not None:
            live.get(camera.id)
    return live


async def tried(shelf: CameraShelf, source: str) -> tuple[dict[str, Any], bytes]:
    """A source opened in a process of its own: its state, and one picture as PNG; what it refuses is raised."""
    camera = LiveCamera("test", shelf.spec_of(source))
    camera.start()
    try:
        _, png = await camera.first_still(TEST_S)
        return camera.status(), png
    except Unavailable as error:  # here it is the asker's address that does not work, not the server
        raise BadInput(error.what, error.fix, reason=error.reason) from None
    finally:
        await camera.stop()


async def _trusted(shelf: CameraShelf, calibration: Calibration, identity: Identity) -> None:
    try:
        await asyncio.to_thread(shelf.confirm, calibration, identity)
    except Exception:
        log.exception("the camera's identity could not be kept; it is asked for again after a restart")


def _read(id: str, body: Mapping[str, Any]) -> CameraSettings:
    try:
        return CameraSettings(id=id, **body)
    except ValidationError:
        raise Conflict(f"The kept definition of the camera {id!r} is not understood.",
                       "Remove it and add it anew.", reason="camera-definition") from None
