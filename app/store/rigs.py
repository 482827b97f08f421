"""Rigs that operators have made: cameras that share a field. What a rig's body means is the business of its readers."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from app.core.errors import Conflict, NotFound, Stale
from app.store.cameras import check_name, is_name
from app.store.checksummed import content, sealed
from app.store.quarantine import DamagedFile
from app.store.repository import Shelf, new_id, stamp
from app.store.tables import RigRow

MAX_RIGS = 200


@dataclass(frozen=True)
class KeptRig:
    """One rig as it was saved last. etag: a new one with every save, never one of a rig that was removed."""

    name: str
    body: Mapping[str, Any]
    etag: str
    updated_at: str
    updated_by: str


class Rigs(Shelf):
    """The shelf of rigs. Thread-safe."""

    table = RigRow
    kind = "rigs"

    def all(self) -> tuple[KeptRig, ...]:
        """In the order in which they were made; a damaged one is missing here and named in Store.damaged."""
        with self._database.reading() as rows:
            found = list(rows.scalars(select(RigRow).order_by(RigRow.place)))
        rigs = []
        for row in found:
            with suppress(DamagedFile):
                rigs.append(self._read(row))
        return tuple(rigs)

    def get(self, name: str) -> KeptRig:
        """One; NotFound, or DamagedFile."""
        with self._database.reading() as rows:
            row = rows.get(RigRow, name) if is_name(name) else None
        if row is None:
            raise unknown_rig(name)
        return self._read(row)

    def add(self, name: str, body: Mapping[str, Any], by: str = "") -> KeptRig:
        """A new one; Conflict rig-exists where the name is taken, too-many-rigs where there are MAX_RIGS."""
        check_name(name, "The rig")
        rig = KeptRig(name, dict(body), new_id(), stamp(self._clock), by)
        with self._database.writing("The rig") as rows:
            if rows.get(RigRow, name) is not None:
                raise Conflict(f"There is already a rig called {name!r}.", "Choose another name, or change that one.",
                               reason="rig-exists")
            if (rows.scalar(select(func.count()).select_from(RigRow)) or 0) >= MAX_RIGS:
                raise Conflict(f"There are {MAX_RIGS} rigs already.", "Remove one that is not used any more.",
                               reason="too-many-rigs")
            rows.add(_row(rig, 1 + (rows.scalar(select(func.max(RigRow.place))) or 0)))
        return rig

    def save(self, name: str, body: Mapping[str, Any], etag: str, by: str = "") -> KeptRig:
        """In place of the one with that ETag; Stale where somebody else was faster, be it to remove it."""
        if is_name(name):
            with suppress(NotFound):
                self.get(name)  # a damaged one is told and not written over
        rig = KeptRig(name, dict(body), new_id(), stamp(self._clock), by)
        with self._database.writing("The rig") as rows:
            row = self._current(rows, name, etag)
            rows.merge(_row(rig, row.place))
        return rig

    def remove(self, name: str, etag: str | None = None) -> None:
        """Forget the one with that ETag (None: whichever)."""
        self.get(name)
        with self._database.writing("The deletion") as rows:
            self._current(rows, name, etag)
            rows.execute(delete(RigRow).where(RigRow.name == name))

    def _current(self, rows: Session, name: str, etag: str | None) -> RigRow:
        row = rows.get(RigRow, name, with_for_update=True) if is_name(name) else None
        if row is None:
            raise Stale("Somebody else has removed this rig.", "Make it anew, without If-Match.", reason="stale-rig",
                        current=None, etag=None)
        current = self._read(row)
        if etag is not None and etag != current.etag:
            raise Stale("Somebody else has changed this rig since you opened it.", "Look at it again, then change it.",
                        reason="stale-rig", current=dict(current.body), etag=current.etag)
        return row

    def _read(self, row: RigRow) -> KeptRig:
        record = content(self.checked(row, row.name))
        return KeptRig(row.name, record["rig"], record["etag"], record["updated_at"], record["updated_by"])


def _row(rig: KeptRig, place: int) -> RigRow:
    """A rig as the database has it."""
    record = {"etag": rig.etag, "updated_at": rig.updated_at, "updated_by": rig.updated_by, "rig": dict(rig.body)}
    return sealed(RigRow, record, "The rig", name=rig.name, place=place)


def unknown_rig(name: str) -> NotFound:
    return NotFound(f"There is no rig called {name!r}.", "List them with GET /api/v1/rigs.", reason="unknown-rig")
