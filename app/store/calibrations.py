"""Calibrations: immutable versions, counted for each camera, of which one may be its camera's active one.

    calibrations/SEQUENCE.CAMERA.VERSION.ID.json    one version, never written again
    deleted/…                                       where a deleted one goes, so that its number is not used again
    active/active.json                              which version is active for which camera

No camera at all counts as a camera: uploaded pictures have versions too. In a file name CAMERA is a hash, since a
camera's name may be anything.
"""

import re
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from threading import RLock
from typing import Self

from app.errors import Conflict, NotFound
from app.records import Calibration
from app.store.files import keeping, make_folder, move_whole
from app.store.quarantine import Damage, DamagedFile, Quarantine
from app.store.records import Records
from app.store.shelf import Clock, Page, new_id, page, readable, stamp

NAME = re.compile(r"(?P<sequence>[0-9]{10})\.(?P<camera>[0-9a-f]{12})\."
                  r"(?P<version>[0-9]{6})\.(?P<id>[0-9a-f]{16})\.json")
ACTIVE = "active.json"


def camera_key(camera: str | None) -> str:
    """A camera's name as a part of a file name."""
    return sha256(b"" if camera is None else b"camera " + camera.encode("utf-8", "surrogatepass")).hexdigest()[:12]


@dataclass(frozen=True)
class Entry:
    """What a calibration's file name says."""

    sequence: int
    camera: str
    version: int
    id: str

    @property
    def name(self) -> str:
        return f"{self.sequence:010d}.{self.camera}.{self.version:06d}.{self.id}.json"

    @classmethod
    def table(cls, names: Iterable[str]) -> dict[str, Self]:
        """By id; names that are not ours are left out."""
        found = (NAME.match(name) for name in names)
        entries = [cls(int(m["sequence"]), m["camera"], int(m["version"]), m["id"]) for m in found if m]
        return {entry.id: entry for entry in entries}


class Calibrations:
    """The shelf of calibrations. Thread-safe."""

    def __init__(self, folder: Path, quarantine: Quarantine, clock: Clock) -> None:
        self._records = Records(folder / "calibrations", quarantine)
        self._active_record = Records(folder / "active", quarantine)
        self._deleted = make_folder(folder / "deleted")
        self._clock = clock
        self._lock = RLock()
        self._entries = Entry.table(self._records.names())
        self._damaged = Entry.table(quarantine.names("calibrations"))
        deleted = Entry.table(path.name for path in self._deleted.glob("*.json"))
        self._last = 0
        self._last_version: dict[str, int] = {}
        for entry in (*self._entries.values(), *self._damaged.values(), *deleted.values()):
            self._count(entry)
        self._active = self._read_active()

    def add(self, calibration: Calibration) -> Calibration:
        """Keep a new version: its id, version and date are given here. On return it is safe on disk."""
        with self._lock:
            key = camera_key(calibration.camera)
            entry = Entry(self._last + 1, key, self._last_version.get(key, 0) + 1, new_id())
            self._count(entry)  # a number is never used twice, not even after a failure
        kept = replace(calibration, id=entry.id, version=entry.version, created_at=stamp(self._clock), active=False)
        self._records.write(entry.name, kept.to_json(), "The calibration")
        with self._lock:
            self._entries[entry.id] = entry
        return kept

    def get(self, id: str) -> Calibration:
        """One version by its id; NotFound, or DamagedFile."""
        entry = self._entry(id)
        try:
            record = self._records.read(entry.name)
        except DamagedFile:
            self._damaged[id] = entry
            raise
        if record is None:
            raise _unknown(id)
        return Calibration.from_json(record).activated(self._active.get(entry.camera) == id)

    def list(self, camera: str | None = None, limit: int = 50, cursor: str | None = None) -> Page[Calibration]:
        """Newest first, of one camera or of all. Damaged ones are not among them; Store.damaged names those."""
        with self._lock:
            ids = {entry.sequence: entry.id for entry in self._entries.values()
                   if entry.id not in self._damaged and (camera is None or entry.camera == camera_key(camera))}
        shown, following = page(ids, limit, cursor)
        return Page(tuple(readable(self.get, (ids[sequence] for sequence in shown))), following)

    def delete(self, id: str) -> None:
        """Take a version off the shelf; Conflict while it is its camera's active one."""
        with self._lock:
            entry = self._entry(id)
            if self._active.get(entry.camera) == id:
                raise Conflict("This calibration is its camera's active one.", "Activate another version first.",
                               reason="calibration-active")
            with keeping("The deletion"):
                move_whole(self._records.folder / entry.name, self._deleted / entry.name)
            del self._entries[id]

    def activate(self, id: str) -> Calibration:
        """Make a version its camera's; the former one stays on the shelf."""
        with self._lock:
            calibration = self.get(id)  # a damaged one cannot be activated
            active = {**self._active, self._entry(id).camera: id}
            self._active_record.write(ACTIVE, {"active": active}, "The choice of the active calibration")
            self._active = active
            return calibration.activated(True)

    def active(self, camera: str | None) -> Calibration | None:
        """A camera's active version, None where none was activated."""
        id = self._active.get(camera_key(camera))
        return None if id is None else self.get(id)

    def _entry(self, id: str) -> Entry:
        if id in self._damaged:
            raise DamagedFile(Damage("calibrations", self._damaged[id].name))
        entry = self._entries.get(id)
        if entry is None:
            raise _unknown(id)
        return entry

    def _count(self, entry: Entry) -> None:
        self._last = max(self._last, entry.sequence)
        self._last_version[entry.camera] = max(self._last_version.get(entry.camera, 0), entry.version)

    def _read_active(self) -> dict[str, str]:
        with suppress(DamagedFile):  # told in Store.damaged; the versions themselves are all there
            record = self._active_record.read(ACTIVE)
            return {} if record is None else record["active"]
        return {}


def _unknown(id: str) -> NotFound:
    return NotFound(f"There is no calibration {id!r}.", "List them with GET /api/v1/calibrations.",
                    reason="unknown-calibration")
