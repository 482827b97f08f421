"""The cameras of this server: those that the settings name and those that operators added."""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import asdict
from typing import Any

from pydantic import ValidationError

from touchline.capabilities import camera_parts
from touchline.core.errors import BadInput, Conflict, NotFound, TouchlineError, Unavailable
from touchline.core.records import Calibration
from touchline.core.statements import say
from touchline.evaluate.report import expected_figures
from touchline.images import ImageLimits
from touchline.live.camera import LiveCamera
from touchline.live.messages import CameraStatus
from touchline.settings import CameraSettings, Settings
from touchline.sources import Identity, read_query, source_class, split_address, without_password
from touchline.store.documents import Document
from touchline.store.fields import FieldRepository
from touchline.store.store import Store

TEST_S = 15.0  # a camera that is tried out gets so long to show a picture


class CameraService:
    """Cameras by id. Calls of the store block: make them from a thread where the event loop must not wait."""

    def __init__(
        self, settings: Settings, store: Store, fields: FieldRepository, limits: ImageLimits
    ) -> None:
        self._settings = settings
        self._store = store
        self._fields = fields
        self._limits = limits

    def all(self) -> list[CameraSettings]:
        """Return the settings' cameras, then those that were added, oldest first."""
        return self._with_added(self._store.cameras.all())

    def _with_added(self, rows: Iterable[Document]) -> list[CameraSettings]:
        configured = list(self._settings.cameras)
        ids = {camera.id for camera in configured}
        return configured + [_read(row.name, row.body) for row in rows if row.name not in ids]

    def get(self, id: str) -> CameraSettings:
        """Return one camera; NotFound."""
        if (camera := self._from_settings(id)) is not None:
            return camera
        try:
            return _read(id, self._store.cameras.get(id).body)
        except NotFound:
            known = (
                ", ".join(camera.id for camera in self.all())
                or "none: add one with POST /api/v1/cameras"
            )
            raise NotFound(
                say("camera.unknown", "There is no camera called {id!r}.", id=id),
                say("camera.known", "Known cameras: {cameras}.", cameras=known),
                reason="unknown-camera",
            ) from None

    def title(self, id: str) -> str:
        """Return the camera's name for operators; its id where it was removed or never was here."""
        with suppress(NotFound):
            return self.get(id).title
        return id

    def etag(self, id: str) -> str | None:
        """Return the ETag of a camera that was added; None for those of the settings, which only their file changes."""
        return None if self._from_settings(id) else self._store.cameras.get(id).etag

    def to_json(self, camera: CameraSettings) -> dict[str, Any]:
        """Return what the API shows of a camera; never its password."""
        row = None if self._from_settings(camera.id) else self._store.cameras.get(camera.id)
        return self._json(camera, row, self._store.calibrations.active(camera.id))

    def all_json(self) -> list[dict[str, Any]]:
        """Return the same of every camera; the store is asked twice, however many there are."""
        rows = {row.name: row for row in self._store.cameras.all()}
        cameras = self._with_added(rows.values())
        active = self._store.calibrations.active_of([camera.id for camera in cameras])
        return [
            self._json(
                camera,
                None if self._from_settings(camera.id) else rows[camera.id],
                active.get(camera.id),
            )
            for camera in cameras
        ]

    def _json(
        self, camera: CameraSettings, row: Document | None, active: Calibration | None
    ) -> dict[str, Any]:
        return {
            "id": camera.id,
            "name": camera.title,
            "field": camera.field,
            "region": camera.region,
            "source": without_password(camera.source),
            "editable": row is not None,
            "active_calibration": active.id if active else None,
            "active": self._summary(active) if active else None,
            "updated_at": row.updated_at if row else None,
            "updated_by": row.updated_by if row else None,
        }

    def add(self, camera: CameraSettings, by: str) -> CameraSettings:
        """Save a new camera; its address is checked, not whether it answers."""
        if self._from_settings(camera.id):
            raise Conflict(
                say("camera.exists", "There is already a camera called {id!r}.", id=camera.id),
                say("camera.another-id", "Choose another id."),
                reason="camera-exists",
            )
        with self._store.references:
            self._check(camera)
            self._store.cameras.add(camera.id, camera.model_dump(exclude={"id"}), by)
        return camera

    def change(self, id: str, changes: Mapping[str, Any], etag: str, by: str) -> CameraSettings:
        """Save some new values; Stale unless the ETag is the newest."""
        with self._store.references:
            self._check(self.get(id).model_copy(update=changes))
            self._refuse_settings(id)
            camera = _read(id, {**self._store.cameras.get(id).body, **changes})
            self._store.cameras.save(id, camera.model_dump(exclude={"id"}), etag, by)
        return camera

    def remove(self, id: str, etag: str | None) -> None:
        self._refuse_settings(id)
        self._store.cameras.delete(id, etag)

    def process_spec(self, id: str) -> dict[str, Any]:
        """Return what a camera's process must know, as plain JSON."""
        return {**self._process_spec(self.get(id).source), "parts": list(camera_parts())}

    async def try_source(self, source: str) -> tuple[CameraStatus, bytes]:
        """Open a source in a process of its own; return its status and one frame as PNG, or raise what it refuses."""
        camera = LiveCamera("test", self._process_spec(source))
        camera.start()
        try:
            _, png = await camera.first_still(TEST_S)
            return camera.status(), png
        # it is the caller's address that does not work, not the server
        except Unavailable as error:
            raise BadInput(error.what, error.fix, reason=error.reason) from None
        finally:
            await camera.stop()

    def active_calibrations(self) -> list[Calibration]:
        """Return the active versions of the cameras that have one, in their order."""
        return list(
            self._store.calibrations.active_of([camera.id for camera in self.all()]).values()
        )

    def active_calibration(self, id: str) -> tuple[Calibration | None, Identity | None]:
        """Return a camera's active calibration, and for which device it was made or confirmed."""
        calibration = self._store.calibrations.active(id)
        if calibration is None:
            return None, None
        evidence = self._store.identities.get(calibration.id)
        if evidence is None and calibration.snapshot is not None:
            evidence = self._store.identities.get(calibration.snapshot)
        return calibration, Identity(**evidence) if evidence else None

    def calibration_picture(self, calibration: Calibration) -> dict[str, Any] | None:
        """Return where another process finds the picture that was calibrated; None if it is gone."""
        if calibration.snapshot is None:
            return None
        with suppress(TouchlineError):
            return self._store.snapshots.for_job(calibration.snapshot, "the calibration image")
        return None

    def confirm(self, calibration: Calibration, identity: Identity, by: str = "") -> None:
        """Note that the calibration belongs to that device. by: the operator who says so."""
        self._store.identities.confirm(calibration.id, asdict(identity), by)

    def _process_spec(self, source: str) -> dict[str, Any]:
        return {
            "source": source,
            "fields": {name: self._fields[name].to_json() for name in self._fields},
            "pictures": str(self._settings.shown_pictures),
            "hosts": list(self._settings.sources.allowed_hosts),
            "limits": asdict(self._limits),
        }

    def field_changes(self, calibration: Calibration) -> list[str]:
        """Name what of its field lies elsewhere than when the calibration was made; nothing where the field is gone."""
        name = calibration.field["name"]
        return (
            list(calibration.field_changes(self._fields[name].to_json()))
            if name in self._fields
            else []
        )

    def _summary(self, calibration: Calibration) -> dict[str, Any]:
        """Return what a list of cameras shows of a version; an imported one may have no verdict."""
        return {
            "id": calibration.id,
            "version": calibration.version,
            "model": calibration.model_name,
            "created_at": calibration.created_at,
            "verdict": calibration.report.get("verdict") or {},
            "field": calibration.field["name"],
            "region": calibration.region,
            "rotate": calibration.rotate,
            "field_changes": self.field_changes(calibration),
            **expected_figures(calibration.report),
        }

    def _check(self, camera: CameraSettings) -> None:
        """Refuse what can be known to be wrong without opening it: address, source kind, options, field, region."""
        scheme, _, given = split_address(camera.source)
        read_query(source_class(scheme).OPTIONS, given)
        if camera.field is not None:
            field = self._fields[camera.field]
            if camera.region is not None:
                field.region(camera.region)

    def _from_settings(self, id: str) -> CameraSettings | None:
        return next((camera for camera in self._settings.cameras if camera.id == id), None)

    def _refuse_settings(self, id: str) -> None:
        if self._from_settings(id):
            raise Conflict(
                say(
                    "camera.in-settings",
                    "The camera {id!r} is defined in the settings file.",
                    id=id,
                ),
                say("camera.edit-settings", "Edit the file and restart the server."),
                reason="camera-in-settings",
            )


def _read(id: str, body: Mapping[str, Any]) -> CameraSettings:
    try:
        return CameraSettings(id=id, **body)
    except ValidationError:
        raise Conflict(
            say(
                "camera.bad-definition",
                "The saved definition of the camera {id!r} is not valid.",
                id=id,
            ),
            say("camera.delete-and-add", "Delete the camera and add it again."),
            reason="camera-definition",
        ) from None
