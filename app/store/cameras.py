"""Cameras that operators added in the browser, and the evidence of which camera an id was confirmed to be.

What a camera's body means is the business of whoever reads it; here it is plain JSON.
"""

import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from app.core.errors import BadInput, Conflict, NotFound, Stale
from app.store.checksummed import content, sealed
from app.store.quarantine import DamagedFile
from app.store.repository import Shelf, stamp
from app.store.tables import CameraRow, IdentityRow


@dataclass(frozen=True)
class KeptCamera:
    """One camera's definition as it was saved last. etag: different after every save."""

    id: str
    body: Mapping[str, Any]
    sequence: int
    revision: int
    updated_at: str
    updated_by: str = ""

    @property
    def etag(self) -> str:
        return f"{self.sequence}-{self.revision}"


class Cameras(Shelf):
    """The shelf of cameras. Thread-safe."""

    table = CameraRow
    kind = "cameras"

    def all(self) -> tuple[KeptCamera, ...]:
        """In the order in which they were added; a damaged one is missing here and named in Store.damaged."""
        with self._database.reading() as rows:
            found = list(rows.scalars(select(CameraRow).order_by(CameraRow.place)))
        cameras = []
        for row in found:
            with suppress(DamagedFile):
                cameras.append(self._read(row))
        return tuple(cameras)

    def get(self, id: str) -> KeptCamera:
        """One; NotFound, or DamagedFile."""
        with self._database.reading() as rows:
            row = rows.get(CameraRow, id) if is_name(id) else None
        if row is None:
            raise NotFound(f"There is no camera called {id!r}.", "List them with GET /api/v1/cameras.",
                           reason="unknown-camera")
        return self._read(row)

    def add(self, id: str, body: Mapping[str, Any], by: str = "") -> KeptCamera:
        """A new one; Conflict where the id is taken."""
        check_name(id, "The camera")
        with self._database.writing("The camera") as rows:
            if rows.get(CameraRow, id) is not None:
                raise Conflict(f"There is already a camera called {id!r}.", "Choose another id, or change that one.",
                               reason="camera-exists")
            place = 1 + (rows.scalar(select(func.max(CameraRow.place))) or 0)
            camera = KeptCamera(id, dict(body), place, 1, stamp(self._clock), by)
            rows.add(camera_row(camera))
        return camera

    def save(self, id: str, body: Mapping[str, Any], etag: str, by: str = "") -> KeptCamera:
        """In place of the one with that ETag; Stale where somebody else was faster."""
        self.get(id)  # a damaged one is told and not written over
        with self._database.writing("The camera") as rows:
            current = self._current(rows, id, etag)
            camera = KeptCamera(id, dict(body), current.sequence, current.revision + 1, stamp(self._clock), by)
            rows.merge(camera_row(camera))
        return camera

    def remove(self, id: str, etag: str | None = None) -> None:
        """Forget the one with that ETag (None: whichever), and its evidence; its calibrations stay."""
        self.get(id)
        with self._database.writing("The deletion") as rows:
            self._current(rows, id, etag)
            rows.execute(delete(IdentityRow).where(IdentityRow.camera == id))
            rows.execute(delete(CameraRow).where(CameraRow.id == id))

    def _current(self, rows: Session, id: str, etag: str | None) -> KeptCamera:
        row = rows.get(CameraRow, id, with_for_update=True)
        if row is None:
            raise NotFound(f"There is no camera called {id!r} any more.", "List them with GET /api/v1/cameras.",
                           reason="unknown-camera")
        current = self._read(row)
        if etag is not None and etag != current.etag:
            raise Stale("Somebody else has changed this camera since you opened it.",
                        "Look at it again, then change it.", reason="stale-camera", current=dict(current.body),
                        etag=current.etag)
        return current

    def _read(self, row: CameraRow) -> KeptCamera:
        record = content(self.checked(row, row.id))
        return KeptCamera(row.id, record["camera"], record["sequence"], record["revision"], record["updated_at"],
                          record.get("updated_by", ""))  # once nobody asked who it was


class Identities(Shelf):
    """Which physical camera an id was confirmed to be. Thread-safe."""

    table = IdentityRow
    kind = "identities"

    def get(self, camera: str) -> dict[str, Any] | None:
        """The evidence that was confirmed last; None before that, or where it was damaged."""
        with self._database.reading() as rows:
            row = rows.get(IdentityRow, camera) if is_name(camera) else None
        if row is None:
            return None
        with suppress(DamagedFile):
            return content(self.checked(row, camera))["evidence"]
        return None

    def confirm(self, camera: str, evidence: Mapping[str, Any], by: str = "") -> None:
        """From now on this is the camera that the id means."""
        check_name(camera, "The camera's identity")
        with self._database.writing("The camera's identity") as rows:
            rows.merge(identity_row(camera, evidence, stamp(self._clock), by))


def is_name(id: str) -> bool:
    """Whether a camera, a snapshot or a calibration could have that id: ids come from strangers."""
    return re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}", id) is not None


def check_name(id: str, what: str) -> None:
    if not is_name(id):
        raise BadInput(f"{what} has a name that cannot be kept.", "Choose small letters, digits and hyphens.",
                       reason="bad-name")


def camera_row(camera: KeptCamera) -> CameraRow:
    """A camera as the database has it."""
    record = {"sequence": camera.sequence, "revision": camera.revision, "updated_at": camera.updated_at,
              "updated_by": camera.updated_by, "camera": dict(camera.body)}
    return sealed(CameraRow, record, "The camera", id=camera.id, revision=camera.revision, place=camera.sequence)


def identity_row(camera: str, evidence: Mapping[str, Any], at: str, by: str) -> IdentityRow:
    """The evidence as the database has it."""
    record = {"confirmed_at": at, "confirmed_by": by, "evidence": dict(evidence)}
    return sealed(IdentityRow, record, "The camera's identity", camera=camera)
