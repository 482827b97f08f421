"""Calibrations: immutable versions, counted for each camera, of which one may be its camera's active one.

No camera at all counts as a camera: uploaded pictures have versions too. In the database a camera's name is a hash,
since a name may be anything; the version's body has it in words.
"""

import json
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from math import inf
from time import monotonic
from typing import Any

from sqlalchemy import ColumnElement, Select, and_, bindparam, func, select

from touchline.core.errors import Conflict
from touchline.core.records import Calibration
from touchline.core.statements import say
from touchline.store.integrity import checksummed, content, json_text
from touchline.store.repository import (
    LruCache,
    Page,
    Repository,
    StoreContext,
    check_etag,
    column_text,
    content_etag,
    is_id,
    new_id,
    timestamp,
)
from touchline.store.tables import ActivationRow, ActiveRow, CalibrationRow

SHOWN = CalibrationRow.deleted_at.is_(None)  # a deleted version keeps its row and its number
NOTHING_ACTIVE = "none"
ACTIVE = ',"active":{},"field_definition":'  # within Calibration.to_json()
# characters of the versions that stay parsed: some 100, which take three times as many bytes
MAX_PARSED = 8 << 20


def version_etag(calibration: Calibration) -> str:
    """Return the ETag of what can change of a version."""
    return content_etag({"note": calibration.note, "active": calibration.active})


def camera_key(camera: str | None) -> str:
    """Return a camera's name as the database has it."""
    return sha256(
        b"" if camera is None else b"camera " + camera.encode("utf-8", "surrogatepass")
    ).hexdigest()[:12]


# Rows of versions, each with its camera's choice of the active one or None. Made once: that takes as long as they do.
WITH_CHOICE = (
    select(CalibrationRow, ActiveRow)
    .outerjoin(
        ActiveRow,
        and_(ActiveRow.camera_key == CalibrationRow.camera_key, ActiveRow.damaged.is_(None)),
    )
    .where(SHOWN)
)
BY_ID = WITH_CHOICE.where(CalibrationRow.id == bindparam("id"))
CHOSEN = WITH_CHOICE.where(
    ActiveRow.calibration == CalibrationRow.id,
    ActiveRow.camera_key.in_(bindparam("cameras", expanding=True)),
)

# by the row's checksum, with how many characters it has
Parsed = LruCache[str, tuple[int, Calibration]]


@dataclass(frozen=True, eq=False)
class FoundVersion:
    """A version as its row, read and checked, has it; it is parsed when that is needed, and once."""

    body: str
    sha256: str  # of the whole row
    active: bool
    parsed: Parsed

    @property
    def stamp(self) -> tuple[str, bool]:
        """Return what is another one as soon as anything of the version is."""
        return self.sha256, self.active

    @property
    def text(self) -> str:
        """Return its JSON as it was saved, but for whether it is active now."""
        before, mark, after = self.body.rpartition(ACTIVE.format("false"))
        assert mark, "a version is saved as inactive"
        return before + ACTIVE.format("true" if self.active else "false") + after

    @property
    def calibration(self) -> Calibration:
        """Return the record, whose parts every caller shares: it is only read."""
        _, known = self.parsed.get_or_make(
            self.sha256, lambda: (len(self.body), Calibration.from_json(json.loads(self.body)))
        )
        return known.activated(self.active)


class CalibrationRepository(Repository):
    """The versions of every camera's calibration."""

    table, noun = CalibrationRow, "calibration"
    listing = "List them with GET /api/v1/calibrations."

    def __init__(self, store: StoreContext) -> None:
        super().__init__(store)
        self._parsed: Parsed = LruCache(MAX_PARSED, lambda sized: sized[0])
        self._cameras: dict[str, str | None] = {}  # by key
        # by an activation's sequence, monotonic: of those since we were opened
        self._moments: dict[int, float] = {}

    def add(self, calibration: Calibration, by: str = "") -> Calibration:
        """Save a new version; its id, version, date and maker are given here."""
        key = camera_key(calibration.camera)
        with self._database.writing("The calibration") as rows:
            last = rows.scalar(
                select(func.max(CalibrationRow.version)).where(CalibrationRow.camera_key == key)
            )
            saved = replace(
                calibration,
                id=new_id(),
                version=(last or 0) + 1,
                created_at=timestamp(self._clock),
                made_by=by,
                active=False,
            )
            rows.add(calibration_row(saved))
        return saved

    def get(self, id: str) -> Calibration:
        """Return one version by its id; NotFound, or DamagedFile."""
        return self.find(id).calibration

    def find(self, id: str) -> FoundVersion:
        """Return the same without parsing it."""
        for row, choice in self._pairs(BY_ID, id=id) if is_id(id) else ():
            return self._chosen(row, choice)
        raise self._unknown(id)

    def list(
        self, camera: str | None = None, limit: int = 50, cursor: str | None = None
    ) -> Page[Calibration]:
        """Return a page, newest first, of one camera or of all, without damaged ones."""
        page = self.found(camera, limit, cursor)
        return Page(tuple(one.calibration for one in page.items), page.next_cursor)

    def found(
        self,
        camera: str | None = None,
        limit: int = 50,
        cursor: str | None = None,
        snapshot: str | None = None,
    ) -> Page[FoundVersion]:
        """Return the same page without parsing it: a tenth of the time. snapshot: of those from that image alone."""
        active = self._active_ids()
        where = _shown(camera, snapshot)
        return self._page(limit, cursor, lambda row: self._found(row, active), *where)

    def delete(self, id: str, etag: str | None = None) -> None:
        """Hide a version with that ETag (None: whichever); Conflict while it is its camera's active one.

        Its number is not used again.
        """
        with self._changing("The deletion", id, SHOWN) as (rows, row):
            self._check_version(row, etag)
            if (
                rows.scalar(select(ActiveRow.camera_key).where(ActiveRow.calibration == id))
                is not None
            ):
                raise Conflict(
                    say("calibration.is-active", "This calibration is active for its camera."),
                    say("calibration.activate-another", "Activate another version first."),
                    reason="calibration-active",
                )
            row.deleted_at = timestamp(self._clock)

    def restore(self, id: str, etag: str | None = None) -> Calibration:
        """Take the deletion of a version with that ETag (None: whichever) back; one that is there stays as it is."""
        with self._changing("The undoing of the deletion", id) as (_, row):
            self._check_version(row, etag)
            row.deleted_at = None
        return self.get(id)

    def annotate(self, id: str, note: str, etag: str | None = None) -> Calibration:
        """Change the remark beside a version with that ETag (None: whichever).

        It is all that is ever changed of one: no number rests on it.
        """
        with self._changing("The note", id, SHOWN) as (_, row):
            known = self._check_version(row, etag)
            row.body = json_text(replace(known, note=note, active=False).to_json(), "The note")
        return self.get(id)

    def activate(
        self, id: str, by: str = "", etag: str | None = None, despite: Sequence[str] = ()
    ) -> Calibration:
        """Make a version its camera's active one; the history says who did it, when, and despite which claims.

        etag: the id of the version that is active, NOTHING_ACTIVE for none; Stale if it is another one by now.
        """
        row = self._row(id, SHOWN)  # no damaged one can be activated
        activated = self._found(row, {id}).calibration
        chosen = {"camera_key": row.camera_key, "calibration": id}
        what = "The choice of the active calibration"
        with self._database.writing(what) as rows:
            if rows.scalar(select(CalibrationRow.id).where(CalibrationRow.id == id, SHOWN)) is None:
                raise self._unknown(id)  # deleted a moment ago
            self._check_active(activated, etag)
            rows.merge(checksummed(ActiveRow, chosen, what, **chosen))
            row = ActivationRow(
                **chosen, at=timestamp(self._clock), by=by, despite=json.dumps(list(despite))
            )
            rows.add(row)
            rows.flush()  # which numbers it
            self._moments[row.sequence] = monotonic()
        return activated

    def _check_active(self, chosen: Calibration, etag: str | None) -> None:
        """Raise Stale, naming who was faster, where another version than that or the chosen one is active."""
        former = self.active_id(chosen.camera)
        if etag in (None, former or NOTHING_ACTIVE) or former == chosen.id:
            return
        now, what = None, "No version of this camera is active now."
        if former is not None:
            now = {**self.history(chosen.camera, 1)[0], "version": self.get(former).version}
            what = say(
                "stale.activated",
                "{by} has activated version {version} since you opened this page.",
                by=now["by"] or say("stale.another-user", "Another user"),
                version=now["version"],
            )
        check_etag(
            etag,
            former or NOTHING_ACTIVE,
            what,
            "stale-activation",
            now,
            say(
                "stale.compare-versions", "Compare the two versions, then activate the better one."
            ),
        )

    def _check_version(self, row: CalibrationRow, etag: str | None) -> Calibration:
        known = self._found(self._checked(row), self._active_ids(row.camera_key)).calibration
        check_etag(
            etag,
            version_etag(known),
            say("stale.version", "Another user has changed this version since you opened it."),
            "stale-calibration",
            {"note": known.note, "active": known.active},
        )
        return known

    def active(self, camera: str | None) -> Calibration | None:
        """Return a camera's active version; None where none was activated, or where that is damaged and reported."""
        return self.active_of([camera]).get(camera)

    def active_of(self, cameras: Collection[str | None]) -> dict[str | None, Calibration]:
        """Return the active version of each of the cameras that has one, in their order, all in one read."""
        names = {camera_key(camera): camera for camera in cameras}
        pairs = self._pairs(CHOSEN, cameras=list(names))
        found = dict(self._intact(pairs, lambda pair: (pair[0].camera_key, self._chosen(*pair))))
        return {
            camera: found[key].calibration
            for key, camera in names.items()
            if key in found and found[key].active
        }

    def active_id(self, camera: str | None) -> str | None:
        """Return the id of a camera's active version, also of a damaged one."""
        return next(iter(self._active_ids(camera_key(camera))), None)

    def history(self, camera: str | None, limit: int = 50) -> tuple[dict[str, Any], ...]:
        """Return what was activated for a camera, newest first: {"calibration", "at", "by", "despite"}."""
        query = (
            select(ActivationRow)
            .where(ActivationRow.camera_key == camera_key(camera))
            .order_by(ActivationRow.sequence.desc())
            .limit(limit)
        )
        return tuple(
            {"calibration": row.calibration, "at": row.at, "by": row.by, "despite": _despite(row)}
            for row in self._find(query)
        )

    def activations(self, limit: int = 50) -> tuple[dict[str, Any], ...]:
        """Return what was activated for any camera, newest first.

        As {"camera", "version", "at", "by", "despite", "moment"}. Versions that were deleted since are there too,
        damaged ones are not. camera: None for pictures from files. moment: monotonic; -inf for what was activated
        before the store was opened.
        """
        query = (
            select(ActivationRow, CalibrationRow.version)
            .join(CalibrationRow, CalibrationRow.id == ActivationRow.calibration)
            .order_by(ActivationRow.sequence.desc())
            .limit(limit)
        )
        with self._database.reading() as rows:
            found = rows.execute(query).all()
        return self._intact(
            found,
            lambda pair: {
                "camera": self._camera(pair[0]),
                "version": pair[1],
                "at": pair[0].at,
                "by": pair[0].by,
                "despite": _despite(pair[0]),
                "moment": self._moments.get(pair[0].sequence, -inf),
            },
        )

    def _camera(self, row: ActivationRow) -> str | None:
        """Return the name behind a key, which only a version's body has; read once, for it is always the same."""
        if row.camera_key not in self._cameras:
            self._cameras[row.camera_key] = content(self._row(row.calibration))["camera"]
        return self._cameras[row.camera_key]

    def _pairs(self, query: Select[Any, Any], **values: Any) -> Sequence[Any]:
        with self._database.reading() as rows:
            return rows.execute(query, values).all()

    def _chosen(self, row: CalibrationRow, choice: ActiveRow | None) -> FoundVersion:
        return self._found(self._checked(row), self._choices(() if choice is None else (choice,)))

    def _choices(self, rows: Iterable[ActiveRow]) -> set[str]:
        """Return the versions chosen. A choice that is damaged is reported; then nothing is active there."""
        return set(self._intact(rows, lambda row: str(self._checked(row).calibration)))

    def _found(self, row: CalibrationRow, active: set[str]) -> FoundVersion:
        """Return what an intact row has."""
        return FoundVersion(row.body, row.sha256, row.id in active, self._parsed)

    def _active_ids(self, key: str | None = None) -> set[str]:
        query = select(ActiveRow).where(ActiveRow.damaged.is_(None))
        if key is not None:
            query = query.where(ActiveRow.camera_key == key)
        return self._choices(self._find(query))


def _shown(camera: str | None, snapshot: str | None = None) -> Iterator[ColumnElement[bool]]:
    yield SHOWN
    if camera is not None:
        yield CalibrationRow.camera_key == camera_key(camera)
    if snapshot is not None:
        yield CalibrationRow.snapshot == snapshot


def _despite(row: ActivationRow) -> list[str]:
    """Return the codes of the claims that it was activated in spite of."""
    return [] if row.despite is None else json.loads(row.despite)


def calibration_row(calibration: Calibration) -> CalibrationRow:
    """Return a version as the database has it."""
    return checksummed(
        CalibrationRow,
        calibration.to_json(),
        "The calibration",
        id=calibration.id,
        camera_key=camera_key(calibration.camera),
        version=calibration.version,
        parent=column_text(calibration.parent),
        snapshot=column_text(calibration.snapshot),
        software=column_text(calibration.software),
        created_at=column_text(calibration.created_at),
        made_by=column_text(calibration.made_by),
    )
