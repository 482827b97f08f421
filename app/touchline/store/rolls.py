"""Rolls: the straight tracks that a ball has left before a camera; what they mean is the business of their readers."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from sqlalchemy import delete, func, select

from touchline.core.statements import say
from touchline.store.checksummed import checksummed, content, json_text
from touchline.store.repository import Repository, check_etag, content_etag, timestamp
from touchline.store.tables import RollRow

MAX_ROLLS = 300  # of one camera: with more nothing is known better; the oldest go


class RollRepository(Repository):
    """Rolls by camera. revision: another number after every change, by whomever."""

    table, noun = RollRow, "roll"
    listing = "List them with GET /api/v1/cameras/{id}/rolls."
    revision = 0

    def add(self, camera: str, id: str, roll: Mapping[str, Any]) -> bool:
        """Save one, plain JSON, under an id that its finder gave it; False where two have seen the same one."""
        saved = {**roll, "id": id, "camera": camera, "kept_at": timestamp(self._clock), "left_out": False}
        with self._database.writing("The roll") as rows:
            if rows.scalar(select(RollRow.id).where(RollRow.id == id)) is not None:
                return False
            rows.add(checksummed(RollRow, saved, "The roll", id=id, camera=camera))
            rows.flush()
            mine = select(RollRow.sequence).where(RollRow.camera == camera)
            if (rows.scalar(select(func.count()).select_from(mine.subquery())) or 0) > MAX_ROLLS:
                oldest = mine.order_by(RollRow.sequence.desc()).offset(MAX_ROLLS)
                rows.execute(delete(RollRow).where(RollRow.sequence.in_(oldest)))
        self.revision += 1
        return True

    def of(self, camera: str) -> tuple[dict[str, Any], ...]:
        """Return a camera's, oldest first, without damaged ones."""
        query = select(RollRow).where(RollRow.camera == camera, RollRow.damaged.is_(None)).order_by(RollRow.sequence)
        return self._intact(self._find(query), lambda row: content(self._checked(row)))

    def leave_out(self, camera: str, id: str, left_out: bool, etag: str | None = None) -> dict[str, Any]:
        """Save whether an operator wants the one with that ETag (None: whichever) left out; NotFound, or Stale."""
        with self._changing("The roll", id, RollRow.camera == camera) as (_, row):
            _check([content(row)], etag)
            saved = {**content(row), "left_out": left_out}
            row.body = json_text(saved, "The roll")
        self.revision += 1
        return saved

    def delete(self, camera: str, id: str, etag: str | None = None) -> None:
        """Delete the one with that ETag (None: whichever); NotFound, or Stale."""
        with self._changing("The deletion", id, RollRow.camera == camera) as (rows, row):
            _check([content(row)], etag)
            rows.delete(row)
        self.revision += 1

    def clear(self, camera: str, etag: str | None = None) -> None:
        """Delete all of a camera's; Stale unless all together have that ETag (None: whichever)."""
        with self._database.writing("The deletion") as rows:
            _check(self.of(camera) if etag is not None else (), etag)
            rows.execute(delete(RollRow).where(RollRow.camera == camera, RollRow.damaged.is_(None)))
        self.revision += 1


def rolls_etag(rolls: Iterable[Mapping[str, Any]]) -> str:
    """Return the ETag of one roll or of several together: all else of a roll never changes."""
    return content_etag([[roll["id"], roll["left_out"]] for roll in rolls])


def _check(rolls: Sequence[Mapping[str, Any]], etag: str | None) -> None:
    now = [{"id": roll["id"], "left_out": roll["left_out"]} for roll in rolls]
    what = say("stale.rolls", "Another user has changed these rolls since you opened them.")
    check_etag(etag, rolls_etag(rolls), what, "stale-rolls", now)
