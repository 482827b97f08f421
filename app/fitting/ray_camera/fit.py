"""Fitting a camera with a lens: linear start, robust refinement, outlier rejection, then plain least squares."""

from collections.abc import Iterable, Mapping
from typing import Any, ClassVar

import numpy as np

from app.core.errors import FitFailed
from app.core.field import Field, Region
from app.core.geometry import Array, ImageSize
from app.core.options import Option, read_options
from app.core.progress import Progress, no_progress
from app.core.records import Fit, Observations
from app.fitting.clicks import check_inside_picture, inlier_masks, outlier_warnings
from app.fitting.contract import Fitter, Sensitivity
from app.fitting.corrected_rectangle import corrected_rectangle
from app.fitting.options import RAY_OPTIONS
from app.fitting.ray_camera.distortion_prior import read_distortion, with_distortion
from app.fitting.ray_camera.initial import start_states
from app.fitting.ray_camera.lens_prior import read_lens, with_lens
from app.fitting.ray_camera.parameters import RayCameraParameters
from app.fitting.ray_camera.problem import gather_clicks, line_incidences
from app.fitting.ray_camera.search import RayFitProblem, RayFitResult, best_start, significantly_better, solve
from app.fitting.ray_camera.setup import fit_problem, read_shrinkage, shrinkage_for, term_sets_for
from app.fitting.sensitivity import ParameterSensitivity
from app.models import parameters_json
from app.models.ray_camera import RayCamera


class RayFitter(Fitter):
    """What the fitters of all cameras with a lens have in common; a member names its MODEL, OPTIONS and terms."""

    MODEL: ClassVar[type[RayCamera]]
    OPTIONS: ClassVar[tuple[Option, ...]] = RAY_OPTIONS

    TERM_SETS: ClassVar[tuple[tuple[str, ...], ...]] = ()  # those that "auto" tries, simplest first
    FIRST_TERM: ClassVar[tuple[float, float]] = (1.0, 0.0)  # of the lens, by k1 of r_d = r (1 + k1 r²): slope, offset

    @classmethod
    def start_terms(cls, k1: float) -> Array:
        """Return the lens's terms whose leading behaviour is r_d = r (1 + k1 r²)."""
        slope, offset = cls.FIRST_TERM
        return np.pad([slope * k1 + offset], (0, len(cls.MODEL.LENS.TERMS) - 1))

    @classmethod
    def term_sets(cls) -> tuple[tuple[str, ...], ...]:
        """Return the sets of lens terms that "auto" tries, simplest first; a lens without a choice has one."""
        return cls.TERM_SETS or (cls.MODEL.LENS.TERMS,)

    @classmethod
    def points_needed(cls) -> str:
        return (f"{8 + len(cls.term_sets()[0])} points or more on at least four lines, not all parallel; "
                "nine on each of the four borders are good.")

    @classmethod
    def sensitivity(cls, model: RayCamera) -> Sensitivity:
        return ParameterSensitivity(RayCameraParameters.of(model))

    @classmethod
    def fit(cls, observations: Observations, field: Field, region: Region, image_size: ImageSize,
            options: Mapping[str, Any] | None = None, progress: Progress = no_progress) -> Fit:
        """Fit to points anywhere along lines and arcs, to landmarks, and to points at known heights.

        Options: OPTIONS; also "start" (parameters), which begins near a known answer, and "leanings" (σ by term), which
        an earlier fit chose.
        """
        given = dict(options or {})
        start, shrinkage_sigmas = given.pop("start", None), read_shrinkage(cls.MODEL.LENS, given.pop("leanings", None))
        settings = read_options(cls.OPTIONS, given)
        check_inside_picture(observations, image_size)
        problem = gather_clicks(observations, field, region, with_offsets=settings["line_sigma_mm"] > 0)
        distortion = read_distortion(cls.MODEL.NAME, settings, image_size)
        intrinsics = None if distortion else read_lens(cls.MODEL.NAME, settings, image_size)
        width_px, height_px, n_x, n_y = corrected_rectangle(settings, region, image_size)
        if start is None:
            height = settings["height_mm"]["value"] if settings["height_mm"] else None
            starts = start_states(cls.MODEL.LENS, cls.start_terms, problem,
                                  line_incidences(observations, field, region), image_size, height)
        else:
            starts = [RayCameraParameters.of(cls.MODEL.from_parameters(start), len(problem.line_names))]
        if intrinsics is not None:
            starts = [with_lens(state, intrinsics) for state in starts]
        if distortion is not None:
            starts = [with_distortion(state, distortion) for state in starts]
        term_sets = term_sets_for(cls.MODEL.LENS, cls.term_sets(), settings, intrinsics, distortion)
        best, refusal, tried, chosen_shrinkage = None, None, {}, {}
        simplest = next((terms for terms in term_sets if terms), term_sets[-1])  # with any distortion
        first = fit_problem(starts[0], problem, simplest, settings, image_size, intrinsics, distortion)
        # a known answer is only spoilt by a rough search
        begin = best_start(first, starts) if start is None else starts[0]
        for rung, terms in enumerate(term_sets):
            progress(0.1 + 0.8 * rung / len(term_sets), f"Fitting {' '.join(terms) or 'without distortion'}")
            shrinkage = shrinkage_sigmas or shrinkage_for(best, terms)
            task = fit_problem(starts[0], problem, terms, settings, image_size, intrinsics, distortion, shrinkage)
            near = begin if best is None or not best.terms else best.minimum.state
            try:
                found = _first_solved(task, [near, begin, *starts], terms, settings)
            except FitFailed as refused:  # a lens too simple or too free for these clicks; the others may do
                refusal = refused
                continue
            tried[" ".join(terms)] = found
            if best is None or (shrinkage and not shrinkage_sigmas) or significantly_better(best, found):
                best, chosen_shrinkage = found, shrinkage
        if best is None:
            raise refusal
        state = best.minimum.state
        model = cls.MODEL(**state.parameters(), width_px=width_px, height_px=height_px, n_rectangles_x=n_x,
                          n_rectangles_y=n_y, region=region, image_size=image_size)
        if not model.plausible():
            raise FitFailed("The clicks lead to a camera that cannot be: "
                            f"{model.position_mm[2] / 1000:.3g} m above the carpet with a focal length of "
                            f"{model.focal_px:.3g} px.",
                            "Check which line each click belongs to, and the region; then click more points.",
                            reason="implausible-camera")
        inliers = inlier_masks(observations, problem.owners, best.inliers)
        choices = {"start": parameters_json(model), "click_sigma_px": best.sigma_px}
        if "terms" in {o.name for o in cls.OPTIONS}:
            choices = {"terms": list(best.terms), **choices, "leanings": chosen_shrinkage}
        notes = {
            "terms": {"chosen": best.terms, "tried": {
                t: {"rms_px": f.rms_px, "parameters": int(f.task.free.sum())} for t, f in tried.items()}},
            "click_sigma_px": best.sigma_px, "degrees_of_freedom": best.freedom,
            "parameters": int(best.task.free.sum()),
            "line_offsets_mm": dict(zip(problem.line_names, map(float, state.offsets_mm), strict=True)),
            "choices": choices,
        }
        warnings = tuple(outlier_warnings(observations, problem.owners, best.inliers, best.pixels))
        names = tuple(name for name, free in zip(best.task.names, best.task.free, strict=True) if free)
        return Fit(model, inliers, (True,) * len(observations), warnings, notes, covariance=best.covariance,
                   parameter_names=names)


def _first_solved(task: RayFitProblem, starts: Iterable[RayCameraParameters], terms: tuple[str, ...],
                  settings: Mapping[str, Any]) -> RayFitResult:
    """Solve from the first start that leads anywhere: some see no click at all once their lens is another."""
    for start in starts:
        try:
            return solve(task, start if task.lens_given else start.with_only_terms(terms), settings)
        except FitFailed as refused:
            refusal = refused
    raise refusal
