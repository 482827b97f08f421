"""Refusals as they cross the socket between a child process and its parent."""

from collections.abc import Callable, Mapping
from typing import Any

from app.core.errors import BadInput, NotFound, ProblemJson, TouchlineError, Unavailable
from app.core.statements import sentence_in
from app.processes.framing import ANSWER, Connection, encode_body

KINDS: dict[str, type[TouchlineError]] = {kind.__name__: kind for kind in (BadInput, NotFound, Unavailable)}


class CrossingProblem(ProblemJson):
    kind: str


def problem_json(error: TouchlineError) -> CrossingProblem:
    return {"kind": type(error).__name__, **error.to_json()}


def error_from_json(problem: Mapping[str, Any]) -> TouchlineError:
    """Return the error to raise in the parent; Unavailable for a kind that does not cross."""
    kind = KINDS.get(problem.get("kind", ""), Unavailable)
    return kind(sentence_in(problem, "what"), sentence_in(problem, "fix"), reason=problem["reason"])


def answer(connection: Connection, number: int, action: Callable[[], tuple[dict[str, Any], bytes]]) -> None:
    """Answer a request with what the action returns, JSON and payload, or with its refusal."""
    try:
        head, payload = action()
    except TouchlineError as error:
        head, payload = {"problem": problem_json(error)}, b""
    connection.send(ANSWER, number, encode_body(head, payload))
