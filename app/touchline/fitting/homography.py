"""Fitting a homography: normalised DLT from points anywhere along lines, then the distances in pixels, arcs too."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from touchline.core.errors import FitFailed
from touchline.core.field import Field, Region
from touchline.core.geometry import Array, ImageSize, Indices, Mask, homogeneous, with_z
from touchline.core.jobs import Progress, no_progress
from touchline.core.options import Option, read_options
from touchline.core.records import Fit, Observations
from touchline.core.statements import say
from touchline.fitting.contract import (
    CLICK_SIGMA,
    COMMON_OPTIONS,
    LINE_SIGMA,
    Fitter,
    Sensitivity,
    check_inside_picture,
    corrected_rectangle,
    elevated_point_warnings,
    inlier_masks,
    outlier_warning,
    outlier_warnings,
)
from touchline.fitting.linear import (
    MIN_ROWS,
    MORE_LINES,
    NOT_DETERMINED,
    Incidences,
    homography_from_lines,
    mirrored_error,
)
from touchline.fitting.ray_camera.fit import line_priors, line_sigma_mm
from touchline.fitting.ray_camera.problem import ClickResiduals, gather_clicks, line_incidences
from touchline.fitting.ray_camera.search import (
    MAX_OUTLIER_SHARE,
    RayFitProblem,
    RayFitResult,
    residual_count,
    solve,
)
from touchline.fitting.sensitivity import HomographyParameters, ParameterSensitivity
from touchline.models import CameraModel, parameters_json
from touchline.models.homography import Homography

# random tens of clicks: with four outliers in 36, 27 of the tens are clean
TRIALS, PER_TRIAL = 100, 10
SUSPECT_PX = 10.0  # a click this far off may have distorted the linear estimate
MAX_SIGMA_SHARE = 0.1  # of the region's shorter side: a corner known no better is not known


class HomographyFitter(Fitter):
    MODEL: ClassVar[type[CameraModel]] = Homography
    OPTIONS: ClassVar[tuple[Option, ...]] = (LINE_SIGMA, CLICK_SIGMA, *COMMON_OPTIONS)

    @classmethod
    def points_needed(cls) -> str:
        return (
            "8 points on four lines, two in each direction (a landmark counts for 2). Nine on each of the four are "
            "recommended."
        )

    @classmethod
    def sensitivity(cls, model: CameraModel) -> Sensitivity | None:
        return (
            ParameterSensitivity(HomographyParameters.of(model))
            if isinstance(model, Homography)
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
        """Fit to points anywhere along lines and arcs, and to landmarks.

        Options: OPTIONS; "start" (parameters), which begins near a known answer, with its "start_lines_mm" (offsets
        by marking and part); with "line_sigmas_mm" (their σ likewise) the noise is known too."""
        given = dict(options or {})
        start, lines = given.pop("start", None), given.pop("start_lines_mm", {})
        learned = given.pop("line_sigmas_mm", None)
        settings = read_options(cls.OPTIONS, given)
        check_inside_picture(observations, image_size)
        flat = tuple(o if o.z_mm == 0 else replace(o, points=o.points[:0]) for o in observations)
        problem = gather_clicks(
            flat, field, region, with_offsets=line_sigma_mm(settings, field) > 0
        )
        width_px, height_px, n_x, n_y = corrected_rectangle(settings, region, image_size)
        progress(0.1, "Fitting the homography")
        if start is None:
            begin = _initial_parameters(
                problem, line_incidences(flat, field, region), region, image_size
            )
        else:
            begin = replace(
                HomographyParameters.of(Homography.from_parameters(start)),
                offsets_mm=problem.offsets_mm(lines),
            )
        whole, visible = problem, _visible(problem, begin, settings["robust"])
        problem = whole.only(visible)
        rows = residual_count(problem)
        if rows < MIN_ROWS:
            raise FitFailed(
                say(
                    "refused.measurements",
                    "The points give {n} measurements; a fit needs {unknowns}.",
                    n=rows,
                    unknowns=MIN_ROWS,
                ),
                say(
                    "refused.measurements.fix", "Mark at least {n} more points.", n=MIN_ROWS - rows
                ),
                reason="too-few-points",
            )
        priors, usual_line_mm = line_priors(problem, settings, field, learned)
        names = begin.names
        progress(0.4, "Refining")
        task = RayFitProblem(
            problem,
            priors,
            np.ones(len(names), bool),
            names,
            line_sigma_mm(settings, field),
            usual_line_mm=usual_line_mm,
        )
        found = solve(task, begin, settings, noise_known=learned is not None)
        state = found.minimum.state
        _refuse_impossible(found, region)
        model = Homography(
            **state.parameters(),
            width_px=width_px,
            height_px=height_px,
            n_rectangles_x=n_x,
            n_rectangles_y=n_y,
            region=region,
            image_size=image_size,
        )
        inlier = visible.copy()
        inlier[visible] = found.inliers
        inliers = inlier_masks(observations, whole.owners, inlier)
        notes = {
            "click_sigma_px": found.sigma_px,
            "degrees_of_freedom": found.freedom,
            "parameters": found.parameters,
            **found.offset_notes,
            "choices": {"start": parameters_json(model), **found.choices},
        }
        warnings = (
            *outlier_warnings(observations, problem.owners, found.inliers, found.pixels),
            *(
                outlier_warning(
                    observations,
                    i,
                    k,
                    say("outlier.horizon", "is beyond the horizon of the other points"),
                )
                for i, k in whole.owners[~visible]
            ),
            *elevated_point_warnings(observations, say("who.homography", "a homography")),
        )
        return Fit(
            model,
            inliers,
            tuple(o.z_mm == 0 for o in observations),
            warnings,
            notes,
            covariance=found.covariance,
            parameter_names=names,
        )


def _initial_parameters(
    problem: ClickResiduals, lines: Incidences, region: Region, image_size: ImageSize
) -> HomographyParameters:
    """Return the linear estimate; where a click is far off, the best of many estimates from ten random clicks each."""
    centre = np.array(image_size.centre)
    clicked = homogeneous(lines.pixels)

    def linear(which: Indices) -> Array:
        some = Incidences(lines.pixels[which], lines.lines[which])
        found = homography_from_lines(some, centre, bends=np.zeros(1))
        return found.field_from_plane @ np.array(
            [[1, 0, -centre[0]], [0, 1, -centre[1]], [0, 0, 1.0]]
        )

    def misses(field_from_raw: Array) -> Array:
        """Return pixels (n,) from each click to the image of its line."""
        projected = lines.lines @ field_from_raw
        with np.errstate(all="ignore"):
            miss = np.abs(np.sum(projected * clicked, axis=1)) / np.linalg.norm(
                projected[:, :2], axis=1
            )
        return np.where(np.isfinite(miss), miss, np.inf)

    rows = len(clicked)
    views: list[Array] = []
    refusal: FitFailed | None = None
    try:
        views.append(linear(np.arange(rows)))
    except FitFailed as error:
        if error.reason != "no-camera":
            raise
        refusal = error
    if rows > PER_TRIAL and (refusal or misses(views[0]).max() > SUSPECT_PX):
        rng = np.random.default_rng(0)
        for _ in range(TRIALS):
            try:
                views.append(linear(rng.choice(rows, PER_TRIAL, replace=False)))
            except FitFailed:
                continue
    if refusal is not None and not views:
        raise refusal
    best = min(views, key=lambda view: float(np.sum(np.minimum(misses(view), SUSPECT_PX))))
    return HomographyParameters.of_camera(
        np.asarray(np.linalg.inv(best), np.float64), region, len(problem.offset_names)
    )


def _visible(problem: ClickResiduals, state: HomographyParameters, robust: bool) -> Mask:
    """Return which clicks (n,) lie before this view's horizon; the few that do not are outliers."""
    problem.places = np.empty(0)
    r, _ = problem.residuals(state)
    finite = np.isfinite(r)
    visible = np.concatenate(
        [finite[: problem.curves], finite[problem.curves :].reshape(-1, 2).all(axis=1)]
    )
    return (
        visible
        if robust and (~visible).sum() <= MAX_OUTLIER_SHARE * visible.size
        else np.ones_like(visible)
    )


def _refuse_impossible(found: RayFitResult[HomographyParameters], region: Region) -> None:
    """Raise FitFailed for a mirrored or an undetermined view: both have small residuals."""
    state = found.minimum.state
    corners = region.field_from_region(
        np.array([[0, 0], [1, 0], [0, 1], [1, 1.0]]) * [region.width_mm, region.height_mm]
    )
    jacobian = found.minimum.jacobian
    spread = np.linalg.svd(
        jacobian / np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300), compute_uv=False
    )
    with np.errstate(all="ignore"):
        _, by_point, by = state.project_jacobian(with_z(corners))
        if spread[-1] > 1e-10 * spread[0] and np.isfinite(by).all():
            moves = np.linalg.solve(by_point[:, :, :2], by)  # (4, 2, 8) field mm
            variance = np.einsum("nij,jk,nik->n", moves, found.covariance[:8, :8], moves)
        else:
            variance = np.full(4, np.inf)
    sigma_mm = np.sqrt(np.where(np.isfinite(variance), variance, np.inf))
    worst = int(np.argmax(sigma_mm))
    if np.isinf(sigma_mm[worst]):
        raise FitFailed(NOT_DETERMINED, MORE_LINES, reason="lines-not-enough")
    if not sigma_mm[worst] < MAX_SIGMA_SHARE * min(region.width_mm, region.height_mm):
        corner = f"{('top', 'bottom')[worst // 2]} {('left', 'right')[worst % 2]}"
        raise FitFailed(
            say(
                f"refused.corner-{corner.replace(' ', '-')}",
                "The marked lines do not determine the position of the "
                f"field in the image: its {corner} corner is uncertain by {{mm:.3g}} mm.",
                mm=sigma_mm[worst],
            ),
            MORE_LINES,
            reason="lines-not-enough",
        )
    if np.linalg.det(state.raw_from_unit) * np.linalg.det(state.unit_from_field) > 0:
        raise mirrored_error()
