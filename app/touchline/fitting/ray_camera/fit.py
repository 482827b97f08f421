"""Fitting a camera with a lens: linear start, robust refinement, outlier rejection, then plain least squares."""

from abc import abstractmethod
from collections.abc import Callable, Mapping
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
from touchline.fitting.contract import (
    RAY_OPTIONS,
    TERMS_OPTION,
    Fitter,
    Sensitivity,
    check_inside_picture,
    corrected_rectangle,
    inlier_masks,
    outlier_warnings,
)
from touchline.fitting.linear import (
    Incidences,
    focal_from_vanishing_points,
    homography_from_lines,
    pose_from_homography,
    tsai_two_stage,
)
from touchline.fitting.ray_camera.camera_prior import (
    ASPECT_SIGMA,
    camera_priors,
    centre_sigma_px,
    check_height,
    given_lens_warnings,
    misplaced_line_warnings,
    residual_warnings,
    unusual_camera_warnings,
    without_square_pixels,
)
from touchline.fitting.ray_camera.lens_prior import (
    CENTRE,
    DistortionEstimate,
    distortion_prior,
    lens_prior,
    read_distortion,
    read_lens,
    with_distortion,
    with_lens,
)
from touchline.fitting.ray_camera.parameters import RayCameraParameters
from touchline.fitting.ray_camera.problem import (
    ClickResiduals,
    Offsets,
    ScalarPrior,
    gather_clicks,
    line_incidences,
)
from touchline.fitting.ray_camera.search import RayFitProblem, best_start, residual_count, solve
from touchline.fitting.sensitivity import ParameterSensitivity
from touchline.models import CameraModel, parameters_json
from touchline.models.intrinsics import Intrinsics
from touchline.models.lenses import Lens
from touchline.models.lenses.division import division_radii, odd_series
from touchline.models.ray_camera import BrownConrady, Division, Fisheye, RayCamera, Ssl

FOCAL_GUESSES = (0.55, 0.8, 1.1, 1.6)  # of the picture's width: what field cameras have
PLAUSIBLE_FOCAL = (0.2, 20.0)  # of the picture's width
# of the logarithm of the focal length: k3's prior is then nearly twice as wide as it should be
MOVED = 0.1
USUAL_CORNER = 0.75  # of the picture, in focal lengths


def fit_problem(
    state: RayCameraParameters,
    problem: ClickResiduals,
    terms: tuple[str, ...],
    settings: Mapping[str, Any],
    field: Field,
    image_size: ImageSize,
    intrinsics: Intrinsics | None,
    distortion: DistortionEstimate | None,
    learned_lines: Offsets | None = None,
) -> RayFitProblem:
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
    priors = camera_priors(
        state.lens, terms, settings, field, image_size, float(np.exp(state.log_focal)), known
    )
    lines, usual_line_mm = line_priors(problem, settings, field, learned_lines)
    priors += lines
    rows = residual_count(problem)
    if rows + len(priors) + (len(gaussian.names) if gaussian else 0) - 1 < free.sum():
        raise FitFailed(
            say(
                "refused.unknowns",
                "The points give {n} measurements; this lens model needs {unknowns}.",
                n=rows,
                unknowns=int(free.sum()),
            ),
            say(
                "refused.unknowns.fix",
                "Mark at least {n} more points, or choose fewer lens terms.",
                n=int(free.sum()) - rows,
            ),
            reason="too-few-points",
        )
    return RayFitProblem(
        problem, priors, free, names, line_sigma_mm(settings, field), gaussian, usual_line_mm
    )


def line_sigma_mm(settings: Mapping[str, Any], field: Field) -> float:
    """Return σ of the lines about their places: the option's, or what the field says."""
    given = settings["line_sigma_mm"]
    return field.line_sigma_mm if given is None else given


def line_priors(
    problem: ClickResiduals,
    settings: Mapping[str, Any],
    field: Field,
    learned: Offsets | None = None,
) -> tuple[tuple[ScalarPrior, ...], float | None]:
    """Return the priors of the markings' offsets, and about which σ theirs are learned.

    learned: σ of an earlier fit; None is returned instead of the latter there, and where the options give it.
    """
    sigma_mm = line_sigma_mm(settings, field)
    sigmas = [
        (learned or {}).get(name, {}).get(part, sigma_mm) for name, part in problem.offset_names
    ]
    free = learned is None and settings["line_sigma_mm"] is None and sigmas
    return tuple(
        ScalarPrior(f"line_{i}", 0.0, s) for i, s in enumerate(sigmas)
    ), sigma_mm if free else None


def start_states(
    lens: type[Lens],
    start_terms: Callable[[float, float], Array],
    problem: ClickResiduals,
    incidences: Incidences,
    image_size: ImageSize,
    height_mm: float | None,
) -> list[RayCameraParameters]:
    """Return candidates for the refinement. Raises FitFailed where no linear method sees a camera."""
    centre, offsets_mm = np.array(image_size.centre), np.zeros(len(problem.offset_names))

    half_diagonal_px = float(np.hypot(*image_size)) / 2

    def state(focal: float, k1: float, rotation: Array, position: Array) -> RayCameraParameters:
        return RayCameraParameters(
            lens,
            float(np.log(focal)),
            1.0,
            centre,
            start_terms(k1, half_diagonal_px / focal),
            rotation,
            position,
            offsets_mm,
        )

    found = homography_from_lines(incidences, centre)
    plane_from_field = np.asarray(np.linalg.inv(found.field_from_plane), np.float64)
    states = [
        state(
            focal,
            float(np.clip(found.bend * focal**2, -1.0, 0.5)),
            *pose_from_homography(plane_from_field, focal),
        )
        for focal in _focals(plane_from_field, image_size, height_mm)
    ]
    flat = problem.marks[:, 2] == 0
    if flat.sum() >= 6:  # landmarks alone allow Tsai's two stages as well
        spots = problem.pixels[problem.curves :][flat]
        try:
            rotation, position, focal, k1 = tsai_two_stage(spots - centre, problem.marks[flat, :2])
            if (
                PLAUSIBLE_FOCAL[0] < focal / image_size.width < PLAUSIBLE_FOCAL[1]
                and position[2] > 0
            ):
                states.append(state(focal, float(np.clip(k1, -0.5, 0.5)), rotation, position))
        except FitFailed:
            pass  # the linear candidates remain
    return states


def _focals(plane_from_field: Array, image_size: ImageSize, height_mm: float | None) -> list[float]:
    estimate = focal_from_vanishing_points(plane_from_field)
    focals = [f * image_size.width for f in FOCAL_GUESSES]
    if (
        estimate is not None
        and PLAUSIBLE_FOCAL[0] < estimate / image_size.width < PLAUSIBLE_FOCAL[1]
    ):
        focals.insert(0, estimate)
    if height_mm is not None:  # the focal length under which the pose comes out at the taped height
        trial = np.geomspace(*PLAUSIBLE_FOCAL, 60) * image_size.width
        _, positions_mm = pose_from_homography(plane_from_field, trial)
        focals.insert(0, float(trial[np.argmin(np.abs(positions_mm[:, 2] - height_mm))]))
    return focals


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
        return (
            f"{8 + min(len(cls.TERMS), 1)} points or more on at least four lines, not all parallel. Nine on each "
            "of the four borders are recommended."
        )

    @classmethod
    def sensitivity(cls, model: CameraModel) -> Sensitivity | None:
        return (
            ParameterSensitivity(RayCameraParameters.of(model))
            if isinstance(model, RayCamera)
            else None
        )

    @classmethod
    def fit(
        cls,
        observations: Observations,
        field: Field,
        region: Region,
        image_size: ImageSize,
        options: Mapping[str, Any] | None = None,
        progress: Progress = no_progress,
    ) -> Fit:
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
        problem = gather_clicks(
            observations, field, region, with_offsets=line_sigma_mm(settings, field) > 0
        )
        distortion = read_distortion(cls.MODEL.NAME, settings, image_size)
        intrinsics = None if distortion else read_lens(cls.MODEL.NAME, settings, image_size)
        width_px, height_px, n_x, n_y = corrected_rectangle(settings, region, image_size)
        if start is None:
            height = settings["height_mm"]["value"] if settings["height_mm"] else None
            starts = start_states(
                cls.MODEL.LENS,
                cls.start_terms,
                problem,
                line_incidences(observations, field, region),
                image_size,
                height,
            )
        else:
            starts = [
                RayCameraParameters.of(cls.MODEL.from_parameters(start), problem.offsets_mm(lines))
            ]
        # what is not estimated must not stay as another camera had it
        if settings["aspect_sigma"] == 0:
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
        begin = (
            starts[0] if start is not None else best_start(fit_problem(starts[0], *setup), starts)
        )
        best = solve(fit_problem(begin, *setup), begin, settings, noise_known=learned is not None)
        state = best.minimum.state
        if learned is None and abs(state.log_focal - begin.log_focal) > MOVED:
            # how wide the terms' priors are goes with the focal length, and how probable this lens is with them
            best = solve(fit_problem(state, *setup), state, settings)
            state = best.minimum.state

        def camera(found: RayCameraParameters) -> RayCamera:
            return cls.MODEL(
                **found.parameters(),
                width_px=width_px,
                height_px=height_px,
                n_rectangles_x=n_x,
                n_rectangles_y=n_y,
                region=region,
                image_size=image_size,
            )

        model = camera(state)
        if not model.plausible():
            raise FitFailed(
                say(
                    "refused.implausible",
                    "The points result in an impossible camera: {m:.3g} m above the carpet with "
                    "a focal length of {px:.3g} px.",
                    m=model.position_mm[2] / 1000,
                    px=model.focal_px,
                ),
                say(
                    "refused.implausible.fix",
                    "Check the line of each point and the covered area, then add points.",
                ),
                reason="implausible-camera",
            )
        inliers = inlier_masks(observations, problem.owners, best.inliers)
        if learned is not None:
            return Fit(model, inliers, (True,) * len(observations), notes=best.offset_notes)
        notes = {
            "terms": {
                "chosen": best.terms,
                "tried": {
                    " ".join(best.terms): {"rms_px": best.rms_px, "parameters": best.parameters}
                },
            },
            "click_sigma_px": best.sigma_px,
            "degrees_of_freedom": best.freedom,
            "parameters": best.parameters,
            "log_evidence": best.log_evidence,
            **best.offset_notes,
            "line_sigmas_mm": {
                name: sigma["across"] for name, sigma in best.offset_sigmas_mm.items()
            },
            "choices": {"start": parameters_json(model), **best.choices},
        }
        warnings = [
            *outlier_warnings(observations, problem.owners, best.inliers, best.pixels),
            *residual_warnings(best.rms_px, settings, image_size),
            *misplaced_line_warnings(notes["line_offsets_mm"], line_sigma_mm(settings, field)),
            *unusual_camera_warnings(state, best.task.priors, image_size, field),
        ]
        if intrinsics is not None:
            free_lens = fit_problem(
                state, problem, cls.TERMS, settings, field, image_size, None, None
            )
            warnings += given_lens_warnings(free_lens, best, settings, image_size)
        task = fit_problem(state, *setup)
        height = check_height(task, best, settings)
        notes["height"] = height.figures
        warnings += height.warnings()
        other = (
            height.alone if height.is_contradicted else without_square_pixels(task, best, settings)
        )
        alternative = (
            None
            if other is None
            else Fit(
                camera(other.minimum.state),
                inliers,
                (True,) * len(observations),
                covariance=other.covariance,
                parameter_names=other.free_names,
            )
        )
        covariance, names = best.covariance, best.free_names
        sigma = dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
        notes["line_offset_sigmas_mm"] = {
            marking: sigma[f"line_{i}"]
            for i, (marking, part) in enumerate(problem.offset_names)
            if part == "across" and f"line_{i}" in sigma
        }
        return Fit(
            model,
            inliers,
            (True,) * len(observations),
            tuple(warnings),
            notes,
            covariance=covariance,
            parameter_names=names,
            alternative=alternative,
        )


def lens_fitter(model: type[RayCamera]) -> type[RayFitter]:
    """Return the fitter of a camera with a lens."""
    fitter = FITTERS[model.NAME]
    if not issubclass(fitter, RayFitter):
        raise TypeError(f"the fitter of {model.NAME} starts from no lens")
    return fitter


class DivisionFitter(RayFitter):
    MODEL: ClassVar[type[RayCamera]] = Division
    TERMS: ClassVar[tuple[str, ...]] = Division.LENS.TERMS

    @classmethod
    def start_terms(cls, k1: float, corner: float = USUAL_CORNER) -> Array:
        return np.array([k1])


class BrownConradyFitter(RayFitter):
    MODEL: ClassVar[type[RayCamera]] = BrownConrady
    TERMS: ClassVar[tuple[str, ...]] = ("k1", "k2", "p1", "p2", "k3")
    OPTIONS: ClassVar[tuple[Option, ...]] = (
        replace(TERMS_OPTION, choices=BrownConrady.LENS.TERMS),
        *RAY_OPTIONS,
    )

    @classmethod
    def start_terms(cls, k1: float, corner: float = USUAL_CORNER) -> Array:
        k1, k2, k3 = odd_series(*division_radii(k1, corner), 3)
        return np.array([k1, k2, 0, 0, k3, 0, 0, 0], float)


class FisheyeFitter(RayFitter):
    MODEL: ClassVar[type[RayCamera]] = Fisheye
    TERMS: ClassVar[tuple[str, ...]] = Fisheye.LENS.TERMS
    OPTIONS: ClassVar[tuple[Option, ...]] = (
        replace(TERMS_OPTION, choices=Fisheye.LENS.TERMS),
        *RAY_OPTIONS,
    )

    @classmethod
    def start_terms(cls, k1: float, corner: float = USUAL_CORNER) -> Array:
        undistorted, distorted = division_radii(k1, corner)
        return np.array([*odd_series(np.arctan(undistorted), distorted, 2), 0, 0], float)


class SslFitter(RayFitter):
    MODEL: ClassVar[type[RayCamera]] = Ssl
    TERMS: ClassVar[tuple[str, ...]] = Ssl.LENS.TERMS
    ASPECT_SIGMA: ClassVar[float] = 0.0  # the league's message has one focal length

    @classmethod
    def start_terms(cls, k1: float, corner: float = USUAL_CORNER) -> Array:
        return np.array([-k1])
