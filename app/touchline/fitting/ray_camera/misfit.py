"""What no camera and no hand makes: residuals of many pixels, and pixels that are not square."""

from collections.abc import Mapping
from typing import Any

from touchline.core.errors import FitFailed
from touchline.core.geometry import ImageSize
from touchline.core.records import Warning
from touchline.core.statements import say
from touchline.fitting.ray_camera.camera_prior import ABSURD_SIGMAS
from touchline.fitting.ray_camera.parameters import RayCameraParameters
from touchline.fitting.ray_camera.problem import ScalarPrior
from touchline.fitting.ray_camera.search import RayFitProblem, RayFitResult, solve

CLICK_SHARE = 0.7 / 1280  # σ of a careless click, of the picture's width; real ones have 0.3 to 0.5 px of 1280
TOO_LARGE = 3.0  # of that, rms
ANOTHER_LENS = 2.0  # times the rms of a lens of their own
STRETCHED = 0.05  # σ of the aspect of a picture that was stretched
MIN_LIMIT_PX = 1.5  # what no image is too sharp for


def residual_warnings(rms_px: float, settings: Mapping[str, Any], image_size: ImageSize) -> list[Warning]:
    """Warn where the points without outliers lie further off, rms px, than they can have been marked.

    That is measured against what the options say of a click, or what clicks are like: σ as estimated from the points
    themselves grows with any misfit.
    """
    limit_px = _limit_px(settings, image_size)
    if rms_px <= limit_px:
        return []
    return [Warning("residuals-too-large", say(
        "warning.residuals-too-large", "The points are {px:.1f} px off; at most {limit_px:.1f} px is expected.",
        px=rms_px, limit_px=limit_px), say(
        "warning.residuals-too-large.fix", "If a lens was given, check that it is this camera's, at this focus and "
        "zoom. Otherwise check the field type and the line of each point, or try another lens model."))]


def _limit_px(settings: Mapping[str, Any], image_size: ImageSize) -> float:
    return max(TOO_LARGE * (settings["click_sigma_px"] or CLICK_SHARE * image_size.width), MIN_LIMIT_PX)


def given_lens_warnings(own_task: RayFitProblem, found: RayFitResult[RayCameraParameters],
                        settings: Mapping[str, Any], image_size: ImageSize) -> list[Warning]:
    """Warn where the points fit a lens of their own far better than the one that was given, and that not well.

    own_task: the same points, with the lens free. Above the limit of residual_warnings, that warns.
    """
    limit_px = _limit_px(settings, image_size)
    if not limit_px / 2 < found.rms_px <= limit_px:
        return []
    try:
        own = solve(own_task, found.minimum.state, settings)
    except FitFailed:
        return []
    if found.rms_px <= ANOTHER_LENS * own.rms_px:
        return []
    return [Warning("residuals-too-large", say(
        "warning.given-lens", "The points are {px:.1f} px off with the given lens, and {own_px:.1f} px with a lens of "
        "their own.", px=found.rms_px, own_px=own.rms_px), say(
        "warning.given-lens.fix", "Check that the lens is this camera's, at this focus and zoom, or remove it."))]


def without_square_pixels(task: RayFitProblem, found: RayFitResult[RayCameraParameters], settings: Mapping[str, Any],
                          ) -> RayFitResult[RayCameraParameters] | None:
    """Return what the points say where their pixels' aspect strains its prior and they may be stretched; else None.

    Held nearly square, height, tilt and lens bend to make up for it, and the covariance knows nothing of that.
    """
    prior = next((p for p in task.priors if p.name == "aspect"), None)
    if prior is None or abs(found.minimum.state.aspect - prior.value) <= ABSURD_SIGMAS * prior.sigma:
        return None
    wide = ScalarPrior("aspect", prior.value, max(STRETCHED, prior.sigma))
    try:
        return solve(task.with_prior("aspect", wide), found.minimum.state, settings)
    except FitFailed:
        return None
