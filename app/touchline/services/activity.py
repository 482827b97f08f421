"""What has happened to cameras and versions, how far cameras had moved, and which operators have a
picture open.

The store keeps activations. What cameras did is noted here while the server runs, and forgotten with it.
"""

import asyncio
import heapq
import itertools
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterator, Mapping
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass, replace
from itertools import islice
from operator import itemgetter
from threading import Lock
from time import monotonic, time
from typing import Any, Literal

from typing_extensions import TypedDict

from touchline.core.statements import Sentence, format_mm, say, stated
from touchline.live.messages import CameraStatus
from touchline.live.supervisor import LATE_S
from touchline.services.cameras import CameraService
from touchline.services.live import LiveCameras
from touchline.store.repository import timestamp, utc_now
from touchline.store.store import Store

Kind = Literal["activated", "offline", "back", "moved", "cleared"]

FROM_FILES = say("event.images-from-files", "the images from files")
# a camera that hangs is stalled for half a second, then its process starts anew
EVENTS_POLL_S = 0.25
ENTRY_S = 20  # of one entry of how far a camera had moved
HISTORY_S = 6 * 3600
MAX_ENTRIES = HISTORY_S // ENTRY_S
MAX_NOTED = 500  # of all cameras together; a loose cable makes two a minute
# other states tell nothing new
WORKS = {"live": True, "mismatch": True, "stalled": False, "offline": False}
ALARMS = {  # codes and templates
    "knocked": ("event.moved", "{camera} moved by {distance}."),
    "replaced": ("event.replaced", "{camera} was rotated far, or replaced."),
    "out-of-focus": ("event.out-of-focus", "The focus of {camera} has changed."),
    "misplaced": ("event.misplaced", "The calibration of {camera} does not match the field lines."),
}
BACK = "event.back", "{camera} is back."
OFFLINE = "event.offline", "{camera} went offline."
CLEARED = "event.cleared", "{camera} is in its calibrated position again."
PRESENCE_POLL_S = 0.2


@dataclass(frozen=True)
class _Known:
    """What was noted last of a camera: whether it works, by which calibration it is followed, and its alarm."""

    works: bool | None = None
    calibration: str | None = None
    alarm: str | None = None


@dataclass(frozen=True)
class _Event:
    """moment: monotonic; said: a code, and a template with places for the camera's name and how far it moved."""

    moment: float
    at: str
    kind: Kind
    camera: str
    said: tuple[str, str]
    distance: str = ""

    def text(self, camera: str) -> Sentence:
        """Return it in words. camera: its name."""
        moved = {"distance": self.distance} if self.distance else {}
        return say(*self.said, camera=camera, **moved)


class DriftEntry(TypedDict):
    """at: when it begins, unix, s. mm: the largest displacement within it; None where none was measured."""

    at: int
    mm: float | None


class DriftHistory:
    """The newest entries of each camera. Written by the event loop's thread, read by any."""

    def __init__(self, clock: Callable[[], float] = time) -> None:
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


class CameraEvents:
    """What cameras have done since the server was started. Written by the event loop's thread, read by any.

    drift: how far each had moved in the last hours.
    """

    def __init__(self) -> None:
        self.drift = DriftHistory()
        self.noted: tuple[_Event, ...] = ()  # newest first
        self._known: dict[str, _Known] = {}

    @asynccontextmanager
    async def following(self, live: LiveCameras) -> AsyncIterator[None]:
        """Note what the running cameras do as long as the context lasts."""
        task = asyncio.create_task(self._follow(live), name="camera events")
        try:
            yield
        finally:
            task.cancel()

    def note(self, statuses: Mapping[str, CameraStatus]) -> None:
        """Note what has changed since the last call. statuses: of every camera that runs; others are forgotten."""
        self._known = {
            id: self._compare(id, self._known.get(id, _Known()), status)
            for id, status in statuses.items()
        }

    async def _follow(self, live: LiveCameras) -> None:
        loop = asyncio.get_running_loop()
        while True:
            slept = loop.time()
            await asyncio.sleep(EVENTS_POLL_S)
            # else we were held up: what cameras sent lies unread
            if loop.time() - slept < EVENTS_POLL_S + LATE_S:
                statuses = {id: live.status(id) for id in live.running}
                self.note(statuses)
                self.drift.note(statuses)

    def _compare(self, id: str, known: _Known, status: CameraStatus) -> _Known:
        works = WORKS.get(status["state"], known.works)
        if works is not known.works and (works is False or known.works is False):
            self._add(id, "back" if works else "offline", BACK if works else OFFLINE)
        known = replace(known, works=works)
        drift = status["drift"]
        if drift is None:
            return known
        # an alarm about the one before says nothing of this one
        if drift["calibration"] != known.calibration:
            known = replace(known, calibration=drift["calibration"], alarm=None)
        alarm = drift["state"] if drift["alarm"] else None
        if alarm is not None and alarm != known.alarm:
            self._add(
                id,
                "moved",
                ALARMS[alarm],
                format_mm(drift["mm"] or 0.0) if alarm == "knocked" else "",
            )
        elif alarm is None and known.alarm is not None:
            if drift["state"] != "steady":  # whoever covers the lines does not put the camera back
                return known
            self._add(id, "cleared", CLEARED)
        return replace(known, alarm=alarm)

    def _add(self, camera: str, kind: Kind, said: tuple[str, str], distance: str = "") -> None:
        self.noted = (
            _Event(monotonic(), timestamp(utc_now), kind, camera, said, distance),
            *self.noted,
        )[:MAX_NOTED]


def newest_events(
    noted: tuple[_Event, ...], store: Store, cameras: CameraService, limit: int
) -> list[dict[str, Any]]:
    """Return the newest activations and what cameras did, as plain JSON, newest first, even if the clock was set."""
    titles = {camera.id: camera.title for camera in cameras.all()}

    def title(camera: str | None) -> str:
        return FROM_FILES if camera is None else titles.get(camera, camera)

    activated = [
        (
            row["moment"],
            {
                "at": row["at"],
                "kind": "activated",
                "camera": row["camera"],
                "version": row["version"],
                "by": row["by"] or None,
                "despite": row["despite"],
                "text": _activated(row["version"], title(row["camera"]), len(row["despite"])),
            },
        )
        for row in store.calibrations.activations(limit)
    ]
    did: list[tuple[float, dict[str, Any]]] = [
        (
            event.moment,
            {
                "at": event.at,
                "kind": event.kind,
                "camera": event.camera,
                "version": None,
                "by": None,
                "despite": [],
                "text": event.text(title(event.camera)),
            },
        )
        for event in noted[:limit]
    ]
    newest_first = heapq.merge(activated, did, key=itemgetter(0), reverse=True)
    return [stated(event) for _, event in islice(newest_first, limit)]


def _activated(version: int, camera: str, problems: int) -> Sentence:
    if not problems:
        return say(
            "event.activated",
            "Version {version} of {camera} was activated.",
            version=version,
            camera=camera,
        )
    return say(
        "event.activated-despite",
        "Version {version} of {camera} was activated. Known problems: {problems}.",
        version=version,
        camera=camera,
        problems=problems,
    )


class Presence:
    """Thread-safe."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._numbers = itertools.count(1)
        self._here: dict[str, dict[int, str]] = {}
        self._saved: dict[str, tuple[str, str]] = {}

    @contextmanager
    def at(self, snapshot: str, name: str) -> Iterator[int]:
        """Note that somebody has a picture open while the context lasts; yield their number."""
        with self._lock:
            number = next(self._numbers)
            self._here.setdefault(snapshot, {})[number] = name
        try:
            yield number
        finally:
            with self._lock:
                del self._here[snapshot][number]
                if not self._here[snapshot]:
                    del self._here[snapshot]
                    self._saved.pop(snapshot, None)

    def saved(self, snapshot: str, etag: str, by: str) -> None:
        """Note that a draft was saved."""
        with self._lock:
            if snapshot in self._here:
                self._saved[snapshot] = (etag, by)

    def state_for(self, snapshot: str, number: int) -> dict[str, Any]:
        """Return who else is there, in order of arrival, and the draft that was saved last meanwhile."""
        with self._lock:
            others = [
                name for other, name in self._here.get(snapshot, {}).items() if other != number
            ]
            etag, by = self._saved.get(snapshot, (None, None))
        return {"others": others, "etag": etag, "by": by}

    async def changes(self, snapshot: str, name: str) -> AsyncIterator[dict[str, Any]]:
        """Yield the state for somebody who has a picture open, now and after every change."""
        with self.at(snapshot, name) as number:
            before = None
            while True:
                now = self.state_for(snapshot, number)
                if now != before:
                    yield now
                    before = now
                await asyncio.sleep(PRESENCE_POLL_S)
