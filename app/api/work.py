"""Where long arithmetic runs: on worker threads, a few at a time, so that short answers stay short."""

import asyncio
import os
from collections.abc import Callable
from threading import Event
from typing import ParamSpec, TypeVar

from anyio import CapacityLimiter, to_thread
from fastapi import FastAPI, Request
from starlette.requests import HTTPConnection

from app.errors import Cancelled
from app.models import Progress

Given = ParamSpec("Given")
Answer = TypeVar("Answer")
LOOK_S = 0.5  # how often we look whether a caller still waits


def open_workplaces(app: FastAPI) -> None:
    """Room for so many computations at once; within a running event loop."""
    app.state.limiter = CapacityLimiter(max(4, os.cpu_count() or 4))  # fits and pictures, below a second or two
    app.state.long_limiter = CapacityLimiter(1)  # many seconds: never two, and never in the way of the others


async def at_work(connection: HTTPConnection, job: Callable[Given, Answer], *args: Given.args,
                  **kwargs: Given.kwargs) -> Answer:
    """Run a job on a worker thread; when all are busy it waits its turn."""
    return await to_thread.run_sync(lambda: job(*args, **kwargs), limiter=connection.app.state.limiter)


async def at_length(request: Request, job: Callable[[Progress], Answer]) -> Answer:
    """Run a job of many seconds, one at a time; it ends early when its caller has gone."""
    gone = Event()

    def progress(fraction: float, message: str) -> None:
        if gone.is_set():
            raise Cancelled("The caller has gone.", "Ask again.")

    async def watch() -> None:
        while not await request.is_disconnected():
            await asyncio.sleep(LOOK_S)
        gone.set()

    watcher = asyncio.create_task(watch())
    try:
        return await to_thread.run_sync(job, progress, limiter=request.app.state.long_limiter)
    finally:
        gone.set()
        watcher.cancel()
