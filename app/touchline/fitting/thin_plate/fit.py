"""Fitting a thin-plate spline: the base, then what it leaves; smoothing by cross-validation, outliers rejected."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from touchline.core.errors import FitFailed
from touchline.core.field import Feature, Field, Region
from touchline.core.geometry import MAX_COORDINATE, Array, ImageSize, Indices, Mask, Points
from touchline.core.options import Option, read_options
from touchline.core.progress import Progress, no_progress
from touchline.core.records import Fit, Observations, Warning
from touchline.core.statements import say
from touchline.fitting import FITTERS
from touchline.fitting.clicks import check_inside_picture, elevated_point_warnings, inlier_masks, outlier_warning
from touchline.fitting.contract import Fitter, Sensitivity
from touchline.fitting.options import CLICK_SIGMA, COMMON_OPTIONS
from touchline.fitting.ray_camera.search import MAX_OUTLIER_SHARE, MIN_OUTLIER_PX, OUTLIER_SIGMAS
from touchline.fitting.thin_plate.clicks import Clicks, constraints_of, gather_clicks, largest_per_click
from touchline.fitting.thin_plate.sensitivity import LatticeSensitivity
from touchline.fitting.thin_plate.smoothing import Constraints, SmoothingSplines, spline_through
from touchline.fitting.thin_plate.uncertainty import NODE_NAMES, node_covariance
from touchline.models import CameraModel
from touchline.models.thin_plate import BASES, ThinPlate, spline_frame, unfolded_reach
from touchline.models.thin_plate_spline import Spline

ROUNDS, CHOOSING = 40, 2  # of finding where along its line each click lies; the first choose the smoothing anew
STILL_PX = 1e-10
MIN_SPREAD_PX = 0.3  # of clicks; points that agree better by chance must not make an outlier of the next


@dataclass(frozen=True, eq=False)
class _FittedSpline:
    """A spline and the constraints that it was made from; index (n,): which click each row is of."""

    spline: Spline
    smoother: SmoothingSplines
    smoothing: float
    constraints: Constraints
    index: Indices


class ThinPlateFitter(Fitter):
    MODEL: ClassVar[type[CameraModel]] = ThinPlate
    OPTIONS: ClassVar[tuple[Option, ...]] = (
        Option("base", "choice", "homography", "The base model that the spline corrects.", choices=BASES),
        Option("smoothing", "float", None,
               "Stiffness of the spline; 0 passes through every point. Empty: chosen by cross-validation.", (0, 1e4)),
        CLICK_SIGMA,
        *COMMON_OPTIONS,
    )

    @classmethod
    def points_needed(cls) -> str:
        return ("8 points on four lines, two in each direction, for the base model. For the spline, nine on each "
                "border and as many again on lines inside the field.")

    @classmethod
    def sensitivity(cls, model: CameraModel) -> Sensitivity | None:
        return LatticeSensitivity(model) if isinstance(model, ThinPlate) else None

    @classmethod
    def fit(cls, observations: Observations, field: Field, region: Region, image_size: ImageSize,
            options: Mapping[str, Any] | None = None, progress: Progress = no_progress) -> Fit:
        """Fit the base, then the spline to what it leaves.

        Options: OPTIONS; "base_choices" are those that an earlier fit of the base made."""
        given = dict(options or {})
        base_choices = given.pop("base_choices", {})
        settings = read_options(cls.OPTIONS, given)
        check_inside_picture(observations, image_size)
        flat = tuple(o if o.z_mm == 0 else replace(o, points=o.points[:0]) for o in observations)
        base_fitter = FITTERS[settings["base"]]
        base_options = {o.name for o in base_fitter.OPTIONS}
        base_fit = base_fitter.fit(flat, field, region, image_size,
                                   {**{k: v for k, v in settings.items() if k in base_options}, **base_choices},
                                   lambda fraction, message: progress(0.6 * fraction, message))
        base = base_fit.model
        clicks = gather_clicks(flat, field, region, base)
        progress(0.7, "Fitting the spline")
        reachable = np.all(np.isfinite(clicks.base), axis=1) & np.all(np.isfinite(clicks.stretch), axis=(1, 2))
        if reachable.mean() < 1 - MAX_OUTLIER_SHARE or (not settings["robust"] and not reachable.all()):
            raise FitFailed(say("refused.beyond-base", "Points are beyond the horizon of the base model."),
                            say("refused.beyond-base.fix",
                                "Check the line of each point, or choose another base model."), reason="no-camera")
        fine = reachable.copy()
        smoothing = settings["smoothing"]
        if settings["robust"]:
            fine[reachable] = _inliers(clicks.only(reachable), base, smoothing)
        fitted = _fit_spline(clicks.only(fine), base, smoothing)
        smoother, smoothing = fitted.smoother, fitted.smoothing
        reach = unfolded_reach(base, fitted.spline)
        if not reach:
            raise _folding_error()
        model = ThinPlate.of(base, fitted.spline, reach)
        inliers = inlier_masks(observations, clicks.owners, fine)
        warnings = [_outlier_warning(observations, i, k, pixel, model, clicks.features)
                    for (i, k), ok, pixel in zip(clicks.owners, fine, clicks.raw, strict=True) if not ok]
        warnings += elevated_point_warnings(observations, say("who.thin-plate", "a thin-plate spline"))
        noise = ("click_sigma_px", "line_sigmas_mm")
        base_choices = {k: v for k, v in base_fit.notes.get("choices", {}).items() if k not in noise}
        found = len(base_fit.parameter_names) or int(base_fit.notes.get("parameters", 0))
        notes = {"parameters": found + round(smoother.effective_parameters(smoothing)),
                 "base": {"name": base.NAME, **{k: v for k, v in base_fit.notes.items() if k != "choices"}},
                 "smoothing": {"value": smoothing, "effective_parameters": smoother.effective_parameters(smoothing),
                               "chosen": settings["smoothing"] is None},
                 "click_sigma_px": settings["click_sigma_px"] or smoother.sigma_px(smoothing),
                 "choices": {"base": base.NAME, "smoothing": smoothing, "base_choices": base_choices}}
        covariance = _covariance(base_fit, clicks.only(fine), fitted, settings["click_sigma_px"])
        return Fit(model, inliers, tuple(o.z_mm == 0 for o in observations), tuple(warnings), notes,
                   covariance=covariance, parameter_names=NODE_NAMES)


def _covariance(base_fit: Fit, clicks: Clicks, fitted: _FittedSpline, sigma_px: float | None,
                *, unseen: bool = True) -> Array | None:
    """Return the covariance of the displacement at the lattice; see uncertainty.py."""
    trusted = np.array([base_fit.inliers[i][k] for i, k in clicks.owners])[fitted.index]
    return node_covariance(base_fit, clicks.base[fitted.index], trusted, fitted.constraints, fitted.smoother,
                           fitted.smoothing, fitted.spline, sigma_px, unseen=unseen)


def _folding_error() -> FitFailed:
    return FitFailed(say("refused.folds", "The spline folds the image."), say(
        "refused.folds.fix", "Increase the smoothing, check the points for outliers, or choose a base model that fits "
        "better."), reason="folds")


def _inliers(clicks: Clicks, base: CameraModel, smoothing: float | None) -> Mask:
    """Return (n,) clicks that the spline through the others explains; the worst are taken out first."""
    fine = np.ones(len(clicks.raw), bool)
    while True:
        left = clicks.only(fine)
        constraints, _, index = constraints_of(left, base, left.base)
        smoother = SmoothingSplines(constraints)
        chosen = smoother.robust_cross_validated() if smoothing is None else max(smoothing, 1e-9)
        free_share = smoother.free_share(chosen)
        residual = smoother.residuals(chosen)
        off = largest_per_click(residual / free_share, index, len(left.raw))  # px, if it were left out
        student = largest_per_click(residual / np.sqrt(free_share), index, len(left.raw))  # px, of equal σ
        sigma = max(1.4826 * float(np.median(student)), MIN_SPREAD_PX)
        bad = (student > OUTLIER_SIGMAS * sigma) & (off > MIN_OUTLIER_PX)
        if not bad.any():
            break
        bad &= student > 0.5 * student.max()  # lesser ones may only be pulled by the worst
        fine[np.flatnonzero(fine)[bad]] = False
        if (~fine).sum() > MAX_OUTLIER_SHARE * fine.size:
            return np.ones_like(fine)  # that many are no outliers
    out = np.flatnonzero(~fine)
    if out.size:  # a click beside an outlier may have gone with it; what the others predict comes back
        constraints, _, index = constraints_of(clicks, base, clicks.base)
        displaced = smoother.spline(chosen)(constraints.places)
        error = (constraints.values - np.einsum("ni,ni->n", constraints.directions, displaced)) * constraints.weights
        fine[out] = largest_per_click(error, index, len(fine))[out] <= max(OUTLIER_SIGMAS * sigma, MIN_OUTLIER_PX)
    return fine


def _fit_spline(clicks: Clicks, base: CameraModel, smoothing: float | None) -> _FittedSpline:
    """Fit the spline and the clicks' places along their lines in turn, until both stand still."""
    guess, (middle, unit) = clicks.base, spline_frame(base)
    for round_number in range(ROUNDS):
        constraints, places, index = constraints_of(clicks, base, guess)
        if round_number < CHOOSING:
            smoother = SmoothingSplines(constraints)
            chosen = smoother.cross_validated() if smoothing is None else smoothing
            spline = smoother.spline(chosen)
        else:
            spline = spline_through(constraints, smoother.strength(chosen))
        with np.errstate(all="ignore"):
            following = clicks.base - spline((places - middle) / unit)
        if not (np.abs(following) < MAX_COORDINATE).all():
            raise _folding_error()
        moved = np.abs(following - guess).max()
        guess = following
        if moved < STILL_PX:
            break
    return _FittedSpline(spline, smoother, float(chosen), constraints, index)


def _outlier_warning(observations: Observations, i: int, k: int, pixel: Points, model: ThinPlate,
           features: tuple[Feature, ...]) -> Warning:
    place = model.field_from_corrected(model.corrected_from_raw(pixel))
    foot = model.raw_from_corrected(model.corrected_from_field(features[i].nearest(place)))
    far = np.linalg.norm(foot - pixel)
    where = (say("outlier.others", "is {px:.1f} px from the position predicted by the other points", px=far)
             if np.isfinite(far) else say("outlier.beyond-field", "is beyond the field"))
    return outlier_warning(observations, i, k, where)
