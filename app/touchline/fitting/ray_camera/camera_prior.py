"""What is known of a camera before it is calibrated, and where its height or its points contradict that.

Without these priors a lens's higher terms, its centre and the tilt compensate one another until nothing is left to see
in the residuals; with the lens's centre held in the picture's middle, they compensate that instead. Each prior is as
wide as real cameras differ (σ of published calibrations and data sheets), so that it costs nothing where the points
say better.

A wrong height that was entered bends focal length and lens until the points fit again, and hides itself: the noise is
learned larger, and good points are outliers. So the fit is made once more from where it ended, without the height, with
a noise of its own. How far the two are apart is the lesser of two measures: by σ of both, and by the likelihood ratio
under that noise, √(least cost with the height - without). Where height and focal length trade, the valley is bent, and
σ at one place is not that of the next.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from typing_extensions import TypedDict

from touchline.core.errors import FitFailed
from touchline.core.field import Field
from touchline.core.geometry import ImageSize
from touchline.core.records import Warning
from touchline.core.sentences import marking_name
from touchline.core.statements import say
from touchline.fitting.ray_camera.parameters import RayCameraParameters
from touchline.fitting.ray_camera.problem import ScalarPrior
from touchline.fitting.ray_camera.search import (
    NEAR,
    RayFitProblem,
    RayFitResult,
    minimum_near,
    solve,
)
from touchline.models.lenses import Lens

CENTRE_SHARE = 0.012  # σ of the principal point about the picture's middle, of the picture's width
ASPECT_SIGMA = 0.002
# of the picture's width, and σ of the logarithm: 78° webcams to 16-mm lenses
FOCAL_SHARE, FOCAL_SIGMA = 0.85, 0.6
HEIGHT_SIGMA = 0.45  # of the logarithm
# by power of the radius, at the picture's corner: twice the rms of published calibrations, so that the strangest of
# them is no stranger than 2 σ
TERM_SIGMAS = {1: 2e-3, 2: 0.4, 4: 0.3, 6: 0.2, 8: 0.1}
MAX_TANGENT = 1.2
ABSURD_SIGMAS = 2.5
# of the field's own σ: 18 mm where it says 3, which no painter and no tape is off
MISPLACED_SIGMAS = 6.0
NAMED_LINES = 3

CONTRADICTED_SIGMAS = 3.0
CHECKED_SHARE = 0.1  # of the height: where so much would not be seen, it has not been checked

# σ of a careless click, of the picture's width; real ones have 0.3 to 0.5 px of 1280
CLICK_SHARE = 0.7 / 1280
TOO_LARGE = 3.0  # of that, rms
ANOTHER_LENS = 2.0  # times the rms of a lens of their own
STRETCHED = 0.05  # σ of the aspect of a picture that was stretched
MIN_LIMIT_PX = 1.5  # what no image is too sharp for


def usual_height_mm(field: Field) -> float:
    """Return the height at which cameras hang over a field: 2.4 m over a table, 5 m over nine metres, 6 m in a hall."""
    return 1900.0 + 0.35 * field.length_mm


def camera_priors(
    lens: type[Lens],
    terms: tuple[str, ...],
    settings: Mapping[str, Any],
    field: Field,
    image_size: ImageSize,
    focal_px: float,
    known: tuple[str, ...] = (),
) -> tuple[ScalarPrior, ...]:
    """Return the priors of a lens's parameters. known: those that the options tell otherwise."""
    # the tangent of the angle off the axis in the corner, or as far out as fields are seen
    corner = min(float(np.hypot(*image_size)) / 2 / focal_px, MAX_TANGENT)
    priors = [ScalarPrior("log_focal", float(np.log(FOCAL_SHARE * image_size.width)), FOCAL_SIGMA)]
    if settings["aspect_sigma"] > 0:
        priors.append(ScalarPrior("aspect", 1.0, settings["aspect_sigma"]))
    sigma_px = centre_sigma_px(settings, image_size)
    if sigma_px > 0:
        priors += [
            ScalarPrior(name, c, sigma_px)
            for name, c in zip(("centre_x", "centre_y"), image_size.centre, strict=True)
        ]
    for name in terms:
        power = lens.power(name)
        priors.append(ScalarPrior(name, 0.0, TERM_SIGMAS[power] / corner**power))
    if settings["height_mm"]:
        priors.append(
            ScalarPrior("height", settings["height_mm"]["value"], settings["height_mm"]["sigma"])
        )
    else:
        priors.append(
            ScalarPrior("log_height", float(np.log(usual_height_mm(field))), HEIGHT_SIGMA)
        )
    return tuple(p for p in priors if p.name not in known)


def unusual_camera_warnings(
    state: RayCameraParameters, priors: Sequence[ScalarPrior], image_size: ImageSize, field: Field
) -> list[Warning]:
    """Warn of each unknown that ended where hardly a camera's is: ABSURD_SIGMAS or more from its prior."""
    values = {**state.values(), "log_height": float(np.log(max(state.position_mm[2], 1.0)))}
    away = {p.name: (values[p.name] - p.value) / p.sigma for p in priors if p.name in values}
    warnings = []
    if abs(away.get("log_height", 0.0)) > ABSURD_SIGMAS:
        warnings.append(
            Warning(
                "unusual-height",
                say(
                    "warning.unusual-height",
                    "The fitted camera height is {m:.1f} m; about {typical_m:.1f} m is typical "
                    "for this field.",
                    m=state.position_mm[2] / 1000,
                    typical_m=usual_height_mm(field) / 1000,
                ),
                say(
                    "warning.unusual-height.fix",
                    "Check the field type and the covered area, or measure and enter the camera height.",
                ),
            )
        )
    if abs(away.get("log_focal", 0.0)) > ABSURD_SIGMAS:
        angle = 2 * np.degrees(np.arctan(image_size.width / 2 / np.exp(state.log_focal)))
        warnings.append(
            Warning(
                "unusual-focal-length",
                say(
                    "warning.unusual-focal-length",
                    "The fitted lens covers {deg:.0f}° across the image; 40° to 90° is typical.",
                    deg=angle,
                ),
                say(
                    "warning.unusual-focal-length.fix",
                    "Check the field type and the covered area, or calibrate the lens with a board.",
                ),
            )
        )
    off_px = float(np.hypot(*(state.centre_px - np.array(image_size.centre))))
    if np.hypot(away.get("centre_x", 0.0), away.get("centre_y", 0.0)) > ABSURD_SIGMAS:
        warnings.append(
            Warning(
                "unusual-principal-point",
                say(
                    "warning.unusual-principal-point",
                    "The fitted principal point is {px:.0f} px from the image centre.",
                    px=off_px,
                ),
                say(
                    "warning.unusual-principal-point.fix",
                    "If the image was cropped, set centre_sigma_px to the size of "
                    "the cut. Otherwise check the line of each point.",
                ),
            )
        )
    if abs(away.get("aspect", 0.0)) > ABSURD_SIGMAS:
        warnings.append(
            Warning(
                "unusual-aspect",
                say(
                    "warning.unusual-aspect",
                    "The fitted pixels are {times:.3f} times as high as wide.",
                    times=state.aspect,
                ),
                say(
                    "warning.unusual-aspect.fix",
                    "If the image was stretched, increase aspect_sigma. Otherwise check the field size.",
                ),
            )
        )
    return warnings


def misplaced_line_warnings(offsets_mm: Mapping[str, float], usual_mm: float) -> list[Warning]:
    """Warn of lines that the picture shows where the field has none: another field, or another size of it.

    offsets_mm: by marking, across it. usual_mm: σ of lines about their places. Points on such lines alone cannot say
    that it is not the lens; σ of the lines grows until they are allowed, and what they tell is told as poor.
    """
    far = sorted(
        (
            (abs(mm), name)
            for name, mm in offsets_mm.items()
            if abs(mm) > MISPLACED_SIGMAS * usual_mm
        ),
        reverse=True,
    )
    if not far:
        return []
    named = [
        say("line-by", "{line} by {mm:.0f} mm", line=marking_name(name), mm=mm)
        for mm, name in far[:NAMED_LINES]
    ]
    return [
        Warning(
            "misplaced-lines",
            say(
                "warning.misplaced-lines",
                "Lines in the image are not where the field model has them: {lines}.",
                lines=named,
            ),
            say(
                "warning.misplaced-lines.fix",
                "Check the field type. If it is correct, measure these lines and correct the field.",
            ),
        )
    ]


def centre_sigma_px(settings: Mapping[str, Any], image_size: ImageSize) -> float:
    given = settings["centre_sigma_px"]
    return CENTRE_SHARE * image_size.width if given is None else given


Result = RayFitResult[RayCameraParameters]
HeightState = Literal["agrees", "contradicted", "not-checked", "estimated"]


class HeightJson(TypedDict):
    """The camera's height: as entered, as the points alone have it, and how many σ of both they are apart.

    state: "estimated" where none was entered, "not-checked" where the points cannot tell a tenth of it.
    """

    entered_mm: float | None
    entered_sigma_mm: float | None
    points_mm: float | None
    points_sigma_mm: float | None
    sigmas: float | None
    state: HeightState


@dataclass(frozen=True, eq=False)
class HeightCheck:
    """alone: the fit without the entered height; None where none was entered, or the points give no camera."""

    figures: HeightJson
    alone: Result | None = None

    @property
    def is_contradicted(self) -> bool:
        return self.figures["state"] == "contradicted"

    def warnings(self) -> list[Warning]:
        if not self.is_contradicted:
            return []
        figures = (
            self.figures["points_mm"],
            self.figures["points_sigma_mm"],
            self.figures["entered_mm"],
        )
        points_m, sigma_m, entered_m = ((mm or 0.0) / 1000 for mm in figures)
        return [
            Warning(
                "height-contradicted",
                say(
                    "warning.height-contradicted",
                    "The points give a camera height of {points_m:.2f} ± {sigma_m:.2f} m; "
                    "{entered_m:.2f} m was entered.",
                    points_m=points_m,
                    sigma_m=sigma_m,
                    entered_m=entered_m,
                ),
                say(
                    "warning.height-contradicted.fix",
                    "Measure the height again, from the carpet to the lens. If it is "
                    "correct, check the field size and the lens. Otherwise remove it, so that the points determine it.",
                ),
            )
        ]


def check_height(task: RayFitProblem, found: Result, settings: Mapping[str, Any]) -> HeightCheck:
    """Compare the height of a fit's priors with the one that the points alone give. task: with all points."""
    entered = next((p for p in task.priors if p.name == "height"), None)
    if entered is None:
        height, sigma = _height(found)
        return HeightCheck(
            HeightJson(
                entered_mm=None,
                entered_sigma_mm=None,
                points_mm=height,
                points_sigma_mm=sigma,
                sigmas=None,
                state="estimated",
            )
        )
    figures = HeightJson(
        entered_mm=entered.value,
        entered_sigma_mm=entered.sigma,
        points_mm=None,
        points_sigma_mm=None,
        sigmas=None,
        state="not-checked",
    )
    # so wide that it only keeps the search in sight
    anywhere = ScalarPrior("log_height", float(np.log(entered.value)), HEIGHT_SIGMA)
    try:
        alone = solve(task.with_prior("height", anywhere), found.minimum.state, settings)
        height, sigma = _height(alone)
    except FitFailed:
        return HeightCheck(figures)
    both = replace(alone.task, priors=(*alone.task.priors, entered))
    both.problem.places = np.empty(0)
    taped = minimum_near(
        both,
        found.minimum.state,
        alone.sigma_px * float(np.sqrt(alone.correlation)),
        0,
        tolerance=NEAR,
    )
    spread = float(np.hypot(sigma, entered.sigma))
    sigmas = min(
        float(np.sqrt(max(taped.cost - alone.minimum.cost, 0.0))),
        abs(height - entered.value) / spread,
    )
    figures |= {"points_mm": height, "points_sigma_mm": sigma, "sigmas": sigmas}
    if sigmas > CONTRADICTED_SIGMAS:
        figures["state"] = "contradicted"
    elif CONTRADICTED_SIGMAS * spread <= CHECKED_SHARE * entered.value:
        figures["state"] = "agrees"
    return HeightCheck(figures, alone)


def _height(found: Result) -> tuple[float, float]:
    """Return the height of a fit and its σ, mm."""
    column = found.free_names.index("height")
    return float(found.minimum.state.position_mm[2]), float(
        np.sqrt(found.covariance[column, column])
    )


def residual_warnings(
    rms_px: float, settings: Mapping[str, Any], image_size: ImageSize
) -> list[Warning]:
    """Warn where the points without outliers lie further off, rms px, than they can have been marked.

    That is measured against what the options say of a click, or what clicks are like: σ as estimated from the points
    themselves grows with any misfit.
    """
    limit_px = _limit_px(settings, image_size)
    if rms_px <= limit_px:
        return []
    return [
        Warning(
            "residuals-too-large",
            say(
                "warning.residuals-too-large",
                "The points are {px:px} px off; at most {limit_px:px} px is expected.",
                px=rms_px,
                limit_px=limit_px,
            ),
            say(
                "warning.residuals-too-large.fix",
                "If a lens was given, check that it is this camera's, at this focus and "
                "zoom. Otherwise check the field type and the line of each point, or try another lens model.",
            ),
        )
    ]


def _limit_px(settings: Mapping[str, Any], image_size: ImageSize) -> float:
    return max(
        TOO_LARGE * (settings["click_sigma_px"] or CLICK_SHARE * image_size.width), MIN_LIMIT_PX
    )


def given_lens_warnings(
    own_task: RayFitProblem,
    found: RayFitResult[RayCameraParameters],
    settings: Mapping[str, Any],
    image_size: ImageSize,
) -> list[Warning]:
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
    return [
        Warning(
            "residuals-too-large",
            say(
                "warning.given-lens",
                "The points are {px:px} px off with the given lens, and {own_px:px} px with a lens of "
                "their own.",
                px=found.rms_px,
                own_px=own.rms_px,
            ),
            say(
                "warning.given-lens.fix",
                "Check that the lens is this camera's, at this focus and zoom, or remove it.",
            ),
        )
    ]


def without_square_pixels(
    task: RayFitProblem,
    found: RayFitResult[RayCameraParameters],
    settings: Mapping[str, Any],
) -> RayFitResult[RayCameraParameters] | None:
    """Return what the points say where their pixels' aspect strains its prior and they may be stretched; else None.

    Held nearly square, height, tilt and lens bend to make up for it, and the covariance knows nothing of that.
    """
    prior = next((p for p in task.priors if p.name == "aspect"), None)
    if (
        prior is None
        or abs(found.minimum.state.aspect - prior.value) <= ABSURD_SIGMAS * prior.sigma
    ):
        return None
    wide = ScalarPrior("aspect", prior.value, max(STRETCHED, prior.sigma))
    try:
        return solve(task.with_prior("aspect", wide), found.minimum.state, settings)
    except FitFailed:
        return None
