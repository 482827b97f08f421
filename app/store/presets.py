"""Presets: plain JSON by kind and name, such as a venue's colours; what it means is the business of its readers."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Literal

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from app.core.errors import Conflict, NotFound, Stale
from app.store.cameras import check_name, is_name
from app.store.checksummed import content, sealed
from app.store.quarantine import DamagedFile
from app.store.repository import Shelf, new_id, stamp
from app.store.tables import PresetRow

Kind = Literal["colours", "seeing"]
MOST = 300  # of one kind
WORDS = {"colours": "colour profile", "seeing": "camera's plan"}


@dataclass(frozen=True)
class Preset:
    """One as it was saved last. etag: a new one with every save, never one of a preset that was removed."""

    name: str
    body: Mapping[str, Any]
    etag: str
    updated_at: str
    updated_by: str


class Presets(Shelf):
    """The shelf of presets. Thread-safe."""

    table = PresetRow
    kind = "presets"

    def all(self, kind: Kind) -> tuple[Preset, ...]:
        """By name; a damaged one is missing here and named in Store.damaged."""
        with self._database.reading() as rows:
            found = list(rows.scalars(select(PresetRow).where(PresetRow.key.startswith(f"{kind}:"))
                                      .order_by(PresetRow.key)))
        kept = []
        for row in found:
            with suppress(DamagedFile):
                kept.append(self._read(row))
        return tuple(kept)

    def get(self, kind: Kind, name: str) -> Preset:
        """One; NotFound, or DamagedFile."""
        with self._database.reading() as rows:
            row = rows.get(PresetRow, _key(kind, name)) if is_name(name) else None
        if row is None:
            raise NotFound(f"There is no {WORDS[kind]} called {name[:64]!r}.", "List what there is.",
                           reason=f"unknown-{kind}")
        return self._read(row)

    def save(self, kind: Kind, name: str, body: Mapping[str, Any], etag: str | None, by: str = "") -> Preset:
        """In place of the one with that ETag, Stale where it is another; None: a new one, Conflict where there is."""
        check_name(name, f"The {WORDS[kind]}")
        preset = Preset(name, dict(body), new_id(), stamp(self._clock), by)
        with suppress(NotFound):
            self.get(kind, name)  # a damaged one is told and not written over
        with self._database.writing(f"The {WORDS[kind]}") as rows:
            if etag is None:
                self._refuse_known(rows, kind, name)
            else:
                self._current(rows, kind, name, etag)
            rows.merge(_row(kind, preset))
        return preset

    def remove(self, kind: Kind, name: str, etag: str | None = None) -> None:
        """Forget the one with that ETag (None: whichever)."""
        self.get(kind, name)
        with self._database.writing("The deletion") as rows:
            self._current(rows, kind, name, etag)
            rows.execute(delete(PresetRow).where(PresetRow.key == _key(kind, name)))

    def _refuse_known(self, rows: Session, kind: Kind, name: str) -> None:
        if rows.get(PresetRow, _key(kind, name)) is not None:
            raise Conflict(f"There is already a {WORDS[kind]} called {name!r}.", "Choose another name, or change that "
                           "one.", reason=f"{kind}-exists")
        known = select(func.count()).select_from(PresetRow).where(PresetRow.key.startswith(f"{kind}:"))
        if (rows.scalar(known) or 0) >= MOST:
            raise Conflict(f"{MOST} are kept already.", "Remove one that is not used any more.",
                           reason=f"too-many-{kind}")

    def _current(self, rows: Session, kind: Kind, name: str, etag: str | None) -> None:
        row = rows.get(PresetRow, _key(kind, name), with_for_update=True)
        current = self._read(row) if row is not None else None
        if current is None or (etag is not None and etag != current.etag):
            raise Stale(f"Somebody else has changed this {WORDS[kind]} since you opened it.",
                        "Look at it again, then change it.", reason=f"stale-{kind}",
                        current=dict(current.body) if current else None, etag=current.etag if current else None)

    def _read(self, row: PresetRow) -> Preset:
        record = content(self.checked(row, row.key.replace(":", "-")))
        return Preset(row.key.partition(":")[2], record["preset"], record["etag"], record["updated_at"],
                      record["updated_by"])


def _key(kind: Kind, name: str) -> str:
    return f"{kind}:{name}"


def _row(kind: Kind, preset: Preset) -> PresetRow:
    record = {"etag": preset.etag, "updated_at": preset.updated_at, "updated_by": preset.updated_by,
              "preset": dict(preset.body)}
    return sealed(PresetRow, record, f"The {WORDS[kind]}", key=_key(kind, preset.name))
