"""Lenses from boards: records that are written once, read, and deleted.

    lenses/SEQUENCE.ID.json    {"id", "created_at", …} and whatever the calibration answered
"""

import re
from collections.abc import Mapping
from pathlib import Path
from threading import Lock
from typing import Any

from app.errors import NotFound
from app.store.files import flush_folder, keeping
from app.store.quarantine import Damage, DamagedFile, Quarantine
from app.store.records import Records
from app.store.shelf import Clock, Page, new_id, page, readable, stamp

NAME = re.compile(r"(?P<sequence>[0-9]{10})\.(?P<id>[0-9a-f]{16})\.json")
KIND = "lenses"


class Lenses:
    """The shelf of lenses. Thread-safe. A calibration that held one has a copy of its own."""

    def __init__(self, folder: Path, quarantine: Quarantine, clock: Clock) -> None:
        self._records = Records(folder / KIND, quarantine)
        self._clock = clock
        self._lock = Lock()
        self._names = _by_id(self._records.names())
        self._damaged = _by_id(quarantine.names(KIND))
        self._last = max([0, *(_sequence(n) for n in (*self._names.values(), *self._damaged.values()))])

    def add(self, lens: Mapping[str, Any]) -> dict[str, Any]:
        """Keep a lens, plain JSON; its id and date are given here. On return it is safe on disk."""
        with self._lock:
            self._last += 1  # a number is never used twice while we run, not even after a failure
            sequence = self._last
        kept = {**lens, "id": new_id(), "created_at": stamp(self._clock)}
        name = f"{sequence:010d}.{kept['id']}.json"
        self._records.write(name, kept, "The lens")
        with self._lock:
            self._names[kept["id"]] = name
        return kept

    def get(self, id: str) -> dict[str, Any]:
        """One by its id; NotFound, or DamagedFile."""
        if id in self._damaged:
            raise DamagedFile(Damage(KIND, self._damaged[id]))
        name = self._names.get(id)
        if name is None:
            raise _unknown(id)
        try:
            record = self._records.read(name)
        except DamagedFile:
            self._damaged[id] = name
            raise
        if record is None:
            raise _unknown(id)
        return record

    def list(self, limit: int = 50, cursor: str | None = None) -> Page[dict[str, Any]]:
        """Newest first. Damaged ones are not among them; Store.damaged names those."""
        with self._lock:
            ids = {_sequence(name): id for id, name in self._names.items() if id not in self._damaged}
        shown, following = page(ids, limit, cursor)
        return Page(tuple(readable(self.get, (ids[sequence] for sequence in shown))), following)

    def delete(self, id: str) -> None:
        """Forget a lens; NotFound."""
        with self._lock:
            if id not in self._names or id in self._damaged:
                raise _unknown(id)
            with keeping("The deletion"):
                (self._records.folder / self._names[id]).unlink(missing_ok=True)
                flush_folder(self._records.folder)
            del self._names[id]


def _sequence(name: str) -> int:
    return int(name[:10])


def _by_id(names: Any) -> dict[str, str]:
    return {match["id"]: name for name in names if (match := NAME.fullmatch(name))}


def _unknown(id: str) -> NotFound:
    return NotFound(f"There is no lens {id!r}.", "List them with GET /api/v1/lenses.", reason="unknown-lens")
