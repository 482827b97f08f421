"""Which connections are open, whose they are, and which of them go first when there are too many.

A connection that waits, idle or with half a head, keeps no request from being answered: it is closed, the longest
waiting first, where another needs its place. What is being answered, and a WebSocket, counts until its end.
"""

from collections import Counter
from typing import Protocol

RESERVE = 64  # beyond the limit, for this machine and for who has the token: until its head says so


class Counted(Protocol):
    """A connection. address: of the other machine; None for this one, and for a proxy on it."""

    address: str | None

    def make_room(self) -> None:
        """Close it without an answer."""


class OpenConnections:
    """Of one server, whose event loop alone calls it. most: at once; per_address: from one other machine."""

    def __init__(self, most: int = 256, per_address: int = 40) -> None:
        self.most = most
        self.per_address = per_address
        self._open: set[Counted] = set()
        self._by_address: Counter[str] = Counter()
        self._waiting: dict[Counted, None] = {}  # the longest waiting first

    def add(self, one: Counted) -> bool:
        """Count a new connection, which waits, and close another where it takes its place; False without a place."""
        if one.address is not None and self._by_address[one.address] >= self.per_address:
            if not self._close_longest_waiting(one.address):
                return False
        elif len(self._open) >= self.most and not self._close_longest_waiting() and \
                len(self._open) >= self.most + RESERVE and one.address is not None:
            return False
        self._open.add(one)
        self._by_address.update([one.address] if one.address is not None else [])
        self._waiting[one] = None
        return True

    def wait(self, one: Counted) -> None:
        """Note that it waits for its next request."""
        if one in self._open:
            self._waiting.pop(one, None)
            self._waiting[one] = None

    def work(self, one: Counted) -> None:
        """Note that it has sent its whole head."""
        self._waiting.pop(one, None)

    def is_beyond(self, one: Counted) -> bool:
        """Tell whether it lives on the reserve, which is for this machine and who has the token."""
        return one.address is not None and len(self._open) > self.most

    def remove(self, one: Counted) -> None:
        """Note that it has ended; it may have been refused before."""
        self._waiting.pop(one, None)
        if one not in self._open:
            return
        self._open.discard(one)
        if one.address is not None:
            self._by_address[one.address] -= 1
            if self._by_address[one.address] <= 0:
                del self._by_address[one.address]

    def _close_longest_waiting(self, address: str | None = None) -> bool:
        """Close the longest waiting of an address, else of all: of other machines before those of this one."""
        waiting = [one for one in self._waiting if address is None or one.address == address]
        found = next((one for one in waiting if one.address is not None), waiting[0] if waiting else None)
        if found is None:
            return False
        found.make_room()
        self.remove(found)
        return True
