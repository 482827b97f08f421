"""Joins the moving blobs of each frame to tracks; a track ends after some frames without a blob."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from touchline.core.geometry import Points
from touchline.vision.motion.foreground import MovingBlob

REACH_PX = 12.0  # how far from the expected place a thing of which only one place is known may be, per frame's time
OF_SPEED = 0.6  # ... and of the way that it made since the last frame: it may be kicked
MAX_MISSED = 4  # frames: behind a robot, a bar or an arm
AREA_RATIO = 3.0
MAX_TRACKS = 64
MIN_POINTS = 5
MAX_POINTS = 600  # of a track: one that drives all day is reported in pieces


@dataclass(frozen=True, eq=False)
class Track:
    """Where a thing was. frames (n,): the numbers of the frames; points (n, 2) px, raw."""

    number: int
    frames: NDArray[np.int64]
    points: Points


@dataclass(eq=False)
class _Open:
    number: int
    frames: list[int] = field(default_factory=list)
    points: list[tuple[float, float]] = field(default_factory=list)
    area_px: float = 0.0

    def expected(self, frame: int) -> tuple[NDArray[np.float64], float]:
        """Where it will be if it goes on, and how far from there it may be, px."""
        last = np.array(self.points[-1])
        since = frame - self.frames[-1]
        if len(self.points) < 2:
            return last, REACH_PX * since * 2
        velocity = (last - self.points[-2]) / (self.frames[-1] - self.frames[-2])
        return last + velocity * since, REACH_PX + OF_SPEED * float(np.hypot(*velocity)) * since

    def done(self) -> Track:
        return Track(self.number, np.array(self.frames), np.array(self.points, float).reshape(-1, 2))


class Tracker:
    """Follows things over frames that come in their order. One thread at a time."""

    def __init__(self) -> None:
        self._open: list[_Open] = []
        self._count = 0

    @property
    def now(self) -> list[Track]:
        """The open tracks so far."""
        return [track.done() for track in self._open if len(track.points) >= MIN_POINTS]

    def add(self, frame: int, movers: Sequence[MovingBlob]) -> list[Track]:
        """Add the blobs of a frame; return the long enough tracks that have ended."""
        pairs = []
        for which, track in enumerate(self._open):
            place, reach = track.expected(frame)
            for other, mover in enumerate(movers):
                off = float(np.hypot(mover.x - place[0], mover.y - place[1]))
                ratio = max(mover.area_px, track.area_px) / max(min(mover.area_px, track.area_px), 1.0)
                if off <= reach and ratio <= AREA_RATIO:
                    pairs.append((off / reach, -len(track.points), which, other))
        taken_tracks, taken_movers = set(), set()
        for _, _, which, other in sorted(pairs):
            if which not in taken_tracks and other not in taken_movers:
                taken_tracks.add(which)
                taken_movers.add(other)
                self._follow(self._open[which], frame, movers[other])
        for other, mover in enumerate(movers):
            if other not in taken_movers and len(self._open) < MAX_TRACKS:
                self._count += 1
                self._open.append(_Open(self._count))
                self._follow(self._open[-1], frame, mover)
        lost = [track for track in self._open if frame - track.frames[-1] > MAX_MISSED
                or len(track.points) >= MAX_POINTS]
        self._open = [track for track in self._open if track not in lost]
        return [track.done() for track in lost if len(track.points) >= MIN_POINTS]

    def forget(self, number: int, until: int) -> None:
        """Drop a track's points up to that frame: they have been reported."""
        for track in self._open:
            if track.number == number:
                rest = [i for i, frame in enumerate(track.frames) if frame > until] or [len(track.frames) - 1]
                track.frames = [track.frames[i] for i in rest]
                track.points = [track.points[i] for i in rest]

    def end(self) -> list[Track]:
        """End all tracks and return them."""
        ended, self._open = self.now, []
        return ended

    def _follow(self, track: _Open, frame: int, mover: MovingBlob) -> None:
        track.frames.append(frame)
        track.points.append((mover.x, mover.y))
        track.area_px = mover.area_px if len(track.points) == 1 else 0.7 * track.area_px + 0.3 * mover.area_px
