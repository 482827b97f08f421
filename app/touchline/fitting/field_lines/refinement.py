"""Refining a camera on ridges: each ridge point is matched to the nearest marking that runs its way, the camera moves
to fit them, and the search radius shrinks. What else is in the picture matches no marking, or is an outlier.
"""

from dataclasses import dataclass, replace

import numpy as np

from touchline.core.errors import FitFailed
from touchline.core.field import Field
from touchline.core.geometry import Array, ImageSize, Indices, Points, with_z
from touchline.fitting.field_lines.blind_distortion import UndistortedPlane
from touchline.fitting.field_lines.seen_lines import SeenLines
from touchline.fitting.field_pattern import FieldPattern
from touchline.fitting.least_squares import minimise
from touchline.fitting.linear import pose_from_homography
from touchline.fitting.ray_camera.camera_prior import ASPECT_SIGMA, CENTRE_SHARE
from touchline.fitting.ray_camera.parameters import RayCameraParameters
from touchline.fitting.ray_camera.problem import ClickResiduals, ScalarPrior, curve_of
from touchline.fitting.ray_camera.search import RayFitProblem, residual_count
from touchline.models.lenses.division import odd_series
from touchline.models.ray_camera import BrownConrady, Division

CAPTURE_PX = (24.0, 14.0, 10.0, 6.0, 3.5, 2.0)  # in a picture of 1280 px, on the way in
MIN_COSINE = np.cos(np.radians(12))
MAX_POINTS, FINER_POINTS = 320, 600
MIN_POINTS = 40
ON_LINE_PX = 5.0
STEPS = 3  # for each capture: its matches change with the next
FINER_PX = (7.0, 4.0, 2.5, 1.5)  # once the camera is known, and only its lens is to be known better
FOCAL_SPREAD = 0.7  # σ of the focal length's logarithm about the first guess
# σ of the lens' terms about the first guess at a radius of half a diagonal
TERM_SPREAD = {"k": 0.3, "k1": 0.3, "k2": 0.3, "k3": 0.15, "p1": 0.01, "p2": 0.01}


@dataclass(frozen=True, eq=False)
class RefinedCamera:
    """state: the camera; rms_px of the matched points; share: of all ridge points that are matched."""

    state: RayCameraParameters
    rms_px: float
    share: float


def initial_camera(homography: Array, focal: float, plane: UndistortedPlane,
                   size: ImageSize) -> RayCameraParameters | None:
    """Return the camera of a homography from the field to the undistorted plane; focal is in the plane's units."""
    focal_px = focal * plane.unit_px
    try:
        rotation, position = pose_from_homography(np.diag([plane.unit_px, plane.unit_px, 1.0]) @ homography, focal_px)
    except FitFailed:
        return None
    return RayCameraParameters(Division.LENS, float(np.log(focal_px)), 1.0, np.array(size.centre),
                    np.array([plane.bend * focal**2]), rotation, position, np.zeros(0))


def with_brown_conrady(state: RayCameraParameters, pattern: FieldPattern, size: ImageSize) -> RayCameraParameters:
    """Return the same camera with the Brown–Conrady lens nearest to its division lens where it sees markings.

    Their series about the axis would not do: under a wide lens it leaves the far lines tens of pixels off.
    """
    rays = (with_z(pattern.points) - state.position_mm) @ state.camera_from_field.T
    with np.errstate(all="ignore"):
        projected = state.project(with_z(pattern.points))
        inside = ((projected > 0) & (projected < np.array(tuple(size)))).all(axis=1) & (rays[:, 2] > 0)
        far = np.linalg.norm(rays[inside, :2] / rays[inside, 2:], axis=1)
    reach = float(far.max()) if far.size else 1.0
    r = np.linspace(reach / 60, reach, 60)
    bent = state.lens.distort(state.terms, np.stack([r, np.zeros(60), np.ones(60)], axis=1))[:, 0]
    fine = np.isfinite(bent)
    terms = np.zeros(len(BrownConrady.LENS.TERMS))
    terms[[BrownConrady.LENS.TERMS.index(name) for name in ("k1", "k2", "k3")]] = odd_series(r[fine], bent[fine], 3)
    return replace(state, lens=BrownConrady.LENS, terms=terms)


def refine_camera(start: RayCameraParameters, pattern: FieldPattern, seen: SeenLines,
                  captures_px: tuple[float, ...] = CAPTURE_PX, most: int = MAX_POINTS) -> RefinedCamera | None:
    """Refine start on ridges, `most` points of them; None where it matches too few."""
    (points, along), size = seen.some(most), seen.size
    scale = max(size.width / 1280, 0.5)
    state, rms, share = start, np.inf, 0.0
    for capture in captures_px:
        marking = nearest_markings(state, pattern, points, along, size, capture * scale)
        taken = marking >= 0
        if taken.sum() < MIN_POINTS:
            return None
        problem = _problem(state, pattern, points[taken], marking[taken])
        fixed = set(state.lens.TERMS) - set(TERM_SPREAD)  # terms that few lenses need
        free = np.array([name not in fixed for name in state.names])
        task = RayFitProblem(problem, _priors(start, size), free, state.names)
        found = _minimise(task, state, 0.15 * capture * scale)
        if found is None:
            return None
        state = found
        off, _ = problem.residuals(state)
        rms, share = float(np.sqrt(np.median(off**2)) * 1.4826), float(taken.mean())
    return RefinedCamera(state, rms, share)


def nearest_markings(state: RayCameraParameters, pattern: FieldPattern, points: Points, along: Array, size: ImageSize,
                     capture_px: float) -> Indices:
    """Return the marking (n,) that each ridge point lies on, or -1: near enough across it, and running its way."""
    with np.errstate(all="ignore"):
        flat = with_z(pattern.points)
        way = with_z(pattern.along) * pattern.step_mm[:, None]
        projected = state.project(flat)
        ahead = state.project(flat + 0.25 * way) - state.project(flat - 0.25 * way)
        length = np.linalg.norm(ahead, axis=1)
        inside = ((projected > -50) & (projected < np.array(tuple(size)) + 50)).all(axis=1) & (length > 0)
    if not inside.any():
        return np.full(len(points), -1)
    projected, ahead, length = projected[inside], ahead[inside], length[inside].astype(np.float32)
    tangent = (ahead / length[:, None]).astype(np.float32)  # each with each: half the bytes, half the time
    x, y = points.astype(np.float32).T[..., None] - projected.astype(np.float32).T[:, None]
    across = np.abs(x * tangent[:, 1] - y * tangent[:, 0])
    further = np.abs(x * tangent[:, 0] + y * tangent[:, 1]) - 1.1 * length  # half a step either way
    alike = np.abs(along.astype(np.float32) @ tangent.T) > MIN_COSINE
    off = np.where(alike & (further < capture_px), across + np.maximum(further, 0), np.inf)
    best = off.argmin(axis=1)
    near = np.take_along_axis(off, best[:, None], axis=1)[:, 0] < capture_px
    return np.where(near, pattern.marking[inside][best], -1)


def outer_mm(field: Field) -> Array:
    """Return x and y (2,) mm within which a line is on the field; what runs along the outermost is a wall or a goal."""
    return np.array([field.length_mm, field.width_mm]) / 2 * 0.99


def explained_points(state: RayCameraParameters, pattern: FieldPattern, outer: Array, points: Points, along: Array,
                     size: ImageSize) -> tuple[int, int]:
    """Return how many points on ridges lie on markings, and how many lie on the field and on no marking."""
    on_line = nearest_markings(state, pattern, points, along, size, ON_LINE_PX) >= 0
    on_field = (np.abs(state.unproject(points, np.zeros(len(points)))) < outer).all(axis=1)
    return int(on_line.sum()), int((on_field & ~on_line).sum())


def _problem(state: RayCameraParameters, pattern: FieldPattern, points: Points, marking: Indices) -> ClickResiduals:
    base, way, radius = (np.array(column)[marking] for column in zip(*map(curve_of, pattern.markings), strict=True))
    count = len(points)
    problem = ClickResiduals(points, np.stack([np.zeros(count, int), np.arange(count)], axis=1), base, way, radius,
                             np.zeros(count), np.full(count, -1), np.full(count, -1), np.full((count, 2), -1),
                             np.empty((0, 3)))
    problem.places = problem.first_places(state)  # near enough: they were matched by this camera
    return problem


def _priors(start: RayCameraParameters, size: ImageSize) -> tuple[ScalarPrior, ...]:
    per_unit = np.exp(start.log_focal) / (np.hypot(size.width, size.height) / 2)
    known = dict(zip(start.lens.TERMS, start.terms, strict=True))
    centre_sigma_px = CENTRE_SHARE * size.width
    return (ScalarPrior("log_focal", start.log_focal, FOCAL_SPREAD), ScalarPrior("aspect", 1.0, ASPECT_SIGMA),
            ScalarPrior("centre_x", size.centre[0], centre_sigma_px),
            ScalarPrior("centre_y", size.centre[1], centre_sigma_px),
            *(ScalarPrior(name, float(known[name]), float(spread * per_unit ** start.lens.power(name)))
              for name, spread in TERM_SPREAD.items() if name in known))


def _minimise(task: RayFitProblem, start: RayCameraParameters, sigma: float) -> RayCameraParameters | None:
    def evaluate(state: RayCameraParameters) -> tuple[Array, Array]:
        r, j = task.problem.residuals(state)
        known, by = task.prior_residuals(state)
        # A point whose foot is out of sight says nothing, here; it must not stop the search.
        fine = np.isfinite(r) & np.isfinite(j).all(axis=1)
        r, j = np.where(fine, r, 0.0), np.where(fine[:, None], j, 0.0)
        return np.concatenate([r / sigma, known]), np.concatenate([j / sigma, by])[:, task.free]

    found = minimise(start, evaluate, lambda state, delta: state.retract(delta, task.free),
                     robust_rows=residual_count(task.problem), max_steps=STEPS, tolerance=1e-3)
    return found.state if np.isfinite(found.cost) else None
