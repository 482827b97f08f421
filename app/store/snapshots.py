"""Snapshots: pictures that are kept, the original bytes under their own checksum, and a record of each.

    pictures/SHA256.FORMAT        the bytes as they came; the same picture twice is one file
    snapshots/SEQUENCE.ID.json    what the picture is; written last, so a record always has its picture
"""

import hashlib
import re
from dataclasses import asdict, dataclass
from pathlib import Path
from threading import Lock
from typing import Any

from app.errors import NotFound, Unavailable
from app.geometry import ImageSize
from app.store.files import keeping, make_folder, sweep, write_whole
from app.store.quarantine import Damage, DamagedFile, Quarantine
from app.store.records import Records
from app.store.shelf import Clock, Page, new_id, page, readable, stamp
from app.wording import sentence

NAME = re.compile(r"(?P<sequence>[0-9]{10})\.(?P<id>[0-9a-f]{16})\.json")


@dataclass(frozen=True)
class Snapshot:
    """A kept picture. format: "png", "jpeg", "bmp" or "webp", of the bytes as they came.

    purpose: what it was taken for: "picture" of a field, of a "board", or of "straight" edges.
    """

    id: str
    width: int
    height: int
    camera: str | None
    taken_at: str  # ISO 8601, UTC
    sha256: str
    format: str
    purpose: str = "picture"

    @property
    def size(self) -> ImageSize:
        return ImageSize(self.width, self.height)

    @property
    def media_type(self) -> str:
        return f"image/{self.format}"

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


class Snapshots:
    """The shelf of snapshots. Thread-safe."""

    def __init__(self, folder: Path, quarantine: Quarantine, clock: Clock) -> None:
        self._records = Records(folder / "snapshots", quarantine)
        self._pictures = make_folder(folder / "pictures")
        self._quarantine = quarantine
        self._clock = clock
        self._lock = Lock()
        sweep(self._pictures)
        self._sequences = _sequences(self._records.names())
        self._damaged = _sequences(quarantine.names("snapshots"))
        self._purposes: dict[str, str] = {}
        self._last = max([0, *self._sequences.values(), *self._damaged.values()])

    def add(self, data: bytes, size: ImageSize, format: str, camera: str | None = None,
            purpose: str = "picture") -> Snapshot:
        """Keep a picture that images.py has decoded; on return it is safe on disk."""
        digest = hashlib.sha256(data).hexdigest()
        snapshot = Snapshot(new_id(), size.width, size.height, camera, stamp(self._clock), digest, format,
                            purpose)
        with self._lock:
            self._last += 1  # a number is never used twice, not even after a failure
            sequence = self._last
        path = self._pictures / f"{digest}.{format}"
        if not _holds(path, digest):
            with keeping("The snapshot"):
                write_whole(path, data)
        self._records.write(f"{sequence:010d}.{snapshot.id}.json", snapshot.to_json(), "The snapshot")
        with self._lock:
            self._sequences[snapshot.id] = sequence
        return snapshot

    def get(self, id: str) -> Snapshot:
        """One by its id; NotFound, or DamagedFile."""
        if id in self._damaged:
            raise DamagedFile(Damage("snapshots", _name(self._damaged[id], id)))
        if id not in self._sequences:
            raise _unknown(id)
        try:
            record = self._records.read(_name(self._sequences[id], id))
        except DamagedFile:
            self._damaged[id] = self._sequences[id]
            raise
        if record is None:
            raise _unknown(id)
        return Snapshot(**record)

    def _purpose(self, id: str) -> str | None:
        """Read once: it never changes."""
        if id not in self._purposes:
            for snapshot in readable(self.get, (id,)):
                self._purposes[id] = snapshot.purpose
        return self._purposes.get(id)

    def path(self, snapshot: Snapshot) -> Path:
        """Where a snapshot's bytes stand."""
        return self._pictures / f"{snapshot.sha256}.{snapshot.format}"

    def picture(self, id: str) -> bytes:
        """The bytes as they came, checked against their checksum."""
        snapshot = self.get(id)
        path = self.path(snapshot)
        try:
            data = path.read_bytes()
        except FileNotFoundError:
            raise DamagedFile(Damage("pictures", path.name)) from None
        if hashlib.sha256(data).hexdigest() != snapshot.sha256:
            raise self._quarantine.take(path, "its checksum is wrong")
        return data

    def list(self, limit: int = 50, cursor: str | None = None, purpose: str | None = None) -> Page[Snapshot]:
        """Newest first, of one purpose or of all. Damaged ones are not among them; Store.damaged names those."""
        with self._lock:
            ids = {sequence: id for id, sequence in self._sequences.items() if id not in self._damaged}
        if purpose is not None:
            ids = {sequence: id for sequence, id in ids.items() if self._purpose(id) == purpose}
        shown, following = page(ids, limit, cursor)
        return Page(tuple(readable(self.get, (ids[sequence] for sequence in shown))), following)


def checked_bytes(name: str, path: str, sha256: str) -> bytes:
    """A kept picture's bytes, read by another process than the one that holds the store. name: for the refusal."""
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise Unavailable(sentence(f"{name} cannot be read: {error.strerror}."), "Upload it again.",
                          reason="damaged-file") from None
    if hashlib.sha256(data).hexdigest() != sha256:
        raise Unavailable(sentence(f"{name} is damaged."), "Upload it again.", reason="damaged-file")
    return data


def _name(sequence: int, id: str) -> str:
    return f"{sequence:010d}.{id}.json"


def _sequences(names: Any) -> dict[str, int]:
    found = (NAME.match(name) for name in names)
    return {match["id"]: int(match["sequence"]) for match in found if match}


def _holds(path: Path, digest: str) -> bool:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest() == digest
    except FileNotFoundError:
        return False


def _unknown(id: str) -> NotFound:
    return NotFound(f"There is no snapshot {id!r}.", "List them with GET /api/v1/snapshots, or send the picture again.",
                    reason="unknown-snapshot")
