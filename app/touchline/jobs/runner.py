"""What runs jobs, whatever stands behind it: a process of this machine, or a cluster."""

from collections.abc import Callable
from typing import Any, Protocol

Report = Callable[[float, str], None]  # fraction, message


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

    def run(self, run: str, spec: Any, report: Report, is_wanted: Callable[[], bool], wall_s: float) -> Any:
        """Do a job once and return its result, plain JSON; run is "module:function".

        is_wanted: asked several times a second; once it says no, the job is stopped or abandoned. Raises one of the
        four above, or a TouchlineError where no worker can be had.
        """

    def end(self) -> None:
        """End for good what is being done; whoever waits for it gets WorkerDied or JobStopped."""

    def close(self) -> None:
        """Let go of what stands behind the runner."""
