"""Fitting a camera with a lens: linear start, robust refinement, outlier rejection, then plain least squares."""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from touchline.core.errors import FitFailed
from touchline.core.field import Field, Region
from touchline.core.geometry import Array, ImageSize
from touchline.core.jobs import Progress, no_progress
from touchline.core.options import Option, read_options
from touchline.core.records import Fit, Observations
from touchline.core.statements import say
from touchline.fitting import FITTERS
from touchline.fitting.clicks import check_inside_picture, inlier_masks, outlier_warnings
from touchline.fitting.contract import Fitter, Sensitivity
from touchline.fitting.corrected_rectangle import corrected_rectangle
from touchline.fitting.options import RAY_OPTIONS
from touchline.fitting.ray_camera.camera_prior import (
    ASPECT_SIGMA,
    centre_sigma_px,
    misplaced_line_warnings,
    unusual_camera_warnings,
)
from touchline.fitting.ray_camera.distortion_prior import read_distortion, with_distortion
from touchline.fitting.ray_camera.height_check import check_height
from touchline.fitting.ray_camera.initial import start_states
from touchline.fitting.ray_camera.lens_prior import read_lens, with_lens
from touchline.fitting.ray_camera.misfit import given_lens_warnings, residual_warnings, without_square_pixels
from touchline.fitting.ray_camera.parameters import RayCameraParameters
from touchline.fitting.ray_camera.problem import gather_clicks, line_incidences
from touchline.fitting.ray_camera.search import best_start, solve
from touchline.fitting.ray_camera.setup import fit_problem, line_sigma_mm
from touchline.fitting.sensitivity import ParameterSensitivity
from touchline.models import CameraModel, parameters_json
from touchline.models.ray_camera import RayCamera

MOVED = 0.1  # of the logarithm of the focal length: k3's prior is then nearly twice as wide as it should be


class RayFitter(Fitter):
    """What the fitters of all cameras with a lens have in common; a member names its MODEL, OPTIONS and terms."""

    MODEL: ClassVar[type[RayCamera]]
    OPTIONS: ClassVar[tuple[Option, ...]] = RAY_OPTIONS
    TERMS: ClassVar[tuple[str, ...]]  # that are estimated unless the options name others
    ASPECT_SIGMA: ClassVar[float] = ASPECT_SIGMA  # unless the options give one

    @classmethod
    @abstractmethod
    def start_terms(cls, k1: float, corner: float = 0.75) -> Array:
        """Return the lens's terms nearest to a division lens, r = r_d / (1 + k1 r_d²), out to r_d = corner."""

    @classmethod
    def points_needed(cls) -> str:
        return (f"{8 + min(len(cls.TERMS), 1)} points or more on at least four lines, not all parallel. Nine on each "
                "of the four borders are recommended.")

    @classmethod
    def sensitivity(cls, model: CameraModel) -> Sensitivity | None:
        return ParameterSensitivity(RayCameraParameters.of(model)) if isinstance(model, RayCamera) else None

    @classmethod
    def fit(cls, observations: Observations, field: Field, region: Region, image_size: ImageSize,
            options: Mapping[str, Any] | None = None, progress: Progress = no_progress) -> Fit:
        """Fit to points anywhere along lines and arcs, to landmarks, and to points at known heights.

        Options: OPTIONS; also "start" (parameters), which begins near a known answer, with its "start_lines_mm"
        (offsets by marking and part); and "line_sigmas_mm" (their σ likewise), which says that the noise is known and
        each point an inlier: then the model and the lines' offsets are all that the fit tells.
        """
        given = dict(options or {})
        start, lines = given.pop("start", None), given.pop("start_lines_mm", {})
        learned = given.pop("line_sigmas_mm", None)
        given.pop("leanings", None)  # of calibrations that chose their terms one by one
        settings = read_options(cls.OPTIONS, given)
        if settings["aspect_sigma"] is None:
            settings["aspect_sigma"] = cls.ASPECT_SIGMA
        check_inside_picture(observations, image_size)
        problem = gather_clicks(observations, field, region, with_offsets=line_sigma_mm(settings, field) > 0)
        distortion = read_distortion(cls.MODEL.NAME, settings, image_size)
        intrinsics = None if distortion else read_lens(cls.MODEL.NAME, settings, image_size)
        width_px, height_px, n_x, n_y = corrected_rectangle(settings, region, image_size)
        if start is None:
            height = settings["height_mm"]["value"] if settings["height_mm"] else None
            starts = start_states(cls.MODEL.LENS, cls.start_terms, problem,
                                  line_incidences(observations, field, region), image_size, height)
        else:
            starts = [RayCameraParameters.of(cls.MODEL.from_parameters(start), problem.offsets_mm(lines))]
        if settings["aspect_sigma"] == 0:  # what is not estimated must not stay as another camera had it
            starts = [state.with_square_pixels() for state in starts]
        if centre_sigma_px(settings, image_size) == 0:
            starts = [replace(state, centre_px=np.array(image_size.centre)) for state in starts]
        if intrinsics is not None:
            starts = [with_lens(state, intrinsics) for state in starts]
        if distortion is not None:
            starts = [with_distortion(state, distortion) for state in starts]
        chosen = settings.get("terms", "auto")
        terms = cls.TERMS if chosen == "auto" else tuple(chosen)
        if distortion is not None:  # what straight lines told stays, whatever the options name
            terms = tuple(t for t in cls.MODEL.LENS.TERMS if t in terms or t in distortion.terms)
        if intrinsics is None:
            starts = [state.with_only_terms(terms) for state in starts]
        progress(0.1, "Fitting")
        setup = (problem, terms, settings, field, image_size, intrinsics, distortion, learned)
        # a known answer is only spoilt by a rough search
        begin = starts[0] if start is not None else best_start(fit_problem(starts[0], *setup), starts)
        best = solve(fit_problem(begin, *setup), begin, settings, noise_known=learned is not None)
        state = best.minimum.state
        if learned is None and abs(state.log_focal - begin.log_focal) > MOVED:
            # how wide the terms' priors are goes with the focal length, and how probable this lens is with them
            best = solve(fit_problem(state, *setup), state, settings)
            state = best.minimum.state
        def camera(found: RayCameraParameters) -> RayCamera:
            return cls.MODEL(**found.parameters(), width_px=width_px, height_px=height_px, n_rectangles_x=n_x,
                             n_rectangles_y=n_y, region=region, image_size=image_size)

        model = camera(state)
        if not model.plausible():
            raise FitFailed(
                say("refused.implausible", "The points result in an impossible camera: {m:.3g} m above the carpet with "
                    "a focal length of {px:.3g} px.", m=model.position_mm[2] / 1000, px=model.focal_px),
                say("refused.implausible.fix", "Check the line of each point and the covered area, then add points."),
                reason="implausible-camera")
        inliers = inlier_masks(observations, problem.owners, best.inliers)
        if learned is not None:
            return Fit(model, inliers, (True,) * len(observations), notes=best.offset_notes)
        notes = {
            "terms": {"chosen": best.terms, "tried": {" ".join(best.terms): {
                "rms_px": best.rms_px, "parameters": best.parameters}}},
            "click_sigma_px": best.sigma_px, "degrees_of_freedom": best.freedom,
            "parameters": best.parameters, "log_evidence": best.log_evidence,
            **best.offset_notes,
            "line_sigmas_mm": {name: sigma["across"] for name, sigma in best.offset_sigmas_mm.items()},
            "choices": {"start": parameters_json(model), **best.choices},
        }
        warnings = [*outlier_warnings(observations, problem.owners, best.inliers, best.pixels),
                    *residual_warnings(best.rms_px, settings, image_size),
                    *misplaced_line_warnings(notes["line_offsets_mm"], line_sigma_mm(settings, field)),
                    *unusual_camera_warnings(state, best.task.priors, image_size, field)]
        if intrinsics is not None:
            free_lens = fit_problem(state, problem, cls.TERMS, settings, field, image_size, None, None)
            warnings += given_lens_warnings(free_lens, best, settings, image_size)
        task = fit_problem(state, *setup)
        height = check_height(task, best, settings)
        notes["height"] = height.told
        warnings += height.warnings()
        other = height.alone if height.is_contradicted else without_square_pixels(task, best, settings)
        alternative = None if other is None else Fit(
            camera(other.minimum.state), inliers, (True,) * len(observations), covariance=other.covariance,
            parameter_names=other.free_names)
        covariance, names = best.covariance, best.free_names
        sigma = dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
        notes["line_offset_sigmas_mm"] = {
            marking: sigma[f"line_{i}"] for i, (marking, part) in enumerate(problem.offset_names)
            if part == "across" and f"line_{i}" in sigma}
        return Fit(model, inliers, (True,) * len(observations), tuple(warnings), notes, covariance=covariance,
                   parameter_names=names, alternative=alternative)


def lens_fitter(model: type[RayCamera]) -> type[RayFitter]:
    """Return the fitter of a camera with a lens."""
    fitter = FITTERS[model.NAME]
    if not issubclass(fitter, RayFitter):
        raise TypeError(f"the fitter of {model.NAME} starts from no lens")
    return fitter
