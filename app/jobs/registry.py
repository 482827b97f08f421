"""All jobs by id, and the state of each. Durable ones are rows of a database too, and outlive the server.

A change of state is written to its row first, and only then known here. Between two states progress is known here
alone; a heartbeat now and then writes it down. Who reads never waits for the disk.
"""

import logging
import secrets
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from threading import Lock
from time import monotonic
from typing import Any, Protocol

from app.core.common_sentences import PROGRESS_DONE
from app.core.errors import NotFound, TouchlineError, Unavailable
from app.core.jobs import Job, JobSpec
from app.core.statements import say

START_AGAIN = say("job.start-again", "Start the job again.")
WAITING_AGAIN = say("job.waiting-again", "The server was restarted; waiting for its turn")
FAILED, CANCELLED = say("job.failed", "Failed"), say("job.cancelled", "Cancelled")
MAX_MESSAGE = 500  # characters
BEAT_S = 2.0
LEASE_S = 60.0  # far above a beat: a disk that is slow for a moment takes nobody's job away
MAX_ROWS = 1_000_000
MAX_UNLISTED = 2000  # more of the last hour are a script's that does not look at them
log = logging.getLogger("touchline")


class JobTable(Protocol):
    """Where durable jobs are stored: the store's jobs, as far as they are needed here."""

    def add(self, kind: str, spec: Any) -> Job: ...
    def list(self, limit: int) -> tuple[Job, ...]: ...
    def claim(self, worker: str, lease_s: float, *, id: str) -> Job | None: ...
    def beat(self, id: str, attempt: int, lease_s: float, progress: float, message: str) -> bool: ...
    def finish(self, id: str, attempt: int, state: str, result: Any, problem: Any, message: str) -> bool: ...
    def requeue(self, id: str, attempt: int, message: str, *, counts: bool) -> bool: ...
    def cancel(self, id: str, message: str) -> Job: ...
    def forget(self, ids: Sequence[str]) -> None: ...
    def transaction(self) -> AbstractContextManager[Any]: ...


class JobRegistry:
    """Jobs by id. Thread-safe. Of ended ones the newest `kept` are listed; those of the last kept_s can be read too."""

    def __init__(self, kept: int, kept_s: float) -> None:
        self._kept, self._kept_s = kept, kept_s
        self._table: JobTable | None = None
        self._jobs: dict[str, Job] = {}  # in the order in which they came
        self._unlisted: dict[str, Job] = {}  # ended, and not among the newest
        self._written_s: dict[str, float] = {}  # of durable jobs: when their row was written last
        self._completing: set[str] = set()  # their results are being saved
        self._unwritten: dict[str, Callable[[], Any]] = {}  # what the database would not take: tried again later
        self._lock = Lock()  # for what is known here
        self._changing = Lock()  # one change of state at a time; who has it may wait for the disk

    def open(self, table: JobTable) -> list[tuple[Job, JobSpec | None]]:
        """Know the jobs that are stored there, and forget those of a table before.

        Returns those that have not ended, oldest first, each with its spec; None for a spec that cannot be read.
        """
        with self._lock:
            for id in self._written_s:
                self._jobs.pop(id, None)
                self._unlisted.pop(id, None)
            self._written_s.clear()
        unfinished = []
        for stored in reversed(table.list(MAX_ROWS)):
            job = replace(stored, spec=None, attempt=max(1, stored.attempt))
            if not job.ended:
                message = WAITING_AGAIN if job.state == "running" else job.message
                job = replace(job, state="queued", progress=0.0, attempt=stored.attempt + 1, message=message)
                unfinished.append((job, JobSpec.from_json(stored.spec)))
            self._jobs[job.id] = job
            self._written_s[job.id] = monotonic()
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
                job = replace(table.add(kind, spec.to_json()), spec=None, attempt=1)
            with self._lock:
                self._jobs[job.id] = job
                if table is not None:
                    self._written_s[job.id] = monotonic()
        return job

    def get(self, id: str) -> Job:
        """Return one by its id; NotFound."""
        with self._lock:
            job = self._jobs.get(id) or self._unlisted.get(id)
        if job is None:
            raise NotFound(f"There is no job {id!r}.", f"List jobs with GET /api/v1/jobs. The last {self._kept} ended "
                                                       "jobs are listed, and all jobs that ended in the last "
                                                       f"{self._kept_s / 60:g} minutes.",
                           reason="unknown-job")
        return job

    def all(self) -> tuple[Job, ...]:
        """Return all that have not ended and the newest that have, newest first."""
        with self._lock:
            return tuple(reversed(self._jobs.values()))

    def ended(self, id: str) -> bool:
        with self._lock:
            return id not in self._jobs or self._jobs[id].ended

    def begin(self, id: str, worker: str) -> bool:
        """Note that a worker runs it; False where it has been cancelled. TouchlineError where no row says so."""
        with self._changing:
            if self.ended(id):
                return False
            if table := self._table_of(id):
                table.claim(worker, LEASE_S, id=id)
            return self._update(id, state="running", message=say("job.starting", "Starting"))

    def report(self, id: str, progress: float, message: str) -> None:
        """Note how far it has come."""
        message = message if len(message) <= MAX_MESSAGE else message[:MAX_MESSAGE]
        with self._lock:
            if id in self._jobs and not self._jobs[id].ended:
                self._jobs[id] = replace(self._jobs[id], progress=min(max(progress, 0.0), 1.0), message=message)

    def beat(self, id: str) -> None:
        """Note that its worker is alive; called often, written now and then."""
        with self._lock:
            job = self._jobs.get(id)
            if job is None or job.state != "running" or id not in self._written_s or (
                    monotonic() < self._written_s[id] + BEAT_S):
                return
            self._written_s[id] = monotonic()
        with self._changing:
            self._write(id, lambda table: table.beat(id, job.attempt, LEASE_S, job.progress, job.message))

    def requeue(self, id: str, message: str) -> bool:
        """Let it wait for another attempt after its worker was lost; False where it has ended meanwhile."""
        with self._changing:
            if self.ended(id):
                return False
            attempt = self.get(id).attempt
            self._write(id, lambda table: table.requeue(id, attempt, message, counts=True))
            return self._update(id, state="queued", attempt=attempt + 1, progress=0.0, message=message)

    def complete(self, id: str, save: Callable[[], Any]) -> bool:
        """End it with the result that `save` returns, stored together with the row or not at all.

        False where it was cancelled before. TouchlineError where it could not be stored.
        """
        with self._changing, self._lock:
            if id not in self._jobs or self._jobs[id].ended:
                return False
            self._completing.add(id)
            job = self._jobs[id] = replace(self._jobs[id], message=say("job.saving", "Saving the result"))
        table = self._table_of(id)
        if table is None:
            result = save()
        else:
            with table.transaction():
                result = save()
                if not table.finish(id, job.attempt, "done", result, None, PROGRESS_DONE):
                    raise Unavailable(say("job.taken-over", "The job was taken over by another server."), START_AGAIN,
                                      reason="job-lost")
        with self._changing:
            return self._update(id, state="done", progress=1.0, message=PROGRESS_DONE, result=result)

    def fail(self, id: str, problem: dict[str, Any]) -> bool:
        """End it with a problem; false where it had ended."""
        with self._changing:
            if self.ended(id):
                return False
            job = self.get(id)

            def end(table: JobTable) -> None:
                claimed = job if job.state == "running" else table.claim("nobody", LEASE_S, id=id)
                if claimed is not None:
                    table.finish(id, claimed.attempt, "failed", None, problem, FAILED)
            self._write(id, end)
            return self._update(id, state="failed", message=FAILED, problem=problem)

    def cancel(self, id: str, message: str = CANCELLED) -> bool:
        """End it, unless it has ended or its result is being kept."""
        with self._changing:
            if self.ended(id) or id in self._completing:
                return False
            self._write(id, lambda table: table.cancel(id, message))
            return self._update(id, state="cancelled", message=message)

    def suspend(self, id: str) -> bool:
        """Stop it with the server: a durable one goes on when that is back, as the same attempt; others are cancelled.
        """
        message = say("job.server-stopped", "The server was stopped")
        if self._table_of(id) is None:
            return self.cancel(id, message)
        with self._changing:
            if self.ended(id) or id in self._completing:
                return False
            job = self.get(id)
            if job.state == "running":
                self._write(id, lambda table: table.requeue(id, job.attempt, message, counts=False))
            return self._update(id, state="queued", progress=0.0, message=say(
                "job.continues", "The server was stopped. The job continues when the server is back"))

    def _table_of(self, id: str) -> JobTable | None:
        return self._table if id in self._written_s else None

    def _write(self, id: str, change: Callable[[JobTable], Any]) -> None:
        """Change its row. What the database does not take now is tried again with the next change of any job."""
        table = self._table_of(id)
        if table is None:
            return
        self._unwritten[id] = lambda: change(table)
        for waiting in list(self._unwritten):
            try:
                self._unwritten[waiting]()
            except TouchlineError as error:
                log.warning("a job's state was not saved: %s", error)
                return
            self._unwritten.pop(waiting, None)

    def _update(self, id: str, **changes: Any) -> bool:
        with self._lock:
            job = self._jobs.get(id)
            if job is None or job.ended:
                return False
            job = self._jobs[id] = replace(job, **changes)
            if not job.ended:
                return True
            self._jobs[id] = replace(job, ended_at=_now())
            self._completing.discard(id)
        self._forget_old()
        return True

    def _forget_old(self) -> None:
        with self._lock:
            ended = [job for job in self._jobs.values() if job.ended]
            for job in ended[:max(0, len(ended) - self._kept)]:
                self._unlisted[job.id] = self._jobs.pop(job.id)
            recent, excess = _now(-self._kept_s), len(self._unlisted) - MAX_UNLISTED
            old = [job.id for n, job in enumerate(self._unlisted.values())
                   if n < excess or (job.ended_at or "") <= recent]
            stored = [id for id in old if self._written_s.pop(id, None) is not None]
            for id in old:
                del self._unlisted[id]
        if self._table is not None and stored:
            try:
                self._table.forget(stored)
            except TouchlineError as error:
                log.warning("old jobs were not forgotten: %s", error)


def _now(later_s: float = 0.0) -> str:
    now = datetime.now(UTC) + timedelta(seconds=later_s)
    return now.isoformat(timespec="milliseconds").replace("+00:00", "Z")
