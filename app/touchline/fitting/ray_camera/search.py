"""The search for a ray camera: several starts, a robust refinement, outlier rejection, then plain least squares."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Generic

import numpy as np

from touchline.core.errors import FitFailed
from touchline.core.geometry import Array, Indices, Mask, root_mean_square
from touchline.core.statements import say
from touchline.fitting.contract import CLICK_SIGMAS_PX
from touchline.fitting.least_squares import FIRST_DAMPING, Minimum, minimise
from touchline.fitting.linear import CHECK_LINES
from touchline.fitting.ray_camera.lens_prior import GaussianPrior
from touchline.fitting.ray_camera.parameters import RayCameraParameters
from touchline.fitting.ray_camera.problem import (
    CameraState,
    ClickResiduals,
    ScalarPrior,
    State,
    line_sigmas_mm,
)

CLICK_PX = 0.5  # prior of σ of a click
# of every start, and of so many that were the best then
FIRST_STEPS, MORE_STEPS, PROMISING = 1, 7, 3
# where height and focal length trade, the least cost lies at the end of a long bent valley
MAX_STEPS = 300
PRIOR_CLICKS = 1  # how many clicks that prior weighs
OUTLIER_SIGMAS = 4.5
MIN_OUTLIER_PX = 1.5  # nothing nearer is an outlier
CORE_MEDIANS = 4.0  # 2.7 σ: the first spread is taken from clicks within
MAX_OUTLIER_SHARE = 0.3  # of all clicks
NOISE_ROUNDS = 3
# damping where the search begins near its end: less, and bent valleys cost steps in vain
NEARBY = 1e-7
MIN_NEIGHBOURS = 40  # fewer, and their correlation is chance
MAX_CORRELATION = 0.95
MIN_HEIGHT_MM = 1.0
# how near to its least the cost must be: for outliers, for σ, for the answer
SEARCHING, NEAR, THERE = 1e-2, 1e-4, 1e-7


_Tried = tuple[Minimum[RayCameraParameters], Array]  # and the places along its curves


@dataclass(frozen=True, eq=False)
class RayFitProblem:
    """Residuals, priors and free parameters of one fit.

    line_sigma_mm: of painted landmarks about their places; lines have offsets, with priors. usual_line_mm: about which
    the lines' own σ is learned, None where it is given.
    """

    problem: ClickResiduals
    priors: tuple[ScalarPrior, ...]
    free: Mask
    names: tuple[str, ...]
    line_sigma_mm: float = 0.0
    lens_prior: GaussianPrior | None = None
    usual_line_mm: float | None = None

    @property
    def known_names(self) -> tuple[str, ...]:
        """Return the name of each prior's residual."""
        return (*(p.name for p in self.priors), *(self.lens_prior.names if self.lens_prior else ()))

    @property
    def unknowns(self) -> int:
        """Return the number of unknowns that the clicks must determine."""
        return max(int(self.free.sum()) - len(self.known_names), 1)

    def prior_residuals(self, state: CameraState) -> tuple[Array, Array]:
        """Return the priors as residuals, in σ, and their Jacobian (rows, all parameters)."""
        values = state.values()
        if "height" in values:
            height = max(values["height"], MIN_HEIGHT_MM)
            values["log_height"] = float(np.log(height))
        means, sigmas, by = self._scalar_priors
        known = (np.array([values[p.name] for p in self.priors]) - means) / sigmas
        for row, p in enumerate(self.priors):
            if p.name == "log_height":
                by = by.copy()
                by[row] /= height
        if self.lens_prior:
            names = list(self.names)
            known = np.concatenate([known, self.lens_prior.residuals(values)])
            by = np.concatenate([by, self.lens_prior.jacobian(names, values)])
        return known, by

    @cached_property
    def _scalar_priors(self) -> tuple[Array, Array, Array]:
        """Return means, σ, and the Jacobian (rows, all parameters), which of log_height is that at a height of 1 mm."""
        sigmas = np.array([p.sigma for p in self.priors])
        by = np.zeros((len(self.priors), len(self.names)))
        for row, p in enumerate(self.priors):
            by[row, self.names.index("height" if p.name == "log_height" else p.name)] = 1 / p.sigma
        return np.array([p.value for p in self.priors]), sigmas, by

    def with_prior(self, name: str, prior: ScalarPrior) -> "RayFitProblem":
        """Return the same problem with another prior in the place of the one so called."""
        return replace(self, priors=tuple(prior if p.name == name else p for p in self.priors))

    def click_weights(self, state: CameraState, sigma_px: float) -> Array:
        """Return the weight (n,) of each click's residual: 1, and less for marks, which may lie beside their places."""
        weights = np.ones(len(self.problem.pixels))
        if len(self.problem.marks) and self.line_sigma_mm:
            _, by_point, _ = state.project_jacobian(self.problem.marks)
            px_per_mm = np.sqrt(np.abs(np.linalg.det(by_point[:, :, :2])))
            weights[self.problem.curves :] = 1 / np.hypot(
                1.0, np.nan_to_num(px_per_mm) * self.line_sigma_mm / sigma_px
            )
        return weights

    def with_line_sigmas(self, sigmas_mm: Array) -> "RayFitProblem":
        """Return the same problem with other σ of the lines' offsets."""
        others = tuple(p for p in self.priors if not p.name.startswith("line_"))
        return replace(
            self,
            priors=(
                *others,
                *(ScalarPrior(f"line_{i}", 0.0, float(s)) for i, s in enumerate(sigmas_mm)),
            ),
        )


@dataclass(frozen=True, eq=False)
class RayFitResult(Generic[State]):
    task: RayFitProblem
    terms: tuple[str, ...]
    minimum: Minimum[State]
    inliers: Mask
    clicks: ClickResiduals  # all of them; the task has the inliers
    sigma_px: float
    freedom: int
    correlation: float

    @cached_property
    def pixels(self) -> Array:
        """Return the residuals of all clicks, px: signed for curves, distances for spots."""
        return _click_distances(self.clicks, self.clicks.residuals(self.minimum.state)[0])

    @property
    def rms_px(self) -> float:
        return root_mean_square(self.pixels[self.inliers])

    @property
    def parameters(self) -> int:
        """Return how many numbers of the camera were estimated; the lines' offsets are none."""
        return sum(not name.startswith("line_") for name in self.free_names)

    @property
    def free_names(self) -> tuple[str, ...]:
        return tuple(
            name for name, free in zip(self.task.names, self.task.free, strict=True) if free
        )

    @property
    def covariance(self) -> Array:
        """Return that of the free parameters, in the order of their names."""
        return covariance_of(self.minimum.jacobian)

    @property
    def choices(self) -> dict[str, Any]:
        """Return what this fit has found, as options of the next one on some of its clicks."""
        return {
            "start_lines_mm": self.offsets_mm,
            "line_sigmas_mm": self.offset_sigmas_mm,
            "click_sigma_px": float(np.clip(self.sigma_px, *CLICK_SIGMAS_PX)),
        }

    @property
    def offsets_mm(self) -> dict[str, dict[str, float]]:
        """Return how far each marking lies beside its place, by its parts."""
        return self.task.problem.by_marking(self.minimum.state.offsets_mm)

    @property
    def offset_sigmas_mm(self) -> dict[str, dict[str, float]]:
        """Return σ of those, as learned or given."""
        return self.task.problem.by_marking(
            np.array([p.sigma for p in self.task.priors if p.name.startswith("line_")])
        )

    @property
    def offset_notes(self) -> dict[str, Any]:
        """Return a fit's notes of them. Lines' tilts follow their offsets and are left out."""
        found = self.offsets_mm
        return {
            "line_offsets_mm": {name: parts["across"] for name, parts in found.items()},
            "arc_offsets_mm": {
                name: (parts["centre_x"], parts["centre_y"])
                for name, parts in found.items()
                if "centre_x" in parts
            },
            "offset_names": self.task.problem.offset_names,
        }

    @property
    def log_evidence(self) -> float:
        """Return the logarithm of the clicks' probability under this lens, its unknowns integrated out, but a constant.

        By Laplace's approximation at the minimum (D. MacKay 1992). It compares lenses on the same clicks: more terms
        fit better, and are believed less where the clicks do not need them.
        """
        rows = residual_count(self.task.problem)
        outliers = int((~self.inliers).sum())
        log_sigma = float(np.log(self.sigma_px)) + 0.5 * float(np.log(self.correlation))
        _, by = self.task.prior_residuals(self.minimum.state)
        by = by[: len(self.task.priors), self.task.free]
        widths = np.linalg.norm(by, axis=1)
        _, log_information = np.linalg.slogdet(self.minimum.jacobian.T @ self.minimum.jacobian)
        return float(
            -(rows + outliers) * log_sigma
            - 0.5 * np.sum(self.minimum.residuals**2)
            - 0.5 * outliers * OUTLIER_SIGMAS**2
            + np.sum(np.log(widths[widths > 0]))
            - 0.5 * log_information
        )


def best_start(task: RayFitProblem, starts: list[RayCameraParameters]) -> RayCameraParameters:
    """Improve each start by a few robust steps, the most promising ones by more, and return the best."""
    rows = residual_count(task.problem)

    def improve(start: RayCameraParameters, places: Array, steps: int, damping: float) -> _Tried:
        task.problem.places = places
        found = minimum_near(task, start, 2 * CLICK_PX, rows, steps=steps, damping=damping)
        return found, task.problem.places

    tried = sorted(
        (improve(start, np.empty(0), FIRST_STEPS, FIRST_DAMPING) for start in starts), key=_cost
    )
    best, _ = min(
        (
            one if one[0].converged else improve(one[0].state, one[1], MORE_STEPS, one[0].damping)
            for one in tried[:PROMISING]
        ),
        key=_cost,
    )
    if not np.isfinite(best.cost):
        raise no_camera_error()
    return best.state


def _cost(tried: _Tried) -> float:
    return tried[0].cost


def no_camera_error() -> FitFailed:
    return FitFailed(
        say("refused.no-camera", "No camera position matches the points."),
        CHECK_LINES,
        reason="no-camera",
    )


def solve(
    task: RayFitProblem, start: State, settings: Mapping[str, Any], *, noise_known: bool = False
) -> RayFitResult[State]:
    """Fit robustly from the start, then plainly without the outliers; then learn what the noise and the lines are.

    noise_known: by an earlier fit, and its outliers are not among the clicks.
    """
    sigma = settings["click_sigma_px"] or CLICK_PX
    robust = settings["robust"]
    rows = residual_count(task.problem)
    task.problem.places = np.empty(0)
    best = minimum_near(
        task,
        start,
        sigma,
        rows if robust else 0,
        tolerance=SEARCHING if robust else NEAR,
        damping=NEARBY if noise_known else FIRST_DAMPING,
    )
    if not np.isfinite(best.cost):
        raise no_camera_error()
    inliers = np.ones(len(task.problem.pixels), bool)
    spread, correlation = sigma, 1.0
    for number in range(0 if noise_known else 4 if robust else 1):
        seen = task.problem.residuals(best.state)
        pixels = _click_distances(task.problem, seen[0])
        # at first without the furthest, which would hide other outliers
        weighted = np.abs(pixels) * task.click_weights(best.state, sigma)
        trusted = inliers if number else weighted <= CORE_MEDIANS * np.median(weighted)
        spread = settings["click_sigma_px"] or _spread(weighted[trusted], task.unknowns)
        outliers = weighted > max(OUTLIER_SIGMAS * spread, MIN_OUTLIER_PX) if robust else ~inliers
        if outliers.sum() > MAX_OUTLIER_SHARE * outliers.size:
            # so many: the model is wrong, or the lines are mixed up
            outliers = np.zeros_like(outliers)
        if np.array_equal(~outliers, inliers) and number > 0:
            break
        inliers = ~outliers
        best = minimum_near(
            replace(task, problem=task.problem.only(inliers)),
            best.state,
            spread,
            0,
            tolerance=NEAR,
            damping=NEARBY,
            seen=_of_clicks(task.problem, seen, inliers),
        )
    chosen = replace(task, problem=task.problem.only(inliers))
    for number in range(0 if noise_known else NOISE_ROUNDS):
        if not np.isfinite(best.cost):
            raise no_camera_error()
        seen = task.problem.residuals(best.state)
        pixels = _click_distances(task.problem, seen[0])
        weighted = pixels * task.click_weights(best.state, spread)
        spread = settings["click_sigma_px"] or _spread(
            weighted[inliers], _determined(best, len(chosen.known_names))
        )
        if task.usual_line_mm is not None:
            columns = [
                k
                for k, name in enumerate(np.array(task.names)[task.free])
                if name.startswith("line_")
            ]
            before = np.array([p.sigma for p in chosen.priors if p.name.startswith("line_")])
            chosen = chosen.with_line_sigmas(
                line_sigmas_mm(
                    best.jacobian,
                    columns,
                    best.state.offsets_mm,
                    before,
                    task.usual_line_mm,
                    np.array([part == "tilt" for _, part in task.problem.offset_names]),
                )
            )
        correlation = correlation_factor(
            pixels[: task.problem.curves][inliers[: task.problem.curves]],
            task.problem.owners[: task.problem.curves][inliers[: task.problem.curves]],
        )
        best = minimum_near(
            chosen,
            best.state,
            spread * np.sqrt(correlation),
            0,
            tolerance=NEAR if number < NOISE_ROUNDS - 1 else THERE,
            damping=NEARBY,
            seen=_of_clicks(task.problem, seen, inliers),
        )
    if not np.isfinite(best.cost):
        raise no_camera_error()
    freedom = residual_count(chosen.problem) + len(chosen.known_names) - int(task.free.sum())
    terms = tuple(
        n for n, f in zip(task.names, task.free, strict=True) if f and n in best.state.lens_names
    )
    # a copy, whose places along the curves no other search moves
    return RayFitResult(
        chosen,
        terms,
        best,
        inliers,
        replace(task.problem),
        float(spread),
        freedom,
        float(correlation),
    )


def _determined(found: Minimum[State], priors: int) -> float:
    """Return how many parameters the clicks determine, and not the priors: the trace of the hat matrix's first rows."""
    clicks = found.jacobian[: len(found.jacobian) - priors]
    return float(np.einsum("ij,jk,ik->", clicks, covariance_of(found.jacobian), clicks))


def correlation_factor(pixels: Array, owners: Indices) -> float:
    """Return what neighbouring residuals along a line, alike, take from the number of independent ones: ≥ 1.

    pixels (n,) signed; owners (n, 2) observation and point, in order along it. The variance of a mean of a first-order
    autoregressive series is (1 + ρ) / (1 - ρ) times that of as many independent values (M. Bartlett 1935).
    """
    order = np.lexsort((owners[:, 1], owners[:, 0]))
    r, line = pixels[order], owners[order, 0]
    neighbours = line[1:] == line[:-1]
    if neighbours.sum() < MIN_NEIGHBOURS:
        return 1.0
    power = float(np.mean(r**2))
    rho = float(np.mean(r[1:][neighbours] * r[:-1][neighbours])) / power if power else 0.0
    rho = min(max(rho - 1 / np.sqrt(neighbours.sum()), 0.0), MAX_CORRELATION)
    return (1 + rho) / (1 - rho)


def covariance_of(jacobian: Array) -> Array:
    """Return (JᵀJ)⁻¹ of whitened residuals, by way of unit columns; FitFailed where they are not finite."""
    if not np.isfinite(jacobian).all():
        raise no_camera_error()
    scale = np.linalg.norm(jacobian, axis=0)
    scale[scale == 0] = 1.0
    information = (jacobian / scale).T @ (jacobian / scale)
    return np.linalg.pinv(information, rcond=1e-14, hermitian=True) / np.outer(scale, scale)


def minimum_near(
    task: RayFitProblem,
    start: State,
    sigma: float,
    robust_rows: int,
    steps: int = MAX_STEPS,
    tolerance: float = SEARCHING,
    damping: float = FIRST_DAMPING,
    seen: tuple[Array, Array] | None = None,
) -> Minimum[State]:
    """Return the minimum near a start. seen: the clicks' residuals there and their Jacobian, where they are known."""
    weights = task.click_weights(start, sigma)
    curves = task.problem.curves
    per_row = np.concatenate([weights[:curves], np.repeat(weights[curves:], 2)]) / sigma

    def evaluate(state: State, seen: tuple[Array, Array] | None = None) -> tuple[Array, Array]:
        r, j = seen or task.problem.residuals(state)
        known, by = task.prior_residuals(state)
        return np.concatenate([r * per_row, known]), np.concatenate([j * per_row[:, None], by])[
            :, task.free
        ]

    return minimise(
        start,
        evaluate,
        lambda state, delta: state.retract(delta, task.free),
        robust_rows=robust_rows,
        max_steps=steps,
        tolerance=tolerance,
        damping=damping,
        first=evaluate(start, seen),
    )


def residual_count(problem: ClickResiduals) -> int:
    return problem.curves + 2 * len(problem.marks)


def _of_clicks(
    problem: ClickResiduals, seen: tuple[Array, Array], keep: Mask
) -> tuple[Array, Array]:
    """Return some clicks' residuals and Jacobian; keep (n,)."""
    rows = np.concatenate([keep[: problem.curves], np.repeat(keep[problem.curves :], 2)])
    return seen[0][rows], seen[1][rows]


def _click_distances(problem: ClickResiduals, r: Array) -> Array:
    """Return per click the signed distance from its curve, or the distance from its mark, px. r: all residuals."""
    spots = r[problem.curves :].reshape(-1, 2)
    return np.concatenate([r[: problem.curves], np.linalg.norm(spots, axis=1) / np.sqrt(2)])


def _spread(pixels: Array, parameters: float) -> float:
    """Return σ of a click from residuals and a prior."""
    freedom = max(len(pixels) - parameters, 1)
    variance = float(np.sum(pixels**2))
    return float(np.sqrt((variance + PRIOR_CLICKS * CLICK_PX**2) / (freedom + PRIOR_CLICKS)))
