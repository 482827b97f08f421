"""Fits whose callers wait: in processes that are there beforehand, by turns, equal ones once."""

import asyncio
import json
import os
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from functools import partial
from hashlib import sha256
from typing import Any

from anyio import CapacityLimiter, to_thread

from touchline.core.errors import Cancelled, Unavailable
from touchline.core.jobs import Progress, error_of
from touchline.core.sentences import SHUTTING_DOWN, TRY_WHEN_BACK
from touchline.jobs.runner import MAX_ATTEMPTS, ProcessRunner, WorkerDied, problem_of_failure
from touchline.services.turns import QueuePlace, Turns
from touchline.store.repository import LruCache

MEMORY_BYTES = 2 << 30
PROCESSES = max(1, (os.cpu_count() or 1) // 2)  # the others answer meanwhile
MAX_KEPT_BYTES = 8 << 20  # of answers: of some eighty previews
FEW_POINTS = 600  # half a second; operators click some fifty
CHECK_S = 0.25  # between two looks whether a caller still waits


class FitProcesses:
    """So many processes; for one event loop, while it is running().

    wall_s: the longest that a fit may take. modules: what each process imports before its first fit. at_once: the first
    process is started beforehand, and not with the first fit.
    """

    _turns: Turns

    def __init__(self, wall_s: float, modules: tuple[str, ...], processes: int = PROCESSES, *,
                 at_once: bool = True) -> None:
        self._wall_s, self._at_once = wall_s, at_once
        self._runners = [ProcessRunner(MEMORY_BYTES, modules, nice=0) for _ in range(processes)]
        self._idle = list(self._runners)
        self._threads = CapacityLimiter(len(self._runners))
        self._cache: LruCache[bytes, bytes] = LruCache(MAX_KEPT_BYTES, len)
        self._closed = False

    @asynccontextmanager
    async def running(self) -> AsyncIterator[None]:
        """Start the first process beside the caller; end all at the end."""
        self._turns = Turns(len(self._runners))
        warming = [asyncio.create_task(self._warm())] if self._at_once else []
        try:
            yield
        finally:
            self._closed = True
            for runner in self._runners:
                runner.end()
            await asyncio.gather(*warming)
            for runner in self._runners:
                runner.close()

    async def run(self, run: Callable[[Any, Progress], Any], spec: Any, address: str,
                  is_abandoned: Callable[[], Awaitable[bool]], series: str | None = None) -> bytes:
        """Return what a job's function makes of a spec, as JSON text; raise its problem.

        address: of the caller. series: of requests of which only the newest is worth waiting for: it takes the place of
        one that waits, which is Cancelled. So are those whose callers have gone.
        """
        name = f"{run.__module__}:{run.__qualname__}"
        key = sha256(json.dumps([name, spec]).encode()).digest()
        if (known := self._cache.get(key)) is not None:
            return known
        place = QueuePlace(address, series)
        watching = asyncio.create_task(_watch(place, is_abandoned))
        try:
            async with self._turns.take(place):
                known = self._cache.get(key)  # of another who asked for the same and was sooner
                if known is None:
                    known = self._cache.put(key, await self._compute(name, spec, place))
                return known
        finally:
            watching.cancel()

    async def _compute(self, name: str, spec: Any, place: QueuePlace) -> bytes:
        runner = self._idle.pop()
        try:
            return await to_thread.run_sync(partial(self._attempt, runner, name, spec, place), limiter=self._threads)
        finally:
            self._idle.append(runner)

    def _attempt(self, runner: ProcessRunner, name: str, spec: Any, place: QueuePlace) -> bytes:
        attempts = 0
        while True:
            attempts += 1
            try:
                return runner.run_to_text(name, spec, lambda *_: None, lambda: place.ended_by is None, self._wall_s)
            except Exception as error:
                if place.ended_by is not None:
                    raise place.ended_by from None
                if self._closed:
                    raise Unavailable(SHUTTING_DOWN, TRY_WHEN_BACK, reason="shutting-down") from None
                if attempts == MAX_ATTEMPTS or not isinstance(error, WorkerDied):
                    raise error_of(problem_of_failure(error, self._wall_s)) from None

    async def _warm(self) -> None:
        async with self._turns.take(QueuePlace("")):
            runner = self._idle.pop()
            with suppress(WorkerDied):  # the first fit tries again, and says so
                await to_thread.run_sync(runner.warm, limiter=self._threads)
            self._idle.append(runner)


async def _watch(place: QueuePlace, is_abandoned: Callable[[], Awaitable[bool]]) -> None:
    while not await is_abandoned():
        await asyncio.sleep(CHECK_S)
    place.end(closed_request())


def closed_request() -> Cancelled:
    """Return the end of a fit that nobody waits for any more."""
    return Cancelled("The request for this fit was closed.", "Request it again.")
