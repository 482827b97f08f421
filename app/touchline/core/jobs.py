"""A job: who wants it (Caller), what it is to do (JobSpec), how it reports its progress, and one state of it (Job).

A call of Progress raises where the job was cancelled.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, Self

from touchline.core.errors import (
    BadInput,
    Busy,
    Conflict,
    DiskFull,
    ImageTooLarge,
    NotFound,
    Stale,
    TouchlineError,
    Unavailable,
)
from touchline.core.statements import STATEMENTS, join, say, sentence_in, stated

Progress = Callable[[float, str], None]

BY_STATUS = {
    kind.status: kind
    for kind in (BadInput, ImageTooLarge, NotFound, Conflict, Stale, Busy, Unavailable, DiskFull)
}
PROBLEM_MEMBERS = ("reason", "title", "status", "detail", "fix", STATEMENTS)
WAITING = say("job.waiting", "Waiting for its turn")
# names in stored rows
STORED = {"run": "run", "spec": "spec", "saver": "keep", "context": "about", "durable": "lasts"}


def no_progress(fraction: float, message: str) -> None:
    """Ignore progress."""


def subprogress(progress: Progress, start: float, end: float, title: str = "") -> Progress:
    """Return the progress callback of one part of a longer work, mapped to [start, end] of the whole."""
    return lambda share, words: progress(start + share * (end - start), join(title, words))


State = Literal["queued", "running", "done", "failed", "cancelled"]
ENDED: tuple[State, ...] = ("done", "failed", "cancelled")


class Caller(NamedTuple):
    """Who wants a job. address: of the connection; name: what the caller says, which nothing proves."""

    address: str = ""
    name: str = ""


NOBODY = Caller()


@dataclass(frozen=True)
class JobSpec:
    """What a job does. run: the name of its function; spec and context: plain JSON.

    saver: the name of a result saver, given what run returned and the context. durable: the job is worth doing
    although nobody waits for it, so one that a stop of the server interrupted is done when the server is back.
    """

    run: str
    spec: Any
    saver: str | None = None
    context: Any = None
    durable: bool = True

    def to_json(self) -> dict[str, Any]:
        return {STORED[name]: value for name, value in vars(self).items()}

    @classmethod
    def from_json(cls, value: Any) -> Self | None:
        """Return what was stored; None where it is damaged, or another version's."""
        names = {stored: name for name, stored in STORED.items()}
        if not (
            isinstance(value, dict)
            and value.keys() <= names.keys()
            and isinstance(value.get("run"), str)
            and "spec" in value
        ):
            return None
        return cls(**{names[stored]: one for stored, one in value.items()})


@dataclass(frozen=True)
class Job:
    """One state of a job. problem: what went wrong, as problem_of writes it. All plain JSON."""

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
    spec: Any = None  # a JobSpec as JSON, where it is read from a row: for the server alone

    @property
    def ended(self) -> bool:
        return self.state in ENDED

    def to_json(self) -> dict[str, Any]:
        """Return what everybody may know of it."""
        return stated({name: value for name, value in vars(self).items() if name != "spec"})


def problem_of(error: TouchlineError) -> dict[str, Any]:
    """Return an error as plain JSON, from which the API makes its answer."""
    return stated(
        {
            "reason": error.reason,
            "title": error.title,
            "status": error.status,
            "detail": error.what,
            "fix": error.fix,
            **error.details,
        }
    )


def error_of(problem: Mapping[str, Any]) -> TouchlineError:
    """Return the error that a problem, as problem_of writes it, was made from."""
    kind = BY_STATUS.get(problem.get("status", 0), Unavailable)
    details = {name: value for name, value in problem.items() if name not in PROBLEM_MEMBERS}
    return kind(
        sentence_in(problem, "detail"),
        sentence_in(problem, "fix"),
        reason=problem["reason"],
        **details,
    )
