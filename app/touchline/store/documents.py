"""Named JSON documents, each changed only by whoever has seen its newest state; and lenses, which are written once.

What a document means is the business of whoever reads it.
"""

import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Select, func, inspect, select
from sqlalchemy.orm import Session

from touchline.core.errors import BadInput, Conflict, NotFound, Stale, TouchlineError
from touchline.core.statements import Sentence, say
from touchline.store.integrity import checksummed, content
from touchline.store.repository import (
    Page,
    Repository,
    StoreContext,
    check_etag,
    content_etag,
    new_id,
    timestamp,
)
from touchline.store.tables import LensRow, PresetRow, RigRow


@dataclass(frozen=True)
class Document:
    """A document as it was saved last. etag: a new one with every save, never one of a document that was deleted."""

    name: str
    body: Mapping[str, Any]
    etag: str
    updated_at: str
    updated_by: str


class DocumentRepository(Repository):
    """Documents by name. member: the body's key in the row's JSON. word, plural: what reasons of errors are made of."""

    member: str
    word: str
    plural: str
    max_count = 300

    def __init__(self, store: StoreContext) -> None:
        super().__init__(store)
        self._key = inspect(self.table).primary_key[0]
        self._what = f"The {self.noun}"

    def all(self) -> tuple[Document, ...]:
        """Return all in their order; a damaged one is missing here and named in Store.damaged."""
        return self._intact(self._find(self._select()), self._read)

    def get(self, name: str) -> Document:
        """Return one; NotFound, or DamagedFile."""
        with self._database.reading() as rows:
            row = self._lookup(rows, name)
        if row is None:
            raise self._unknown(name)
        return self._read(row)

    def add(self, name: str, body: Mapping[str, Any], by: str = "") -> Document:
        """Save a new one; Conflict if the name is taken, or if there are max_count."""
        check_name(name, self._what)
        self._refuse_damaged(name)
        with self._database.writing(self._what) as rows:
            if self._lookup(rows, name) is not None:
                raise Conflict(
                    self._say(
                        "exists", f"There is already a {self.noun} called {{name!r}}.", name=name
                    ),
                    self._say(
                        "choose-another",
                        f"Choose another name, or change the existing {self.noun}.",
                    ),
                    reason=f"{self.word}-exists",
                )
            if (
                rows.scalar(select(func.count()).select_from(self._select().subquery())) or 0
            ) >= self.max_count:
                raise Conflict(
                    say(
                        "document.too-many",
                        "The maximum of {most} is reached.",
                        most=self.max_count,
                    ),
                    say("document.delete-one", "Delete one that is no longer used."),
                    reason=f"too-many-{self.plural}",
                )
            row = self._build(rows, name, body, by, None)
            rows.add(row)
            return self._read(row)

    def save(self, name: str, body: Mapping[str, Any], etag: str | None, by: str = "") -> Document:
        """Replace the one with that ETag; Stale if there is another or none any more. None: add a new one."""
        if etag is None:
            return self.add(name, body, by)
        self._refuse_damaged(name)
        with self._database.writing(self._what) as rows:
            return self._read(
                rows.merge(self._build(rows, name, body, by, self._current(rows, name, etag)))
            )

    def delete(self, name: str, etag: str | None = None) -> None:
        """Delete the one with that ETag (None: whichever); NotFound, or Stale."""
        self.get(name)
        with self._database.writing("The deletion") as rows:
            rows.delete(self._current(rows, name, etag))

    def _unknown(self, name: str) -> NotFound:
        return NotFound(
            self._say("unknown", f"There is no {self.noun} called {{name!r}}.", name=name[:64]),
            self.listing,
            reason=f"unknown-{self.word}",
        )

    def _say(self, code: str, template: str, **values: object) -> Sentence:
        """Return a sentence whose code names the kind of document: "rig-document.unknown"."""
        return say(f"{self.word}-document.{code}", template, **values)

    def _refuse_damaged(self, name: str) -> None:
        """Raise DamagedFile where the one of that name is damaged: it is reported and not written over."""
        with suppress(NotFound):
            self.get(name)

    def _current(self, rows: Session, name: str, etag: str | None) -> Any:
        row = self._lookup(rows, name, for_update=True)
        if row is None:
            raise self._deleted(name)
        current = self._read(row)
        changed = self._say(
            "changed-meanwhile", f"Another user has changed this {self.noun} since you opened it."
        )
        check_etag(etag, current.etag, changed, f"stale-{self.word}", self._shown(current.body))
        return row

    def _deleted(self, name: str) -> TouchlineError:
        """Return the error for who changes one that somebody else has deleted."""
        return Stale(
            self._say("deleted-meanwhile", f"Another user has deleted this {self.noun}."),
            say("document.create-again", "Create it again, without If-Match."),
            reason=f"stale-{self.word}",
            current=None,
            etag=None,
        )

    def _lookup(self, rows: Session, name: str, for_update: bool = False) -> Any:
        return (
            rows.get(self.table, self._key_of(name), with_for_update=for_update)
            if is_name(name)
            else None
        )

    def _select(self) -> Select[Any]:
        return select(self.table).order_by(self.table.place)

    def _key_of(self, name: str) -> str:
        return name

    def _build(
        self, rows: Session, name: str, body: Mapping[str, Any], by: str, before: Any
    ) -> Any:
        """Return the row of a new state. before: the row that it replaces."""
        head, columns = self._head(rows, before)
        record = {
            **head,
            "updated_at": timestamp(self._clock),
            "updated_by": by,
            **self._saved(body, before),
        }
        return checksummed(
            self.table, record, self._what, **{self._key.key: self._key_of(name)}, **columns
        )

    def _saved(self, body: Mapping[str, Any], before: Any) -> dict[str, Any]:
        """Return the part of a row's JSON that holds the body. before: the row that it replaces."""
        return {self.member: dict(body)}

    def _body(self, record: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the body of a row's JSON: what was given to be saved."""
        body: Mapping[str, Any] = record[self.member]
        return body

    def _shown(self, body: Mapping[str, Any]) -> dict[str, Any]:
        """Return the body as an error may show it."""
        return dict(body)

    def _head(self, rows: Session, before: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return what tells this state from others: in the row's JSON, and in its columns."""
        return {"etag": new_id()}, {"place": before.place if before else self._next_place(rows)}

    def _next_place(self, rows: Session) -> int:
        return 1 + (rows.scalar(select(func.max(self.table.place))) or 0)

    def _read(self, row: Any) -> Document:
        key = getattr(row, self._key.key)
        record = content(self._checked(row))
        return Document(
            key.rpartition(":")[2],
            self._body(record),
            self._etag(record),
            record["updated_at"],
            record["updated_by"],
        )

    def _etag(self, record: Mapping[str, Any]) -> str:
        return str(record["etag"])


class RigRepository(DocumentRepository):
    """Rigs, cameras that share a field, in the order in which they were made."""

    table, member = RigRow, "rig"
    noun, word, plural = "rig", "rig", "rigs"
    listing = "List them with GET /api/v1/rigs."
    max_count = 200


class PresetRepository(DocumentRepository):
    """The presets of one kind, by name."""

    table, member = PresetRow, "preset"
    listing = say("document.existing-names", "Use one of the existing names.")

    def _key_of(self, name: str) -> str:
        return f"{self.word}:{name}"

    def _select(self) -> Select[Any]:
        return (
            select(PresetRow)
            .where(PresetRow.key.startswith(f"{self.word}:"))
            .order_by(PresetRow.key)
        )

    def _head(self, rows: Session, before: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        return {"etag": new_id()}, {}


class ColourProfileRepository(PresetRepository):
    """The colours of venues."""

    noun, word, plural = "colour profile", "colours", "colours"


class DetectionPlanRepository(PresetRepository):
    """What each camera is to detect."""

    noun, word, plural = "detection plan", "seeing", "seeing"


def is_name(name: str) -> bool:
    """Check that a camera, a calibration or a document could have that name: names come from strangers."""
    return re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}", name) is not None


def check_name(name: str, what: str) -> None:
    if not is_name(name):
        raise BadInput(
            say("name.not-valid", "{what} has a name that is not valid.", what=what),
            say(
                "name.allowed",
                "Use letters, digits, dots and hyphens, starting with a letter or digit.",
            ),
            reason="bad-name",
        )


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
            check_etag(
                etag,
                content_etag(lens),
                say("stale.lens", "This is another lens than the one you opened."),
                "stale-lens",
                {"id": id},
            )
            rows.delete(row)
