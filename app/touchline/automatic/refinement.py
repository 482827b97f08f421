"""Refining a camera on ridges: each ridge point is matched to the nearest marking that runs its way, the camera moves
to fit them, and the search radius shrinks. What else is in the picture matches no marking, or is an outlier.
"""

from dataclasses import dataclass, replace

import numpy as np

from touchline.automatic.seen_lines import SeenLines
from touchline.core.field import Field
from touchline.core.geometry import Array, ImageSize, Indices, Points, with_z
from touchline.fitting.field_pattern import FieldPattern
from touchline.fitting.least_squares import minimise
from touchline.fitting.ray_camera.camera_prior import ASPECT_SIGMA, CENTRE_SHARE
from touchline.fitting.ray_camera.parameters import RayCameraParameters
from touchline.fitting.ray_camera.problem import ClickResiduals, ScalarPrior, curve_of
from touchline.fitting.ray_camera.search import RayFitProblem, residual_count
from touchline.models.lenses.division import odd_series
from touchline.models.ray_camera import BrownConrady

NOMINAL_WIDTH_PX = 1280  # of the picture for which distances in px are given here
MIN_SCALE = 0.5  # of them, in a small picture
CAPTURE_PX = (24.0, 14.0, 10.0, 6.0, 3.5, 2.0)  # on the way in
# once the camera is known, and only its lens is to be known better
FINER_CAPTURE_PX = (7.0, 4.0, 2.5, 1.5)
MAX_POINTS, MAX_FINER_POINTS = 320, 600  # on ridges, that the camera is moved to
MIN_MATCHED_POINTS = 40
MIN_COSINE = np.cos(np.radians(12))  # between a ridge and the marking that it may be
MAX_ON_LINE_PX = 5.0  # between a ridge point and a marking that explains it
MAX_OUTSIDE_PX = 50  # of a marking's sample beyond the picture's edge: its end may be matched
SAMPLE_REACH = 1.1  # of half a step either way along a marking, for which a sample stands
MAX_STEPS = 3  # for each capture: its matches change with the next
# of the capture radius: the noise of matched points; what lies further off is an outlier
SIGMA_SHARE = 0.15
MAD_TO_SIGMA = 1.4826  # of a normal distribution
FIELD_SHARE = 0.99  # of half the field's sides, in which a line is on it

FOCAL_SIGMA = 0.7  # of the focal length's logarithm about the first guess
# σ of the lens' terms about the first guess at a radius of half a diagonal
TERM_SIGMA = {"k": 0.3, "k1": 0.3, "k2": 0.3, "k3": 0.15, "p1": 0.01, "p2": 0.01}
LENS_SAMPLES = 60  # along a lens' radius


@dataclass(frozen=True, eq=False)
class RefinedCamera:
    """state: the camera; rms_px of the matched points; share: of all ridge points that are matched."""

    state: RayCameraParameters
    rms_px: float
    share: float


def with_brown_conrady(
    state: RayCameraParameters, pattern: FieldPattern, size: ImageSize
) -> RayCameraParameters:
    """Return the same camera with the Brown–Conrady lens nearest to its division lens where it sees markings.

    Their series about the axis would not do: under a wide lens it leaves the far lines tens of pixels off.
    """
    rays = (with_z(pattern.points) - state.position_mm) @ state.camera_from_field.T
    with np.errstate(all="ignore"):
        projected = state.project(with_z(pattern.points))
        inside = ((projected > 0) & (projected < np.array(tuple(size)))).all(axis=1) & (
            rays[:, 2] > 0
        )
        radii = np.linalg.norm(rays[inside, :2] / rays[inside, 2:], axis=1)
    max_radius = float(radii.max()) if radii.size else 1.0
    radius = np.linspace(max_radius / LENS_SAMPLES, max_radius, LENS_SAMPLES)
    sampled_rays = np.stack([radius, np.zeros(LENS_SAMPLES), np.ones(LENS_SAMPLES)], axis=1)
    distorted = state.lens.distort(state.terms, sampled_rays)[:, 0]
    fine = np.isfinite(distorted)
    terms = np.zeros(len(BrownConrady.LENS.TERMS))
    radial = [BrownConrady.LENS.TERMS.index(name) for name in ("k1", "k2", "k3")]
    terms[radial] = odd_series(radius[fine], distorted[fine], 3)
    return replace(state, lens=BrownConrady.LENS, terms=terms)


def refine_camera(
    start: RayCameraParameters,
    pattern: FieldPattern,
    seen: SeenLines,
    captures_px: tuple[float, ...] = CAPTURE_PX,
    most: int = MAX_POINTS,
) -> RefinedCamera | None:
    """Refine start on ridges, `most` points of them; None where it matches too few."""
    (points, along), size = seen.sampled(most), seen.size
    scale = max(size.width / NOMINAL_WIDTH_PX, MIN_SCALE)
    state, rms, share = start, np.inf, 0.0
    for capture in captures_px:
        marking = nearest_markings(state, pattern, points, along, size, capture * scale)
        is_matched = marking >= 0
        if is_matched.sum() < MIN_MATCHED_POINTS:
            return None
        problem = _problem(state, pattern, points[is_matched], marking[is_matched])
        free = np.array(
            [name not in state.lens.TERMS or name in TERM_SIGMA for name in state.names]
        )
        # other terms few lenses need
        task = RayFitProblem(problem, _priors(start, size), free, state.names)
        found = _minimised(task, state, SIGMA_SHARE * capture * scale)
        if found is None:
            return None
        state = found
        residuals, _ = problem.residuals(state)
        rms, share = (
            float(np.sqrt(np.median(residuals**2)) * MAD_TO_SIGMA),
            float(is_matched.mean()),
        )
    return RefinedCamera(state, rms, share)


def nearest_markings(
    state: RayCameraParameters,
    pattern: FieldPattern,
    points: Points,
    along: Array,
    size: ImageSize,
    capture_px: float,
) -> Indices:
    """Return the marking (n,) that each ridge point lies on, or -1: near enough across it, and running its way.

    Every point is compared with every sample of the field, each of which stands for a short piece of its marking.
    """
    with np.errstate(all="ignore"):
        flat = with_z(pattern.points)
        step = with_z(pattern.along) * pattern.step_mm[:, None]
        projected = state.project(flat)
        half_step = state.project(flat + 0.25 * step) - state.project(flat - 0.25 * step)
        half_length = np.linalg.norm(half_step, axis=1)
        is_near_picture = (
            (projected > -MAX_OUTSIDE_PX) & (projected < np.array(tuple(size)) + MAX_OUTSIDE_PX)
        ).all(axis=1) & (half_length > 0)
    if not is_near_picture.any():
        return np.full(len(points), -1)
    projected, half_step = projected[is_near_picture], half_step[is_near_picture]
    half_length = half_length[is_near_picture].astype(np.float32)
    # each with each: half the bytes, half the time
    tangent = (half_step / half_length[:, None]).astype(np.float32)
    x, y = points.astype(np.float32).T[..., None] - projected.astype(np.float32).T[:, None]
    across = np.abs(x * tangent[:, 1] - y * tangent[:, 0])
    beyond_piece = np.abs(x * tangent[:, 0] + y * tangent[:, 1]) - SAMPLE_REACH * half_length
    is_parallel = np.abs(along.astype(np.float32) @ tangent.T) > MIN_COSINE
    distance = np.where(
        is_parallel & (beyond_piece < capture_px), across + np.maximum(beyond_piece, 0), np.inf
    )
    nearest = distance.argmin(axis=1)
    is_captured = np.take_along_axis(distance, nearest[:, None], axis=1)[:, 0] < capture_px
    return np.where(is_captured, pattern.marking[is_near_picture][nearest], -1)


def outer_mm(field: Field) -> Array:
    """Return x and y (2,) mm within which a line is on the field; what runs along the outermost is a wall or a goal."""
    return np.array([field.length_mm, field.width_mm]) / 2 * FIELD_SHARE


def explained_points(
    state: RayCameraParameters,
    pattern: FieldPattern,
    outer: Array,
    points: Points,
    along: Array,
    size: ImageSize,
) -> tuple[int, int]:
    """Return how many points on ridges lie on markings, and how many lie on the field and on no marking."""
    on_line = nearest_markings(state, pattern, points, along, size, MAX_ON_LINE_PX) >= 0
    on_field = (np.abs(state.unproject(points, np.zeros(len(points)))) < outer).all(axis=1)
    return int(on_line.sum()), int((on_field & ~on_line).sum())


def _problem(
    state: RayCameraParameters, pattern: FieldPattern, points: Points, marking: Indices
) -> ClickResiduals:
    base, way, radius = (
        np.array(column)[marking] for column in zip(*map(curve_of, pattern.markings), strict=True)
    )
    count = len(points)
    problem = ClickResiduals(
        points,
        np.stack([np.zeros(count, int), np.arange(count)], axis=1),
        base,
        way,
        radius,
        np.zeros(count),
        np.full(count, -1),
        np.full(count, -1),
        np.full((count, 2), -1),
        np.empty((0, 3)),
    )
    problem.places = problem.first_places(state)  # near enough: they were matched by this camera
    return problem


def _priors(start: RayCameraParameters, size: ImageSize) -> tuple[ScalarPrior, ...]:
    """Return what holds the camera near the first guess where the lines do not tell.

    A lens' term is of rays; its σ is of the picture, and grows with the focal length by the term's power.
    """
    focal = np.exp(start.log_focal) / (np.hypot(size.width, size.height) / 2)  # half diagonals
    terms = dict(zip(start.lens.TERMS, start.terms, strict=True))
    centre_sigma_px = CENTRE_SHARE * size.width
    return (
        ScalarPrior("log_focal", start.log_focal, FOCAL_SIGMA),
        ScalarPrior("aspect", 1.0, ASPECT_SIGMA),
        ScalarPrior("centre_x", size.centre[0], centre_sigma_px),
        ScalarPrior("centre_y", size.centre[1], centre_sigma_px),
        *(
            ScalarPrior(name, float(terms[name]), float(sigma * focal ** start.lens.power(name)))
            for name, sigma in TERM_SIGMA.items()
            if name in terms
        ),
    )


def _minimised(
    task: RayFitProblem, start: RayCameraParameters, sigma_px: float
) -> RayCameraParameters | None:
    def evaluate(state: RayCameraParameters) -> tuple[Array, Array]:
        residuals, jacobian = task.problem.residuals(state)
        prior_residuals, prior_jacobian = task.prior_residuals(state)
        # A point whose foot is out of sight says nothing, here; it must not stop the search.
        fine = np.isfinite(residuals) & np.isfinite(jacobian).all(axis=1)
        residuals, jacobian = np.where(fine, residuals, 0.0), np.where(fine[:, None], jacobian, 0.0)
        return (
            np.concatenate([residuals / sigma_px, prior_residuals]),
            np.concatenate([jacobian / sigma_px, prior_jacobian])[:, task.free],
        )

    found = minimise(
        start,
        evaluate,
        lambda state, delta: state.retract(delta, task.free),
        robust_rows=residual_count(task.problem),
        max_steps=MAX_STEPS,
        tolerance=1e-3,
    )
    return found.state if np.isfinite(found.cost) else None
