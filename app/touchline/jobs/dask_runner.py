"""Jobs on a Dask cluster: one at a time is with its scheduler, and each is begun at most once.

Which worker does it, and how much memory it may take, is the cluster's affair. A job that is cancelled, or out of
time, stops at its next report of progress; one that reports none is abandoned, and what it returns is thrown away.
"""

import json
import queue
import time
from collections.abc import Callable
from concurrent.futures import CancelledError
from typing import Any

from touchline.core.errors import Unavailable
from touchline.core.statements import say, sentence_in
from touchline.jobs.dask_cluster import DaskCluster, SubmittedJob
from touchline.jobs.runner import JobFailed, JobStopped, JobTimeout, Report, WorkerDied

POLL_S = 0.05  # how often we look whether a job is still wanted
WAITING_NOTICE_S = 0.5  # before it is event that a job waits for a worker
ANSWER_S = 30.0  # for a result to come over from the worker


class DaskRunner:
    """Runs one job at a time on the cluster. Only end() may be called by another thread than its own."""

    def __init__(self, cluster: DaskCluster) -> None:
        self._cluster = cluster
        self._closed = False

    def run(self, run: str, spec: Any, report: Report, is_wanted: Callable[[], bool], wall_s: float) -> Any:
        """Do a job and return its result; see runner.py."""
        job = self._cluster.submit(run, spec, lambda: is_wanted() and not self._closed)
        try:
            self._follow(job, report, is_wanted, wall_s)
            return self._answer(job)
        finally:
            self._cluster.release(job)

    def end(self) -> None:
        self._closed = True
        self._cluster.end()

    def close(self) -> None:
        self._cluster.close()

    def _follow(self, job: SubmittedJob, report: Report, is_wanted: Callable[[], bool], wall_s: float) -> None:
        """Wait until it has ended."""
        start, worker, has_said_so = time.monotonic(), None, False
        deadline = start + wall_s
        while True:
            now = time.monotonic()
            if self._closed or not is_wanted():
                raise JobStopped
            if now > deadline:
                raise JobTimeout if worker else Unavailable(say("cluster.no-worker", "No worker of the cluster was "
                                                                "available for the job within {seconds:g} s.",
                                                                seconds=wall_s),
                                                            say("cluster.start-workers",
                                                                "Start more workers: dask worker "
                                                                "tcp://SCHEDULER:8786 --nthreads 1."),
                                                            reason="no-free-worker")
            if worker is None and not has_said_so and now > start + WAITING_NOTICE_S:
                has_said_so = True
                report(0.0, "Waiting for a worker of the cluster")
            try:
                event = job.inbox.get(timeout=POLL_S)
            except queue.Empty:
                continue
            if event["kind"] == "ended":
                return
            if event["kind"] == "begun":
                worker, deadline = event["worker"], now + wall_s
                report(0.0, "Starting")
            elif event["kind"] == "progress":
                report(event["fraction"], sentence_in(event, "message"))
            elif event["kind"] == "gone" and event["worker"] == worker:
                raise WorkerDied

    def _answer(self, job: SubmittedJob) -> Any:
        from distributed import KilledWorker
        try:
            answer = json.loads(job.future.result(timeout=ANSWER_S))
        except (CancelledError, OSError):  # the scheduler is gone, or the worker with its result
            self._cluster.disconnect(job.client)
            raise WorkerDied from None
        except KilledWorker:
            raise WorkerDied from None
        except Exception as error:
            raise Unavailable(say("cluster.cannot-run", "The cluster cannot run Touchline's jobs: {kind}: {error}",
                                  kind=type(error).__name__, error=str(error)[:200]),
                              say("cluster.same-versions", "Install the same versions of Python, of Touchline and of "
                                  "distributed on its scheduler and its workers."),
                              reason="cluster-differs") from None
        if "lost" in answer:
            raise WorkerDied
        if "problem" in answer:
            raise JobFailed(answer["problem"])
        return answer["result"]
