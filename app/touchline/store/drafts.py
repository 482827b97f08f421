"""Drafts: an operator's work in progress on one snapshot, saved only over the draft that it was made from.

A draft that was never saved is the empty one, with an ETag of its own: the first save names that one.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from typing import Any

from sqlalchemy import select

from touchline.core.statements import say
from touchline.store.checksummed import checksummed, content
from touchline.store.quarantine import DamagedFile
from touchline.store.repository import Repository, StoreContext, check_etag, timestamp
from touchline.store.snapshots import SnapshotRepository
from touchline.store.tables import DraftRow

EMPTY: Mapping[str, Any] = {"field": None, "region": None, "rotate": None, "model": None, "options": {},
                            "observations": []}


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
            row = rows.scalar(select(DraftRow).where(DraftRow.snapshot == snapshot).with_for_update())
            current = self._read(row, snapshot)
            check_etag(etag, current.etag, say("stale.draft", "Another user has saved this draft since you opened it."),
                       "stale-draft", current.to_json(),
                       say("stale.compare-drafts", "Compare it with the current draft, then overwrite it."))
            draft = Draft(snapshot, dict(body), current.revision + 1, timestamp(self._clock), by)
            record = {"revision": draft.revision, "updated_at": draft.updated_at, "updated_by": by, "draft": draft.body}
            rows.merge(checksummed(DraftRow, record, "The draft", snapshot=snapshot, revision=draft.revision,
                                   is_begun=bool(draft.body.get("observations"))))
        return draft

    def _read(self, row: DraftRow | None, snapshot: str) -> Draft:
        if row is None:
            return Draft(snapshot, EMPTY)
        try:
            record = content(self._checked(row))
        except DamagedFile as lost:
            place = lost.details["file"]
            return Draft(snapshot, EMPTY, notice=f"The saved draft was damaged and was moved to {place}.")
        return Draft(snapshot, record["draft"], record["revision"], record["updated_at"], record["updated_by"])
