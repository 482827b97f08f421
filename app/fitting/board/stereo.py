"""How two cameras stand to each other, from one board that both saw: every pose and the one between, together.

    point in the right camera = R · point in the left camera + T

The lenses are held as they are known; a corner's residuals in both pictures are minimised over R, T and all poses.
"""

from dataclasses import dataclass

import numpy as np

from app.core.board import BoardView
from app.core.errors import BadInput, FitFailed
from app.fitting.board.initial import poses_from_rays
from app.fitting.board.least_squares import Blocks, minimise_blocks
from app.fitting.board.outlier_rejection import FIRST_SIGMA_PX, LEAST_WEIGHT_PX, STRAY_SIGMAS
from app.fitting.board.parameters import Sights, matrices_from_vectors
from app.fitting.board.views import MIN_CORNERS
from app.models.lens import Array
from app.models.pinhole_lens import PinholeLens
from app.models.rotation import cross_matrix, nearest_rotation, vector_from_matrix


@dataclass(frozen=True, eq=False)
class StereoPose:
    """rotation: right_from_left, as a rotation vector; shift_mm: T. covariance (6, 6) of a turn and the shift.

    sigma_px: of one coordinate of a corner. epipolar_px: mean distance of a corner from the line on which the other
    picture says it must lie, over both pictures, both without distortion.
    """

    rotation: tuple[float, float, float]
    shift_mm: tuple[float, float, float]
    covariance: Array
    sigma_px: float
    rms_px: float
    epipolar_px: float
    pairs: int
    strays: int

    @property
    def baseline_mm(self) -> float:
        return float(np.linalg.norm(self.shift_mm))


@dataclass(frozen=True, eq=False)
class _State:
    turn: Array  # right_from_left (3, 3)
    shift_mm: Array
    rotations: Array  # left camera_from_board (v, 3, 3)
    shifts_mm: Array  # (v, 3)

    def moved(self, delta: Array, own: Array) -> "_State":
        return _State(matrices_from_vectors(delta[None, :3])[0] @ self.turn, self.shift_mm + delta[3:],
                      matrices_from_vectors(own[:, :3]) @ self.rotations, self.shifts_mm + own[:, 3:])


def stereo_pose(left: PinholeLens, right: PinholeLens, left_views: tuple[BoardView, ...],
                right_views: tuple[BoardView, ...], warp_mm: tuple[float, float] = (0.0, 0.0)) -> StereoPose:
    """The pose of the right camera to the left one. Views in pairs, taken at one moment; warp_mm: the board's bow."""
    pairs = _pairs(left_views, right_views)
    both = [Sights.of(side) for side in zip(*pairs, strict=True)]
    points = both[0].places.copy()
    points[..., 2] += both[0].bow @ np.array(warp_mm)
    state = _start((left, right), both)
    present, sigma = both[0].present.copy(), FIRST_SIGMA_PX
    for robust in (True, False, False):
        minimum = _solve((left, right), both, points, present, state, sigma, robust)
        state = minimum.state
        away = _away((left, right), both, points, state)
        freedom = 4 * int(present.sum()) - 6 - 6 * len(points)
        sigma = max(float(np.sqrt(np.sum(away[present] ** 2) / max(freedom, 1))), LEAST_WEIGHT_PX)
        present = both[0].present & (np.linalg.norm(away, axis=-1) < STRAY_SIGMAS * sigma * np.sqrt(2))
    minimum = _solve((left, right), both, points, present, state, sigma, False)
    away = _away((left, right), both, points, minimum.state)[present]
    sigma = float(np.sqrt(np.sum(away**2) / max(4 * int(present.sum()) - 6 - 6 * len(points), 1)))
    information = minimum.information
    if not (np.isfinite(information).all() and np.isfinite(sigma)):
        raise FitFailed("No pose between the two cameras was found.", "Check that the pictures are in pairs, taken at "
                        "one moment.", reason="no-stereo-pose")
    final = minimum.state
    return StereoPose(tuple(map(float, vector_from_matrix(final.turn))), tuple(map(float, final.shift_mm)),
                      np.linalg.pinv(information, hermitian=True), sigma,
                      float(np.sqrt(np.mean(np.sum(away.reshape(-1, 2) ** 2, axis=-1)))),
                      epipolar_error((left, right), final.turn, final.shift_mm,
                                     tuple(side.pixels[present] for side in both)),
                      len(pairs), int(both[0].present.sum() - present.sum()))


def epipolar_error(lenses: tuple[PinholeLens, PinholeLens], turn: Array, shift: Array,
                   pixels: tuple[Array, Array]) -> float:
    """Mean distance, px of an undistorted picture, between corners (n, 2) and the lines that the other side gives."""
    essential = cross_matrix(shift) @ turn
    planes = []
    for lens, seen in zip(lenses, pixels, strict=True):
        rays = lens.rays(seen)
        planes.append(rays / rays[:, 2:])
    first, second = planes
    agree = np.abs(np.sum(second * (first @ essential.T), axis=1))
    distances = []
    for lens, lines in ((lenses[1], first @ essential.T), (lenses[0], second @ essential)):
        distances.append(agree / np.hypot(lines[:, 0] / lens.focal_px, lines[:, 1] / (lens.focal_px * lens.aspect)))
    return float(np.nanmean(distances))


def _pairs(left_views: tuple[BoardView, ...], right_views: tuple[BoardView, ...]) -> list[tuple[BoardView, BoardView]]:
    """Both views of each pair with the corners that both have, in one order."""
    if len(left_views) != len(right_views):
        raise BadInput(f"{len(left_views)} views of the left camera and {len(right_views)} of the right one are no "
                       "pairs.", "Send as many of one as of the other, in one order.", reason="bad-view")
    pairs = []
    for left, right in zip(left_views, right_views, strict=True):
        where = {tuple(place): k for k, place in enumerate(np.round(right.places_mm, 6).tolist())}
        found = [(k, where[tuple(place)]) for k, place in enumerate(np.round(left.places_mm, 6).tolist())
                 if tuple(place) in where]
        if len(found) >= MIN_CORNERS:
            a, b = np.array(found).T
            pairs.append((BoardView(left.pixels[a], left.places_mm[a], left.name),
                          BoardView(right.pixels[b], right.places_mm[b], right.name)))
    if not pairs:
        raise FitFailed("No pair shows the board in both pictures.", "Take pairs in which both cameras see it.",
                        reason="too-few-views")
    return pairs


def _start(lenses: tuple[PinholeLens, PinholeLens], both: list[Sights]) -> _State:
    """The median over the pairs of what each alone says."""
    (r1, t1), (r2, t2) = (poses_from_rays(lens.rays(side.pixels), side)
                          for lens, side in zip(lenses, both, strict=True))
    turn = nearest_rotation(np.median(r2 @ r1.transpose(0, 2, 1), axis=0))
    return _State(turn, np.median(t2 - t1 @ turn.T, axis=0), r1, t1)


def _solve(lenses: tuple[PinholeLens, PinholeLens], both: list[Sights], points: Array, present: Array, start: _State,
           sigma: float, robust: bool) -> Blocks[_State]:
    def look(state: _State) -> tuple[Array, Array, Array]:
        arms = points @ state.rotations.transpose(0, 2, 1)
        seen = arms + state.shifts_mm[:, None]
        turned = seen @ state.turn.T
        looks = []
        for lens, side, rays in zip(lenses, both, (seen, turned + state.shift_mm), strict=True):
            focal = lens.focal_px * np.array([1.0, lens.aspect])
            plane, by_ray, _ = lens.lens.distort_jacobian(np.array(lens.terms), rays)
            by_ray = by_ray * focal[:, None]
            by_seen = by_ray if side is both[0] else by_ray @ state.turn
            shared = np.zeros((*plane.shape, 6))
            if side is both[1]:
                shared = np.concatenate([np.cross(turned[..., None, :], by_ray), by_ray], axis=-1)
            own = np.concatenate([np.cross(arms[..., None, :], by_seen), by_seen], axis=-1)
            looks.append((plane * focal + np.array(lens.centre_px) - side.pixels, shared, own))
        found = tuple(np.concatenate(parts, axis=1) / sigma for parts in zip(*looks, strict=True))
        for array in found:
            array[~np.concatenate([present, present], axis=1)] = 0
        return found

    return minimise_blocks(start, look, _State.moved, prior=np.zeros(6), prior_at=lambda _: np.zeros(6), robust=robust)


def _away(lenses: tuple[PinholeLens, PinholeLens], both: list[Sights], points: Array, state: _State) -> Array:
    """Residuals of each corner in both pictures, (v, m, 4) px."""
    seen = points @ state.rotations.transpose(0, 2, 1) + state.shifts_mm[:, None]
    return np.concatenate([lenses[0].project(seen) - both[0].pixels,
                           lenses[1].project(seen @ state.turn.T + state.shift_mm) - both[1].pixels], axis=-1)
