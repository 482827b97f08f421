"""A job as it is known outside, and the book that keeps jobs while the server runs."""

import secrets
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from threading import Lock
from typing import Any, Literal

from app.errors import NotFound, TouchlineError

State = Literal["queued", "running", "done", "failed", "cancelled"]
ENDED: tuple[State, ...] = ("done", "failed", "cancelled")


@dataclass(frozen=True)
class Job:
    """One state of a job. problem: what went wrong, as `problem_of` writes it. All plain JSON."""

    id: str
    kind: str
    created_at: str  # ISO 8601, UTC
    state: State = "queued"
    progress: float = 0.0
    message: str = "Waiting for its turn"
    result: Any = None
    problem: Mapping[str, Any] | None = None
    ended_at: str | None = None
    attempt: int = 1  # above 1 where a worker was lost in the middle of it

    @property
    def ended(self) -> bool:
        return self.state in ENDED


def problem_of(error: TouchlineError) -> dict[str, Any]:
    """An error as plain JSON, from which a door makes its answer."""
    return {"reason": error.reason, "title": error.title, "status": error.status, "detail": error.what,
            "fix": error.fix, **error.details}


class Book:
    """Jobs by id. Thread-safe. `kept` ended ones stay to be read; older ones are forgotten.

    In memory: who starts the server anew finds it empty.
    """

    def __init__(self, kept: int) -> None:
        self._kept = kept
        self._jobs: dict[str, Job] = {}  # in the order in which they came
        self._held: set[str] = set()
        self._lock = Lock()

    def add(self, kind: str) -> Job:
        job = Job(secrets.token_hex(8), kind, _now())
        with self._lock:
            self._jobs[job.id] = job
        return job

    def get(self, id: str) -> Job:
        """One by its id; NotFound."""
        with self._lock:
            job = self._jobs.get(id)
        if job is None:
            raise NotFound(f"There is no job {id!r}.", f"List them with GET /api/v1/jobs; the last {self._kept} that "
                           "have ended are kept until the server stops.", reason="unknown-job")
        return job

    def all(self) -> tuple[Job, ...]:
        """Newest first."""
        with self._lock:
            return tuple(reversed(self._jobs.values()))

    def ended(self, id: str) -> bool:
        with self._lock:
            return id not in self._jobs or self._jobs[id].ended

    def change(self, id: str, **changes: Any) -> bool:
        """Write a new state; false, and nothing is written, where the job has ended: an end is final."""
        with self._lock:
            return self._change(id, changes)

    def cancel(self, id: str, message: str = "Cancelled") -> bool:
        """End it, unless it has ended or its result is being kept."""
        with self._lock:
            return id not in self._held and self._change(id, {"state": "cancelled", "message": message})

    def hold(self, id: str) -> bool:
        """From here on it cannot be cancelled; false where it was."""
        with self._lock:
            if not self._change(id, {"message": "Keeping the result"}):
                return False
            self._held.add(id)
            return True

    def _change(self, id: str, changes: Mapping[str, Any]) -> bool:
        job = self._jobs.get(id)
        if job is None or job.ended:
            return False
        job = self._jobs[id] = replace(job, **changes)
        if job.ended:
            self._jobs[id] = replace(job, ended_at=_now())
            self._held.discard(id)
            self._forget()
        return True

    def _forget(self) -> None:
        ended = [id for id, job in self._jobs.items() if job.ended]
        for id in ended[:max(0, len(ended) - self._kept)]:
            del self._jobs[id]


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
