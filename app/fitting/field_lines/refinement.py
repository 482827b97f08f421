"""A camera drawn onto ridges: each ridge point goes to the marking that is nearest and runs its way, the camera moves
to lie on them, and what counts as near shrinks. What else is in the picture finds no marking, or is outvoted.
"""

from dataclasses import dataclass, replace

import numpy as np

from app.core.errors import FitFailed
from app.core.field import Arc
from app.core.geometry import Array, ImageSize, Points
from app.fitting.field_lines.blind_distortion import Plane
from app.fitting.field_lines.pattern import FieldPattern
from app.fitting.least_squares import minimise
from app.fitting.linear import pose_from_homography
from app.fitting.ray_camera.parameters import RayState
from app.fitting.ray_camera.problem import Prior, RayProblem
from app.fitting.ray_camera.search import Task, rows_of
from app.models.brown_conrady import BrownConrady
from app.models.division import Division

CAPTURE_PX = (24.0, 14.0, 10.0, 6.0, 3.5, 2.0)  # in a picture of 1280 px, on the way in
SAME_WAY = np.cos(np.radians(12))
MOST_POINTS = 500
LEAST_POINTS = 40
STEPS = 6
FINER_PX = (7.0, 4.0, 2.5, 1.5)  # once the camera is known, and only its lens is to be known better
FOCAL_SPREAD = 0.7  # σ of the focal length's logarithm about the first guess
# σ of the lens' terms about the first guess at a radius of half a diagonal, and the power of the radius they go with.
TERM_SPREAD = {"k": (0.3, 2), "k1": (0.3, 2), "k2": (0.3, 4), "k3": (0.15, 6), "p1": (0.01, 1), "p2": (0.01, 1)}


@dataclass(frozen=True, eq=False)
class Refined:
    """state: the camera; rms_px of the points that it took; share: of all ridge points that it took."""

    state: RayState
    rms_px: float
    share: float


def first_state(homography: Array, focal: float, plane: Plane, size: ImageSize) -> RayState | None:
    """A camera from a homography of the field to the straight plane, with a focal length in the plane's units."""
    focal_px = focal * plane.unit_px
    try:
        rotation, position = pose_from_homography(np.diag([plane.unit_px, plane.unit_px, 1.0]) @ homography, focal_px)
    except FitFailed:
        return None
    return RayState(Division.LENS, float(np.log(focal_px)), 1.0, np.array(size.centre),
                    np.array([plane.bend * focal**2]), rotation, position, np.zeros(0))


def with_finer_lens(state: RayState, pattern: FieldPattern, size: ImageSize) -> RayState:
    """The same camera behind a Brown–Conrady lens, which bends as its division lens does where it sees paint.

    Their series about the axis would not do: under a wide lens it leaves the far lines tens of pixels off.
    """
    rays = (np.c_[pattern.points, np.zeros(len(pattern.points))] - state.position_mm) @ state.camera_from_field.T
    with np.errstate(all="ignore"):
        seen = state.project(np.c_[pattern.points, np.zeros(len(pattern.points))])
        inside = ((seen > 0) & (seen < np.array(tuple(size)))).all(axis=1) & (rays[:, 2] > 0)
        far = np.linalg.norm(rays[inside, :2] / rays[inside, 2:], axis=1)
    reach = float(far.max()) if far.size else 1.0
    r = np.linspace(reach / 60, reach, 60)
    bent = state.lens.distort(state.terms, np.stack([r, np.zeros(60), np.ones(60)], axis=1))[:, 0]
    share = r / reach  # seen from far, every r is small, and its powers are as good as nought
    powers = np.stack([share**3, share**5, share**7], axis=1)
    fine = np.isfinite(bent)
    found, *_ = np.linalg.lstsq(powers[fine], bent[fine] / reach - share[fine], rcond=None)
    terms = np.zeros(len(BrownConrady.LENS.TERMS))
    for power, (name, value) in enumerate(zip(("k1", "k2", "k3"), found, strict=True), 1):
        terms[BrownConrady.LENS.TERMS.index(name)] = value / reach ** (2 * power)
    return replace(state, lens=BrownConrady.LENS, terms=terms)


def refined(start: RayState, pattern: FieldPattern, points: Points, along: Array, size: ImageSize,
            captures_px: tuple[float, ...] = CAPTURE_PX) -> Refined | None:
    """The camera near start that lies on the ridges, points (n, 2) raw px along (n, 2); None where it finds too few."""
    picked = np.random.default_rng(0).permutation(len(points))[:MOST_POINTS]
    points, along = points[picked], along[picked]
    scale = max(size.width / 1280, 0.5)
    state, rms, share = start, np.inf, 0.0
    for capture in captures_px:
        marking = nearest_markings(state, pattern, points, along, size, capture * scale)
        taken = marking >= 0
        if taken.sum() < LEAST_POINTS:
            return None
        problem = _problem(pattern, points[taken], marking[taken])
        found = _least(Task(problem, _priors(start, size), _free(state), state.names), state, 0.15 * capture * scale)
        if found is None:
            return None
        state = found
        off, _ = problem.residuals(state)
        rms, share = float(np.sqrt(np.median(off**2)) * 1.4826), float(taken.mean())
    return Refined(state, rms, share)


def nearest_markings(state: RayState, pattern: FieldPattern, points: Points, along: Array, size: ImageSize,
                     capture_px: float) -> Array:
    """(n,) the marking that each ridge point lies on, or -1: near enough across it, and running its way."""
    with np.errstate(all="ignore"):
        flat = np.concatenate([pattern.points, np.zeros((len(pattern.points), 1))], axis=1)
        way = np.concatenate([pattern.along, np.zeros((len(pattern.points), 1))], axis=1) * pattern.step_mm[:, None]
        seen = state.project(flat)
        ahead = state.project(flat + 0.25 * way) - state.project(flat - 0.25 * way)
        length = np.linalg.norm(ahead, axis=1)
        inside = ((seen > -50) & (seen < np.array(tuple(size)) + 50)).all(axis=1) & (length > 0)
    if not inside.any():
        return np.full(len(points), -1)
    seen, ahead, length = seen[inside], ahead[inside], length[inside]
    tangent = ahead / length[:, None]
    aside = points[:, None] - seen
    across = np.abs(aside[..., 0] * tangent[:, 1] - aside[..., 1] * tangent[:, 0])
    further = np.abs(np.einsum("nmi,mi->nm", aside, tangent)) - 1.1 * length  # half a step either way
    alike = np.abs(along @ tangent.T) > SAME_WAY
    off = np.where(alike & (further < capture_px), across + np.maximum(further, 0), np.inf)
    best = off.argmin(axis=1)
    near = np.take_along_axis(off, best[:, None], axis=1)[:, 0] < capture_px
    return np.where(near, pattern.marking[inside][best], -1)


def _problem(pattern: FieldPattern, points: Points, marking: Array) -> RayProblem:
    base, way, radius = [], [], []
    for m in pattern.markings:
        if isinstance(m, Arc):
            base.append((*m.centre, 0.0))
            way.append((1.0, 0.0))
            radius.append(m.radius_mm)
        else:
            start, end = np.array(m.start), np.array(m.end)
            base.append((*m.start, 0.0))
            way.append(tuple((end - start) / np.linalg.norm(end - start)))
            radius.append(0.0)
    count = len(points)
    return RayProblem(points, np.stack([np.zeros(count, int), np.arange(count)], axis=1), np.array(base)[marking],
                      np.array(way)[marking], np.array(radius)[marking], np.full(count, -1), np.empty((0, 3)), ())


def _free(state: RayState) -> Array:
    """All but the centre, which is the picture's, and terms that no ordinary lens needs."""
    held = {"centre_x", "centre_y", *state.lens.TERMS} - set(TERM_SPREAD)
    return np.array([name not in held for name in state.names])


def _priors(start: RayState, size: ImageSize) -> tuple[Prior, ...]:
    per_unit = np.exp(start.log_focal) / (np.hypot(size.width, size.height) / 2)
    known = dict(zip(start.lens.TERMS, start.terms, strict=True))
    return (Prior("log_focal", start.log_focal, FOCAL_SPREAD),
            *(Prior(name, float(known[name]), float(spread * per_unit**power))
              for name, (spread, power) in TERM_SPREAD.items() if name in known))


def _least(task: Task, start: RayState, sigma: float) -> RayState | None:
    def evaluate(state: RayState) -> tuple[Array, Array]:
        r, j = task.problem.residuals(state)
        known, by = task.known(state)
        # A point whose foot is out of sight says nothing, here; it must not stop the search.
        fine = np.isfinite(r) & np.isfinite(j).all(axis=1)
        r, j = np.where(fine, r, 0.0), np.where(fine[:, None], j, 0.0)
        return np.concatenate([r / sigma, known]), np.concatenate([j / sigma, by])[:, task.free]

    found = minimise(start, evaluate, lambda state, delta: state.moved(delta, task.free),
                     robust_rows=rows_of(task.problem), max_steps=STEPS, tolerance=1e-3)
    return found.state if np.isfinite(found.cost) else None
