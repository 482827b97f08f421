"""The search for a ray camera: several starts, a robust refinement, outlier rejection, then plain least squares."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from app.core.errors import FitFailed
from app.core.geometry import Array
from app.fitting.least_squares import Minimum, minimise
from app.fitting.ray_camera.lens_prior import GaussianPrior
from app.fitting.ray_camera.parameters import RayCameraParameters
from app.fitting.ray_camera.problem import ClickResiduals, ScalarPrior

CLICK_PX = 0.5  # prior of σ of a click
START_STEPS = 8
PRIOR_CLICKS = 1  # how many clicks that prior weighs
ENTRY_F = 6.0
ENTRY_F_EACH = 2.0  # more for terms that enter together: one of them alone may be enough
OUTLIER_SIGMAS = 4.5
MIN_OUTLIER_PX = 1.5  # nothing nearer is an outlier
CORE_MEDIANS = 4.0  # 2.7 σ: the first spread is taken from clicks within
MAX_COUNTED_PX = 3.0  # a click missed by more counts so much when lenses are compared
MAX_OUTLIER_SHARE = 0.3  # of all clicks
KNOWN_SHARE = 0.3  # of a wide prior's σ: a parameter known better is determined by the clicks


@dataclass(frozen=True, eq=False)
class RayFitProblem:
    """Residuals, priors and free parameters of one fit."""

    problem: ClickResiduals
    priors: tuple[ScalarPrior, ...]
    free: Array
    names: tuple[str, ...]
    lens_given: bool = False  # by the options; fixed unless it has a prior
    lens_prior: GaussianPrior | None = None

    @property
    def unknowns(self) -> int:
        """Return the number of unknowns that the clicks must determine."""
        return int(self.free.sum()) - (len(self.lens_prior.names) if self.lens_prior else 0)

    def prior_residuals(self, state: RayCameraParameters) -> tuple[Array, Array]:
        """Return the priors as residuals, in σ, and their Jacobian (rows, all parameters)."""
        values, names = state.values(), list(self.names)
        known = np.array([(values[p.name] - p.value) / p.sigma for p in self.priors])
        by = np.zeros((len(self.priors), len(names)))
        for row, p in enumerate(self.priors):
            by[row, names.index(p.name)] = 1 / p.sigma
        if self.lens_prior:
            known = np.concatenate([known, self.lens_prior.residuals(values)])
            by = np.concatenate([by, self.lens_prior.jacobian(names, values)])
        return known, by


@dataclass(frozen=True, eq=False)
class RayFitResult:
    task: RayFitProblem
    terms: tuple[str, ...]
    minimum: Minimum[RayCameraParameters]
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


def best_start(task: RayFitProblem, starts: list[RayCameraParameters]) -> RayCameraParameters:
    """Improve each start by a few robust steps and return the best."""
    tried = []
    for start in starts:
        task.problem.places = np.empty(0)
        terms = tuple(n for n, f in zip(task.names, task.free, strict=True) if f)
        begin = start if task.lens_given else start.with_only_terms(terms)
        tried.append(_minimise(task, begin, 2 * CLICK_PX, residual_count(task.problem), steps=START_STEPS))
    best = min(tried, key=lambda m: m.cost)
    if not np.isfinite(best.cost):
        raise no_camera_error()
    return best.state


def no_camera_error() -> FitFailed:
    return FitFailed("No camera was found that sees the clicked lines where they were clicked.",
                     "Check which line each click belongs to, and the region.", reason="no-camera")


def solve(task: RayFitProblem, start: RayCameraParameters, settings: Mapping[str, Any]) -> RayFitResult:
    """Fit robustly from the start, then plainly without the outliers."""
    sigma = settings["click_sigma_px"] or CLICK_PX
    robust = settings["robust"]
    rows = residual_count(task.problem)
    task.problem.places = np.empty(0)
    best = _minimise(task, start, sigma, rows if robust else 0)
    if not np.isfinite(best.cost):
        raise no_camera_error()
    inliers = np.ones(len(task.problem.pixels), bool)
    for number in range(4 if robust else 1):
        pixels = _click_distances(task.problem, best.state)
        # at first without the furthest, which would hide other outliers
        trusted = inliers if number else np.abs(pixels) <= CORE_MEDIANS * np.median(np.abs(pixels))
        spread = settings["click_sigma_px"] or _spread(pixels[trusted], task.unknowns)
        outliers = np.abs(pixels) > max(OUTLIER_SIGMAS * spread, MIN_OUTLIER_PX) if robust else ~inliers
        if outliers.sum() > MAX_OUTLIER_SHARE * outliers.size:
            outliers = np.zeros_like(outliers)  # so many: the model is wrong, or the lines are mixed up
        if np.array_equal(~outliers, inliers) and number > 0:
            break
        inliers = ~outliers
        inlier_problem = replace(task, problem=task.problem.only(inliers))
        best = _minimise(inlier_problem, best.state, spread, 0)
    pixels = _click_distances(task.problem, best.state)
    spread = settings["click_sigma_px"] or _spread(pixels[inliers], task.unknowns)
    inlier_problem = replace(task, problem=task.problem.only(inliers))
    best = _minimise(inlier_problem, best.state, spread, 0)
    if not np.isfinite(best.cost):
        raise no_camera_error()
    freed = replace(inlier_problem, priors=_still_needed(task, best))
    if len(freed.priors) < len(task.priors):
        free = _minimise(freed, best.state, spread, 0)
        if np.isfinite(free.cost):  # else the fit went out of reach: the priors stay
            best, inlier_problem = free, freed
    pixels = _click_distances(task.problem, best.state)
    known = len(task.priors) + (len(task.lens_prior.names) if task.lens_prior else 0)
    freedom = residual_count(inlier_problem.problem) + known - int(task.free.sum())
    terms = tuple(n for n, f in zip(task.names, task.free, strict=True) if f and n in best.state.lens_names)
    return RayFitResult(task, terms, best, inliers, pixels, float(spread), freedom)


def _still_needed(task: RayFitProblem, found: Minimum[RayCameraParameters]) -> tuple[ScalarPrior, ...]:
    """Return the priors without the wide ones of parameters that the clicks determine: those would only bias them."""
    sigma = dict(zip(np.array(task.names)[task.free], np.sqrt(np.diag(covariance_of(found.jacobian))), strict=True))
    return tuple(p for p in task.priors if not p.wide or sigma[p.name] > KNOWN_SHARE * p.sigma)


def covariance_of(jacobian: Array) -> Array:
    """Return (JᵀJ)⁻¹ of whitened residuals, by way of unit columns; FitFailed where they are not finite."""
    if not np.isfinite(jacobian).all():
        raise no_camera_error()
    scale = np.linalg.norm(jacobian, axis=0)
    scale[scale == 0] = 1.0
    information = (jacobian / scale).T @ (jacobian / scale)
    return np.linalg.pinv(information, rcond=1e-14, hermitian=True) / np.outer(scale, scale)


def _minimise(task: RayFitProblem, start: RayCameraParameters, sigma: float, robust_rows: int,
              steps: int = 60) -> Minimum[RayCameraParameters]:
    def evaluate(state: RayCameraParameters) -> tuple[Array, Array]:
        r, j = task.problem.residuals(state)
        known, by = task.prior_residuals(state)
        return np.concatenate([r / sigma, known]), np.concatenate([j / sigma, by])[:, task.free]

    return minimise(start, evaluate, lambda state, delta: state.retract(delta, task.free), robust_rows=robust_rows,
                    max_steps=steps, tolerance=1e-4 if robust_rows else 1e-9)


def residual_count(problem: ClickResiduals) -> int:
    return problem.curves + 2 * len(problem.marks)


def _click_distances(problem: ClickResiduals, state: RayCameraParameters) -> Array:
    """Return per click the signed distance from its curve, or the distance from its mark, px."""
    r, _ = problem.residuals(state)
    spots = r[problem.curves:].reshape(-1, 2)
    return np.concatenate([r[:problem.curves], np.linalg.norm(spots, axis=1) / np.sqrt(2)])


def _spread(pixels: Array, parameters: int) -> float:
    """Return σ of a click from residuals and a prior."""
    freedom = max(len(pixels) - parameters, 1)
    variance = float(np.sum(pixels**2))
    return float(np.sqrt((variance + PRIOR_CLICKS * CLICK_PX**2) / (freedom + PRIOR_CLICKS)))


def significantly_better(simple: RayFitResult, rich: RayFitResult) -> bool:
    """Return whether the richer lens explains more than its extra terms would of noise.

    ENTRY_F is tuned for least error, over lenses and tilts, 24 to 48 seeds each: at 3 noise gets in, as k3 mostly
    (2.3 mm for 1.6 under a mild lens); k2 need not pass, it comes with k1 (setup.py).
    """
    extra = int(rich.task.free.sum() - simple.task.free.sum())
    freedom = len(rich.pixels) - int(rich.task.free.sum())
    if extra <= 0 or freedom < 3:
        return False
    judged = simple.inliers | rich.inliers  # what both call an outlier says nothing of the lens
    simple_cost, rich_cost = (float(np.sum(np.minimum(f.pixels[judged] ** 2, MAX_COUNTED_PX**2)))
                              for f in (simple, rich))
    gain = (simple_cost - rich_cost) / extra
    return gain > (ENTRY_F + ENTRY_F_EACH * (extra - 1) + 12 / freedom) * max(rich_cost / freedom, 1e-12)
