"""Jobs as rows: who does each, how far it has come, what came of it. The row is the truth, whoever computes.

    add → queued → claim → running, with a lease that every beat renews → finish: done, failed or cancelled
                     ↑_______ the lease has run out: its worker is lost _______|

A lease is read on the monotonic clock of the process that holds the store, and every process has a watch of its own
name: a lease of another process's watch has run out, since that process has ended. No date decides anything.
"""

import json
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, suppress
from typing import Any

from sqlalchemy import and_, delete, or_, select, update

from app.core.errors import NotFound
from app.core.jobs import ENDED, WAITING, Job
from app.core.statements import STATEMENTS, say, sentence_in, stated
from app.store.checksummed import json_text
from app.store.database import Database
from app.store.repository import Clock, is_id, new_id, timestamp
from app.store.tables import JobRow


class JobRepository:
    """The table of jobs. Thread-safe. now: a monotonic clock, s."""

    def __init__(self, database: Database, clock: Clock, now: Callable[[], float] = time.monotonic) -> None:
        self._database = database
        self._clock = clock
        self._now = now
        self._watch = new_id()

    def add(self, kind: str, spec: Any) -> Job:
        """Add a job, queued."""
        row = JobRow(id=new_id(), kind=kind, state="queued", spec=json_text(spec, "The job"), attempt=0, progress=0.0,
                     **_as_columns(WAITING), created_at=timestamp(self._clock))
        with self._database.writing("The job") as rows:
            rows.add(row)
            rows.flush()
            return _read(row)

    def get(self, id: str) -> Job:
        """Return one by its id; NotFound."""
        with self._database.reading() as rows:
            row = rows.scalar(select(JobRow).where(JobRow.id == id)) if is_id(id) else None
        if row is None:
            raise NotFound(say("job.unknown", "There is no job {id!r}.", id=id), "List them with GET /api/v1/jobs.",
                           reason="unknown-job")
        return _read(row)

    def list(self, limit: int = 200) -> tuple[Job, ...]:
        """List jobs, newest first."""
        newest = select(JobRow).order_by(JobRow.sequence.desc()).limit(limit)
        with self._database.reading() as rows:
            return tuple(_read(row) for row in rows.scalars(newest))

    def claim(self, worker: str, lease_s: float, kinds: tuple[str, ...] | None = None,
              id: str | None = None) -> Job | None:
        """Claim the oldest that is queued or has lost its worker, or the one with that id; None if there is none."""
        now = self._now()
        lost = and_(JobRow.state == "running", or_(JobRow.watch != self._watch, JobRow.lease_until < now))
        query = select(JobRow.id).where(or_(JobRow.state == "queued", lost)).order_by(JobRow.sequence).limit(1)
        if kinds is not None:
            query = query.where(JobRow.kind.in_(kinds))
        if id is not None:
            query = query.where(JobRow.id == id)
        with self._database.writing("The job") as rows:
            claimed = rows.scalar(query.with_for_update(skip_locked=True))
            if claimed is None:
                return None
            rows.execute(update(JobRow).where(JobRow.id == claimed).values(
                state="running", attempt=JobRow.attempt + 1, worker=worker, watch=self._watch, heartbeat=now,
                lease_until=now + lease_s))
            return _read(rows.scalars(select(JobRow).where(JobRow.id == claimed)).one())

    def beat(self, id: str, attempt: int, lease_s: float, progress: float | None = None,
             message: str | None = None) -> bool:
        """Renew the lease of a worker that is alive, and its progress. False: the job is no longer that worker's."""
        now = self._now()
        given = ({} if progress is None else {"progress": progress}) | ({} if message is None else _as_columns(message))
        return self._change(id, attempt, heartbeat=now, lease_until=now + lease_s, **given)

    def finish(self, id: str, attempt: int, state: str, result: Any = None,
               problem: Mapping[str, Any] | None = None, message: str = "") -> bool:
        """End it, once and for all. False: it had ended, or another worker has it by now."""
        return self._change(id, attempt, state=state, **_as_columns(message), ended_at=timestamp(self._clock),
                            progress=1.0 if state == "done" else JobRow.progress,
                            result=json_text(result, "The result"), problem=json_text(problem, "The problem"))

    def requeue(self, id: str, attempt: int, message: str, *, counts: bool = True) -> bool:
        """Queue it again. counts: whether the attempt counts, as it does not where its server was stopped."""
        return self._change(id, attempt, state="queued", worker=None, **_as_columns(message), progress=0.0,
                            attempt=JobRow.attempt - (0 if counts else 1))

    def cancel(self, id: str, message: str = "Cancelled") -> Job:
        """End it unless it has ended."""
        self.get(id)
        with self._database.writing("The cancelling") as rows:
            rows.execute(update(JobRow).where(JobRow.id == id, JobRow.state.not_in(ENDED)).values(
                state="cancelled", **_as_columns(message), ended_at=timestamp(self._clock)))
        return self.get(id)

    def transaction(self) -> AbstractContextManager[Any]:
        """Save what this thread saves within it together with the job's end, or not at all."""
        return self._database.writing("The result")

    def lose_workers(self) -> None:
        """Note that the table was exchanged: whoever runs a job there ran it in the table before."""
        self._watch = new_id()

    def forget(self, ids: Sequence[str]) -> None:
        """Delete those of them that have ended."""
        with self._database.writing("The deletion") as rows:
            rows.execute(delete(JobRow).where(JobRow.state.in_(ENDED), JobRow.id.in_(ids)))

    def _change(self, id: str, claimed: int, /, **values: Any) -> bool:
        with self._database.writing("The job") as rows:
            done = rows.connection().execute(update(JobRow).where(JobRow.id == id, JobRow.attempt == claimed,
                                                     JobRow.state == "running").values(**values))
            return done.rowcount == 1


def _as_columns(message: str) -> dict[str, str | None]:
    """Return a message as columns: its text, and what it states."""
    found = stated({"message": message}).get(STATEMENTS)
    return {"message": str(message), "statements": None if found is None else json_text(found, "The message")}


def _read(row: JobRow) -> Job:
    """Read a row; damaged text is no reason not to start: a queued job has lost its spec, an ended one its result."""
    message = sentence_in({"message": row.message, STATEMENTS: _json(row.statements)}, "message")
    return Job(row.id, row.kind, row.created_at, row.state, row.progress, message, _json(row.result),
               _json(row.problem), row.ended_at, row.attempt, _json(row.spec), row.worker)


def _json(text: str | None) -> Any:
    with suppress(ValueError):
        return None if text is None else json.loads(text)
    return None
