"""Lenses from boards: records that are written once, read, and deleted."""

from collections.abc import Mapping
from typing import Any

from touchline.core.statements import say
from touchline.store.checksummed import checksummed, content
from touchline.store.repository import Page, Repository, check_etag, content_etag, new_id, timestamp
from touchline.store.tables import LensRow


class LensRepository(Repository):
    """Lenses as a board calibration answered them. A calibration that took one over has a copy of its own."""

    table, noun = LensRow, "lens"
    listing = "List them with GET /api/v1/lenses."

    def add(self, lens: Mapping[str, Any]) -> dict[str, Any]:
        """Save a lens, plain JSON; its id and date are given here."""
        saved = {**lens, "id": new_id(), "created_at": timestamp(self._clock)}
        with self._database.writing("The lens") as rows:
            rows.add(checksummed(LensRow, saved, "The lens", id=saved["id"]))
        return saved

    def get(self, id: str) -> dict[str, Any]:
        """Return one by its id; NotFound, or DamagedFile."""
        return content(self._row(id))

    def list(self, limit: int = 50, cursor: str | None = None) -> Page[dict[str, Any]]:
        """Return a page, newest first, without damaged ones."""
        return self._page(limit, cursor, content)

    def delete(self, id: str, etag: str | None = None) -> None:
        """Delete the lens with that ETag (None: whichever); NotFound, or Stale."""
        with self._changing("The deletion", id) as (rows, row):
            lens = content(row)
            check_etag(etag, content_etag(lens), say("stale.lens", "This is another lens than the one you opened."),
                       "stale-lens", {"id": id})
            rows.delete(row)
