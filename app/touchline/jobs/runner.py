"""What runs jobs, and a runner in a process of this machine: started when needed, killed when it does not stop."""

import json
import logging
import secrets
import time
from collections.abc import Callable
from threading import Lock
from typing import Any, Protocol

from touchline.core.errors import BadInput, TouchlineError, Unavailable
from touchline.core.jobs import problem_of
from touchline.core.statements import say, sentence_in
from touchline.jobs import worker_main
from touchline.processes.framing import decode_body, encode_body, split_body
from touchline.processes.start import ChildProcess, Program

Report = Callable[[float, str], None]  # fraction, message

# a worker may be lost by chance twice; a job that has lost three is itself to blame
MAX_ATTEMPTS = 3

START_S = 30.0  # importing OpenCV takes 0.3 s, on a busy small machine some seconds
STOP_S = 1.0  # a cancelled job has so long to stop by itself
POLL_S = 0.05  # how often we look whether a job is still wanted
NICE = 5  # what others wait for goes first
MAX_ANSWER_BYTES = 64 << 20
log = logging.getLogger("touchline")


class WorkerDied(Exception):
    """What did the job ended in the middle of it, or does not start. Another try may end better."""


class JobTimeout(Exception):
    """The job took longer than it may."""


class JobStopped(Exception):
    """The job was cancelled, and is no longer being done."""


class JobFailed(Exception):
    """The job ended with a problem, plain JSON."""

    def __init__(self, problem: dict[str, Any]) -> None:
        super().__init__(problem["reason"])
        self.problem = problem


class JobRunner(Protocol):
    """Runs one job at a time. Only end() may be called by another thread than its own."""

    def run(
        self, run: str, spec: Any, report: Report, is_wanted: Callable[[], bool], wall_s: float
    ) -> Any:
        """Do a job once and return its result, plain JSON; run is "module:function".

        is_wanted: asked several times a second; once it says no, the job is stopped or abandoned. Raises one of the
        four above, or a TouchlineError where no worker can be had.
        """

    def end(self) -> None:
        """End for good what is being done; whoever waits for it gets WorkerDied or JobStopped."""

    def close(self) -> None:
        """Let go of what stands behind the runner."""


def problem_of_failure(error: Exception, wall_s: float) -> dict[str, Any]:
    """Return the problem, as problem_of writes it, of what a runner has raised; wall_s: the longest a job may take."""
    if isinstance(error, JobFailed) and "detail" in error.problem:
        return error.problem
    return problem_of(_explained(error, wall_s))


def _explained(error: Exception, wall_s: float) -> TouchlineError:
    if isinstance(error, TouchlineError):
        return error
    if isinstance(error, WorkerDied):
        return Unavailable(
            say(
                "job.process-died",
                "The process that ran this job ended before the job was complete, {times} times.",
                times=MAX_ATTEMPTS,
            ),
            say(
                "job.reduce-or-check-workers",
                "Reduce the size of the job. On a cluster, check "
                "the memory limit and the log of its workers.",
            ),
            reason="worker-died",
        )
    if isinstance(error, JobTimeout):
        return BadInput(
            say("job.too-long", "The job took longer than {seconds:g} s.", seconds=wall_s),
            say("job.reduce", "Reduce the size of the job."),
            reason="job-too-long",
        )
    if isinstance(error, JobFailed) and error.problem["reason"] == "job-needs-memory":
        return BadInput(
            say("job.needs-memory", "The job needs more memory than it is allowed."),
            say("job.fewer-images", "Use fewer or smaller images."),
            reason="job-needs-memory",
        )
    id = secrets.token_hex(4)
    log.error(
        "unexpected error %s in a job: %s",
        id,
        error.problem.get("trace") if isinstance(error, JobFailed) else repr(error),
    )
    return Unavailable(
        say("job.unexpected", "An unexpected error occurred (error {error}).", error=id),
        say(
            "job.report-error",
            "Try again. If the error remains, report it with the log around error {error}.",
            error=id,
        ),
        reason="unexpected",
    )


class ProcessRunner:
    """Runs one job at a time. Only end() may be called by another thread than its own."""

    def __init__(self, memory_bytes: int, modules: tuple[str, ...] = (), nice: int = NICE) -> None:
        self._program = Program("touchline.jobs.worker_main:main", memory_bytes, nice)
        self._modules = modules
        self._child: ChildProcess | None = None
        self._number = 0
        self._has_begun = False
        self._lock = Lock()
        self._closed = False

    def warm(self) -> None:
        """Start the process before its first job; WorkerDied where none can be started."""
        try:
            self._started()
        except OSError:
            self.close()
            raise WorkerDied from None

    @property
    def pid(self) -> int | None:
        """The process, None where none runs."""
        child = self._child
        return child.pid if child and child.is_alive else None

    def run(
        self, run: str, spec: Any, report: Report, is_wanted: Callable[[], bool], wall_s: float
    ) -> Any:
        """Do a job and return its result; see runner.py."""
        return json.loads(self.run_to_text(run, spec, report, is_wanted, wall_s))

    def run_to_text(
        self, run: str, spec: Any, report: Report, is_wanted: Callable[[], bool], wall_s: float
    ) -> bytes:
        """Do a job and return its result as JSON text, in ASCII; otherwise as run.

        A process that stood idle may have died unseen: a job that it never began is given to a new one.
        """
        stood_idle = self.pid is not None
        try:
            return self._run_once(run, spec, report, is_wanted, wall_s)
        except WorkerDied:
            if not stood_idle or self._has_begun or self._closed:
                raise
            return self._run_once(run, spec, report, is_wanted, wall_s)

    def end(self) -> None:
        """End the process for good; whoever waits for its job gets WorkerDied."""
        with self._lock:
            self._closed = True
            if self._child is not None:
                self._child.end()

    def close(self) -> None:
        """Let go of the process; only for who runs jobs on it."""
        with self._lock:
            self._close()

    def _run_once(
        self, run: str, spec: Any, report: Report, is_wanted: Callable[[], bool], wall_s: float
    ) -> bytes:
        deadline = time.monotonic() + wall_s
        self._number += 1
        self._has_begun = False
        try:
            child = self._started()
            self._send(child, worker_main.RUN, {"run": run, "spec": spec})
            return self._follow(child, report, is_wanted, deadline)
        except OSError:
            self.close()
            raise WorkerDied from None
        except (JobTimeout, JobStopped):
            self.close()
            raise

    def _follow(
        self, child: ChildProcess, report: Report, is_wanted: Callable[[], bool], deadline: float
    ) -> bytes:
        stopping = False
        while True:
            if not stopping and not is_wanted():
                stopping, deadline = True, min(deadline, time.monotonic() + STOP_S)
                self._send(child, worker_main.CANCEL, {})
            if time.monotonic() > deadline:
                raise JobStopped if stopping else JobTimeout
            message = child.connection.receive(POLL_S)
            if message is None or message.number != self._number:
                continue
            if message.kind == worker_main.BEGUN:
                self._has_begun = True
            elif message.kind == worker_main.PROGRESS:
                body, _ = decode_body(message.body)
                report(body["fraction"], sentence_in(body, "message"))
            elif message.kind == worker_main.RESULT:
                return bytes(split_body(message.body)[1])
            elif message.kind == worker_main.PROBLEM:
                raise JobFailed(json.loads(bytes(split_body(message.body)[1])))

    def _started(self) -> ChildProcess:
        """Return a living process that has said it is ready; OSError where there is none."""
        with self._lock:
            if self._closed:
                raise WorkerDied
            if self._child is not None and self._child.is_alive:
                return self._child
            self._close()
            self._child = child = ChildProcess(
                self._program, {"modules": self._modules}, max_body=MAX_ANSWER_BYTES
            )
        child.await_ready(START_S)
        return child

    def _send(self, child: ChildProcess, kind: int, value: Any) -> None:
        # It listens beside its work; only one that is stopped takes longer.
        child.connection.send(kind, self._number, encode_body(value), timeout_s=START_S)

    def _close(self) -> None:
        if self._child is not None:
            self._child.close()
        self._child = None
