"""Many jobs through an engine that lets only a few wait, and the rows that they end in."""

import time
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from app.batch.requests import BatchRequest
from app.batch.table import Row, row_of
from app.core.errors import Busy, Unavailable
from app.jobs import Job, JobEngine

POLL_S = 0.02
QUEUED_AHEAD = 4  # jobs that wait, so that no worker does while the next picture is read
ENGINE_FAULTS = ("no-scheduler", "cluster-differs", "no-free-worker")  # of the picture: every other would fail as well


def run_requests(jobs: JobEngine, workers: int, asked: Iterable[BatchRequest | Row],
            watch: Callable[[float], None] = lambda under_way: None) -> Iterator[Row]:
    """A row for each, in the order in which they end. watch: told of how much of a picture is under way.

    asked is gone through as there is room; a row among it is given back as it is. Unavailable where the engine itself
    does not work.
    """
    coming, under_way = iter(asked), {}
    held: BatchRequest | None = None
    more = True
    while more or held or under_way:
        while (more or held) and len(under_way) < workers + QUEUED_AHEAD:
            one = held or next(coming, None)
            held = None
            if one is None:
                more = False
            elif isinstance(one, BatchRequest):
                try:
                    under_way[jobs.start("batch", one.run, one.spec).id] = one
                except Busy:
                    held = one
                    break
            else:
                yield one
        known = [jobs.get(id) for id in under_way]
        for job in known:
            if job.ended:
                yield _row(under_way.pop(job.id), job)
        watch(sum(job.progress for job in known if not job.ended))
        if not any(job.ended for job in known):
            time.sleep(POLL_S)


def _row(asked: BatchRequest, job: Job) -> Row:
    head: dict[str, Any] = {"picture": asked.picture, "sha256": asked.sha256, "inputs": asked.inputs}
    if job.state == "done":
        return row_of(**head, **job.result)
    problem = job.problem or {"reason": "cancelled", "status": 503, "detail": "It was cancelled.", "fix": "Go on with "
                              "--resume."}
    if problem["reason"] in ENGINE_FAULTS:
        raise Unavailable(problem["detail"], problem["fix"], reason=problem["reason"])
    if problem["status"] >= 500:
        head["inputs"] = ""  # another time it may go well
    return row_of(**head, verdict="failed", problem=problem["detail"], fix=problem["fix"])
