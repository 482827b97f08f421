"""The straight runs of a track: pieces between kicks and cushions along which a thing rolled, each with its bow.

What rolls freely goes straight over the carpet; a lens bends that into a gentle arc, a kick into a corner. So a run is
a piece that a parabola across its chord fits, found by a robust orthogonal regression: points count by how well they
agree (Huber's weights), and distances are across the run, never along an axis of the picture:

    v = a + b u + c u²,   u along the chord, v across it;   bow = c L² / 4,  L the run's length.

Without the bow (c = 0) it is the paper's modified linear regression (section IV).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from touchline.core.geometry import Points, root_mean_square

MIN_POINTS = 8
MIN_LENGTH = 0.05  # of the picture's diagonal: shorter ones say nothing about its lens
MIN_STEP_PX = 1.0  # from point to point on the average: slower things stand, and jitter
MAX_BOW = 0.12  # of the length: more is no lens, but a curve that was driven
CROOKED_PX = 3.0  # a point further off than this is off whatever the noise
NOISES = 3.5
NOISE_PX = 0.25  # about what a ball's middle errs in a clean picture
HUBER = 1.5
ROUNDS = 6
MAX_NOISE_PX = 1.5  # a run that is rougher is no rolling thing


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


def straight_runs(frames: NDArray[np.int64], points: Points, diagonal_px: float) -> list[StraightRun]:
    """The runs of one track, in their order; frames (n,) ascending, points (n, 2) px."""
    runs: list[StraightRun] = []
    for first, last in _pieces(points, 0, len(points)):
        run = _run(frames[first:last], points[first:last])
        if run is not None and run.length_px >= MIN_LENGTH * diagonal_px:
            runs.append(run)
    return runs


def _pieces(points: Points, first: int, last: int) -> Sequence[tuple[int, int]]:
    """Cut where it is bent most, until every piece is an arc; then join neighbours that are one."""
    if last - first < MIN_POINTS:
        return []
    arc = _arc(points[first:last])
    if arc.fits:
        return [(first, last)]
    cut = _corner(points[first:last]) + first
    left, right = list(_pieces(points, first, cut)), list(_pieces(points, cut, last))
    if left and right and left[-1][1] >= right[0][0] - 1 and _arc(points[left[-1][0]:right[0][1]]).fits:
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
        noise = max(1.4826 * float(np.median(np.abs(off))) * np.sqrt(len(u) / freedom) if len(u) > 3 else 0.0, 0.02)
        weight = np.minimum(1.0, HUBER * noise / np.maximum(np.abs(off), 1e-12))
    normal = (design * weight[:, None]).T @ design
    sigma = float(np.sqrt(max(np.linalg.pinv(normal)[2, 2], 0.0))) * noise
    bow = -float(terms[2])  # the arc's height above its chord, of whose half-length `scale` is
    away = np.abs(off) > np.maximum(NOISES * max(noise, NOISE_PX), 1e-9)
    in_a_row = bool(np.any(away[1:] & away[:-1]))
    steps = np.diff(u)
    forwards = length > 0 and float(np.mean(steps > -2 * noise)) > 0.95 and length / max(len(u) - 1, 1) > MIN_STEP_PX
    fits = (noise <= MAX_NOISE_PX and not in_a_row and float(np.mean(away)) <= 0.12
            and abs(bow) <= MAX_BOW * max(length, 1e-9))
    return _Arc(off, noise, bow, sigma, length, forwards, fits)


def _run(frames: NDArray[np.int64], points: Points) -> StraightRun | None:
    if len(points) < MIN_POINTS:
        return None
    arc = _arc(points)
    near = np.abs(arc.off) <= NOISES * max(arc.noise_px, 0.1)
    frames, points = frames[near], points[near]
    if len(points) < MIN_POINTS:
        return None
    arc = _arc(points)
    if not (arc.fits and arc.forwards):
        return None
    _, v, _ = _turned(points)
    return StraightRun(frames, points, arc.length_px, arc.sag_px, arc.sag_sigma_px, root_mean_square(arc.off),
                       float(np.std(v)))
