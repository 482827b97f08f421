"""Calibrations: immutable versions, counted for each camera, of which one may be its camera's active one.

No camera at all counts as a camera: uploaded pictures have versions too. In the database a camera's name is a hash,
since a name may be anything; the version's body has it in words.
"""

from collections.abc import Iterator
from dataclasses import replace
from hashlib import sha256
from typing import Any

from sqlalchemy import ColumnElement, func, select
from sqlalchemy.orm import Session

from app.core.errors import Conflict, NotFound
from app.core.records import Calibration
from app.store.checksummed import as_text, content, is_whole, resealed, sealed
from app.store.repository import Page, Shelf, column, new_id, stamp
from app.store.tables import ActivationRow, ActiveRow, CalibrationRow

ACTIVE = ',"active":{},"field_definition":'  # within Calibration.to_json()


def camera_key(camera: str | None) -> str:
    """A camera's name as the database has it."""
    return sha256(b"" if camera is None else b"camera " + camera.encode("utf-8", "surrogatepass")).hexdigest()[:12]


class Calibrations(Shelf):
    """The shelf of calibrations. Thread-safe."""

    table = CalibrationRow
    kind = "calibrations"

    def add(self, calibration: Calibration, made_by: str = "") -> Calibration:
        """Keep a new version: its id, version, date and maker are given here. On return it is safe on disk."""
        key = camera_key(calibration.camera)
        with self._database.writing("The calibration") as rows:
            last = rows.scalar(select(func.max(CalibrationRow.version)).where(CalibrationRow.camera_key == key))
            kept = replace(calibration, id=new_id(), version=(last or 0) + 1, created_at=stamp(self._clock),
                           made_by=made_by, active=False)
            rows.add(calibration_row(kept))
        return kept

    def get(self, id: str) -> Calibration:
        """One version by its id; NotFound, or DamagedFile."""
        row = self.row(id, unknown_calibration, CalibrationRow.deleted_at.is_(None))
        return self._read(row, self._active_ids(row.camera_key))

    def list(self, camera: str | None = None, limit: int = 50, cursor: str | None = None) -> Page[Calibration]:
        """Newest first, of one camera or of all. Damaged ones are not among them; Store.damaged names those."""
        active = self._active_ids()
        return self.page(limit, cursor, lambda row: self._read(row, active), *_shown(camera))

    def texts(self, camera: str | None = None, limit: int = 50, cursor: str | None = None) -> Page[str]:
        """The same as JSON, without reading numbers only to write them again: a tenth of the time."""
        active = self._active_ids()
        return self.page(limit, cursor, lambda row: _text(row, row.id in active), *_shown(camera))

    def delete(self, id: str) -> None:
        """Take a version off the shelf; Conflict while it is its camera's active one. Its number is not used again."""
        self.row(id, unknown_calibration, CalibrationRow.deleted_at.is_(None))
        with self._database.writing("The deletion") as rows:
            if rows.scalar(select(ActiveRow.camera_key).where(ActiveRow.calibration == id)) is not None:
                raise Conflict("This calibration is its camera's active one.", "Activate another version first.",
                               reason="calibration-active")
            there = select(CalibrationRow).where(CalibrationRow.id == id, CalibrationRow.deleted_at.is_(None))
            row = rows.scalar(there)
            if row is None:
                raise unknown_calibration(id)  # somebody else deleted it a moment ago
            row.deleted_at = stamp(self._clock)
            resealed(row)

    def restore(self, id: str) -> Calibration:
        """Put a version that was taken off back on the shelf, as it was; one that stands there stays."""
        self.row(id, unknown_calibration)
        with self._database.writing("The undoing of the deletion") as rows:
            row = rows.scalar(select(CalibrationRow).where(CalibrationRow.id == id))
            row.deleted_at = None
            resealed(row)
        return self.get(id)

    def annotate(self, id: str, note: str) -> Calibration:
        """Change the remark beside a version. It is all that is ever changed of one: no number rests on it."""
        kept = self.get(id)
        with self._database.writing("The note") as rows:
            there = select(CalibrationRow).where(CalibrationRow.id == id, CalibrationRow.deleted_at.is_(None))
            row = rows.scalar(there)
            if row is None:
                raise unknown_calibration(id)  # deleted a moment ago
            row.body = as_text(replace(kept, note=note, active=False).to_json(), "The note")
            resealed(row)
        return self.get(id)

    def activate(self, id: str, by: str = "") -> Calibration:
        """Make a version its camera's; the former one stays on the shelf, and the history says who did it and when."""
        row = self.row(id, unknown_calibration, CalibrationRow.deleted_at.is_(None))  # no damaged one can be activated
        with self._database.writing("The choice of the active calibration") as rows:
            here = select(CalibrationRow.id).where(CalibrationRow.id == id, CalibrationRow.deleted_at.is_(None))
            if rows.scalar(here) is None:
                raise unknown_calibration(id)  # deleted a moment ago
            put_active(rows, row.camera_key, id, stamp(self._clock), by)
        return self._read(row, {id})

    def active(self, camera: str | None) -> Calibration | None:
        """A camera's active version, None where none was activated."""
        for id in self._active_ids(camera_key(camera)):
            return self.get(id)
        return None

    def history(self, camera: str | None, limit: int = 50) -> tuple[dict[str, Any], ...]:
        """What was active before: {"calibration", "at", "by"}, newest first."""
        wanted = (select(ActivationRow).where(ActivationRow.camera_key == camera_key(camera))
                  .order_by(ActivationRow.sequence.desc()).limit(limit))
        with self._database.reading() as rows:
            return tuple({"calibration": row.calibration, "at": row.at, "by": row.by} for row in rows.scalars(wanted))

    def _read(self, row: CalibrationRow, active: set[str]) -> Calibration:
        return Calibration.from_json(content(row)).activated(row.id in active)

    def _active_ids(self, key: str | None = None) -> set[str]:
        """The active versions' ids, of one camera or of all."""
        wanted = select(ActiveRow).where(ActiveRow.damaged.is_(None))
        if key is not None:
            wanted = wanted.where(ActiveRow.camera_key == key)
        with self._database.reading() as rows:
            found = list(rows.scalars(wanted))
        return {row.calibration for row in found if self._active_is_whole(row)}

    def _active_is_whole(self, row: ActiveRow) -> bool:
        """A choice that is damaged is told, and then nothing is active: the versions themselves are all there."""
        if is_whole(row):
            return True
        self.put_aside(row, row.camera_key, "active")
        return False


def _shown(camera: str | None) -> Iterator[ColumnElement[bool]]:
    """What a list shows, of one camera or of all."""
    yield CalibrationRow.deleted_at.is_(None)
    if camera is not None:
        yield CalibrationRow.camera_key == camera_key(camera)


def _text(row: CalibrationRow, active: bool) -> str:
    """A version's JSON as it was saved, but for whether it is active now."""
    before, mark, after = row.body.rpartition(ACTIVE.format("false"))
    assert mark, "a version is kept as inactive"
    return before + ACTIVE.format("true" if active else "false") + after


def calibration_row(kept: Calibration, deleted_at: str | None = None) -> CalibrationRow:
    """A version as the database has it."""
    return sealed(CalibrationRow, kept.to_json(), "The calibration", id=kept.id, camera_key=camera_key(kept.camera),
                  version=kept.version, parent=column(kept.parent), snapshot=column(kept.snapshot),
                  software=column(kept.software), created_at=column(kept.created_at), made_by=column(kept.made_by),
                  deleted_at=deleted_at)


def put_active(rows: Session, key: str, id: str, at: str, by: str) -> None:
    """Within a transaction: this version is that camera's from now on."""
    chosen = {"camera_key": key, "calibration": id}
    rows.merge(sealed(ActiveRow, chosen, "The choice of the active calibration", **chosen))
    rows.add(ActivationRow(camera_key=key, calibration=id, at=at, by=by))


def unknown_calibration(id: str) -> NotFound:
    return NotFound(f"There is no calibration {id!r}.", "List them with GET /api/v1/calibrations.",
                    reason="unknown-calibration")
