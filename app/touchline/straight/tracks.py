"""Moving blobs in front of a still background, joined to tracks, and the straight runs of a track.

The background is what a pixel mostly shows: each frame moves it by at most one grey level towards what is seen, so it
follows slow light and is not drawn along by what passes. How much a pixel changes by itself, at a sharp edge in a
compressed stream more than on bare carpet, is learned likewise (sigma-delta, A. Manzanera and J. Richefeu, 2007).

Large pictures are looked at reduced: a ball's middle is the mean of so many pixels that little is lost.

What rolls freely goes straight over the carpet; a lens bends that into a gentle arc, a kick into a corner. So a run is
a piece that a parabola across its chord fits, found by a robust orthogonal regression: points count by how well they
agree (Huber's weights), and distances are across the run, never along an axis of the picture:

    v = a + b u + c u²,   u along the chord, v across it;   bow = c L² / 4,  L the run's length.

Without the bow (c = 0) it is the paper's modified linear regression (section IV).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.geometry import Points, root_mean_square

MIN_DIFFERENCE = 12  # grey levels: below, compression and flicker look like movement
MIN_CHANGE_NOISES = 4  # times what a pixel's change usually is
WIDTH_PX = 1000  # larger pictures are reduced by a whole number
MIN_AREA_PX = 6
MAX_AREA = 0.02  # of the picture: above, it is a person or the light
# of the picture: light was switched, or the camera was moved; what was known is void
MAX_CHANGED = 0.25
MAX_BLOBS = 200
BESIDE_PX = 3  # around a blob that its middle takes part of
FULL = 0.6  # of a blob's strong difference: from here on a pixel belongs to it wholly

# how far from the expected place a thing of which only one place is known may be, per frame's time
REACH_PX = 12.0
OF_SPEED = 0.6  # ... and of the way that it made since the last frame: it may be kicked
MAX_MISSED = 4  # frames: behind a robot, a bar or an arm
AREA_RATIO = 3.0
MAX_TRACKS = 64
MIN_TRACK_POINTS = 5
MAX_POINTS = 600  # of a track: one that drives all day is reported in pieces

MIN_RUN_POINTS = 8
MIN_LENGTH = 0.05  # of the picture's diagonal: shorter ones say nothing about its lens
MIN_STEP_PX = 1.0  # from point to point on the average: slower things stand, and jitter
MAX_BOW = 0.12  # of the length: more is no lens, but a curve that was driven
CROOKED_PX = 3.0  # a point further off than this is off whatever the noise
MAX_OFF_NOISES = 3.5
NOISE_PX = 0.25  # about what a ball's middle errs in a clean picture
HUBER = 1.5
ROUNDS = 6
MAX_NOISE_PX = 1.5  # a run that is rougher is no rolling thing


@dataclass(frozen=True)
class MovingBlob:
    """A moving blob. x, y: its middle, px; area_px; contrast: grey levels by which it stands out."""

    x: float
    y: float
    area_px: float
    contrast: float


class MotionDetector:
    """Detects motion in the frames of one still camera, in order. One thread at a time."""

    def __init__(self) -> None:
        self._background: NDArray[np.uint8] | None = None
        self._usual: NDArray[np.uint8] | None = None
        self.upset = 0  # frames in which nearly everything changed

    def add(self, pixels: NDArray[np.uint8]) -> list[MovingBlob]:
        """Return what moves in a frame (h, w[, 3]), px; nothing in the first one, and where nearly all changed."""
        shrink = max(1, round(pixels.shape[1] / WIDTH_PX))
        small = (
            pixels
            if shrink == 1
            else np.asarray(
                cv2.resize(
                    pixels,
                    (pixels.shape[1] // shrink, pixels.shape[0] // shrink),
                    interpolation=cv2.INTER_AREA,
                ),
                np.uint8,
            )
        )
        if self._background is None or self._usual is None or self._background.shape != small.shape:
            return self._anew(small)
        difference = _difference(small, self._background)
        smooth = cv2.blur(difference, (3, 3))
        changed = ((smooth > self._usual) & (smooth > MIN_DIFFERENCE)).view(np.uint8)
        if cv2.countNonZero(changed) > MAX_CHANGED * changed.size:
            self.upset += 1
            return self._anew(small)
        self._background = _towards(self._background, small)
        self._usual = _towards(
            self._usual, np.asarray(cv2.convertScaleAbs(smooth, alpha=MIN_CHANGE_NOISES), np.uint8)
        )
        _, _, stats, _ = cv2.connectedComponentsWithStats(changed, connectivity=8)
        boxes = stats[1:]
        area = boxes[:, cv2.CC_STAT_AREA]
        boxes = boxes[(area >= MIN_AREA_PX) & (area <= MAX_AREA * changed.size)]
        if len(boxes) > MAX_BLOBS:
            boxes = boxes[np.argsort(-boxes[:, cv2.CC_STAT_AREA])[:MAX_BLOBS]]
        scale = np.array([pixels.shape[1] / small.shape[1], pixels.shape[0] / small.shape[0]])
        return [_mover(difference, box, scale) for box in boxes]

    def _anew(self, small: NDArray[np.uint8]) -> list[MovingBlob]:
        self._background = small.copy()
        self._usual = np.full(small.shape[:2], MIN_DIFFERENCE, np.uint8)
        return []


def _towards(known: NDArray[np.uint8], current: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return known + (current > known) - (current < known)


def _difference(pixels: NDArray[np.uint8], background: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """(h, w): of the channel that differs most, as a coloured ball may be as bright as the carpet."""
    first, *others = cv2.split(cv2.absdiff(pixels, background))
    for other in others:
        first = cv2.max(first, other)
    return np.asarray(first, np.uint8)


def _mover(
    difference: NDArray[np.uint8], box: NDArray[np.int32], scale: NDArray[np.float64]
) -> MovingBlob:
    left, top, width, height, area = (int(v) for v in box)
    x0, y0 = max(left - BESIDE_PX, 0), max(top - BESIDE_PX, 0)
    part = difference[y0 : top + height + BESIDE_PX, x0 : left + width + BESIDE_PX].astype(
        np.float64
    )
    strong = float(np.percentile(np.sort(part, axis=None)[-max(area, 4) :], 50))
    weight = np.clip(part - MIN_DIFFERENCE / 2, 0, max(FULL * strong, 1.0))
    total = weight.sum()
    x = x0 + float((weight.sum(axis=0) * np.arange(part.shape[1])).sum() / total)
    y = y0 + float((weight.sum(axis=1) * np.arange(part.shape[0])).sum() / total)
    raw = (np.array([x, y]) + 0.5) * scale - 0.5
    return MovingBlob(float(raw[0]), float(raw[1]), area * float(scale.prod()), strong)


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
        return Track(
            self.number, np.array(self.frames), np.array(self.points, float).reshape(-1, 2)
        )


class Tracker:
    """Follows things over frames that come in their order. One thread at a time."""

    def __init__(self) -> None:
        self._open: list[_Open] = []
        self._count = 0

    @property
    def now(self) -> list[Track]:
        """The open tracks so far."""
        return [track.done() for track in self._open if len(track.points) >= MIN_TRACK_POINTS]

    def add(self, frame: int, movers: Sequence[MovingBlob]) -> list[Track]:
        """Add the blobs of a frame; return the long enough tracks that have ended."""
        pairs = []
        for which, track in enumerate(self._open):
            place, reach = track.expected(frame)
            for other, mover in enumerate(movers):
                off = float(np.hypot(mover.x - place[0], mover.y - place[1]))
                ratio = max(mover.area_px, track.area_px) / max(
                    min(mover.area_px, track.area_px), 1.0
                )
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
        lost = [
            track
            for track in self._open
            if frame - track.frames[-1] > MAX_MISSED or len(track.points) >= MAX_POINTS
        ]
        self._open = [track for track in self._open if track not in lost]
        return [track.done() for track in lost if len(track.points) >= MIN_TRACK_POINTS]

    def forget(self, number: int, until: int) -> None:
        """Drop a track's points up to that frame: they have been reported."""
        for track in self._open:
            if track.number == number:
                rest = [i for i, frame in enumerate(track.frames) if frame > until] or [
                    len(track.frames) - 1
                ]
                track.frames = [track.frames[i] for i in rest]
                track.points = [track.points[i] for i in rest]

    def end(self) -> list[Track]:
        """End all tracks and return them."""
        ended, self._open = self.now, []
        return ended

    def _follow(self, track: _Open, frame: int, mover: MovingBlob) -> None:
        track.frames.append(frame)
        track.points.append((mover.x, mover.y))
        track.area_px = (
            mover.area_px if len(track.points) == 1 else 0.7 * track.area_px + 0.3 * mover.area_px
        )


@dataclass(frozen=True, eq=False)
class StraightRun:
    """One straight run. frames (n,), points (n, 2) raw px; bow_px: signed, to the left of its way positive.

    rms_px: about the parabola; straight_px: about the straight line; bow_sigma_px: from the run's own noise.
    """

    frames: NDArray[np.int64]
    points: Points
    length_px: float
    sag_px: float
    sag_sigma_px: float
    rms_px: float
    straight_px: float


@dataclass(frozen=True)
class _Arc:
    off: NDArray[np.float64]  # each point's distance, px
    noise_px: float
    sag_px: float
    sag_sigma_px: float
    length_px: float
    forwards: bool
    fits: bool


def straight_runs(
    frames: NDArray[np.int64], points: Points, diagonal_px: float
) -> list[StraightRun]:
    """The runs of one track, in their order; frames (n,) ascending, points (n, 2) px."""
    runs: list[StraightRun] = []
    for first, last in _pieces(points, 0, len(points)):
        run = _run(frames[first:last], points[first:last])
        if run is not None and run.length_px >= MIN_LENGTH * diagonal_px:
            runs.append(run)
    return runs


def _pieces(points: Points, first: int, last: int) -> Sequence[tuple[int, int]]:
    """Cut where it is bent most, until every piece is an arc; then join neighbours that are one."""
    if last - first < MIN_RUN_POINTS:
        return []
    arc = _arc(points[first:last])
    if arc.fits:
        return [(first, last)]
    cut = _corner(points[first:last]) + first
    left, right = list(_pieces(points, first, cut)), list(_pieces(points, cut, last))
    if (
        left
        and right
        and left[-1][1] >= right[0][0] - 1
        and _arc(points[left[-1][0] : right[0][1]]).fits
    ):
        right[0] = (left.pop()[0], right[0][1])
    return left + right


def _corner(points: Points) -> int:
    """Where two arcs fit better than at any other place."""
    best, where = np.inf, len(points) // 2
    least = 3
    for cut in range(least, len(points) - least + 1):
        cost = _roughness(points[:cut]) + _roughness(points[cut:])
        if cost < best:
            best, where = cost, cut
    return where


def _roughness(points: Points) -> float:
    """The sum of what the points are off a straight line, without much harm by a few that are far off."""
    u, v, _ = _turned(points)
    degree = 1 if len(points) < 5 else 2
    scale = max(float(np.ptp(u)), 1.0)
    design = np.vander(u / scale, degree + 1)
    off = v - design @ np.linalg.lstsq(design, v, rcond=None)[0]
    return float(np.minimum(off**2, CROOKED_PX**2 * 4).sum())


def _turned(points: Points) -> tuple[NDArray, NDArray, NDArray]:
    """Along and across the main direction, from the middle; the direction points the way it went."""
    middle = points.mean(axis=0)
    direction = np.linalg.svd(points - middle, full_matrices=False)[2][0]
    if (points[-1] - points[0]) @ direction < 0:
        direction = -direction
    across = np.array([direction[1], -direction[0]])  # to the left of its way, as y points down
    return (points - middle) @ direction, (points - middle) @ across, direction


def _arc(points: Points) -> _Arc:
    u, v, _ = _turned(points)
    length = float(np.ptp(u))
    scale = max(length / 2, 1e-9)
    design = np.stack([np.ones_like(u), u / scale, (u / scale) ** 2], axis=1)
    weight, noise = np.ones(len(u)), NOISE_PX
    for _ in range(ROUNDS):
        root = np.sqrt(weight)
        terms = np.linalg.lstsq(design * root[:, None], v * root, rcond=None)[0]
        off = v - design @ terms
        freedom = max(1.0, weight.sum() - 3)
        noise = max(
            1.4826 * float(np.median(np.abs(off))) * np.sqrt(len(u) / freedom)
            if len(u) > 3
            else 0.0,
            0.02,
        )
        weight = np.minimum(1.0, HUBER * noise / np.maximum(np.abs(off), 1e-12))
    normal = (design * weight[:, None]).T @ design
    sigma = float(np.sqrt(max(np.linalg.pinv(normal)[2, 2], 0.0))) * noise
    bow = -float(terms[2])  # the arc's height above its chord, of whose half-length `scale` is
    away = np.abs(off) > np.maximum(MAX_OFF_NOISES * max(noise, NOISE_PX), 1e-9)
    in_a_row = bool(np.any(away[1:] & away[:-1]))
    steps = np.diff(u)
    forwards = (
        length > 0
        and float(np.mean(steps > -2 * noise)) > 0.95
        and length / max(len(u) - 1, 1) > MIN_STEP_PX
    )
    fits = (
        noise <= MAX_NOISE_PX
        and not in_a_row
        and float(np.mean(away)) <= 0.12
        and abs(bow) <= MAX_BOW * max(length, 1e-9)
    )
    return _Arc(off, noise, bow, sigma, length, forwards, fits)


def _run(frames: NDArray[np.int64], points: Points) -> StraightRun | None:
    if len(points) < MIN_RUN_POINTS:
        return None
    arc = _arc(points)
    near = np.abs(arc.off) <= MAX_OFF_NOISES * max(arc.noise_px, 0.1)
    frames, points = frames[near], points[near]
    if len(points) < MIN_RUN_POINTS:
        return None
    arc = _arc(points)
    if not (arc.fits and arc.forwards):
        return None
    _, v, _ = _turned(points)
    return StraightRun(
        frames,
        points,
        arc.length_px,
        arc.sag_px,
        arc.sag_sigma_px,
        root_mean_square(arc.off),
        float(np.std(v)),
    )
