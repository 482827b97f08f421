"""Multi-camera tracking of robots and balls: one track a thing, however many cameras see it.

    state (x, y, vx, vy), constant velocity;  Q = σ_a² G Gᵀ,  G = (dt²/2, dt) for each of x and y
    z = (x, y) of one camera, R its covariance + σ_seam² I;  K = P Hᵀ (H P Hᵀ + R)⁻¹

A sighting belongs to the track of its own team and number, else to the nearest of its kind within the gate, counted in
their common covariance. The seam of a track is how far apart its cameras see it at one moment: what calibrations
disagree by, and what no average of them shows.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from math import atan2, cos, degrees, inf, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.detection.records import Detection

GATE = 4.0  # standard deviations
# and no sighting farther than that is the same thing
REACH_MM = {"robot": 250.0, "ball": 400.0, "marker": 250.0}
ACCELERATION_MM_S2 = {"robot": 3000.0, "ball": 5000.0, "marker": 3000.0}
# standard deviation of what is new
FIRST_SPEED_MM_S = {"robot": 2000.0, "ball": 6000.0, "marker": 2000.0}
SEAM_MM = 4.0  # standard deviation by which good calibrations may differ
UNKNOWN_MM = 10.0  # of a sighting without a covariance
MIN_SIGHTINGS = 3  # until it is reported: what flickers for a frame is none
LOST_S = 0.5  # without a sighting
FRESH_S = 0.15  # a camera's sighting is of this moment, as far as the seam is concerned
LATE_S = 0.2  # what comes so late is left out
CLOCK_STEP_S = 1.0  # no camera's frames go back so far: the clock was set
TURN = 0.5  # share of a new sighting in what is believed of the front


@dataclass(frozen=True)
class Sighting:
    """Where one camera saw it last."""

    time_s: float
    place: NDArray[np.float64]  # (2,) mm


@dataclass
class ObjectTrack:
    """One thing. state: x, y mm, vx, vy mm/s; spread: its covariance (4, 4)."""

    number: int
    kind: str
    team: str | None
    id: int | None
    state: NDArray[np.float64]
    spread: NDArray[np.float64]
    time_s: float
    seen: int = 1
    front_rad: float | None = None
    sightings: dict[str, Sighting] = field(default_factory=dict)

    @property
    def last_s(self) -> float:
        return max(sighting.time_s for sighting in self.sightings.values())

    def at(self, time_s: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """State and covariance at that time; never back."""
        dt = max(0.0, time_s - self.time_s)
        if dt == 0:
            return self.state, self.spread
        move = np.eye(4)
        move[0, 2] = move[1, 3] = dt
        g = (
            np.array([[dt * dt / 2, 0], [0, dt * dt / 2], [dt, 0], [0, dt]])
            * ACCELERATION_MM_S2[self.kind]
        )
        return move @ self.state, move @ self.spread @ move.T + g @ g.T

    def seam_mm(self, now_s: float) -> float | None:
        """The largest distance between two cameras' sightings of now; None where fewer than two see it."""
        here = [
            s.place + self.state[2:] * (now_s - s.time_s)
            for s in self.sightings.values()
            if now_s - s.time_s <= FRESH_S
        ]
        if len(here) < 2:
            return None
        return max(float(np.hypot(*(a - b))) for i, a in enumerate(here) for b in here[:i])

    def to_json(self, now_s: float) -> dict[str, Any]:
        state, spread = self.at(now_s)
        seam = self.seam_mm(now_s)
        return {
            "track": self.number,
            "kind": self.kind,
            "team": self.team,
            "id": self.id,
            "x_mm": round(float(state[0]), 2),
            "y_mm": round(float(state[1]), 2),
            "orientation_deg": None
            if self.front_rad is None
            else round(degrees(self.front_rad), 2),
            "vx_mm_s": round(float(state[2]), 1),
            "vy_mm_s": round(float(state[3]), 1),
            "covariance_mm2": [[round(float(v), 3) for v in row] for row in spread[:2, :2]],
            "cameras": sorted(c for c, s in self.sightings.items() if now_s - s.time_s <= FRESH_S),
            "seam_mm": None if seam is None else round(seam, 2),
        }


class ObjectTracker:
    """Tracks the cameras' detections, frame by frame. Times are of one clock, s."""

    def __init__(self) -> None:
        self._tracks: list[ObjectTrack] = []
        self._next = 1
        self._now_s = -inf
        self._last_s: dict[str, float] = {}  # of each camera

    def add(self, camera: str, time_s: float, items: Iterable[Detection]) -> None:
        """One frame of one camera. Things without a place are left out, and a frame that comes late altogether.

        Where a camera's frames go back in time, the clock was set back: all tracks begin anew.
        """
        if time_s < self._last_s.get(camera, -inf) - CLOCK_STEP_S:
            self._tracks, self._now_s = [], -inf
            self._last_s.clear()
        self._last_s[camera] = time_s
        if time_s < self._now_s - LATE_S:
            return
        self._now_s = max(self._now_s, time_s)
        self._tracks = [track for track in self._tracks if time_s - track.last_s <= LOST_S]
        placed = [item for item in items if item.x_mm is not None and item.y_mm is not None]
        free = list(self._tracks)
        # who has a number chooses first
        for item in sorted(placed, key=lambda item: item.id is None):
            place, noise = np.array([item.x_mm, item.y_mm]), _noise(item)
            track = _nearest(free, item, place, noise, time_s)
            if track is None:
                self._begin(camera, item, place, noise, time_s)
                continue
            free = [one for one in free if one is not track]
            _update(track, camera, item, place, noise, time_s)

    @property
    def now_s(self) -> float | None:
        """The newest frame's time; None before the first."""
        return None if self._now_s == -inf else self._now_s

    def to_json(self, now_s: float | None = None) -> list[dict[str, Any]]:
        """Return every confirmed track, at that time or at the newest frame's; plain JSON."""
        now_s = self._now_s if now_s is None else now_s
        return [
            track.to_json(now_s)
            for track in self._tracks
            if track.seen >= MIN_SIGHTINGS and now_s - track.last_s <= LOST_S
        ]

    def _begin(
        self,
        camera: str,
        item: Detection,
        place: NDArray[np.float64],
        noise: NDArray[np.float64],
        time_s: float,
    ) -> None:
        spread = np.zeros((4, 4))
        spread[:2, :2] = noise
        spread[2:, 2:] = np.eye(2) * FIRST_SPEED_MM_S[item.kind] ** 2
        self._tracks.append(
            ObjectTrack(
                self._next,
                item.kind,
                item.team,
                item.id,
                np.array([*place, 0.0, 0.0]),
                spread,
                time_s,
                1,
                item.orientation_rad,
                {camera: Sighting(time_s, place)},
            )
        )
        self._next += 1


def seams_of(tracks: Iterable[Mapping[str, Any]]) -> dict[str, float | int | None]:
    """How far apart cameras see the same things now: {"things", "median_mm", "max_mm"}."""
    seams = [track["seam_mm"] for track in tracks if track["seam_mm"] is not None]
    return {
        "things": len(seams),
        "median_mm": round(float(np.median(seams)), 2) if seams else None,
        "max_mm": max(seams) if seams else None,
    }


def _noise(item: Detection) -> NDArray[np.float64]:
    covariance = (
        np.eye(2) * UNKNOWN_MM**2 if item.covariance_mm2 is None else np.array(item.covariance_mm2)
    )
    return covariance + np.eye(2) * SEAM_MM**2


def _nearest(
    tracks: Iterable[ObjectTrack],
    item: Detection,
    place: NDArray[np.float64],
    noise: NDArray[np.float64],
    time_s: float,
) -> ObjectTrack | None:
    best, least = None, inf
    for track in tracks:
        if track.kind != item.kind or track.team != item.team:
            continue
        if track.id is not None and item.id is not None and track.id != item.id:
            continue
        state, spread = track.at(time_s)
        apart = place - state[:2]
        if np.hypot(*apart) > REACH_MM[item.kind]:
            continue
        distance = float(apart @ np.linalg.solve(spread[:2, :2] + noise, apart)) ** 0.5
        named = item.id is not None and track.id == item.id
        if (named or distance <= GATE) and (distance - 1e6 * named) < least:
            best, least = track, distance - 1e6 * named
    return best


def _update(
    track: ObjectTrack,
    camera: str,
    item: Detection,
    place: NDArray[np.float64],
    noise: NDArray[np.float64],
    time_s: float,
) -> None:
    state, spread = track.at(time_s)
    gain = np.linalg.solve(spread[:2, :2] + noise, spread[:2, :]).T  # (4, 2)
    track.state = state + gain @ (place - state[:2])
    left = np.eye(4)
    left[:, :2] -= gain
    track.spread = left @ spread @ left.T + gain @ noise @ gain.T  # Joseph's form stays positive
    track.time_s = max(track.time_s, time_s)
    track.seen += 1
    track.id = track.id if item.id is None else item.id
    track.sightings[camera] = Sighting(time_s, place)
    if item.orientation_rad is not None:
        if track.front_rad is None:
            track.front_rad = item.orientation_rad
        turn = atan2(
            sin(item.orientation_rad - track.front_rad), cos(item.orientation_rad - track.front_rad)
        )
        track.front_rad = atan2(
            sin(track.front_rad + TURN * turn), cos(track.front_rad + TURN * turn)
        )
