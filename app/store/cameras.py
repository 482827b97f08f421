"""Cameras that operators added in the browser, and the evidence of which camera an id was confirmed to be."""

from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from sqlalchemy import delete
from sqlalchemy.orm import Session

from app.core.errors import NotFound
from app.store.checksummed import checksummed, content
from app.store.documents import DocumentRepository, check_name, is_name
from app.store.quarantine import DamagedFile
from app.store.repository import Repository, timestamp
from app.store.tables import CameraRow, IdentityRow


class CameraRepository(DocumentRepository):
    """Cameras in the order in which they were added; a document's name is the camera's id."""

    table, member = CameraRow, "camera"
    noun, word, plural = "camera", "camera", "cameras"
    listing = "List them with GET /api/v1/cameras."
    max_count = 10_000

    def delete(self, name: str, etag: str | None = None) -> None:
        """Delete the one with that ETag (None: whichever) and its evidence; its calibrations stay."""
        with self._database.writing("The deletion") as rows:
            super().delete(name, etag)
            rows.execute(delete(IdentityRow).where(IdentityRow.camera == name))

    def _deleted(self, name: str) -> NotFound:
        return self._unknown(name)

    def _head(self, rows: Session, before: CameraRow | None) -> tuple[dict[str, Any], dict[str, Any]]:
        place, revision = (before.place, before.revision + 1) if before else (self._next_place(rows), 1)
        return {"sequence": place, "revision": revision}, {"place": place, "revision": revision}

    def _etag(self, record: Mapping[str, Any]) -> str:
        return f"{record['sequence']}-{record['revision']}"


class IdentityRepository(Repository):
    """Which physical camera an id was confirmed to be."""

    table = IdentityRow

    def get(self, camera: str) -> dict[str, Any] | None:
        """Return the evidence that was confirmed last; None before that, or if it was damaged."""
        with self._database.reading() as rows:
            row = rows.get(IdentityRow, camera) if is_name(camera) else None
        with suppress(DamagedFile):
            return None if row is None else content(self._checked(row))["evidence"]
        return None

    def confirm(self, camera: str, evidence: Mapping[str, Any], by: str = "") -> None:
        """Let the id mean the camera with that evidence from now on. by: "" where nobody said so and it was seen."""
        check_name(camera, "The camera's identity")
        record = {"confirmed_at": timestamp(self._clock), "confirmed_by": by, "evidence": dict(evidence)}
        with self._database.writing("The camera's identity") as rows:
            rows.merge(checksummed(IdentityRow, record, "The camera's identity", camera=camera))
