"""Many jobs through an engine that lets only a few wait, and the rows that they end in."""

import time
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from touchline.batch.requests import BatchRequest
from touchline.batch.table import Row, row_of
from touchline.core.errors import Busy, Unavailable
from touchline.jobs import Job, JobEngine

POLL_S = 0.02
QUEUED_AHEAD = 4  # jobs that wait, so that no worker does while the next picture is read
ENGINE_FAULTS = ("no-scheduler", "cluster-differs", "no-free-worker")  # of the picture: every other would fail as well


def run_requests(jobs: JobEngine, workers: int, requests: Iterable[BatchRequest | Row],
                 watch: Callable[[float], None] = lambda under_way: None) -> Iterator[Row]:
    """Yield a row for each, in the order in which they end. watch: called with how many pictures' worth is under way.

    requests is gone through as there is room; a row among it is given back as it is. Unavailable where the engine
    itself does not work.
    """
    coming = iter(requests)
    under_way: dict[str, BatchRequest] = {}
    refused: BatchRequest | None = None  # for now: the engine lets no more wait
    more = True
    while more or refused or under_way:
        while (more or refused) and len(under_way) < workers + QUEUED_AHEAD:
            request, refused = refused or next(coming, None), None
            if request is None:
                more = False
            elif isinstance(request, BatchRequest):
                try:
                    under_way[jobs.start("batch", request.run, request.spec).id] = request
                except Busy:
                    refused = request
                    break
            else:
                yield request
        states = [jobs.get(id) for id in under_way]
        for job in states:
            if job.ended:
                yield _row(under_way.pop(job.id), job)
        watch(sum(job.progress for job in states if not job.ended))
        if not any(job.ended for job in states):
            time.sleep(POLL_S)


def _row(request: BatchRequest, job: Job) -> Row:
    head: dict[str, Any] = {"picture": request.picture, "sha256": request.sha256, "inputs": request.inputs}
    if job.state == "done":
        return row_of(**head, **job.result)
    problem = job.problem or {"reason": "cancelled", "status": 503, "detail": "The batch was cancelled.",
                              "fix": "Continue "
                              "with --resume."}
    if problem["reason"] in ENGINE_FAULTS:
        raise Unavailable(problem["detail"], problem["fix"], reason=problem["reason"])
    if problem["status"] >= 500:
        head["inputs"] = ""  # another time it may go well
    return row_of(**head, verdict="failed", problem=problem["detail"], fix=problem["fix"])
