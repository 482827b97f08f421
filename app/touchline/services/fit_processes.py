"""Fits whose callers wait: in processes that are there beforehand, by turns of addresses, equal ones once."""

import asyncio
import json
import os
from collections import OrderedDict, deque
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from functools import partial
from hashlib import sha256
from typing import Any

from anyio import CapacityLimiter, to_thread

from touchline.core.errors import Busy, Cancelled, TouchlineError, Unavailable
from touchline.core.jobs import Progress, error_of
from touchline.core.sentences import SHUTTING_DOWN, TRY_WHEN_BACK
from touchline.core.statements import say
from touchline.jobs.runner import MAX_ATTEMPTS, ProcessRunner, WorkerDied, problem_of_failure
from touchline.store.repository import LruCache

MAX_WAITING = 200
SUPERSEDED = (
    say("fit.superseded", "A newer request of the same series has replaced this one."),
    say("fit.superseded.fix", "Wait for the answer to the newer request."),
)

MEMORY_BYTES = 2 << 30
PROCESSES = max(1, (os.cpu_count() or 1) // 2)  # the others answer meanwhile
MAX_KEPT_BYTES = 8 << 20  # of answers: of some eighty previews
FEW_POINTS = 600  # half a second; operators click some fifty
CHECK_S = 0.25  # between two looks whether a caller still waits


class QueuePlace:
    """One caller's place in a queue; a newer one of its address and series is put there instead. None: of no series."""

    def __init__(self, address: str, series: str | None = None) -> None:
        self.address, self.series = address, series
        # why nobody waits for it any more; other threads may look
        self.ended_by: TouchlineError | None = None
        self.begun: asyncio.Future[None] = asyncio.get_running_loop().create_future()

    def end(self, why: TouchlineError) -> None:
        """Let nobody wait for it any more."""
        self.ended_by = why
        if not self.begun.done():
            self.begun.set_exception(why)


class Turns:
    """So many callers at once. For one event loop."""

    def __init__(self, at_once: int) -> None:
        self._free = at_once
        # by address, in the order of their turns
        self._waiting: OrderedDict[str, deque[QueuePlace]] = OrderedDict()

    @asynccontextmanager
    async def take(self, place: QueuePlace) -> AsyncIterator[None]:
        """Wait for one's turn, and have it within the context. Cancelled for a place that ended, Busy in a crowd."""
        self._enter(place)
        try:
            await place.begun
            if place.ended_by is not None:  # in the moment between
                raise place.ended_by
            yield
        finally:
            self._leave(place)

    def _enter(self, place: QueuePlace) -> None:
        waiting = self._waiting.setdefault(place.address, deque())
        former = next(
            (one for one in waiting if one.series is not None and one.series == place.series), None
        )
        if former is None:
            waiting.append(place)
        else:
            waiting[waiting.index(former)] = place
            former.end(Cancelled(*SUPERSEDED, reason="superseded"))
        if sum(map(len, self._waiting.values())) > MAX_WAITING:
            crowded = max(self._waiting, key=lambda address: len(self._waiting[address]))
            newest = self._waiting[crowded].pop()
            self._drop_empty(crowded)
            newest.end(
                Busy(
                    say(
                        "fit.too-many", "{requests} fits are already waiting.", requests=MAX_WAITING
                    ),
                    say("fit.wait", "Wait until some have ended."),
                    reason="too-many-fits",
                )
            )
        self._give()

    def _leave(self, place: QueuePlace) -> None:
        if place.begun.done() and not place.begun.cancelled() and place.begun.exception() is None:
            self._free += 1
        elif place in self._waiting.get(place.address, ()):
            self._waiting[place.address].remove(place)
            self._drop_empty(place.address)
        self._give()

    def _give(self) -> None:
        while self._free and self._waiting:
            address, waiting = next(iter(self._waiting.items()))
            place = waiting.popleft()
            self._waiting.move_to_end(address)
            self._drop_empty(address)
            if not place.begun.done():
                self._free -= 1
                place.begun.set_result(None)

    def _drop_empty(self, address: str) -> None:
        if not self._waiting[address]:
            del self._waiting[address]


class FitProcesses:
    """So many processes; for one event loop, while it is running().

    wall_s: the longest that a fit may take. modules: what each process imports before its first fit. at_once: the first
    process is started beforehand, and not with the first fit.
    """

    _turns: Turns

    def __init__(
        self,
        wall_s: float,
        modules: tuple[str, ...],
        processes: int = PROCESSES,
        *,
        at_once: bool = True,
    ) -> None:
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

    async def run(
        self,
        run: Callable[[Any, Progress], Any],
        spec: Any,
        address: str,
        is_abandoned: Callable[[], Awaitable[bool]],
        series: str | None = None,
    ) -> bytes:
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
            return await to_thread.run_sync(
                partial(self._attempt, runner, name, spec, place), limiter=self._threads
            )
        finally:
            self._idle.append(runner)

    def _attempt(self, runner: ProcessRunner, name: str, spec: Any, place: QueuePlace) -> bytes:
        attempts = 0
        while True:
            attempts += 1
            try:
                return runner.run_to_text(
                    name, spec, lambda *_: None, lambda: place.ended_by is None, self._wall_s
                )
            except Exception as error:
                if place.ended_by is not None:
                    raise place.ended_by from None
                if self._closed:
                    raise Unavailable(
                        SHUTTING_DOWN, TRY_WHEN_BACK, reason="shutting-down"
                    ) from None
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
