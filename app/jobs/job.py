"""A job as it is known outside, and what its problem is as plain JSON."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from app.core.errors import TouchlineError

State = Literal["queued", "running", "done", "failed", "cancelled"]
ENDED: tuple[State, ...] = ("done", "failed", "cancelled")
WAITING = "Waiting for its turn"


@dataclass(frozen=True)
class Job:
    """One state of a job. problem: what went wrong, as `problem_of` writes it. All plain JSON."""

    id: str
    kind: str
    created_at: str  # ISO 8601, UTC
    state: State = "queued"
    progress: float = 0.0
    message: str = WAITING
    result: Any = None
    problem: Mapping[str, Any] | None = None
    ended_at: str | None = None
    attempt: int = 1  # above 1 where a worker was lost in the middle of it

    @property
    def ended(self) -> bool:
        return self.state in ENDED


@dataclass(frozen=True)
class JobSpec:
    """What a job shall do. run: "module:function"; spec and about: plain JSON.

    keep: the name of a keeper, given what run returned and `about`. lasts: the job is worth doing although nobody
    waits for it, so one that a stop of the server cut short is done when the server is back.
    """

    run: str
    spec: Any
    keep: str | None = None
    about: Any = None
    lasts: bool = True


def problem_of(error: TouchlineError) -> dict[str, Any]:
    """An error as plain JSON, from which a door makes its answer."""
    return {"reason": error.reason, "title": error.title, "status": error.status, "detail": error.what,
            "fix": error.fix, **error.details}
