"""The search for a lens and the poses of a board: where it starts, and how it reaches the minimum.

Start: homographies, the intrinsics of Z. Zhang ("A flexible new technique for camera calibration", PAMI 2000), poses
along rays. His closed form supposes a lens without distortion; where the lens is strong, a scan over focal lengths,
judged by how well poses fit along the rays, is what finds the right minimum.

Minimum: all views share the lens and the bow, and each has a pose of its own, which is eliminated first:

    | U   W | | shared |     | a |          S = U - Σ W_v V_v⁻¹ W_vᵀ    (Schur complement)
    | Wᵀ  V | | poses  | = - | b |          shared = - S⁻¹ (a - Σ W_v V_v⁻¹ b_v)

V is block-diagonal, one 6 × 6 block a view, so 300 views cost 300 small inversions and not one of 1800 rows.
B. Triggs et al., "Bundle adjustment – a modern synthesis", 1999, §6.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from touchline.boards.problem import (
    BlockLinearisation,
    BoardObservations,
    BoardParameters,
    BoardProblem,
    free_mask,
)
from touchline.core.geometry import Array, ImageSize, Mask, homogeneous
from touchline.fitting.ray_camera.fit import lens_fitter
from touchline.models.lenses import Lens
from touchline.models.ray_camera import RayCamera

SCAN_VIEWS = 12  # enough to tell the local minima apart
SCAN_FOCAL = np.geomspace(0.25, 6.0, 14)  # of the image's width: 127° to 9.5° across
# k1 of the scanned lenses, r_d = r (1 + k1 r²): none, usual, strong barrel
SCAN_BEND = (0.0, -0.15, -0.35)
MAX_STARTS = 4
# of the image's width: else Zhang's closed form is no start
MIN_FOCAL_SHARE, MAX_FOCAL_SHARE = 0.05, 100
MIN_ASPECT, MAX_ASPECT = 0.5, 2
LOST_CORNER_PX = 1e6  # the distance that a corner counts which a lens cannot project
MIN_SIGMA_PX = 1e-6  # no corner counts more than that, exact as it may be
FIRST_DAMPING, MIN_DAMPING, MAX_DAMPING = 1e-4, 1e-12, 1e10
MIN_GAIN = 1e-7  # of a step: a share of one residual's worth


def start_states(
    model: type[RayCamera], observations: BoardObservations, image_size: ImageSize, distorts: bool
) -> list[BoardParameters]:
    """Return the best of Zhang's lens and of the scan, each with all poses. distorts: whether the lens may."""
    lens, centre, width = model.LENS, np.array(image_size.centre), image_size.width
    few = observations.only(
        np.unique(np.linspace(0, len(observations.pixels) - 1, SCAN_VIEWS).astype(int))
    )
    distortions = (
        [lens_fitter(model).start_terms(k1) for k1 in SCAN_BEND]
        if distorts
        else [np.zeros(len(lens.TERMS))]
    )
    candidates = list(product(SCAN_FOCAL * width, distortions))
    focal, aspect = zhang_intrinsics(homographies(observations), image_size)
    if (
        MIN_FOCAL_SHARE * width < focal < MAX_FOCAL_SHARE * width
        and MIN_ASPECT <= aspect <= MAX_ASPECT
    ):
        # The aspect only says whether to believe the focal length: every start has square pixels.
        candidates += [(focal, terms) for terms in distortions]
    distances = [
        _median_distance(state_with_poses(lens, terms, f, 1.0, centre, few), few)
        for f, terms in candidates
    ]
    return [
        state_with_poses(lens, terms, f, 1.0, centre, observations)
        for f, terms in (candidates[i] for i in np.argsort(distances)[:MAX_STARTS])
    ]


def _median_distance(state: BoardParameters, observations: BoardObservations) -> float:
    """Return the median distance of corners from their projections, px; what a lens cannot project counts as far."""
    with np.errstate(all="ignore"):
        distances = np.linalg.norm(state.project(observations) - observations.pixels, axis=-1)[
            observations.present
        ]
    return float(np.median(np.where(np.isfinite(distances), distances, LOST_CORNER_PX)))


def state_with_poses(
    lens: type[Lens],
    terms: Array,
    focal_px: float,
    aspect: float,
    centre_px: Array,
    observations: BoardObservations,
) -> BoardParameters:
    """Return the state of a roughly known lens, with every pose straight from its rays."""
    with np.errstate(all="ignore"):
        plane = (observations.pixels - centre_px) / (focal_px * np.array([1.0, aspect]))
        rays = lens.undistort(terms, plane)
        rays = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
    rotations, translations = poses_from_rays(rays, observations)
    return BoardParameters(
        lens,
        float(np.log(focal_px)),
        aspect,
        np.array(centre_px, float),
        np.array(terms, float),
        np.zeros(2),
        rotations,
        translations,
    )


def homographies(observations: BoardObservations) -> Array:
    """Return H of every view, pixel ~ H (x, y, 1), (v, 3, 3), by the normalised direct linear transform."""
    unit_from_pixel, pixels = _normalised(observations.pixels, observations.present)
    unit_from_board, places = _normalised(observations.places[..., :2], observations.present)
    h = _null_vectors(homogeneous(pixels), places, observations.present)
    h = np.linalg.inv(unit_from_pixel) @ h @ unit_from_board
    return h / h[:, 2:, 2:]


def zhang_intrinsics(h: Array, image_size: ImageSize) -> tuple[float, float]:
    """Return (focal_px, aspect) of homographies (v, 3, 3); NaN where undetermined.

    The principal point is the image's centre. The first two columns of K⁻¹ H are perpendicular and of one length: two
    linear equations in 1/fx² and 1/fy² a view.
    """
    cx, cy = image_size.centre
    shifted = h.copy()
    shifted[:, 0] -= cx * h[:, 2]
    shifted[:, 1] -= cy * h[:, 2]
    a, b = shifted[:, :, 0], shifted[:, :, 1]
    left = np.concatenate([a[:, :2] * b[:, :2], a[:, :2] ** 2 - b[:, :2] ** 2])
    right = np.concatenate([-a[:, 2] * b[:, 2], b[:, 2] ** 2 - a[:, 2] ** 2])
    scale = np.maximum(np.tile(np.sum(a[:, :2] ** 2 + b[:, :2] ** 2, axis=1), 2), 1e-300)
    inverse_squares, *_ = np.linalg.lstsq(left / scale[:, None], right / scale, rcond=None)
    if not (inverse_squares > 0).all():
        return float("nan"), float("nan")
    fx, fy = 1 / np.sqrt(inverse_squares)
    return float(fx), float(fy / fx)


def poses_from_rays(rays: Array, observations: BoardObservations) -> tuple[Array, Array]:
    """Return camera_from_board of every view, (v, 3, 3) and (v, 3) mm, from unit rays (v, m, 3), also past 90°.

    ray × (r1 x + r2 y + t) = 0 is linear in the columns r1, r2, t; the rotation nearest to them follows.
    """
    flat = observations.places[..., :2]
    unit_from_board, places = _normalised(flat, observations.present)
    rays = np.where(np.isfinite(rays), rays, np.nan)
    usable = observations.present & np.isfinite(rays).all(axis=-1)
    m = _null_vectors(np.nan_to_num(rays), places, usable) @ unit_from_board
    # Its size: r1 and r2 are unit vectors. Its sign: corners are ahead, along their rays.
    length = np.sqrt(np.linalg.norm(m[:, :, 0], axis=1) * np.linalg.norm(m[:, :, 1], axis=1))
    m = m / np.maximum(length, 1e-300)[:, None, None]
    points = homogeneous(flat) @ m.transpose(0, 2, 1)
    ahead = np.sum(
        np.where(observations.present, np.sum(points * np.nan_to_num(rays), -1), 0), axis=1
    )
    m = m * np.where(ahead < 0, -1.0, 1.0)[:, None, None]
    columns = np.stack([m[:, :, 0], m[:, :, 1], np.cross(m[:, :, 0], m[:, :, 1])], axis=-1)
    finite = np.isfinite(columns).all(axis=(1, 2), keepdims=True)  # numpy's SVD would not end
    u, _, vt = np.linalg.svd(np.where(finite, columns, np.eye(3)))
    u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]  # a rotation, and no reflection
    return u @ vt, m[:, :, 2]


def _normalised(points: Array, present: Mask) -> tuple[Array, Array]:
    """Return transforms (v, 3, 3) that centre each view's points and scale them to √2 (Hartley), and the points."""
    count = np.maximum(present.sum(axis=1), 1)[:, None]
    middle = np.sum(points * present[..., None], axis=1) / count
    distances = np.linalg.norm(points - middle[:, None], axis=-1)
    scale = np.sqrt(2) / np.maximum(np.sum(distances * present, axis=1) / count[:, 0], 1e-12)
    transform = np.zeros((len(points), 3, 3))
    transform[:, 0, 0] = transform[:, 1, 1] = scale
    transform[:, :2, 2] = -scale[:, None] * middle
    transform[:, 2, 2] = 1
    return transform, (points - middle[:, None]) * scale[:, None, None]


def _null_vectors(rays: Array, places: Array, present: Mask) -> Array:
    """Return M (v, 3, 3) with ray × M (x, y, 1) = 0 in the least-squares sense, of unit size.

    M, row by row, is the eigenvector of the least eigenvalue of Σ [ray]×ᵀ[ray]× ⊗ p pᵀ, 9 × 9 a view.
    """
    p = homogeneous(places) * present[..., None]
    # [r]×ᵀ[r]× = |r|² I - r rᵀ
    cross_squared = (
        np.sum(rays**2, -1)[..., None, None] * np.eye(3) - rays[..., :, None] * rays[..., None, :]
    )
    outer = p[..., :, None] * p[..., None, :]
    v = len(places)
    # Σ over the corners: all views in one product, then its axes in the order of the Kronecker product.
    normal = (cross_squared.reshape(v, -1, 9).transpose(0, 2, 1) @ outer.reshape(v, -1, 9)).reshape(
        v, 3, 3, 3, 3
    )
    normal = normal.transpose(0, 1, 3, 2, 4).reshape(v, 9, 9)
    _, vectors = np.linalg.eigh(normal)
    return vectors[:, :, 0].reshape(v, 3, 3)


@dataclass(frozen=True, eq=False)
class BoardMinimum:
    """Where the search ended. residuals, by_shared, by_pose: of BlockLinearisation there, without robust weights."""

    state: BoardParameters
    cost: float
    residuals: Array
    by_shared: Array
    by_pose: Array

    @property
    def reduced(self) -> Array:
        """Return derivatives by the shared parameters (v, 2 m, n), each view's pose eliminated."""
        v = len(self.residuals)
        by_shared, by_pose = (
            self.by_shared.reshape(v, -1, self.by_shared.shape[-1]),
            self.by_pose.reshape(v, -1, 6),
        )
        by_pose_t = by_pose.transpose(0, 2, 1)
        blocks = by_pose_t @ by_pose
        # a little more on the diagonals, so that a view with too few corners does not make the system singular
        blocks += np.einsum("vi,ij->vij", np.einsum("vii->vi", blocks) * 1e-13 + 1e-12, np.eye(6))
        return by_shared - by_pose @ np.linalg.solve(blocks, by_pose_t @ by_shared)

    @property
    def information(self) -> Array:
        """Return the information matrix (n, n) of the shared parameters; poses are eliminated."""
        reduced = self.reduced
        return np.einsum("vij,vik->jk", reduced, reduced, optimize=True)


@dataclass(frozen=True, eq=False)
class BoardSolution:
    """A problem and its minimum."""

    problem: BoardProblem
    minimum: BoardMinimum
    terms: tuple[str, ...]

    @property
    def sigma_px(self) -> float:
        """Return σ of one coordinate of a corner."""
        squares = float(np.sum(self.minimum.residuals**2)) * self.problem.sigma_px**2
        return float(np.sqrt(squares / max(self.freedom, 1)))

    @property
    def freedom(self) -> int:
        """Return the degrees of freedom: coordinates less estimated parameters."""
        poses = 6 * len(self.problem.observations.pixels)
        return (
            2 * int(self.problem.observations.present.sum()) - int(self.problem.free.sum()) - poses
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the shared parameters that were estimated."""
        return tuple(np.array(self.minimum.state.names)[self.problem.free])

    @property
    def prior(self) -> Array:
        """Return 1/σ of the prior of each of names."""
        return self.problem.prior(self.minimum.state)[1]


@dataclass(frozen=True, eq=False)
class BoardSolver:
    """Fits boards under the settings of one calibration."""

    image_size: ImageSize
    settings: Mapping[str, Any]

    def solve(
        self,
        observations: BoardObservations,
        start: BoardParameters,
        terms: tuple[str, ...],
        sigma_px: float,
        *,
        robust: bool = False,
        max_steps: int = 50,
    ) -> BoardSolution:
        """Find the minimum nearest to start, with these terms free and the others 0."""
        keep = np.array([name in terms for name in start.lens.TERMS], bool)
        start = replace(start, terms=np.where(keep, start.terms, 0.0))
        free = free_mask(
            start, terms, **{name: self.settings[name] for name in ("aspect", "centre", "warp")}
        )
        problem = BoardProblem(observations, free, self.image_size, max(sigma_px, MIN_SIGMA_PX))
        return BoardSolution(
            problem, minimise(problem, start, robust=robust, max_steps=max_steps), terms
        )

    def fit_poses(
        self, observations: BoardObservations, start: BoardParameters, sigma_px: float
    ) -> BoardMinimum:
        """Fit the poses alone; the lens and the bow are fixed."""
        nothing = np.zeros(len(start.names), bool)
        return minimise(
            BoardProblem(observations, nothing, self.image_size, max(sigma_px, MIN_SIGMA_PX)), start
        )


def minimise(
    problem: BoardProblem, start: BoardParameters, *, robust: bool = False, max_steps: int = 50
) -> BoardMinimum:
    """Find the state of least cost near start by Levenberg–Marquardt, poses eliminated.

    robust: soft L1 on the length of each corner's residual. Converged when no step would lower the cost by more than
    MIN_GAIN of one residual's worth. The damping follows H. Nielsen 1999.
    """
    prior_mean, prior = problem.prior(start)

    def prior_residual(state: BoardParameters) -> Array:
        return prior * (state.shared[problem.free] - prior_mean)

    state, linear = start, problem.linearise(start)
    cost = _cost(linear.residuals, prior_residual(state), robust)
    damping, growth = FIRST_DAMPING, 2.0
    if not np.isfinite(cost):
        return BoardMinimum(state, np.inf, *linear)
    for _ in range(max_steps):
        weight = (1 + np.sum(linear.residuals**2, axis=-1)) ** -0.5 if robust else None
        normal = _normal_equations(linear, weight)
        while True:  # damp more and more, until a step lowers the cost
            shared_step, pose_steps, gain = _step(normal, prior, prior_residual(state), damping)
            if np.isfinite(shared_step).all() and np.isfinite(pose_steps).all():
                if gain < MIN_GAIN:
                    return BoardMinimum(state, cost, *linear)
                candidate = state.retract(shared_step, problem.free, pose_steps)
                candidate_linear = problem.linearise(candidate)
                candidate_cost = _cost(
                    candidate_linear.residuals, prior_residual(candidate), robust
                )
                if np.isfinite(candidate_cost) and candidate_cost < cost:
                    break
            damping, growth = damping * growth, growth * 2
            if damping > MAX_DAMPING:
                return BoardMinimum(state, cost, *linear)
        ratio = (cost - candidate_cost) / gain  # 1 where the linear model predicted the gain
        state, cost, linear = candidate, candidate_cost, candidate_linear
        damping, growth = max(damping * max(1 / 5, 1 - (2 * ratio - 1) ** 3), MIN_DAMPING), 2.0
    return BoardMinimum(state, cost, *linear)


class NormalEquations(NamedTuple):
    """U (n, n), Wᵀ (v, 6, n), V (v, 6, 6), a (n,), b (v, 6), of the equations above."""

    u: Array
    w: Array
    v: Array
    a: Array
    b: Array


def _normal_equations(linear: BlockLinearisation, weight: Array | None) -> NormalEquations:
    """Sum up the normal equations; weight (v, m): of each corner, None for 1."""
    v, rows = len(linear.residuals), linear.residuals[0].size
    residuals = linear.residuals.reshape(v, rows)
    by_shared, by_pose = linear.by_shared.reshape(v, rows, -1), linear.by_pose.reshape(v, rows, 6)
    if weight is None:
        weighted_shared, weighted_pose = by_shared.transpose(0, 2, 1), by_pose.transpose(0, 2, 1)
    else:
        row_weight = np.repeat(weight, 2, axis=1)[..., None]
        weighted_shared = (by_shared * row_weight).transpose(0, 2, 1)
        weighted_pose = (by_pose * row_weight).transpose(0, 2, 1)
    a, b = (
        (weighted_shared @ residuals[..., None])[..., 0],
        (weighted_pose @ residuals[..., None])[..., 0],
    )
    return NormalEquations(
        np.sum(weighted_shared @ by_shared, axis=0),
        weighted_pose @ by_shared,
        weighted_pose @ by_pose,
        np.sum(a, axis=0),
        b,
    )


def _step(
    normal: NormalEquations, prior: Array, prior_residual: Array, damping: float
) -> tuple[Array, Array, float]:
    """Return the shared step, the poses' steps, and how much the linear model predicts them to lower the cost.

    NaN where the damped equations are singular.
    """
    u, w, v, a, b = normal
    u = u + np.diag(prior**2)
    a = a + prior * prior_residual
    diag_u, diag_v = np.diag(u).copy(), np.einsum("vii->vi", v).copy()
    diag_u[diag_u <= 0] = 1.0
    diag_v[diag_v <= 0] = 1.0
    try:
        damped_v = v + damping * np.einsum("vi,ij->vij", diag_v, np.eye(v.shape[-1]))
        solved = np.linalg.solve(damped_v, np.concatenate([w, b[..., None]], axis=-1))
        v_inverse_w, v_inverse_b = solved[..., :-1], solved[..., -1]
        schur = (
            u + damping * np.diag(diag_u) - np.einsum("vkn,vkm->nm", w, v_inverse_w, optimize=True)
        )
        right = a - np.einsum("vkn,vk->n", w, v_inverse_b)
        # unknowns of one size: the focal length in px and k3 are far apart
        scale = 1 / np.sqrt(diag_u)
        shared_step = -scale * np.linalg.solve(schur * np.outer(scale, scale), scale * right)
    except np.linalg.LinAlgError:
        return np.full(len(a), np.nan), np.full_like(b, np.nan), np.nan
    pose_steps = -(v_inverse_b + v_inverse_w @ shared_step)
    # (H + D) step = -gradient, so the linear model's gain -2 gradientᵀ step - stepᵀ H step is
    gain = -(a @ shared_step + np.sum(b * pose_steps)) + damping * (
        diag_u @ shared_step**2 + np.sum(diag_v * pose_steps**2)
    )
    return shared_step, pose_steps, float(gain)


def _cost(residuals: Array, prior_residual: Array, robust: bool) -> float:
    squared = np.sum(residuals**2, axis=-1)
    of_corners = np.sum(2 * (np.sqrt(1 + squared) - 1)) if robust else np.sum(squared)
    return float(of_corners + prior_residual @ prior_residual)
