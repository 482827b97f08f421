"""Cameras that operators added in the browser, and the evidence of which camera an id was confirmed to be.

    cameras/ID.json       {"sequence", "revision", "updated_at", "camera"}
    identities/ID.json    {"confirmed_at", "evidence"}

What a camera's body means is the business of whoever reads it; here it is plain JSON.
"""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Any

from app.errors import Conflict, NotFound, Stale
from app.store.files import flush_folder, keeping
from app.store.quarantine import DamagedFile, Quarantine
from app.store.records import Records
from app.store.shelf import Clock, stamp


@dataclass(frozen=True)
class KeptCamera:
    """One camera's definition as it was saved last. etag: different after every save."""

    id: str
    body: Mapping[str, Any]
    sequence: int
    revision: int
    updated_at: str

    @property
    def etag(self) -> str:
        return f"{self.sequence}-{self.revision}"


class Cameras:
    """The shelf of cameras. Thread-safe."""

    def __init__(self, folder: Path, quarantine: Quarantine, clock: Clock) -> None:
        self._records = Records(folder / "cameras", quarantine)
        self._identities = Records(folder / "identities", quarantine)
        self._clock = clock
        self._lock = Lock()

    def all(self) -> tuple[KeptCamera, ...]:
        """In the order in which they were added; a damaged one is missing here and named in Store.damaged."""
        found = []
        for name in self._records.names():
            with suppress(DamagedFile, NotFound):
                found.append(self.get(name.removesuffix(".json")))
        return tuple(sorted(found, key=lambda camera: camera.sequence))

    def get(self, id: str) -> KeptCamera:
        """One; NotFound, or DamagedFile."""
        record = self._records.read(f"{id}.json")
        if record is None:
            raise NotFound(f"There is no camera called {id!r}.", "List them with GET /api/v1/cameras.",
                           reason="unknown-camera")
        return KeptCamera(id, record["camera"], record["sequence"], record["revision"], record["updated_at"])

    def add(self, id: str, body: Mapping[str, Any]) -> KeptCamera:
        """A new one; Conflict where the id is taken."""
        with self._lock:
            if f"{id}.json" in self._records.names():
                raise Conflict(f"There is already a camera called {id!r}.", "Choose another id, or change that one.",
                               reason="camera-exists")
            sequence = 1 + max([0, *(camera.sequence for camera in self.all())])
            return self._write(KeptCamera(id, dict(body), sequence, 1, stamp(self._clock)))

    def save(self, id: str, body: Mapping[str, Any], etag: str) -> KeptCamera:
        """In place of the one with that ETag; Stale where somebody else was faster."""
        with self._lock:
            current = self._current(id, etag)
            return self._write(KeptCamera(id, dict(body), current.sequence, current.revision + 1, stamp(self._clock)))

    def remove(self, id: str, etag: str | None = None) -> None:
        """Forget the one with that ETag (None: whichever), and its evidence; its calibrations stay."""
        with self._lock:
            self._current(id, etag)
            with keeping("The deletion"):
                for records in (self._identities, self._records):
                    (records.folder / f"{id}.json").unlink(missing_ok=True)
                    flush_folder(records.folder)

    def identity(self, id: str) -> dict[str, Any] | None:
        """The evidence that was confirmed last; None before that, or where it was damaged."""
        with suppress(DamagedFile):
            record = self._identities.read(f"{id}.json")
            return None if record is None else record["evidence"]
        return None

    def confirm(self, id: str, evidence: Mapping[str, Any]) -> None:
        """From now on this is the camera that the id means."""
        with self._lock:
            self._identities.write(f"{id}.json", {"confirmed_at": stamp(self._clock), "evidence": dict(evidence)},
                                   "The camera's identity")

    def _current(self, id: str, etag: str | None) -> KeptCamera:
        current = self.get(id)
        if etag is not None and etag != current.etag:
            raise Stale("Somebody else has changed this camera since you opened it.",
                        "Look at it again, then change it.", reason="stale-camera", current=dict(current.body),
                        etag=current.etag)
        return current

    def _write(self, camera: KeptCamera) -> KeptCamera:
        self._records.write(f"{camera.id}.json", {"sequence": camera.sequence, "revision": camera.revision,
                                                  "updated_at": camera.updated_at, "camera": dict(camera.body)},
                            "The camera")
        return camera
