"""Taking over a data folder of the former form, in which every record was a file. Nothing is lost or deleted.

    snapshots/SEQUENCE.ID.json   drafts/SNAPSHOT.json   lenses/SEQUENCE.ID.json   cameras/ID.json   identities/ID.json
    calibrations/ and deleted/SEQUENCE.CAMERA.VERSION.ID.json   active/active.json

Everything goes into the database in one transaction; then the folders are moved into former/. A kill in between
leaves both, and the next start takes over what is not there yet. Damaged records go to the quarantine and keep their
number, as they did before.
"""

import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from sqlalchemy import select, text
from sqlalchemy.orm import Session

from app.core.records import Calibration
from app.store.calibrations import calibration_row, put_active
from app.store.cameras import KeptCamera, camera_row, identity_row
from app.store.database import Database
from app.store.drafts import Draft, draft_row
from app.store.files import flush_folder, make_folder, move_whole
from app.store.lenses import lens_row
from app.store.quarantine import DamagedFile, Quarantine
from app.store.records import Records
from app.store.snapshots import Snapshot, snapshot_row
from app.store.tables import (
    ActiveRow,
    CalibrationRow,
    CameraRow,
    DraftRow,
    IdentityRow,
    LensRow,
    SnapshotRow,
)

FOLDERS = ("snapshots", "drafts", "calibrations", "deleted", "active", "lenses", "cameras", "identities")
NUMBERED = re.compile(r"(?P<sequence>[0-9]{10})\.((?P<camera>[0-9a-f]{12})\.(?P<version>[0-9]{6})\.)?"
                      r"(?P<id>[0-9a-f]{16})\.json")
LONG_AGO = "1970-01-01T00:00:00.000Z"  # of things whose date the former form did not keep


def take_over(folder: Path, database: Database, quarantine: Quarantine) -> int:
    """Bring what the former form kept into the database; how many records that were."""
    found = [folder / name for name in FOLDERS if (folder / name).is_dir()]
    if not found:
        return 0
    with database.writing("The former data folder") as rows:
        count = _Former(folder, quarantine, rows).all()
        _count_on(rows, database.is_sqlite)
    former = make_folder(folder / "former")
    for place in found:
        target = former / place.name
        number = 0
        while target.exists():
            number += 1
            target = former / f"{place.name}.{number}"
        move_whole(place, target)
    flush_folder(folder)
    return count


class _Former:
    """One reading of the former files, within one transaction."""

    def __init__(self, folder: Path, quarantine: Quarantine, rows: Session) -> None:
        self._folder = folder
        self._quarantine = quarantine
        self._rows = rows

    def all(self) -> int:
        """In an order in which what is referred to comes first."""
        count = self._numbered("snapshots", SnapshotRow, lambda record, _: snapshot_row(Snapshot(**record)))
        count += self._numbered("calibrations", CalibrationRow, lambda record, _: _calibration(record, None))
        count += self._numbered("deleted", CalibrationRow, lambda record, _: _calibration(record, LONG_AGO))
        count += self._numbered("lenses", LensRow, lambda record, _: lens_row(record))
        self._rows.flush()
        count += self._named("drafts", DraftRow, self._draft)
        count += self._named("cameras", CameraRow, lambda id, r: camera_row(
            KeptCamera(id, r["camera"], r["sequence"], r["revision"], r["updated_at"])))
        count += self._named("identities", IdentityRow,
                             lambda id, r: identity_row(id, r["evidence"], r["confirmed_at"], ""))
        return count + self._active()

    def _numbered(self, kind: str, table: Any, make: Callable[[dict[str, Any], str], Any]) -> int:
        """Records whose file name is their number; the damaged ones keep theirs."""
        count = 0
        for name, record in self._records(kind):
            match = NUMBERED.fullmatch(name)
            if match is None or self._has(table.id, match["id"]):
                continue
            row = make(record, name) if record is not None else _tombstone(table, match)
            row.sequence, row.damaged = int(match["sequence"]), None if record is not None else name
            self._rows.add(row)
            count += 1
        return count

    def _named(self, kind: str, table: Any, make: Callable[[str, dict[str, Any]], Any]) -> int:
        """Records whose file name is what they belong to."""
        count = 0
        key = next(iter(table.__mapper__.primary_key))
        for name, record in self._records(kind):
            id = name.removesuffix(".json")
            row = None if record is None or self._has(key, id) else make(id, record)
            if row is not None:
                self._rows.add(row)
                count += 1
        return count

    def _draft(self, snapshot: str, record: dict[str, Any]) -> DraftRow | None:
        if not self._has(SnapshotRow.id, snapshot):
            return None  # its snapshot was lost: the file stays in former/
        return draft_row(Draft(snapshot, record["draft"], record["revision"], record["updated_at"]))

    def _active(self) -> int:
        count = 0
        for _, record in self._records("active"):
            for key, id in (record or {"active": {}})["active"].items():
                if self._has(CalibrationRow.id, id) and not self._has(ActiveRow.camera_key, key):
                    put_active(self._rows, key, id, LONG_AGO, "")
                    count += 1
        return count

    def _records(self, kind: str) -> Iterator[tuple[str, dict[str, Any] | None]]:
        """Every file of a folder, by name; None for one that is damaged, now or earlier."""
        if (self._folder / kind).is_dir():
            records = Records(self._folder / kind, self._quarantine)
            for name in records.names():
                record = None
                with suppress(DamagedFile):
                    record = records.read(name)
                yield name, record
        for name in self._quarantine.names(kind):
            if not (self._folder / kind / name).exists():
                yield name, None

    def _has(self, column: Any, value: Any) -> bool:
        self._rows.flush()
        return self._rows.scalar(select(column).where(column == value)) is not None


def _calibration(record: dict[str, Any], deleted_at: str | None) -> CalibrationRow:
    return calibration_row(Calibration.from_json(record), deleted_at)


def _tombstone(table: Any, match: re.Match[str]) -> Any:
    """A row that only keeps a damaged record's number."""
    if table is CalibrationRow:
        return CalibrationRow(id=match["id"], camera_key=match["camera"], version=int(match["version"]), software="",
                              created_at=LONG_AGO, made_by="", body="", sha256="")
    more = {"picture": "", "purpose": ""} if table is SnapshotRow else {}
    return table(id=match["id"], body="", sha256="", **more)


def _count_on(rows: Session, is_sqlite: bool) -> None:
    """PostgreSQL counts by itself only what it has numbered by itself."""
    if is_sqlite:
        return
    for table in (SnapshotRow.__tablename__, CalibrationRow.__tablename__, LensRow.__tablename__, "activations"):
        rows.execute(text(f"SELECT setval(pg_get_serial_sequence('{table}', 'sequence'), "
                          f"greatest(1, (SELECT coalesce(max(sequence), 1) FROM {table})))"))
