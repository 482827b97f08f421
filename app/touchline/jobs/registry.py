"""All jobs by id, and the state of each. Durable ones are rows of a database too, and outlive the server.

A change of state is written to its row first, and only then known here; progress is known here alone. Who reads never
waits for the disk.
"""

import logging
import secrets
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from threading import Lock
from typing import Any, Protocol

from touchline.core.errors import NotFound, TouchlineError
from touchline.core.jobs import Job, JobSpec
from touchline.core.sentences import PROGRESS_DONE
from touchline.core.statements import say

START_AGAIN = say("job.start-again", "Start the job again.")
WAITING_AGAIN = say("job.waiting-again", "The server was restarted; waiting for its turn")
FAILED, CANCELLED = say("job.failed", "Failed"), say("job.cancelled", "Cancelled")
MAX_MESSAGE = 500  # characters
MAX_ROWS = 1_000_000
MAX_UNLISTED = 2000  # more of the last hour are a script's that does not look at them
log = logging.getLogger("touchline")


class JobTable(Protocol):
    """Where durable jobs are stored: the store's jobs, as far as they are needed here."""

    def add(self, kind: str, spec: Any) -> Job: ...
    def list(self, limit: int) -> tuple[Job, ...]: ...
    def save(self, job: Job) -> None: ...
    def forget(self, ids: Sequence[str]) -> None: ...
    def transaction(self) -> AbstractContextManager[Any]: ...


class JobRegistry:
    """Jobs by id. Thread-safe. Of ended ones the newest `kept` are listed; those of the last kept_s can be read too."""

    def __init__(self, kept: int, kept_s: float) -> None:
        self._kept, self._kept_s = kept, kept_s
        self._table: JobTable | None = None
        self._jobs: dict[str, Job] = {}  # in the order in which they came
        self._unlisted: dict[str, Job] = {}  # ended, and not among the newest
        self._durable: set[str] = set()  # those that have a row
        self._completing: set[str] = set()  # their results are being saved
        self._unsaved: dict[str, Job] = {}  # what the database would not take: tried again later
        self._lock = Lock()  # for what is known here
        self._changing = Lock()  # one change of state at a time; who has it may wait for the disk

    def open(self, table: JobTable) -> list[tuple[Job, JobSpec | None]]:
        """Know the jobs that are stored there, and forget those of a table before.

        Returns those that have not ended, oldest first, each with its spec; None for a spec that cannot be read.
        """
        with self._lock:
            for id in self._durable:
                self._jobs.pop(id, None)
                self._unlisted.pop(id, None)
            self._durable.clear()
            self._unsaved.clear()
        unfinished = []
        for stored in reversed(table.list(MAX_ROWS)):
            job = replace(stored, spec=None)
            if not job.ended:
                job = replace(
                    job,
                    state="queued",
                    progress=0.0,
                    attempt=job.attempt + (job.state == "running"),
                    message=WAITING_AGAIN,
                )
                unfinished.append((job, JobSpec.from_json(stored.spec)))
            self._jobs[job.id] = job
            self._durable.add(job.id)
        self._table = table
        self._forget_old()
        return unfinished

    def add(self, kind: str, spec: JobSpec) -> Job:
        """Return a new one, queued; a TouchlineError where it could not be stored."""
        with self._changing:
            table = self._table if spec.durable else None
            if table is None:
                job = Job(secrets.token_hex(8), kind, _now())
            else:
                job = replace(table.add(kind, spec.to_json()), spec=None)
            with self._lock:
                self._jobs[job.id] = job
                if table is not None:
                    self._durable.add(job.id)
        return job

    def get(self, id: str) -> Job:
        """Return one by its id; NotFound."""
        with self._lock:
            job = self._jobs.get(id) or self._unlisted.get(id)
        if job is None:
            raise NotFound(
                f"There is no job {id!r}.",
                f"List jobs with GET /api/v1/jobs. The last {self._kept} ended "
                "jobs are listed, and all jobs that ended in the last "
                f"{self._kept_s / 60:g} minutes.",
                reason="unknown-job",
            )
        return job

    def all(self) -> tuple[Job, ...]:
        """Return all that have not ended and the newest that have, newest first."""
        with self._lock:
            return tuple(reversed(self._jobs.values()))

    def ended(self, id: str) -> bool:
        with self._lock:
            return id not in self._jobs or self._jobs[id].ended

    def begin(self, id: str) -> bool:
        """Note that it runs; False where it has been cancelled. TouchlineError where no row says so."""
        with self._changing:
            return self._change(
                id, must_save=True, state="running", message=say("job.starting", "Starting")
            )

    def report(self, id: str, progress: float, message: str) -> None:
        """Note how far it has come."""
        message = message if len(message) <= MAX_MESSAGE else message[:MAX_MESSAGE]
        with self._lock:
            if id in self._jobs and not self._jobs[id].ended:
                self._jobs[id] = replace(
                    self._jobs[id], progress=min(max(progress, 0.0), 1.0), message=message
                )

    def requeue(self, id: str, message: str) -> bool:
        """Let it wait for another attempt after its worker was lost; False where it has ended meanwhile."""
        with self._changing:
            return self._change(
                id, state="queued", attempt=self.get(id).attempt + 1, progress=0.0, message=message
            )

    def complete(self, id: str, save: Callable[[], Any]) -> bool:
        """End it with the result that `save` returns, stored together with the row or not at all.

        False where it was cancelled before. TouchlineError where it could not be stored.
        """
        with self._changing, self._lock:
            if id not in self._jobs or self._jobs[id].ended:
                return False
            self._completing.add(id)
            job = self._jobs[id] = replace(
                self._jobs[id], message=say("job.saving", "Saving the result")
            )
        table = self._table_of(id)
        with table.transaction() if table else nullcontext():
            job = _changed(job, state="done", progress=1.0, message=PROGRESS_DONE, result=save())
            if table:
                table.save(job)
        with self._changing:
            self._know(job)
        return True

    def fail(self, id: str, problem: dict[str, Any]) -> bool:
        """End it with a problem; false where it had ended."""
        with self._changing:
            return self._change(id, state="failed", message=FAILED, problem=problem)

    def cancel(self, id: str, message: str = CANCELLED) -> bool:
        """End it, unless it has ended or its result is being kept."""
        with self._changing:
            return id not in self._completing and self._change(
                id, state="cancelled", message=message
            )

    def suspend(self, id: str) -> bool:
        """Stop it with the server.

        A durable one goes on when the server is back, as the same attempt; others are cancelled.
        """
        if self._table_of(id) is None:
            return self.cancel(id, say("job.server-stopped", "The server was stopped"))
        with self._changing:
            return id not in self._completing and self._change(
                id,
                state="queued",
                progress=0.0,
                message=say(
                    "job.continues",
                    "The server was stopped. The job continues when the server is back",
                ),
            )

    def _table_of(self, id: str) -> JobTable | None:
        return self._table if id in self._durable else None

    def _change(self, id: str, *, must_save: bool = False, **changes: Any) -> bool:
        """Save a new state and know it; False where it has ended. must_save: a TouchlineError where it is not saved."""
        if self.ended(id):
            return False
        job = _changed(self.get(id), **changes)
        if table := self._table_of(id):
            if must_save:
                self._unsaved.pop(id, None)
                table.save(job)
            else:
                self._save(table, job)
        self._know(job)
        return True

    def _save(self, table: JobTable, job: Job) -> None:
        """Write its row. What the database does not take now is tried again with the next change of any job."""
        self._unsaved[job.id] = job
        for id, waiting in list(self._unsaved.items()):
            try:
                table.save(waiting)
            except TouchlineError as error:
                log.warning("a job's state was not saved: %s", error)
                return
            self._unsaved.pop(id, None)

    def _know(self, job: Job) -> None:
        with self._lock:
            self._jobs[job.id] = job
            if job.ended:
                self._completing.discard(job.id)
        if job.ended:
            self._forget_old()

    def _forget_old(self) -> None:
        with self._lock:
            ended = [job for job in self._jobs.values() if job.ended]
            for job in ended[: max(0, len(ended) - self._kept)]:
                self._unlisted[job.id] = self._jobs.pop(job.id)
            recent, excess = _now(-self._kept_s), len(self._unlisted) - MAX_UNLISTED
            old = [
                job.id
                for n, job in enumerate(self._unlisted.values())
                if n < excess or (job.ended_at or "") <= recent
            ]
            stored = [id for id in old if id in self._durable]
            for id in old:
                del self._unlisted[id]
            self._durable.difference_update(old)
        if self._table is not None and stored:
            try:
                self._table.forget(stored)
            except TouchlineError as error:
                log.warning("old jobs were not forgotten: %s", error)


def _changed(job: Job, **changes: Any) -> Job:
    job = replace(job, **changes)
    return replace(job, ended_at=_now()) if job.ended else job


def _now(later_s: float = 0.0) -> str:
    now = datetime.now(UTC) + timedelta(seconds=later_s)
    return now.isoformat(timespec="milliseconds").replace("+00:00", "Z")
