"""What the end of a job means to who wants it, and what to do."""

import logging
import secrets
from typing import Any

from touchline.core.errors import BadInput, TouchlineError, Unavailable
from touchline.core.jobs import problem_of
from touchline.core.statements import say
from touchline.jobs.runner import JobFailed, JobTimeout, WorkerDied

MAX_ATTEMPTS = 3  # a worker may be lost by chance twice; a job that has lost three is itself to blame
log = logging.getLogger("touchline")


def problem_of_failure(error: Exception, wall_s: float) -> dict[str, Any]:
    """Return the problem, as problem_of writes it, of what a runner has raised; wall_s: the longest a job may take."""
    if isinstance(error, JobFailed) and "detail" in error.problem:
        return error.problem
    return problem_of(_explained(error, wall_s))


def _explained(error: Exception, wall_s: float) -> TouchlineError:
    if isinstance(error, TouchlineError):
        return error
    if isinstance(error, WorkerDied):
        return Unavailable(say("job.process-died", "The process that ran this job ended before the job was "
                               "complete, {times} times.", times=MAX_ATTEMPTS),
                           say("job.reduce-or-check-workers", "Reduce the size of the job. On a cluster, check "
                               "the memory limit and the log of its workers."), reason="worker-died")
    if isinstance(error, JobTimeout):
        return BadInput(say("job.too-long", "The job took longer than {seconds:g} s.", seconds=wall_s),
                        say("job.reduce", "Reduce the size of the job."), reason="job-too-long")
    if isinstance(error, JobFailed) and error.problem["reason"] == "job-needs-memory":
        return BadInput(say("job.needs-memory", "The job needs more memory than it is allowed."),
                        say("job.fewer-images", "Use fewer or smaller images."), reason="job-needs-memory")
    id = secrets.token_hex(4)
    log.error("unexpected error %s in a job: %s", id,
              error.problem.get("trace") if isinstance(error, JobFailed) else repr(error))
    return Unavailable(say("job.unexpected", "An unexpected error occurred (error {error}).", error=id),
                       say("job.report-error", "Try again. If the error remains, report it with the log around "
                           "error {error}.", error=id), reason="unexpected")
