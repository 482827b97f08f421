"""Jobs that wait: which comes next, and how many a caller may have waiting.

A name is only claimed, an address is not: names share what their address has. So of the addresses the one with the
fewest jobs comes first, and of the names behind it the one with the fewest.
"""

import heapq
import queue
from collections.abc import Callable, Sequence
from itertools import count
from math import inf
from threading import Lock
from typing import Generic, TypeVar

from touchline.core.errors import Busy
from touchline.core.jobs import Caller
from touchline.core.statements import Sentence, say

MAX_QUEUED = 100
MAX_QUEUED_EACH = 20  # of one name: more would wait for so long that nobody waits for them
Item = TypeVar("Item")


def check_room(caller: Caller, waiting: Sequence[Caller]) -> None:
    """Raise Busy where a caller has enough jobs waiting. waiting: who each waiting job is of.

    An address may have half of the places that others leave, so that there are always some for one more.
    """
    of_address = sum(one.address == caller.address for one in waiting)
    left = MAX_QUEUED - (len(waiting) - of_address)
    limits: tuple[tuple[int, int, Callable[[], Sentence]], ...] = (
        (len(waiting), MAX_QUEUED, lambda: say("job.too-many", "{jobs} jobs are already waiting.", jobs=len(waiting))),
        (waiting.count(caller), MAX_QUEUED_EACH, lambda: say(
            "job.too-many-of-yours", "{jobs} of your jobs are already waiting.", jobs=MAX_QUEUED_EACH)),
        (of_address, (left + 1) // 2, lambda: say(
            "job.too-many-of-address", "{jobs} jobs from your address are already waiting.", jobs=of_address)))
    for jobs, most, what in limits:
        if jobs >= most:
            raise Busy(what(), say("job.wait-or-cancel", "Wait until some have ended, or cancel some."),
                       reason="too-many-jobs")


class FairQueue(Generic[Item]):
    """Thread-safe."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._numbers = count()
        self._turns: queue.PriorityQueue[tuple[float, int, str | None]] = queue.PriorityQueue()  # of addresses
        self._waiting: dict[str, list[tuple[float, int, Item]]] = {}  # by address: a heap

    def put(self, item: Item, caller: Caller, before_of_address: int, before_of_name: int) -> None:
        """Let it wait. before_…: how many jobs that address, and that name behind it, have under way already."""
        with self._lock:
            number = next(self._numbers)
            heapq.heappush(self._waiting.setdefault(caller.address, []), (before_of_name, number, item))
            self._turns.put((before_of_address, number, caller.address))

    def get(self) -> Item | None:
        """Wait for the next and return it; None where the queue has ended."""
        address = self._turns.get()[2]
        if address is None:
            return None
        with self._lock:
            waiting = self._waiting[address]
            item = heapq.heappop(waiting)[2]
            if not waiting:
                del self._waiting[address]
        return item

    def end(self) -> None:
        """Let one get() return None, once nothing waits any more."""
        with self._lock:
            self._turns.put((inf, next(self._numbers), None))

    @property
    def is_empty(self) -> bool:
        return self._turns.empty()
