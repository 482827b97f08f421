"""Drafts: an operator's work in progress on one snapshot, saved only over the draft that it was made from.

    drafts/SNAPSHOT.json    {"revision", "updated_at", "draft"}

A draft that was never saved is the empty one, with an ETag of its own: the first save names that one.
"""

import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from threading import Lock
from typing import Any

from app.errors import Stale
from app.store.quarantine import DamagedFile, Quarantine
from app.store.records import Records
from app.store.shelf import Clock, stamp

EMPTY: Mapping[str, Any] = {"field": None, "region": None, "rotate": None, "model": None, "options": {},
                            "observations": []}


@dataclass(frozen=True)
class Draft:
    """One state of a draft. etag: bare, without the quotes of the HTTP header; different after every save.

    notice: None, or what the operator must be told: that an earlier draft was damaged, and where it is.
    """

    snapshot: str
    body: Mapping[str, Any]
    revision: int = 0
    updated_at: str | None = None  # None: never saved
    notice: str | None = None

    @property
    def etag(self) -> str:
        # The content as well as the number: a number alone would come again after a damaged file.
        content = json.dumps(self.body, sort_keys=True).encode()
        return f"{self.revision}-{sha256(content).hexdigest()[:12]}"

    def to_json(self) -> dict[str, Any]:
        more = {} if self.notice is None else {"notice": self.notice}
        return {**self.body, "updated_at": self.updated_at, **more}


class Drafts:
    """The shelf of drafts. Thread-safe."""

    def __init__(self, folder: Path, quarantine: Quarantine, clock: Clock) -> None:
        self._records = Records(folder / "drafts", quarantine)
        self._quarantine = quarantine
        self._clock = clock
        self._lock = Lock()

    def get(self, snapshot: str) -> Draft:
        """The draft as it was saved last, or the empty one; never a damaged one without a notice."""
        with suppress(DamagedFile):
            record = self._records.read(f"{snapshot}.json")
            if record is not None:
                return Draft(snapshot, record["draft"], record["revision"], record["updated_at"])
        lost = [name for name in self._quarantine.names("drafts") if name.startswith(f"{snapshot}.json")]
        notice = f"The saved draft was damaged and was moved to quarantine/drafts/{lost[-1]}." if lost else None
        return Draft(snapshot, EMPTY, notice=notice)

    def save(self, snapshot: str, body: Mapping[str, Any], etag: str) -> Draft:
        """Put the body in place of the draft with that ETag; Stale where there is another by now.

        The error's details carry the current draft and its ETag, so that nobody's work is lost.
        """
        with self._lock:
            current = self.get(snapshot)
            if etag != current.etag:
                raise Stale("Somebody else has saved this draft since you opened it.",
                            "Compare it with the current one, then save yours over it.", reason="stale-draft",
                            current=current.to_json(), etag=current.etag)
            draft = Draft(snapshot, dict(body), current.revision + 1, stamp(self._clock))
            self._records.write(f"{snapshot}.json", {"revision": draft.revision, "updated_at": draft.updated_at,
                                                     "draft": draft.body}, "The draft")
            return draft
