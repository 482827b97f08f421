"""Where long arithmetic runs: on worker threads, a few at a time, so that short answers stay short."""

import os
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from anyio import CapacityLimiter, to_thread
from starlette.requests import HTTPConnection

Given = ParamSpec("Given")
Answer = TypeVar("Answer")


def new_limiter() -> CapacityLimiter:
    """As many long computations at once as there are processors."""
    return CapacityLimiter(max(2, os.cpu_count() or 2))


async def at_work(connection: HTTPConnection, job: Callable[Given, Answer], *args: Given.args,
                  **kwargs: Given.kwargs) -> Answer:
    """Run a job on a worker thread; more jobs than processors wait their turn."""
    return await to_thread.run_sync(lambda: job(*args, **kwargs), limiter=connection.app.state.limiter)
