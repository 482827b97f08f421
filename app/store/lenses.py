"""Lenses from boards: records that are written once, read, and deleted."""

from collections.abc import Mapping
from typing import Any

from sqlalchemy import delete

from app.core.errors import NotFound
from app.store.checksummed import content, sealed
from app.store.repository import Page, Shelf, new_id, stamp
from app.store.tables import LensRow


class Lenses(Shelf):
    """The shelf of lenses. Thread-safe. A calibration that held one has a copy of its own."""

    table = LensRow
    kind = "lenses"

    def add(self, lens: Mapping[str, Any]) -> dict[str, Any]:
        """Keep a lens, plain JSON; its id and date are given here. On return it is safe on disk."""
        kept = {**lens, "id": new_id(), "created_at": stamp(self._clock)}
        with self._database.writing("The lens") as rows:
            rows.add(lens_row(kept))
        return kept

    def get(self, id: str) -> dict[str, Any]:
        """One by its id; NotFound, or DamagedFile."""
        return content(self.row(id, _unknown))

    def list(self, limit: int = 50, cursor: str | None = None) -> Page[dict[str, Any]]:
        """Newest first. Damaged ones are not among them; Store.damaged names those."""
        return self.page(limit, cursor, content)

    def delete(self, id: str) -> None:
        """Forget a lens; NotFound."""
        with self._database.writing("The deletion") as rows:
            done = rows.execute(delete(LensRow).where(LensRow.id == id, LensRow.damaged.is_(None)))
            if done.rowcount == 0:
                raise _unknown(id)


def lens_row(kept: Mapping[str, Any]) -> LensRow:
    """A lens as the database has it."""
    return sealed(LensRow, kept, "The lens", id=kept["id"])


def _unknown(id: str) -> NotFound:
    return NotFound(f"There is no lens {id!r}.", "List them with GET /api/v1/lenses.", reason="unknown-lens")
