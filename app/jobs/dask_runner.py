"""A place on a Dask cluster: one job at a time is with its scheduler, and each is begun at most once.

Which worker does it, and how much memory it may take, is the cluster's affair. A job that is cancelled, or out of
time, stops at its next word of progress; one that says none is abandoned, and what it returns is thrown away.
"""

import json
import queue
import time
from collections.abc import Callable
from concurrent.futures import CancelledError
from typing import Any

from app.core.errors import Unavailable
from app.jobs.dask_cluster import DaskCluster, SubmittedJob
from app.jobs.runner import JobFailed, JobStopped, JobTimeout, Report, WorkerDied

POLL_S = 0.05  # how often we look whether a job is still wanted
WAITING_NOTICE_S = 0.5  # before it is said that a job waits for a worker
ANSWER_S = 30.0  # for a result to come over from the worker


class DaskRunner:
    """Room for one job on the cluster. Only end() may be called by another thread than its own."""

    pid = None

    def __init__(self, cluster: DaskCluster) -> None:
        self._cluster = cluster
        self._closed = False

    def run(self, run: str, spec: Any, report: Report, wanted: Callable[[], bool], wall_s: float) -> Any:
        """Do a job and return its result; see place.py."""
        sent = self._cluster.send(run, spec, lambda: wanted() and not self._closed)
        try:
            self._follow(sent, report, wanted, wall_s)
            return self._answer(sent)
        finally:
            self._cluster.let_go(sent)

    def end(self) -> None:
        self._closed = True
        self._cluster.end()

    def drop(self) -> None:
        self._cluster.close()

    def _follow(self, sent: SubmittedJob, report: Report, wanted: Callable[[], bool], wall_s: float) -> None:
        """Until it has ended."""
        start, worker, said_so = time.monotonic(), None, False
        deadline = start + wall_s
        while True:
            now = time.monotonic()
            if self._closed or not wanted():
                raise JobStopped
            if now > deadline:
                raise JobTimeout if worker else _no_worker(wall_s)
            if worker is None and not said_so and now > start + WAITING_NOTICE_S:
                said_so = True
                report(0.0, "Waiting for a worker of the cluster")
            try:
                said = sent.inbox.get(timeout=POLL_S)
            except queue.Empty:
                continue
            if said["kind"] == "ended":
                return
            if said["kind"] == "begun":
                worker, deadline = said["worker"], now + wall_s
                report(0.0, "Starting")
            elif said["kind"] == "progress":
                report(said["fraction"], said["message"])
            elif said["kind"] == "gone" and said["worker"] == worker:
                raise WorkerDied

    def _answer(self, sent: SubmittedJob) -> Any:
        from distributed import KilledWorker
        try:
            answer = json.loads(sent.future.result(timeout=ANSWER_S))
        except (CancelledError, OSError):  # the scheduler is gone, or the worker with its result
            self._cluster.lost(sent.client)
            raise WorkerDied from None
        except KilledWorker:
            raise WorkerDied from None
        except Exception as error:
            raise Unavailable(f"The cluster cannot do Touchline's jobs: {type(error).__name__}: {str(error)[:200]}",
                              "Install the same Python and the same Touchline on its scheduler and its workers: "
                              "pip install 'touchline[dask]'.", reason="cluster-differs") from None
        if "lost" in answer:
            raise WorkerDied
        if "problem" in answer:
            raise JobFailed(answer["problem"])
        return answer["result"]


def _no_worker(wall_s: float) -> Unavailable:
    return Unavailable(f"No worker of the cluster was free for the job within {wall_s:g} s.",
                       "Start workers, or more of them: dask worker tcp://SCHEDULER:8786 --nthreads 1.",
                       reason="no-free-worker")
