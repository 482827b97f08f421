"""How far each camera had moved in the last hours, for the page's time line.

It is noted here while the server runs, and forgotten with it.
"""

import time
from collections import deque
from collections.abc import Callable, Mapping

from typing_extensions import TypedDict

from touchline.live.messages import CameraStatus

ENTRY_S = 20  # of one entry
HISTORY_S = 6 * 3600
MAX_ENTRIES = HISTORY_S // ENTRY_S


class DriftEntry(TypedDict):
    """at: when it begins, unix, s. mm: the largest displacement within it; None where none was measured."""

    at: int
    mm: float | None


class DriftHistory:
    """The newest entries of each camera. Written by the event loop's thread, read by any."""

    def __init__(self, clock: Callable[[], float] = time.time) -> None:
        self._clock = clock
        self._entries: dict[str, deque[DriftEntry]] = {}

    def note(self, statuses: Mapping[str, CameraStatus]) -> None:
        """Note how far cameras have moved. statuses: of every camera that runs; others are forgotten."""
        at = int(self._clock()) // ENTRY_S * ENTRY_S
        for id in [*self._entries]:
            if id not in statuses:
                del self._entries[id]
        for id, status in statuses.items():
            if status["active_calibration"] is not None:
                drift = status["drift"]
                self._add(id, at, drift["mm"] if drift is not None and drift["monitored"] else None)

    def of(self, camera: str, since: float = 0.0) -> list[DriftEntry]:
        """Return a camera's entries that begin at that time (unix, s) or later, oldest first."""
        return [entry for entry in [*self._entries.get(camera, ())] if entry["at"] >= since]

    def _add(self, id: str, at: int, mm: float | None) -> None:
        entries = self._entries.setdefault(id, deque(maxlen=MAX_ENTRIES))
        while entries and entries[-1]["at"] > at:  # the clock was set back
            entries.pop()
        if not entries or entries[-1]["at"] < at:
            entries.append({"at": at, "mm": mm})
        elif mm is not None:
            entries[-1] = {"at": at, "mm": max(mm, entries[-1]["mm"] or 0.0)}
