"""What one fit of a ray camera estimates: the sets of terms to try, the priors, and which parameters are free."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from app.core.errors import BadInput, FitFailed
from app.core.geometry import ImageSize
from app.fitting.ray_camera.distortion_prior import CENTRE, DistortionEstimate, distortion_prior
from app.fitting.ray_camera.lens_prior import lens_prior
from app.fitting.ray_camera.parameters import RayCameraParameters
from app.fitting.ray_camera.problem import ClickResiduals, ScalarPrior
from app.fitting.ray_camera.search import RayFitProblem, RayFitResult, residual_count
from app.models.intrinsics import Intrinsics
from app.models.lenses import Lens

# So wide that the clicks decide, and narrow enough that no unknown diverges.
WIDE_SIGMA = {"log_focal": 1.0, "centre": 0.05, "k": 1.0, "a": 1.0, "p1": 0.05, "p2": 0.05}
# A lens that bends by k1 bends by some k2 too, whether or not the clicks show it: left out, it costs more than it
# saves.
COMPANION = {("k1", "k2"): ("k1", "k2")}
COMPANION_SHARE = 0.5  # σ of the companion in parts of its leader; real lenses have k2 of 0.1 to 1.5 k1²
MIN_SHRINKAGE_SIGMA = 1e-4


def term_sets_for(lens: type[Lens], term_sets: tuple[tuple[str, ...], ...], settings: Mapping[str, Any],
              intrinsics: Intrinsics | None, distortion: DistortionEstimate | None) -> tuple[tuple[str, ...], ...]:
    """Return the sets of terms to try, simplest first."""
    if intrinsics is not None:
        return (lens.TERMS,)
    chosen = settings.get("terms", "auto")
    term_sets = term_sets if chosen == "auto" else (tuple(chosen),)
    if distortion is None:
        return term_sets
    known = distortion.terms
    return tuple(dict.fromkeys(tuple(t for t in lens.TERMS if t in rung or t in known) for rung in term_sets))


def shrinkage_for(best: RayFitResult | None, terms: tuple[str, ...]) -> dict[str, float]:
    """Return σ of the companion term that joins the one that was found, by name; empty where there is none."""
    if terms not in COMPANION or best is None or best.task.lens_given or best.terms != COMPANION[terms][:1]:
        return {}
    leader, companion = COMPANION[terms]
    share = COMPANION_SHARE * abs(float(best.minimum.state.values()[leader]))
    return {companion: min(max(share, MIN_SHRINKAGE_SIGMA), WIDE_SIGMA["k"])}


def read_shrinkage(lens: type[Lens], given: Any) -> dict[str, float]:
    if given is None:
        return {}
    fine = isinstance(given, Mapping) and set(given) <= set(lens.TERMS) and all(
        isinstance(s, float) and MIN_SHRINKAGE_SIGMA <= s <= WIDE_SIGMA["k"] for s in given.values())
    if not fine:
        raise BadInput("The option leanings is none that a fit has told.", "Leave it out.", reason="bad-option")
    return dict(given)


def fit_problem(state: RayCameraParameters, problem: ClickResiduals, terms: tuple[str, ...],
                settings: Mapping[str, Any], image_size: ImageSize, intrinsics: Intrinsics | None,
                distortion: DistortionEstimate | None,
                shrinkage_sigmas: Mapping[str, float] = MappingProxyType({})) -> RayFitProblem:
    names, lens_terms = state.names, state.lens.TERMS
    free = np.array([name not in lens_terms or name in terms for name in names])
    priors = []
    if intrinsics is not None:
        gaussian = lens_prior(intrinsics, settings)
        of_lens = slice(3 + len(lens_terms))
        free[of_lens] = [gaussian is not None and name in gaussian.names for name in names[of_lens]]
    else:
        known = distortion.names if distortion is not None else ()
        gaussian = distortion_prior(distortion, settings) if distortion is not None else None
        centre_sigma = settings["centre_sigma_px"]
        free[1:3] = [centre_sigma > 0 or name in known for name in CENTRE]
        if centre_sigma > 0:
            priors += [ScalarPrior(name, c, centre_sigma) for name, c in zip(CENTRE, image_size.centre, strict=True)
                       if name not in known]
        priors.append(ScalarPrior("log_focal", float(np.log(image_size.width)), WIDE_SIGMA["log_focal"], wide=True))
        priors += [ScalarPrior(t, 0.0, shrinkage_sigmas.get(t, WIDE_SIGMA.get(t, WIDE_SIGMA["k"])), wide=True)
                   for t in terms if t not in known]
    if settings["height_mm"]:
        priors.append(ScalarPrior("height", settings["height_mm"]["value"], settings["height_mm"]["sigma"]))
    if problem.line_names:
        priors += [ScalarPrior(f"line_{i}", 0.0, settings["line_sigma_mm"]) for i in range(len(problem.line_names))]
    rows = residual_count(problem)
    if rows + len(priors) + (len(gaussian.names) if gaussian else 0) - 1 < free.sum():
        raise FitFailed(f"There are {rows} measurements for {int(free.sum())} unknowns.",
                        f"Click at least {int(free.sum()) - rows} more points, or choose fewer lens terms.",
                        reason="too-few-points")
    return RayFitProblem(problem, tuple(priors), free, names, intrinsics is not None, gaussian)
