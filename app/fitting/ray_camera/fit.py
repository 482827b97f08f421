"""Fitting a camera with rays: linear start, robust refinement, strays named, then plain least squares on the rest."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from app.core.errors import BadInput, FitFailed
from app.core.field import Field, Region
from app.core.geometry import ImageSize
from app.core.records import Fit, Observations, Warning
from app.fitting.ray_camera.distortion_prior import CENTRE, BentLens, bend_prior, bent_lens, with_bend
from app.fitting.ray_camera.initial import start_states
from app.fitting.ray_camera.lens_prior import held_lens, lens_prior, with_lens
from app.fitting.ray_camera.parameters import RayState
from app.fitting.ray_camera.problem import Prior, RayProblem, gather, incidences
from app.fitting.ray_camera.search import (
    Found,
    Task,
    best_start,
    cleared,
    first_bend,
    rows_of,
    significantly_better,
    solve,
)
from app.models import Progress, parameters_json, read_options
from app.models.corrected_rectangle import rectangles
from app.models.pinhole_lens import PinholeLens
from app.models.ray_camera import RayCamera

# So wide that they decide nothing that the clicks tell, and narrow enough that no unknown runs off to infinity.
WIDE = {"log_focal": 1.0, "centre": 0.05, "k": 1.0, "a": 1.0, "p1": 0.05, "p2": 0.05}
# A lens that bends by k1 bends by some k2 too, whether or not the clicks show it: left out, it costs more than it
# saves.
COMPANION = {("k1", "k2"): ("k1", "k2")}
SHARE = 0.5  # σ of the companion in parts of its leader: real lenses have k2 of 0.1 to 1.5 k1², so less than that
LEAST_LEANING = 1e-4


def fit_rays(model_class: type[RayCamera], observations: Observations, field: Field, region: Region,
             image_size: ImageSize, options: Mapping[str, Any] | None, progress: Progress) -> Fit:
    """Fit a ray camera. Options: see the model's OPTIONS.

    Also "start" (parameters), which begins near a known answer, and "leanings" (σ by term), which an earlier fit chose.
    """
    given = dict(options or {})
    start, leanings = given.pop("start", None), _read_leanings(model_class, given.pop("leanings", None))
    settings = read_options(model_class.OPTIONS, given)
    check_inside_picture(observations, image_size)
    problem = gather(observations, field, region, with_offsets=settings["line_sigma_mm"] > 0)
    bent = bent_lens(model_class.NAME, settings, image_size)
    held = None if bent else held_lens(model_class, settings, image_size)
    width_px, height_px, n_x, n_y = rectangles(settings, region, image_size)
    if start is None:
        height = settings["height_mm"]["value"] if settings["height_mm"] else None
        starts = start_states(model_class, problem, incidences(observations, field, region), image_size, height)
    else:
        starts = [RayState.of(model_class.from_parameters(start), len(problem.line_names))]
    if held is not None:
        starts = [with_lens(state, held) for state in starts]
    if bent is not None:
        starts = [with_bend(state, bent) for state in starts]
    ladder = _ladder(model_class, settings, held, bent)
    best, refusal, tried, leant = None, None, {}, {}
    first = _task(model_class, starts[0], problem, first_bend(ladder), settings, image_size, held, bent)
    begin = best_start(first, starts) if start is None else starts[0]  # a known answer is only spoilt by a rough look
    for rung, terms in enumerate(ladder):
        progress(0.1 + 0.8 * rung / len(ladder), f"Fitting {' '.join(terms) or 'without distortion'}")
        lean = leanings or _leanings(best, terms)
        task = _task(model_class, starts[0], problem, terms, settings, image_size, held, bent, lean)
        near = begin if best is None or not best.terms else best.minimum.state
        try:
            found = _first_solved(task, [near, begin, *starts], terms, settings)
        except FitFailed as refused:  # a lens too simple or too free for these clicks; the others may do
            refusal = refused
            continue
        tried[" ".join(terms)] = found
        if best is None or (lean and not leanings) or significantly_better(best, found):
            best, leant = found, lean
    if best is None:
        raise refusal
    state = best.minimum.state
    model = model_class(**state.parameters(), width_px=width_px, height_px=height_px, n_rectangles_x=n_x,
                        n_rectangles_y=n_y, region=region, image_size=image_size)
    if not model.plausible():
        raise FitFailed(f"The clicks lead to a camera that cannot be: {model.position_mm[2] / 1000:.3g} m above the "
                        f"carpet with a focal length of {model.focal_px:.3g} px.",
                        "Check which line each click belongs to, and the region; then click more points.",
                        reason="implausible-camera")
    inliers = tuple(np.ones(len(o.points), bool) for o in observations)
    for (i, k), fine in zip(problem.owners, best.inliers, strict=True):
        inliers[i][k] = fine
    notes = {
        "terms": {"chosen": best.terms, "tried": {t: {"rms_px": f.rms_px, "parameters": int(f.task.free.sum())}
                                                 for t, f in tried.items()}},
        "click_sigma_px": best.sigma_px, "degrees_of_freedom": best.freedom, "parameters": int(best.task.free.sum()),
        "line_offsets_mm": dict(zip(problem.line_names, map(float, state.offsets_mm), strict=True)),
        "choices": {"terms": list(best.terms), "start": parameters_json(model), "click_sigma_px": best.sigma_px,
                    "leanings": leant}
        if "terms" in {o.name for o in model_class.OPTIONS} else
        {"start": parameters_json(model), "click_sigma_px": best.sigma_px},
    }
    found = tuple(name for name, free in zip(best.task.names, best.task.free, strict=True) if free)
    return Fit(model, inliers, (True,) * len(observations), tuple(name_strays(observations, problem, best)), notes,
               covariance=best.covariance, parameter_names=found)


def check_inside_picture(observations: Observations, image_size: ImageSize) -> None:
    """Refuse, by name, a click that no picture of that size can have."""
    for o in observations:
        outside = np.flatnonzero(((o.points < -1) | (o.points > np.array(tuple(image_size)))).any(axis=1))
        if outside.size:
            x, y = o.points[outside[0]]
            raise FitFailed(f"Point {outside[0] + 1} of {o.label}, ({x:.6g}, {y:.6g}), is outside the picture of "
                            f"{image_size.width} × {image_size.height} px.", "Remove it, or choose the picture it was "
                            "clicked on.", reason="outside-picture", feature=str(o.feature), index=int(outside[0]))


def _first_solved(task: Task, starts: Iterable[RayState], terms: tuple[str, ...], settings: Mapping[str, Any]) -> Found:
    """From the first start that leads anywhere: some see no click at all once their lens is another."""
    for start in starts:
        try:
            return solve(task, start if task.held else cleared(start, terms), settings)
        except FitFailed as refused:
            refusal = refused
    raise refusal


def _ladder(model_class: type[RayCamera], settings: Mapping[str, Any], held: PinholeLens | None,
            bent: BentLens | None) -> tuple[tuple[str, ...], ...]:
    if held is not None:
        return (model_class.LENS.TERMS,)
    chosen = settings.get("terms", "auto")
    ladder = model_class.term_ladder() if chosen == "auto" else (tuple(chosen),)
    if bent is None:
        return ladder
    known = bent.terms
    return tuple(dict.fromkeys(tuple(t for t in model_class.LENS.TERMS if t in rung or t in known) for rung in ladder))


def _leanings(best: Found | None, terms: tuple[str, ...]) -> dict[str, float]:
    """σ of a term that joins the one that was found, by name; none where all have to prove themselves."""
    if terms not in COMPANION or best is None or best.task.held or best.terms != COMPANION[terms][:1]:
        return {}
    leader, companion = COMPANION[terms]
    share = SHARE * abs(float(best.minimum.state.values()[leader]))
    return {companion: min(max(share, LEAST_LEANING), WIDE["k"])}


def _read_leanings(model_class: type[RayCamera], given: Any) -> dict[str, float]:
    if given is None:
        return {}
    fine = isinstance(given, Mapping) and set(given) <= set(model_class.LENS.TERMS) and all(
        isinstance(s, float) and LEAST_LEANING <= s <= WIDE["k"] for s in given.values())
    if not fine:
        raise BadInput("The option leanings is none that a fit has told.", "Leave it out.", reason="bad-option")
    return dict(given)


def _task(model_class: type[RayCamera], state: RayState, problem: RayProblem, terms: tuple[str, ...],
          settings: Mapping[str, Any], image_size: ImageSize, held: PinholeLens | None, bent: BentLens | None,
          leanings: Mapping[str, float] = MappingProxyType({})) -> Task:
    names = state.names
    free = np.ones(len(names), bool)
    for i, name in enumerate(names):
        if name in model_class.LENS.TERMS:
            free[i] = name in terms
    priors, joint = [], None
    if held is not None:
        joint = lens_prior(held, settings)
        free[:3 + len(model_class.LENS.TERMS)] = [joint is not None and n in joint.names for n in
                                                  names[:3 + len(model_class.LENS.TERMS)]]
    else:
        known = bent.names if bent is not None else ()
        joint = bend_prior(bent, settings) if bent is not None else None
        centre_sigma = settings["centre_sigma_px"]
        free[1:3] = [centre_sigma > 0 or name in known for name in CENTRE]
        if centre_sigma > 0:
            priors += [Prior(name, c, centre_sigma) for name, c in zip(CENTRE, image_size.centre, strict=True)
                       if name not in known]
        priors.append(Prior("log_focal", float(np.log(image_size.width)), WIDE["log_focal"], wide=True))
        priors += [Prior(t, 0.0, leanings.get(t, WIDE.get(t, WIDE["k"])), wide=True) for t in terms if t not in known]
    if settings["height_mm"]:
        priors.append(Prior("height", settings["height_mm"]["value"], settings["height_mm"]["sigma"]))
    if problem.line_names:
        priors += [Prior(f"line_{i}", 0.0, settings["line_sigma_mm"]) for i in range(len(problem.line_names))]
    rows = rows_of(problem)
    if rows + len(priors) + (len(joint.names) if joint else 0) - 1 < free.sum():
        raise FitFailed(f"There are {rows} measurements for {int(free.sum())} unknowns.",
                        f"Click at least {int(free.sum()) - rows} more points, or choose fewer lens terms.",
                        reason="too-few-points")
    return Task(problem, tuple(priors), free, names, held is not None, joint)


def name_strays(observations: Observations, problem: RayProblem, found: Found) -> list[Warning]:
    """A warning for each click that was left out."""
    named = []
    for (i, k), fine, px in zip(problem.owners, found.inliers, found.pixels, strict=True):
        if not fine:
            named.append(Warning("stray-click", f"Point {k + 1} of {observations[i].label} lies {abs(px):.1f} px from "
                                 "where the camera sees it; it was left out of the fit.",
                                 "Drag it onto the line, or remove it.", str(observations[i].feature), int(k)))
    return named
