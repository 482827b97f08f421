"""What one fit of a ray camera estimates: its terms, the priors, and which parameters are free."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from touchline.core.errors import FitFailed
from touchline.core.field import Field
from touchline.core.geometry import ImageSize
from touchline.core.statements import say
from touchline.fitting.ray_camera.camera_prior import camera_priors, centre_sigma_px
from touchline.fitting.ray_camera.distortion_prior import CENTRE, DistortionEstimate, distortion_prior
from touchline.fitting.ray_camera.lens_prior import lens_prior
from touchline.fitting.ray_camera.parameters import RayCameraParameters
from touchline.fitting.ray_camera.problem import ClickResiduals, Offsets, ScalarPrior
from touchline.fitting.ray_camera.search import RayFitProblem, residual_count
from touchline.models.intrinsics import Intrinsics


def fit_problem(state: RayCameraParameters, problem: ClickResiduals, terms: tuple[str, ...],
                settings: Mapping[str, Any], field: Field, image_size: ImageSize, intrinsics: Intrinsics | None,
                distortion: DistortionEstimate | None,
                learned_lines: Offsets | None = None) -> RayFitProblem:
    """Return the problem of a fit with those lens terms; FitFailed where there are too few clicks for it."""
    names, lens_terms = state.names, state.lens.TERMS
    free = np.array([name in terms if name in lens_terms else True for name in names])
    pinhole = names.index("turn_x")  # the lens and all before it
    if intrinsics is not None:
        gaussian = lens_prior(intrinsics, settings)
        free[:pinhole] = [gaussian is not None and n in gaussian.names for n in names[:pinhole]]
        known = names[:pinhole]
        if gaussian is not None and "lens" not in settings["lens"]:
            known = (*known, "log_height")  # the other calibration has counted it already
    else:
        known = distortion.names if distortion is not None else ()
        gaussian = distortion_prior(distortion, settings) if distortion is not None else None
        free[names.index("aspect")] = settings["aspect_sigma"] > 0
        for name in CENTRE:
            free[names.index(name)] = centre_sigma_px(settings, image_size) > 0 or name in known
    priors = camera_priors(state.lens, terms, settings, field, image_size, float(np.exp(state.log_focal)), known)
    lines, usual_line_mm = line_priors(problem, settings, field, learned_lines)
    priors += lines
    rows = residual_count(problem)
    if rows + len(priors) + (len(gaussian.names) if gaussian else 0) - 1 < free.sum():
        raise FitFailed(
            say("refused.unknowns", "There are {n} measurements for {unknowns} unknowns.", n=rows,
                unknowns=int(free.sum())),
            say("refused.unknowns.fix", "Mark at least {n} more points, or choose fewer lens terms.",
                n=int(free.sum()) - rows), reason="too-few-points")
    return RayFitProblem(problem, priors, free, names, line_sigma_mm(settings, field), gaussian, usual_line_mm)


def line_sigma_mm(settings: Mapping[str, Any], field: Field) -> float:
    """Return σ of the lines about their places: the option's, or what the field says."""
    given = settings["line_sigma_mm"]
    return field.line_sigma_mm if given is None else given


def line_priors(problem: ClickResiduals, settings: Mapping[str, Any], field: Field, learned: Offsets | None = None,
                ) -> tuple[tuple[ScalarPrior, ...], float | None]:
    """Return the priors of the markings' offsets, and about which σ theirs are learned.

    learned: σ of an earlier fit; None is returned instead of the latter there, and where the options give it.
    """
    sigma_mm = line_sigma_mm(settings, field)
    sigmas = [(learned or {}).get(name, {}).get(part, sigma_mm) for name, part in problem.offset_names]
    free = learned is None and settings["line_sigma_mm"] is None and sigmas
    return tuple(ScalarPrior(f"line_{i}", 0.0, s) for i, s in enumerate(sigmas)), sigma_mm if free else None
