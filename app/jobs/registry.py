"""The book of jobs: what each has come to. Those that last are rows of a database too, and outlive the server.

A change of state is written to its row first, and only then known here. Between two states progress is known here
alone; a beat now and then writes it down. Who reads never waits for the disk.
"""

import logging
import secrets
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import asdict, fields, replace
from datetime import UTC, datetime
from threading import Lock
from time import monotonic
from typing import Any, Protocol

from app.core.errors import NotFound, TouchlineError, Unavailable
from app.jobs.job import WAITING, Job, JobSpec

BEAT_S = 2.0
LEASE_S = 60.0  # far above a beat: a disk that is slow for a moment takes nobody's job away
MAX_ROWS = 1_000_000
log = logging.getLogger("touchline")


class JobTable(Protocol):
    """Where lasting jobs are kept: the store's jobs, as far as they are needed here."""

    def add(self, kind: str, spec: Any) -> Any: ...
    def list(self, limit: int) -> tuple[Any, ...]: ...
    def claim(self, worker: str, lease_s: float, *, id: str) -> Any: ...
    def beat(self, id: str, attempt: int, lease_s: float, progress: float, message: str) -> bool: ...
    def finish(self, id: str, attempt: int, state: str, result: Any, problem: Any, message: str) -> bool: ...
    def requeue(self, id: str, attempt: int, message: str, *, counts: bool) -> bool: ...
    def cancel(self, id: str, message: str) -> Any: ...
    def forget(self, kept: int) -> None: ...
    def together(self) -> AbstractContextManager[Any]: ...


class JobRegistry:
    """Jobs by id. Thread-safe. `kept` ended ones stay to be read; older ones are forgotten."""

    def __init__(self, kept: int) -> None:
        self._kept = kept
        self._rows: JobTable | None = None
        self._jobs: dict[str, Job] = {}  # in the order in which they came
        self._beaten: dict[str, float] = {}  # of lasting jobs: when their row was written last, s
        self._held: set[str] = set()
        self._owed: dict[str, Callable[[], Any]] = {}  # what the database would not take: tried again later
        self._lock = Lock()  # for what is known here
        self._changing = Lock()  # one change of state at a time; who has it may wait for the disk

    def open(self, rows: JobTable) -> list[tuple[Job, JobSpec | None]]:
        """Know the jobs that are kept there: those that have not ended, oldest first, each with its order.

        None for an order that cannot be read.
        """
        found = []
        for kept in reversed(rows.list(MAX_ROWS)):
            job = Job(kept.id, kept.kind, kept.created_at, kept.state, kept.progress, kept.message, kept.result,
                      kept.problem, kept.ended_at, max(1, kept.attempt))
            if not job.ended:
                again = "The server was started anew; " + WAITING.lower() if kept.state == "running" else kept.message
                job = replace(job, state="queued", progress=0.0, attempt=kept.attempt + 1, message=again)
                found.append((job, _order(kept.spec)))
            self._jobs[job.id] = job
            self._beaten[job.id] = monotonic()
        self._rows = rows
        return found

    def add(self, kind: str, order: JobSpec) -> Job:
        """A new one, queued; a TouchlineError where it could not be kept."""
        job = Job(secrets.token_hex(8), kind, _now())
        with self._changing:
            if self._rows is not None and order.lasts:
                row = self._rows.add(kind, asdict(order))
                job = replace(job, id=row.id, created_at=row.created_at)
            with self._lock:
                self._jobs[job.id] = job
                if self._rows is not None and order.lasts:
                    self._beaten[job.id] = monotonic()
        return job

    def get(self, id: str) -> Job:
        """One by its id; NotFound."""
        with self._lock:
            job = self._jobs.get(id)
        if job is None:
            raise NotFound(f"There is no job {id!r}.", f"List them with GET /api/v1/jobs; of those that have ended the "
                           f"last {self._kept} are kept.", reason="unknown-job")
        return job

    def all(self) -> tuple[Job, ...]:
        """Newest first."""
        with self._lock:
            return tuple(reversed(self._jobs.values()))

    def ended(self, id: str) -> bool:
        with self._lock:
            return id not in self._jobs or self._jobs[id].ended

    def begin(self, id: str, worker: str) -> bool:
        """A worker takes it up; false where it has been cancelled meanwhile. TouchlineError where no row says so."""
        with self._changing:
            if self.ended(id):
                return False
            if rows := self._rows_of(id):
                rows.claim(worker, LEASE_S, id=id)
            return self._know(id, state="running", message="Starting")

    def report(self, id: str, progress: float, message: str) -> None:
        """How far it has come."""
        with self._lock:
            if id in self._jobs and not self._jobs[id].ended:
                self._jobs[id] = replace(self._jobs[id], progress=progress, message=message)

    def beat(self, id: str) -> None:
        """Its worker is alive; asked often, written now and then."""
        with self._lock:
            job = self._jobs.get(id)
            if job is None or job.state != "running" or id not in self._beaten or (
                    monotonic() < self._beaten[id] + BEAT_S):
                return
            self._beaten[id] = monotonic()
        with self._changing:
            self._write(id, lambda rows: rows.beat(id, job.attempt, LEASE_S, job.progress, job.message))

    def again(self, id: str, message: str) -> bool:
        """Its worker was lost: it waits for another attempt. False where it has ended meanwhile."""
        with self._changing:
            if self.ended(id):
                return False
            attempt = self.get(id).attempt
            self._write(id, lambda rows: rows.requeue(id, attempt, message, counts=True))
            return self._know(id, state="queued", attempt=attempt + 1, progress=0.0, message=message)

    def done(self, id: str, keep: Callable[[], Any]) -> bool:
        """End it with what `keep` returns, which is kept together with the row or not at all; false where it was
        cancelled before. TouchlineError where it could not be kept."""
        with self._changing, self._lock:
            if id not in self._jobs or self._jobs[id].ended:
                return False
            self._held.add(id)
            job = self._jobs[id] = replace(self._jobs[id], message="Keeping the result")
        rows = self._rows_of(id)
        if rows is None:
            result = keep()
        else:
            with rows.transaction():
                result = keep()
                if not rows.finish(id, job.attempt, "done", result, None, "Done"):
                    raise Unavailable("The job's row says that somebody else has it.", "Ask for the job again.",
                                      reason="job-lost")
        with self._changing:
            return self._know(id, state="done", progress=1.0, message="Done", result=result)

    def fail(self, id: str, problem: dict[str, Any]) -> bool:
        """End it with a problem; false where it had ended."""
        with self._changing:
            if self.ended(id):
                return False
            job = self.get(id)

            def end(rows: JobTable) -> None:
                attempt = job.attempt if job.state == "running" else rows.claim("nobody", LEASE_S, id=id).attempt
                rows.finish(id, attempt, "failed", None, problem, "Failed")
            self._write(id, end)
            return self._know(id, state="failed", message="Failed", problem=problem)

    def cancel(self, id: str, message: str = "Cancelled") -> bool:
        """End it, unless it has ended or its result is being kept."""
        with self._changing:
            if self.ended(id) or id in self._held:
                return False
            self._write(id, lambda rows: rows.cancel(id, message))
            return self._know(id, state="cancelled", message=message)

    def put_off(self, id: str) -> bool:
        """The server stops: what lasts is done when it is back, and the attempt does not count. Else as cancelled."""
        message = "The server was stopped"
        if self._rows_of(id) is None:
            return self.cancel(id, message)
        with self._changing:
            if self.ended(id) or id in self._held:
                return False
            job = self.get(id)
            if job.state == "running":
                self._write(id, lambda rows: rows.requeue(id, job.attempt, message, counts=False))
            return self._know(id, state="queued", progress=0.0, message=f"{message}; this goes on when it is back")

    def _rows_of(self, id: str) -> JobTable | None:
        return self._rows if id in self._beaten else None

    def _write(self, id: str, deed: Callable[[JobTable], Any]) -> None:
        """Tell the row. What the database does not take now is tried again with the next change of any job."""
        rows = self._rows_of(id)
        if rows is None:
            return
        self._owed[id] = lambda: deed(rows)
        for owed in list(self._owed):
            try:
                self._owed[owed]()
            except TouchlineError as error:
                log.warning("a job's state was not saved: %s", error)
                return
            self._owed.pop(owed, None)

    def _know(self, id: str, **changes: Any) -> bool:
        with self._lock:
            job = self._jobs.get(id)
            if job is None or job.ended:
                return False
            job = self._jobs[id] = replace(job, **changes)
            if not job.ended:
                return True
            self._jobs[id] = replace(job, ended_at=_now())
            self._held.discard(id)
            ended = [id for id, job in self._jobs.items() if job.ended]
            old = ended[:max(0, len(ended) - self._kept)]
            rows = self._rows if any(id in self._beaten for id in old) else None
            for id in old:
                del self._jobs[id]
                self._beaten.pop(id, None)
        if rows is not None:
            self._forget(rows)
        return True

    def _forget(self, rows: JobTable) -> None:
        try:
            rows.prune(self._kept)
        except TouchlineError as error:
            log.warning("old jobs were not forgotten: %s", error)


def _order(spec: Any) -> JobSpec | None:
    """As it was written; None for what is none: damaged, or from another version."""
    names = {field.name for field in fields(JobSpec)}
    whole = isinstance(spec, dict) and spec.keys() <= names and isinstance(spec.get("run"), str) and "spec" in spec
    return JobSpec(**spec) if whole else None


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
