"""Who of those that wait is next: by turns of addresses, and of a series of requests only the newest."""

import asyncio
from collections import OrderedDict, deque
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from touchline.core.errors import Busy, Cancelled, TouchlineError
from touchline.core.statements import say

MAX_WAITING = 200
SUPERSEDED = (say("fit.superseded", "A newer request of the same series has replaced this one."),
              say("fit.superseded.fix", "Wait for the answer to the newer request."))


class QueuePlace:
    """One caller's place in a queue; a newer one of its address and series is put there instead. None: of no series."""

    def __init__(self, address: str, series: str | None = None) -> None:
        self.address, self.series = address, series
        self.ended_by: TouchlineError | None = None  # why nobody waits for it any more; other threads may look
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
        self._waiting: OrderedDict[str, deque[QueuePlace]] = OrderedDict()  # by address, in the order of their turns

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
        former = next((one for one in waiting if one.series is not None and one.series == place.series), None)
        if former is None:
            waiting.append(place)
        else:
            waiting[waiting.index(former)] = place
            former.end(Cancelled(*SUPERSEDED, reason="superseded"))
        if sum(map(len, self._waiting.values())) > MAX_WAITING:
            crowded = max(self._waiting, key=lambda address: len(self._waiting[address]))
            newest = self._waiting[crowded].pop()
            self._drop_empty(crowded)
            newest.end(Busy(say("fit.too-many", "{requests} fits are already waiting.", requests=MAX_WAITING),
                            say("fit.wait", "Wait until some have ended."), reason="too-many-fits"))
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
