"""Where long arithmetic runs, so that short answers stay short: a second's on threads, longer in processes."""

import asyncio
import os
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

from anyio import CapacityLimiter, to_thread
from fastapi import FastAPI, Request
from starlette.requests import HTTPConnection

from app.core.progress import Progress
from app.jobs import Job

Given = ParamSpec("Given")
Answer = TypeVar("Answer")
LOOK_S = 0.05  # how often we look whether a job has ended
STAY_LOOKS = 10  # and every so many looks whether its caller still waits


def open_workplaces(app: FastAPI) -> None:
    """Room for so many computations at once; within a running event loop."""
    app.state.limiter = CapacityLimiter(max(4, os.cpu_count() or 4))  # fits and pictures, below a second or two


async def at_work(connection: HTTPConnection, job: Callable[Given, Answer], *args: Given.args,
                  **kwargs: Given.kwargs) -> Answer:
    """Run a job on a worker thread; when all are busy it waits its turn."""
    return await to_thread.run_sync(lambda: job(*args, **kwargs), limiter=connection.app.state.limiter)


async def at_length(request: Request, kind: str, run: Callable[[Any, Progress], Any], spec: Any) -> Job:
    """Do a job of many seconds and wait for its end; it is cancelled when its caller has gone."""
    jobs = request.app.state.jobs
    job = jobs.start(kind, run, spec, durable=False)
    looks = 0
    try:
        while not jobs.get(job.id).ended:
            await asyncio.sleep(LOOK_S)
            looks += 1
            if looks % STAY_LOOKS == 0 and await request.is_disconnected():
                break
        return jobs.get(job.id)
    finally:
        jobs.cancel(job.id)
