"""Rolls: the straight tracks that a ball has left before a camera; what they mean is the business of their readers."""

from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from sqlalchemy import delete, func, select

from app.core.errors import NotFound
from app.store.checksummed import as_text, content, resealed, sealed
from app.store.quarantine import DamagedFile
from app.store.repository import Shelf, is_id, stamp
from app.store.tables import RollRow

MOST = 300  # of one camera: with more nothing is known better; the oldest go


class Rolls(Shelf):
    """The shelf of rolls. Thread-safe. revision: another number after every change, by whomever."""

    table = RollRow
    kind = "rolls"
    revision = 0

    def add(self, camera: str, id: str, roll: Mapping[str, Any]) -> bool:
        """Keep one, plain JSON, under an id that its finder gave it; False where two have seen the same one."""
        kept = {**roll, "id": id, "camera": camera, "kept_at": stamp(self._clock), "left_out": False}
        with self._database.writing("The roll") as rows:
            if rows.scalar(select(RollRow.id).where(RollRow.id == id)) is not None:
                return False
            rows.add(roll_row(kept))
            rows.flush()
            mine = select(RollRow.sequence).where(RollRow.camera == camera)
            if (rows.scalar(select(func.count()).select_from(mine.subquery())) or 0) > MOST:
                oldest = mine.order_by(RollRow.sequence.desc()).offset(MOST)
                rows.execute(delete(RollRow).where(RollRow.sequence.in_(oldest)))
        self.revision += 1
        return True

    def of(self, camera: str) -> tuple[dict[str, Any], ...]:
        """A camera's, oldest first; a damaged one is missing here and named in Store.damaged."""
        with self._database.reading() as rows:
            found = list(rows.scalars(select(RollRow).where(RollRow.camera == camera, RollRow.damaged.is_(None))
                                      .order_by(RollRow.sequence)))
        rolls = []
        for row in found:
            with suppress(DamagedFile):
                rolls.append(content(self.checked(row, row.id)))
        return tuple(rolls)

    def leave_out(self, camera: str, id: str, left_out: bool) -> dict[str, Any]:
        """Whether an operator wants it counted; NotFound."""
        self._known(camera, id)
        with self._database.writing("The roll") as rows:
            row = rows.scalar(select(RollRow).where(RollRow.id == id))
            if row is None:
                raise _unknown(id)  # somebody else removed it a moment ago
            kept = {**content(row), "left_out": left_out}
            row.body = as_text(kept, "The roll")
            resealed(row)
        self.revision += 1
        return kept

    def remove(self, camera: str, id: str) -> None:
        """Forget one; NotFound."""
        self._known(camera, id)
        with self._database.writing("The deletion") as rows:
            rows.execute(delete(RollRow).where(RollRow.id == id))
        self.revision += 1

    def clear(self, camera: str) -> None:
        """Forget all of a camera's."""
        with self._database.writing("The deletion") as rows:
            rows.execute(delete(RollRow).where(RollRow.camera == camera, RollRow.damaged.is_(None)))
        self.revision += 1

    def _known(self, camera: str, id: str) -> None:
        if not is_id(id):
            raise _unknown(id)
        self.row(id, _unknown, RollRow.camera == camera)


def roll_row(kept: Mapping[str, Any]) -> RollRow:
    """A roll as the database has it."""
    return sealed(RollRow, kept, "The roll", id=kept["id"], camera=kept["camera"])


def _unknown(id: str) -> NotFound:
    return NotFound(f"There is no roll {id!r}.", "List them with GET /api/v1/cameras/{id}/rolls.",
                    reason="unknown-roll")
