"""The search for a ray camera: several starts, a robust refinement, strays named, then plain least squares."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from app.core.errors import FitFailed
from app.core.geometry import Array
from app.fitting.least_squares import Minimum, minimise
from app.fitting.ray_camera.distortion_prior import BendPrior
from app.fitting.ray_camera.lens_prior import JointPrior
from app.fitting.ray_camera.parameters import RayState
from app.fitting.ray_camera.problem import Prior, RayProblem

CLICK_PX = 0.5  # σ of a click before the clicks themselves tell
START_STEPS = 8
CLICK_PRIOR = 1  # clicks that this guess weighs
ENTER = 6.0
ENTER_EACH = 2.0  # more for terms that come in company: one of them alone may be all that is needed
STRAY_SIGMAS = 4.5
STRAY_PX = 1.5  # nothing nearer is called a stray
CORE = 4.0  # medians: what tells the first spread, 2.7 σ
MISS_PX = 3.0  # a click missed by more counts so much when lenses are compared
MAX_STRAYS = 0.3  # of all clicks
TOLD_SHARE = 0.3  # of a wide prior's σ: a parameter known better than this is told by the clicks


@dataclass(frozen=True, eq=False)
class Task:
    """Everything that stays the same during one fit."""

    problem: RayProblem
    priors: tuple[Prior, ...]
    free: Array
    names: tuple[str, ...]
    held: bool = False  # the lens is given
    joint: JointPrior | BendPrior | None = None  # how well it is known; a lens that is given is held fast without

    @property
    def unknowns(self) -> int:
        """What the clicks themselves have to tell."""
        return int(self.free.sum()) - (len(self.joint.names) if self.joint else 0)

    def known(self, state: RayState) -> tuple[Array, Array]:
        """What is known beforehand as further residuals, in σ, and their Jacobian (rows, all parameters)."""
        values, names = state.values(), list(self.names)
        known = np.array([(values[p.name] - p.value) / p.sigma for p in self.priors])
        by = np.zeros((len(self.priors), len(names)))
        for row, p in enumerate(self.priors):
            by[row, names.index(p.name)] = 1 / p.sigma
        if self.joint:
            known = np.concatenate([known, self.joint.residuals(values)])
            by = np.concatenate([by, self.joint.jacobian(names, values)])
        return known, by


@dataclass(frozen=True, eq=False)
class Found:
    task: Task
    terms: tuple[str, ...]
    minimum: Minimum[RayState]
    inliers: Array
    pixels: Array  # residuals, px: signed for curves, distances for spots
    sigma_px: float
    freedom: int

    @property
    def rms_px(self) -> float:
        return float(np.sqrt(np.mean(self.pixels[self.inliers] ** 2)))

    @property
    def covariance(self) -> Array:
        return covariance_of(self.minimum.jacobian)


def first_bend(ladder: tuple[tuple[str, ...], ...]) -> tuple[str, ...]:
    """The simplest lens that bends at all: what tells the starts apart."""
    return next((terms for terms in ladder if terms), ladder[-1])


def best_start(task: Task, starts: list[RayState]) -> RayState:
    """Each start is improved a little, robustly; the best goes on."""
    tried = []
    for start in starts:
        task.problem.places = np.empty(0)
        terms = tuple(n for n, f in zip(task.names, task.free, strict=True) if f)
        begin = start if task.held else cleared(start, terms)
        tried.append(_minimise(task, begin, 2 * CLICK_PX, rows_of(task.problem), steps=START_STEPS))
    best = min(tried, key=lambda m: m.cost)
    if not np.isfinite(best.cost):
        raise no_camera()
    return best.state


def no_camera() -> FitFailed:
    return FitFailed("No camera was found that sees the clicked lines where they were clicked.",
                     "Check which line each click belongs to, and the region.", reason="no-camera")


def solve(task: Task, start: RayState, settings: Mapping[str, Any]) -> Found:
    """Robustly from the start, then plainly without the strays."""
    sigma = settings["click_sigma_px"] or CLICK_PX
    robust = settings["robust"]
    rows = rows_of(task.problem)
    task.problem.places = np.empty(0)
    best = _minimise(task, start, sigma, rows if robust else 0)
    if not np.isfinite(best.cost):
        raise no_camera()
    inliers = np.ones(len(task.problem.pixels), bool)
    for _ in range(4 if robust else 1):
        pixels = _distances(task.problem, best.state)
        trusted = inliers if _ else np.abs(pixels) <= CORE * np.median(np.abs(pixels))  # wild ones hide others
        spread = settings["click_sigma_px"] or _spread(pixels[trusted], task.unknowns)
        strays = np.abs(pixels) > max(STRAY_SIGMAS * spread, STRAY_PX) if robust else ~inliers
        if strays.sum() > MAX_STRAYS * strays.size:
            strays = np.zeros_like(strays)  # that many are no strays: the model is wrong, or the lines are mixed up
        if np.array_equal(~strays, inliers) and _ > 0:
            break
        inliers = ~strays
        kept = replace(task, problem=task.problem.only(inliers))
        best = _minimise(kept, best.state, spread, 0)
    pixels = _distances(task.problem, best.state)
    spread = settings["click_sigma_px"] or _spread(pixels[inliers], task.unknowns)
    kept = replace(task, problem=task.problem.only(inliers))
    best = _minimise(kept, best.state, spread, 0)
    if not np.isfinite(best.cost):
        raise no_camera()
    freed = replace(kept, priors=_still_needed(task, best))
    if len(freed.priors) < len(task.priors):
        free = _minimise(freed, best.state, spread, 0)
        if np.isfinite(free.cost):  # else a look at the same place went out of reach: the priors stay
            best, kept = free, freed
    pixels = _distances(task.problem, best.state)
    known = len(task.priors) + (len(task.joint.names) if task.joint else 0)
    freedom = rows_of(kept.problem) + known - int(task.free.sum())
    terms = tuple(n for n, f in zip(task.names, task.free, strict=True) if f and n in best.state.lens_names)
    return Found(task, terms, best, inliers, pixels, float(spread), freedom)


def _still_needed(task: Task, found: Minimum[RayState]) -> tuple[Prior, ...]:
    """Without the wide priors of all that the clicks tell by themselves, which those would only pull aside."""
    sigma = dict(zip(np.array(task.names)[task.free], np.sqrt(np.diag(covariance_of(found.jacobian))), strict=True))
    return tuple(p for p in task.priors if not p.wide or sigma[p.name] > TOLD_SHARE * p.sigma)


def covariance_of(jacobian: Array) -> Array:
    """(JᵀJ)⁻¹ of whitened residuals, by way of unit columns. Refuses what would hang the decomposition."""
    if not np.isfinite(jacobian).all():
        raise no_camera()
    scale = np.linalg.norm(jacobian, axis=0)
    scale[scale == 0] = 1.0
    information = (jacobian / scale).T @ (jacobian / scale)
    return np.linalg.pinv(information, rcond=1e-14, hermitian=True) / np.outer(scale, scale)


def _minimise(task: Task, start: RayState, sigma: float, robust_rows: int, steps: int = 60) -> Minimum[RayState]:
    def evaluate(state: RayState) -> tuple[Array, Array]:
        r, j = task.problem.residuals(state)
        known, by = task.known(state)
        return np.concatenate([r / sigma, known]), np.concatenate([j / sigma, by])[:, task.free]

    return minimise(start, evaluate, lambda state, delta: state.moved(delta, task.free),
                    robust_rows=robust_rows, max_steps=steps,
                    tolerance=1e-4 if robust_rows else 1e-9)


def rows_of(problem: RayProblem) -> int:
    return problem.curves + 2 * len(problem.spots)


def _distances(problem: RayProblem, state: RayState) -> Array:
    """Per click: the signed distance from its curve, or the distance from its spot, px."""
    r, _ = problem.residuals(state)
    spots = r[problem.curves:].reshape(-1, 2)
    return np.concatenate([r[:problem.curves], np.linalg.norm(spots, axis=1) / np.sqrt(2)])


def _spread(pixels: Array, parameters: int) -> float:
    """σ of a click from residuals, with a prior; robust when there are enough of them."""
    freedom = max(len(pixels) - parameters, 1)
    variance = float(np.sum(pixels**2))
    return float(np.sqrt((variance + CLICK_PRIOR * CLICK_PX**2) / (freedom + CLICK_PRIOR)))


def significantly_better(simple: Found, rich: Found) -> bool:
    """Does the richer lens explain more than its extra terms would of noise? ENTER is F, tuned for least error.

    Measured over lenses and tilts, 24 to 48 seeds each: at 3 noise gets in, as k3 mostly (2.3 mm for 1.6 under a mild
    lens); k2 need not pass, it comes with k1 (setup.py).
    """
    extra = int(rich.task.free.sum() - simple.task.free.sum())
    freedom = len(rich.pixels) - int(rich.task.free.sum())
    if extra <= 0 or freedom < 3:
        return False
    judged = simple.inliers | rich.inliers  # what both call a stray says nothing of the lens
    simple_cost, rich_cost = (float(np.sum(np.minimum(f.pixels[judged] ** 2, MISS_PX**2))) for f in (simple, rich))
    gain = (simple_cost - rich_cost) / extra
    return gain > (ENTER + ENTER_EACH * (extra - 1) + 12 / freedom) * max(rich_cost / freedom, 1e-12)


def cleared(state: RayState, terms: tuple[str, ...]) -> RayState:
    keep = np.array([name in terms for name in state.lens.TERMS], bool)
    return replace(state, terms=np.where(keep, state.terms, 0.0))
