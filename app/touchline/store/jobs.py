"""Jobs as rows: what each is to do, how it stands, what came of it.

One process holds the store and does all jobs, so a row that says "running" when the store is opened was cut short.
"""

import json
from collections.abc import Sequence
from contextlib import AbstractContextManager, suppress
from typing import Any

from sqlalchemy import delete, select, update

from touchline.core.errors import NotFound
from touchline.core.jobs import ENDED, WAITING, Job
from touchline.core.statements import STATEMENTS, say, sentence_in, stated
from touchline.store.integrity import json_text
from touchline.store.repository import StoreContext, is_id, new_id, timestamp
from touchline.store.tables import JobRow


class JobRepository:
    """The table of jobs. Thread-safe."""

    def __init__(self, store: StoreContext) -> None:
        self._database, self._clock = store.database, store.clock

    def add(self, kind: str, spec: Any) -> Job:
        """Add a job, queued."""
        row = JobRow(
            id=new_id(),
            kind=kind,
            state="queued",
            spec=json_text(spec, "The job"),
            attempt=0,
            progress=0.0,
            **_as_columns(WAITING),
            created_at=timestamp(self._clock),
        )
        with self._database.writing("The job") as rows:
            rows.add(row)
            rows.flush()
            return _read(row)

    def get(self, id: str) -> Job:
        """Return one by its id; NotFound."""
        with self._database.reading() as rows:
            row = rows.scalar(select(JobRow).where(JobRow.id == id)) if is_id(id) else None
        if row is None:
            raise NotFound(
                say("job.unknown", "There is no job {id!r}.", id=id),
                "List them with GET /api/v1/jobs.",
                reason="unknown-job",
            )
        return _read(row)

    def list(self, limit: int = 200) -> tuple[Job, ...]:
        """List jobs, newest first."""
        newest = select(JobRow).order_by(JobRow.sequence.desc()).limit(limit)
        with self._database.reading() as rows:
            return tuple(_read(row) for row in rows.scalars(newest))

    def save(self, job: Job) -> None:
        """Write how it stands."""
        changed = (
            update(JobRow)
            .where(JobRow.id == job.id)
            .values(
                state=job.state,
                attempt=_begun(job),
                progress=job.progress,
                **_as_columns(job.message),
                result=json_text(job.result, "The result"),
                problem=json_text(job.problem, "The problem"),
                ended_at=job.ended_at,
            )
        )
        with self._database.writing("The job") as rows:
            rows.execute(changed)

    def transaction(self) -> AbstractContextManager[Any]:
        """Save what this thread saves within it together with the job's end, or not at all."""
        return self._database.writing("The result")

    def forget(self, ids: Sequence[str]) -> None:
        """Delete those of them that have ended."""
        with self._database.writing("The deletion") as rows:
            rows.execute(delete(JobRow).where(JobRow.state.in_(ENDED), JobRow.id.in_(ids)))


def _begun(job: Job) -> int:
    """Return how many attempts have begun: the one that a queued job waits for has not."""
    return job.attempt - (job.state == "queued")


def _as_columns(message: str) -> dict[str, str | None]:
    """Return a message as columns: its text, and what it states."""
    found = stated({"message": message}).get(STATEMENTS)
    return {
        "message": str(message),
        "statements": None if found is None else json_text(found, "The message"),
    }


def _read(row: JobRow) -> Job:
    """Read a row; damaged text is no reason not to start: a queued job has lost its spec, an ended one its result."""
    message = sentence_in({"message": row.message, STATEMENTS: _json(row.statements)}, "message")
    # one that was cancelled while it waited has begun none
    attempt = max(1, row.attempt + (row.state == "queued"))
    return Job(
        row.id,
        row.kind,
        row.created_at,
        row.state,
        row.progress,
        message,
        _json(row.result),
        _json(row.problem),
        row.ended_at,
        attempt,
        _json(row.spec),
    )


def _json(text: str | None) -> Any:
    with suppress(ValueError):
        return None if text is None else json.loads(text)
    return None
