"""A cache that drops what was used least recently."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import Lock
from typing import Generic, TypeVar

Key = TypeVar("Key", bound=Hashable)
Value = TypeVar("Value")


class LruCache(Generic[Key, Value]):
    """Values by key, of max_size together; the newest stays even if it is larger. Thread-safe."""

    def __init__(self, max_size: int, size_of: Callable[[Value], int] = lambda _value: 1) -> None:
        self._max_size, self._size_of, self._size = max_size, size_of, 0
        self._values: OrderedDict[Key, Value] = OrderedDict()
        self._lock = Lock()

    def get(self, key: Key) -> Value | None:
        """Return the value and mark it as used; None if it is not there."""
        with self._lock:
            if key in self._values:
                self._values.move_to_end(key)
            return self._values.get(key)

    def put(self, key: Key, value: Value) -> Value:
        """Add a value, drop the oldest ones that have no room beside it, and return it."""
        with self._lock:
            if key in self._values:
                self._size -= self._size_of(self._values.pop(key))
            self._values[key] = value
            self._size += self._size_of(value)
            while len(self._values) > 1 and self._size > self._max_size:
                self._size -= self._size_of(self._values.popitem(last=False)[1])
        return value

    def get_or_make(self, key: Key, make: Callable[[], Value]) -> Value:
        """Return the value, made where it is missing. Two threads may make the same one, which only costs time."""
        value = self.get(key)
        return self.put(key, make()) if value is None else value

    @property
    def size(self) -> int:
        """Return the size of all values together."""
        return self._size
