"""The last few snapshots, decoded: a picture that is looked at is asked for many times in a row."""

from collections import OrderedDict
from collections.abc import Callable
from threading import Lock

from app.core.records import Frame

MAX_BYTES = 256 << 20


class Frames:
    """Decoded frames by snapshot id, the least recently used forgotten first. Thread-safe.

    decode: makes the frame of an id; two threads may decode the same one at once, which only costs time.
    """

    def __init__(self, decode: Callable[[str], Frame]) -> None:
        self._decode = decode
        self._kept: OrderedDict[str, Frame] = OrderedDict()
        self._lock = Lock()

    def __getitem__(self, id: str) -> Frame:
        with self._lock:
            if id in self._kept:
                self._kept.move_to_end(id)
                return self._kept[id]
        frame = self._decode(id)
        with self._lock:
            self._kept[id] = frame
            while len(self._kept) > 1 and sum(kept.pixels.nbytes for kept in self._kept.values()) > MAX_BYTES:
                self._kept.popitem(last=False)
        return frame
