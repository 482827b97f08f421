"""What one fit of a ray camera estimates: the sets of terms to try, the priors, and which parameters are free."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from app.core.errors import BadInput, FitFailed
from app.core.geometry import ImageSize
from app.fitting.ray_camera.distortion_prior import CENTRE, BentLens, bend_prior
from app.fitting.ray_camera.lens_prior import lens_prior
from app.fitting.ray_camera.parameters import RayState
from app.fitting.ray_camera.problem import Prior, RayProblem
from app.fitting.ray_camera.search import Found, Task, rows_of
from app.models.lenses import Lens
from app.models.pinhole_lens import PinholeLens

# So wide that they decide nothing that the clicks tell, and narrow enough that no unknown runs off to infinity.
WIDE = {"log_focal": 1.0, "centre": 0.05, "k": 1.0, "a": 1.0, "p1": 0.05, "p2": 0.05}
# A lens that bends by k1 bends by some k2 too, whether or not the clicks show it: left out, it costs more than it
# saves.
COMPANION = {("k1", "k2"): ("k1", "k2")}
SHARE = 0.5  # σ of the companion in parts of its leader: real lenses have k2 of 0.1 to 1.5 k1², so less than that
LEAST_LEANING = 1e-4


def ladder_of(lens: type[Lens], term_sets: tuple[tuple[str, ...], ...], settings: Mapping[str, Any],
              held: PinholeLens | None, bent: BentLens | None) -> tuple[tuple[str, ...], ...]:
    """Return the sets of terms to try, simplest first."""
    if held is not None:
        return (lens.TERMS,)
    chosen = settings.get("terms", "auto")
    ladder = term_sets if chosen == "auto" else (tuple(chosen),)
    if bent is None:
        return ladder
    known = bent.terms
    return tuple(dict.fromkeys(tuple(t for t in lens.TERMS if t in rung or t in known) for rung in ladder))


def leanings_for(best: Found | None, terms: tuple[str, ...]) -> dict[str, float]:
    """σ of a term that joins the one that was found, by name; none where all have to prove themselves."""
    if terms not in COMPANION or best is None or best.task.held or best.terms != COMPANION[terms][:1]:
        return {}
    leader, companion = COMPANION[terms]
    share = SHARE * abs(float(best.minimum.state.values()[leader]))
    return {companion: min(max(share, LEAST_LEANING), WIDE["k"])}


def read_leanings(lens: type[Lens], given: Any) -> dict[str, float]:
    if given is None:
        return {}
    fine = isinstance(given, Mapping) and set(given) <= set(lens.TERMS) and all(
        isinstance(s, float) and LEAST_LEANING <= s <= WIDE["k"] for s in given.values())
    if not fine:
        raise BadInput("The option leanings is none that a fit has told.", "Leave it out.", reason="bad-option")
    return dict(given)


def task_of(state: RayState, problem: RayProblem, terms: tuple[str, ...], settings: Mapping[str, Any],
            image_size: ImageSize, held: PinholeLens | None, bent: BentLens | None,
            leanings: Mapping[str, float] = MappingProxyType({})) -> Task:
    names, lens_terms = state.names, state.lens.TERMS
    free = np.ones(len(names), bool)
    for i, name in enumerate(names):
        if name in lens_terms:
            free[i] = name in terms
    priors, joint = [], None
    if held is not None:
        joint = lens_prior(held, settings)
        free[:3 + len(lens_terms)] = [joint is not None and n in joint.names for n in
                                                  names[:3 + len(lens_terms)]]
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
