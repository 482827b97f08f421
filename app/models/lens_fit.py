"""Fitting a camera with rays: linear start, robust refinement, strays named, then plain least squares on the rest."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from app.errors import BadInput, FitFailed
from app.field import Field, Region
from app.geometry import ImageSize
from app.models import Progress, model_from_json, parameters_json, read_options
from app.models.lens import Array
from app.models.ray_problem import Prior, RayProblem, gather, incidences
from app.models.ray_start import start_states
from app.models.ray_state import RayState
from app.models.rays import RayCamera
from app.models.rectangles import rectangles
from app.models.solve import Minimum, minimise
from app.records import Fit, Observations, Warning

CLICK_PX = 0.5  # σ of a click before the clicks themselves tell
CLICK_PRIOR = 4  # clicks that this guess weighs
STRAY_SIGMAS = 4.5
STRAY_PX = 1.5  # nothing nearer is called a stray
MAX_STRAYS = 0.3  # of all clicks
# So wide that they decide nothing that the clicks tell, and narrow enough that no unknown runs off to infinity.
WIDE = {"log_focal": 1.0, "centre": 0.05, "k": 1.0, "a": 1.0, "p1": 0.05, "p2": 0.05}


@dataclass(frozen=True, eq=False)
class _Task:
    """Everything that stays the same during one fit."""

    problem: RayProblem
    priors: tuple[Prior, ...]
    free: Array
    names: tuple[str, ...]


def fit_rays(model_class: type[RayCamera], observations: Observations, field: Field, region: Region,
             image_size: ImageSize, options: Mapping[str, Any] | None, progress: Progress) -> Fit:
    """Fit a ray camera. Options: see the model's OPTIONS; "start" (parameters) begins near a known answer."""
    given = dict(options or {})
    start = given.pop("start", None)
    settings = read_options(model_class.OPTIONS, given)
    _check(observations, image_size)
    problem = gather(observations, field, region, with_offsets=settings["line_sigma_mm"] > 0)
    held = _held_lens(model_class, settings)
    width_px, height_px, n_x, n_y = rectangles(settings, region, image_size)
    if start is None:
        height = settings["height_mm"]["value"] if settings["height_mm"] else None
        starts = start_states(model_class, problem, incidences(observations, field, region), image_size, height)
    else:
        starts = [RayState.of(model_class.from_parameters(start), len(problem.line_names))]
    if held is not None:
        starts = [_with_lens(state, held) for state in starts]
    ladder = _ladder(model_class, settings, held)
    best, tried = None, {}
    for rung, terms in enumerate(ladder):
        progress(0.1 + 0.8 * rung / len(ladder), f"Fitting {' '.join(terms) or 'without distortion'}")
        task = _task(model_class, starts[0], problem, terms, settings, image_size, held)
        found = _solve(task, [_cleared(s, terms) for s in starts] if rung == 0 else
                       [_cleared(s, terms) for s in (best.minimum.state, *starts)], settings, image_size)
        tried[" ".join(terms)] = found
        if best is None or _significantly_better(best, found):
            best = found
    state = best.minimum.state
    model = model_class(**state.parameters(), width_px=width_px, height_px=height_px, n_rectangles_x=n_x,
                        n_rectangles_y=n_y, region=region, image_size=image_size)
    inliers = tuple(np.ones(len(o.points), bool) for o in observations)
    for (i, k), fine in zip(problem.owners, best.inliers, strict=True):
        inliers[i][k] = fine
    notes = {
        "terms": {"chosen": best.terms, "tried": {t: {"rms_px": f.rms_px, "parameters": int(f.task.free.sum())}
                                                 for t, f in tried.items()}},
        "click_sigma_px": best.sigma_px, "degrees_of_freedom": best.freedom, "parameters": int(best.task.free.sum()),
        "line_offsets_mm": dict(zip(problem.line_names, map(float, state.offsets_mm), strict=True)),
        "choices": {"terms": list(best.terms), "start": parameters_json(model), "click_sigma_px": best.sigma_px}
        if "terms" in {o.name for o in model_class.OPTIONS} else
        {"start": parameters_json(model), "click_sigma_px": best.sigma_px},
    }
    return Fit(model, inliers, (True,) * len(observations), tuple(_strays(observations, problem, best)), notes,
               covariance=best.covariance, parameter_names=tuple(np.array(best.task.names)[best.task.free]))


@dataclass(frozen=True, eq=False)
class _Found:
    task: _Task
    terms: tuple[str, ...]
    minimum: Minimum[RayState]
    inliers: Array
    pixels: Array  # residuals, px: signed for curves, distances for spots
    sigma_px: float
    freedom: int
    cost: float  # of all clicks with a common ceiling, for comparing rungs

    @property
    def rms_px(self) -> float:
        return float(np.sqrt(np.mean(self.pixels[self.inliers] ** 2)))

    @property
    def covariance(self) -> Array:
        j = self.minimum.jacobian
        scale = np.linalg.norm(j, axis=0)
        scale[scale == 0] = 1.0
        information = (j / scale).T @ (j / scale)
        return np.linalg.pinv(information, rcond=1e-14, hermitian=True) / np.outer(scale, scale)


def _solve(task: _Task, starts: list[RayState], settings: Mapping[str, Any], image_size: ImageSize) -> _Found:
    """Robustly from each start, then plainly from the best without the strays."""
    sigma = settings["click_sigma_px"] or CLICK_PX
    robust = settings["robust"]
    rows = _rows(task.problem)
    first = []
    for start in starts:
        task.problem.places = np.empty(0)
        first.append(_minimise(task, start, sigma * 2, rows if robust else 0, steps=25))
    best = min(first, key=lambda m: m.cost)
    if not np.isfinite(best.cost):
        raise FitFailed("No camera was found that sees the clicked lines where they were clicked.",
                        "Check which line each click belongs to, and the region.", reason="no-camera")
    task.problem.places = np.empty(0)
    best = _minimise(task, best.state, sigma, rows if robust else 0)
    inliers = np.ones(len(task.problem.pixels), bool)
    for _ in range(4 if robust else 1):
        pixels = _distances(task.problem, best.state)
        spread = settings["click_sigma_px"] or _spread(pixels[inliers], int(task.free.sum()))
        strays = np.abs(pixels) > max(STRAY_SIGMAS * spread, STRAY_PX) if robust else ~inliers
        if strays.sum() > MAX_STRAYS * strays.size:
            strays = np.zeros_like(strays)  # that many are no strays: the model is wrong, or the lines are mixed up
        if np.array_equal(~strays, inliers) and _ > 0:
            break
        inliers = ~strays
        kept = _Task(task.problem.only(inliers), task.priors, task.free, task.names)
        best = _minimise(kept, best.state, spread, 0)
    pixels = _distances(task.problem, best.state)
    spread = settings["click_sigma_px"] or _spread(pixels[inliers], int(task.free.sum()))
    kept = _Task(task.problem.only(inliers), task.priors, task.free, task.names)
    best = _minimise(kept, best.state, spread, 0)
    pixels = _distances(task.problem, best.state)
    freedom = _rows(kept.problem) + len(task.priors) - int(task.free.sum())
    terms = tuple(n for n, f in zip(task.names, task.free, strict=True) if f and n in best.state.lens.TERMS)
    return _Found(task, terms, best, inliers, pixels, float(spread), freedom,
                  float(np.sum(np.minimum(pixels**2, STRAY_PX**2 * 4))))


def _minimise(task: _Task, start: RayState, sigma: float, robust_rows: int, steps: int = 60) -> Minimum[RayState]:
    names = list(task.names)

    def evaluate(state: RayState) -> tuple[Array, Array]:
        r, j = task.problem.residuals(state)
        values = {"log_focal": state.log_focal, "centre_x": state.centre_px[0], "centre_y": state.centre_px[1],
                  "height": state.position_mm[2], **dict(zip(state.lens.TERMS, state.terms, strict=True)),
                  **{f"line_{i}": o for i, o in enumerate(state.offsets_mm)}}
        known = np.array([(values[p.name] - p.value) / p.sigma for p in task.priors])
        by = np.zeros((len(task.priors), len(names)))
        for row, p in enumerate(task.priors):
            by[row, names.index(p.name)] = 1 / p.sigma
        return np.concatenate([r / sigma, known]), np.concatenate([j / sigma, by])[:, task.free]

    return minimise(start, evaluate, lambda state, delta: state.moved(delta, task.free),
                    robust_rows=robust_rows, max_steps=steps)


def _rows(problem: RayProblem) -> int:
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


def _significantly_better(simple: _Found, rich: _Found) -> bool:
    """F test at about 1 %: does the richer lens explain more than its extra terms would of noise?"""
    extra = int(rich.task.free.sum() - simple.task.free.sum())
    freedom = len(rich.pixels) - int(rich.task.free.sum())
    if extra <= 0 or freedom < 3:
        return False
    gain = (simple.cost - rich.cost) / extra
    return gain > (4 + 8 / extra + 12 / freedom) * max(rich.cost / freedom, 1e-12)


def _check(observations: Observations, image_size: ImageSize) -> None:
    for o in observations:
        outside = np.flatnonzero(((o.points < -1) | (o.points > np.array(tuple(image_size)))).any(axis=1))
        if outside.size:
            x, y = o.points[outside[0]]
            raise FitFailed(f"Point {outside[0] + 1} of {o.label}, ({x:.6g}, {y:.6g}), is outside the picture of "
                            f"{image_size.width} × {image_size.height} px.", "Remove it, or choose the picture it was "
                            "clicked on.", reason="outside-picture", feature=str(o.feature), index=int(outside[0]))


def _held_lens(model_class: type[RayCamera], settings: Mapping[str, Any]) -> RayCamera | None:
    """The lens that an option hands over: {"name", "parameters"} of the same kind of model."""
    given = settings.get("lens")
    if given is None:
        return None
    model = model_from_json(given["name"], given["parameters"])
    if type(model) is not model_class:
        raise BadInput(f"The held lens is {model.NAME}, the model to fit is {model_class.NAME}.",
                       f"Fit {model.NAME}, or hold another lens.", reason="bad-option")
    return model


def _with_lens(state: RayState, held: RayCamera) -> RayState:
    from dataclasses import replace
    return replace(state, log_focal=float(np.log(held.focal_px)), aspect=held.aspect,
                   centre_px=np.array(held.centre_px), terms=np.array(held.lens_terms))


def _ladder(model_class: type[RayCamera], settings: Mapping[str, Any], held: RayCamera | None,
            ) -> tuple[tuple[str, ...], ...]:
    if held is not None:
        return (model_class.LENS.TERMS,)
    chosen = settings.get("terms", "auto")
    return model_class.term_ladder() if chosen == "auto" else (tuple(chosen),)


def _cleared(state: RayState, terms: tuple[str, ...]) -> RayState:
    from dataclasses import replace
    keep = np.array([name in terms for name in state.lens.TERMS], bool)
    return replace(state, terms=np.where(keep, state.terms, 0.0))


def _task(model_class: type[RayCamera], state: RayState, problem: RayProblem, terms: tuple[str, ...],
          settings: Mapping[str, Any], image_size: ImageSize, held: RayCamera | None) -> _Task:
    names = state.names
    free = np.ones(len(names), bool)
    for i, name in enumerate(names):
        if name in model_class.LENS.TERMS:
            free[i] = name in terms
    priors = []
    if held is not None:
        free[:3 + len(model_class.LENS.TERMS)] = False
    else:
        centre_sigma = settings["centre_sigma_px"]
        free[1:3] = centre_sigma > 0
        if centre_sigma > 0:
            priors += [Prior(f"centre_{a}", c, centre_sigma) for a, c in zip("xy", image_size.centre, strict=True)]
        priors.append(Prior("log_focal", float(np.log(image_size.width)), WIDE["log_focal"]))
        priors += [Prior(t, 0.0, WIDE.get(t, WIDE["k"])) for t in terms]
    if settings["height_mm"]:
        priors.append(Prior("height", settings["height_mm"]["value"], settings["height_mm"]["sigma"]))
    if problem.line_names:
        priors += [Prior(f"line_{i}", 0.0, settings["line_sigma_mm"]) for i in range(len(problem.line_names))]
    rows = _rows(problem)
    if rows + len(priors) - 1 < free.sum():
        raise FitFailed(f"There are {rows} measurements for {int(free.sum())} unknowns.",
                        f"Click at least {int(free.sum()) - rows} more points, or choose fewer lens terms.",
                        reason="too-few-points")
    return _Task(problem, tuple(priors), free, names)


def _strays(observations: Observations, problem: RayProblem, found: _Found) -> list[Warning]:
    named = []
    for (i, k), fine, px in zip(problem.owners, found.inliers, found.pixels, strict=True):
        if not fine:
            named.append(Warning("stray-click", f"Point {k + 1} of {observations[i].label} lies {abs(px):.1f} px from "
                                 "where the camera sees it; it was left out of the fit.",
                                 "Drag it onto the line, or remove it.", str(observations[i].feature), int(k)))
    return named
