"""Snapshots: stored pictures with their original bytes and a record of each, and operators' drafts on them.

    pictures/SHA256.FORMAT     the bytes as they came; the same picture twice is one file
    the table of snapshots     what the picture is; its row is written last, so a row always has its picture

A draft that was never saved is the empty one, with an ETag of its own: the first save names that one.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from hashlib import sha256
from pathlib import Path
from threading import RLock
from typing import Any

from sqlalchemy import ColumnElement, delete, func, select
from sqlalchemy.orm import Session

from touchline.core.geometry import ImageSize
from touchline.core.statements import say
from touchline.store.files import cannot_read, make_folder, remove_temporary_files, write_atomically
from touchline.store.integrity import checksummed, content, json_text
from touchline.store.quarantine import Damage, DamagedFile
from touchline.store.repository import (
    Page,
    Repository,
    StoreContext,
    check_etag,
    column_text,
    new_id,
    timestamp,
)
from touchline.store.tables import CalibrationRow, DraftRow, LensRow, SnapshotRow

EMPTY: Mapping[str, Any] = {
    "field": None,
    "region": None,
    "rotate": None,
    "model": None,
    "options": {},
    "observations": [],
}


@dataclass(frozen=True)
class Snapshot:
    """A stored picture. format: "png", "jpeg", "bmp" or "webp", of the bytes as they came.

    purpose: "picture" of a field, of a "board", of "straight" edges, for a "rig" or for detection ("seeing").
    name: what its file was called, "" without one.
    """

    id: str
    width: int
    height: int
    camera: str | None
    taken_at: str  # ISO 8601, UTC
    sha256: str
    format: str
    purpose: str = "picture"
    name: str = ""

    @property
    def size(self) -> ImageSize:
        return ImageSize(self.width, self.height)

    @property
    def file(self) -> str:
        """Its picture's name in pictures/."""
        return f"{self.sha256}.{self.format}"

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


class SnapshotRepository(Repository):
    """Snapshots and their files. quota: how much of the disk the pictures may take."""

    table, noun = SnapshotRow, "snapshot"
    listing = "List them with GET /api/v1/snapshots, or send the image again."

    def __init__(self, store: StoreContext) -> None:
        super().__init__(store)
        self._pictures = make_folder(store.folder / "pictures")
        self._quota = store.quota
        # a file that is about to get its row must not be removed as one that has none
        self._files = RLock()
        remove_temporary_files(self._pictures)
        self._quota.count(self._pictures)

    def add(
        self,
        data: bytes,
        size: ImageSize,
        format: str,
        camera: str | None = None,
        purpose: str = "picture",
        name: str = "",
        taken_at: str | None = None,
    ) -> Snapshot:
        """Save a picture that images/ has decoded, format "png", "jpeg", "bmp" or "webp"; DiskFull without space.

        taken_at: of a picture that was made of another one; else now.
        """
        digest = hashlib.sha256(data).hexdigest()
        snapshot = Snapshot(
            new_id(),
            size.width,
            size.height,
            camera,
            taken_at or timestamp(self._clock),
            digest,
            format,
            purpose,
            name,
        )
        path = self.path(snapshot)
        with self._files:
            with self._database.failures.noted("The snapshot"):
                if not _contains(path, digest):
                    self._free_space(len(data))
                    write_atomically(path, data)
                    self._quota.added(len(data))
            with self._database.writing("The snapshot") as rows:
                rows.add(
                    checksummed(
                        SnapshotRow,
                        snapshot.to_json(),
                        "The snapshot",
                        id=snapshot.id,
                        picture=snapshot.file,
                        purpose=column_text(purpose),
                    )
                )
        return snapshot

    def get(self, id: str) -> Snapshot:
        """Return one by its id; NotFound, or DamagedFile."""
        return _read(self._row(id))

    def path(self, snapshot: Snapshot) -> Path:
        """Return where a snapshot's bytes are, for another process that reads them and checks their sha256 itself."""
        return self._pictures / snapshot.file

    def for_job(self, id: str, name: str = "") -> dict[str, str]:
        """Return {"name", "path", "sha256"}, with which a job in another process calls read_checked; NotFound.

        name: for its errors; the id where there is none.
        """
        snapshot = self.get(id)
        return {"name": name or id, "path": str(self.path(snapshot)), "sha256": snapshot.sha256}

    def all_for_job(self, ids: Iterable[str]) -> Sequence[dict[str, str]]:
        """Return the same for several, called "image 1" and so on."""
        return [self.for_job(id, f"image {number}") for number, id in enumerate(ids, 1)]

    def picture(self, id: str) -> bytes:
        """Return the bytes as they came, checked; they are a stranger's, so only images/ decodes them."""
        snapshot = self.get(id)
        path = self.path(snapshot)
        try:
            data = path.read_bytes()
        except OSError as error:
            if self._quarantine.has(self._pictures.name, path.name):
                raise DamagedFile(Damage(self._pictures.name, path.name)) from None
            refusal = cannot_read("the image", error)
            self._database.failures.note(refusal)
            raise refusal from None
        if hashlib.sha256(data).hexdigest() != snapshot.sha256:
            raise self._quarantine.move(path, "its checksum is wrong")
        return data

    def list(
        self,
        limit: int = 50,
        cursor: str | None = None,
        purpose: str | None = None,
        camera: str | None = None,
    ) -> Page[Snapshot]:
        """Return a page, newest first, of one purpose, of one camera or of all, without damaged ones."""
        where = [] if purpose is None else [SnapshotRow.purpose == column_text(purpose)]
        if camera is not None:  # only the body names it; LIKE would not tell North from north
            entry = json_text({"camera": camera}, "The camera")[1:-1]
            where.append(func.replace(SnapshotRow.body, entry, "") != SnapshotRow.body)
        return self._page(limit, cursor, _read, *where)

    def lost(self) -> frozenset[str]:
        """Return the names of pictures that are gone: no file is there, and none was moved to the quarantine."""
        with self._database.reading() as rows:
            known = set(
                rows.scalars(
                    select(SnapshotRow.picture).where(SnapshotRow.damaged.is_(None)).distinct()
                )
            )
        there = {path.name for path in self._pictures.iterdir()}
        moved = {
            damage.name for damage in self._quarantine.all() if damage.kind == self._pictures.name
        }
        return frozenset(known - there - moved)

    def _free_space(self, size_bytes: int) -> None:
        """Delete the oldest pictures that nothing needs until so many bytes fit in; DiskFull if they cannot."""
        self._quota.check_free()
        if self._quota.over_by(size_bytes) > 0:
            self._remove_files_without_rows()
        while self._quota.over_by(size_bytes) > 0:
            self._delete_oldest()

    def _delete_oldest(self) -> None:
        """Delete the oldest that nothing needs; DiskFull without one.

        It is chosen where it is deleted: its first click may be on its way. The row goes first: the other way round, a
        kill in between would leave a row without its picture.
        """
        with self._database.writing("The deletion") as rows:
            unneeded = select(SnapshotRow).where(*_unneeded(rows))
            row = rows.scalar(unneeded.order_by(SnapshotRow.sequence).limit(1))
            if row is None:
                raise self._quota.refusal()
            picture = row.picture
            rows.execute(delete(DraftRow).where(DraftRow.snapshot == row.id))
            rows.execute(delete(SnapshotRow).where(SnapshotRow.sequence == row.sequence))
            others = rows.scalar(select(func.count()).where(SnapshotRow.picture == picture))
        if others == 0:
            self._remove(self._pictures / picture)

    def _remove_files_without_rows(self) -> None:
        """Remove what a kill between a file and its row has left, only for want of space: a backup may lack rows."""
        with self._database.reading() as rows:
            known = set(rows.scalars(select(SnapshotRow.picture).distinct()))
        for path in self._pictures.iterdir():
            if path.name not in known:
                self._remove(path)

    def _remove(self, path: Path) -> None:
        size_bytes = path.stat().st_size if path.exists() else 0
        path.unlink(missing_ok=True)
        self._quota.added(-size_bytes)


def _unneeded(rows: Session) -> list[ColumnElement[bool]]:
    """Return the conditions for snapshots that no calibration (deleted ones too), begun draft or lens uses."""
    used = select(CalibrationRow.snapshot).where(CalibrationRow.snapshot.is_not(None))
    begun = select(DraftRow.snapshot).where(DraftRow.is_begun)
    boards: set[str] = set()
    for lens in rows.scalars(select(LensRow).where(LensRow.damaged.is_(None))):
        boards.update(content(lens).get("snapshots") or ())
    return [
        SnapshotRow.damaged.is_(None),
        SnapshotRow.id.not_in(used),
        SnapshotRow.id.not_in(begun),
        SnapshotRow.id.not_in(boards),
    ]


def _read(row: SnapshotRow) -> Snapshot:
    return Snapshot(**content(row))


def _contains(path: Path, digest: str) -> bool:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest() == digest
    except FileNotFoundError:
        return False


@dataclass(frozen=True)
class Draft:
    """One state of a draft. etag: bare, without the quotes of the HTTP header; different after every save.

    notice: for the operator, that an earlier draft was damaged and where it is; None otherwise.
    """

    snapshot: str
    body: Mapping[str, Any]
    revision: int = 0
    updated_at: str | None = None  # None: never saved
    updated_by: str | None = None
    notice: str | None = None

    @property
    def etag(self) -> str:
        # The content as well as the number: a number alone would come again after a restored backup.
        content = json.dumps(self.body, sort_keys=True).encode()
        return f"{self.revision}-{sha256(content).hexdigest()[:12]}"

    def to_json(self) -> dict[str, Any]:
        more = {} if self.notice is None else {"notice": self.notice}
        return {**self.body, "updated_at": self.updated_at, "updated_by": self.updated_by, **more}


class DraftRepository(Repository):
    """Drafts by snapshot."""

    table = DraftRow

    def __init__(self, store: StoreContext, snapshots: SnapshotRepository) -> None:
        super().__init__(store)
        self._snapshots = snapshots

    def get(self, snapshot: str) -> Draft:
        """Return the draft as it was saved last, EMPTY before that; NotFound for an unknown snapshot.

        For a damaged one it is EMPTY with a notice.
        """
        self._snapshots.get(snapshot)
        with self._database.reading() as rows:
            row = rows.get(DraftRow, snapshot)
        return self._read(row, snapshot)

    def save(self, snapshot: str, body: Mapping[str, Any], etag: str, by: str = "") -> Draft:
        """Save over the draft with that ETag; Stale, with `current` and `etag` in its details, if that is old."""
        self.get(snapshot)  # a damaged one goes to the quarantine before it is written over
        with self._database.writing("The draft") as rows:
            row = rows.scalar(
                select(DraftRow).where(DraftRow.snapshot == snapshot).with_for_update()
            )
            current = self._read(row, snapshot)
            check_etag(
                etag,
                current.etag,
                say("stale.draft", "Another user has saved this draft since you opened it."),
                "stale-draft",
                current.to_json(),
                say(
                    "stale.compare-drafts", "Compare it with the current draft, then overwrite it."
                ),
            )
            draft = Draft(snapshot, dict(body), current.revision + 1, timestamp(self._clock), by)
            record = {
                "revision": draft.revision,
                "updated_at": draft.updated_at,
                "updated_by": by,
                "draft": draft.body,
            }
            rows.merge(
                checksummed(
                    DraftRow,
                    record,
                    "The draft",
                    snapshot=snapshot,
                    revision=draft.revision,
                    is_begun=bool(draft.body.get("observations")),
                )
            )
        return draft

    def _read(self, row: DraftRow | None, snapshot: str) -> Draft:
        if row is None:
            return Draft(snapshot, EMPTY)
        try:
            record = content(self._checked(row))
        except DamagedFile as lost:
            place = lost.details["file"]
            return Draft(
                snapshot, EMPTY, notice=f"The saved draft was damaged and was moved to {place}."
            )
        return Draft(
            snapshot,
            record["draft"],
            record["revision"],
            record["updated_at"],
            record["updated_by"],
        )
