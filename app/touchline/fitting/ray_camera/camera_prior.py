"""What is known of a camera before it is calibrated: of its lens, of where it hangs, and of how true the field is.

Without these priors a lens's higher terms, its centre and the tilt compensate one another until nothing is left to see
in the residuals; with the lens's centre held in the picture's middle, they compensate that instead. Each prior is as
wide as real cameras differ (σ of published calibrations and data sheets), so that it costs nothing where the points
say better.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from touchline.core.field import Field
from touchline.core.geometry import ImageSize
from touchline.core.records import Warning
from touchline.core.sentences import marking_name
from touchline.core.statements import say
from touchline.fitting.ray_camera.parameters import RayCameraParameters
from touchline.fitting.ray_camera.problem import ScalarPrior
from touchline.models.lenses import Lens

CENTRE_SHARE = 0.012  # σ of the principal point about the picture's middle, of the picture's width
ASPECT_SIGMA = 0.002
FOCAL_SHARE, FOCAL_SIGMA = 0.85, 0.6  # of the picture's width, and σ of the logarithm: 78° webcams to 16-mm lenses
HEIGHT_SIGMA = 0.45  # of the logarithm
# by power of the radius, at the picture's corner: twice the rms of published calibrations, so that the strangest of
# them is no stranger than 2 σ
TERM_SIGMAS = {1: 2e-3, 2: 0.4, 4: 0.3, 6: 0.2, 8: 0.1}
MAX_TANGENT = 1.2
ABSURD_SIGMAS = 2.5
MISPLACED_SIGMAS = 6.0  # of the field's own σ: 18 mm where it says 3, which no painter and no tape is off
NAMED_LINES = 3


def usual_height_mm(field: Field) -> float:
    """Return the height at which cameras hang over a field: 2.4 m over a table, 5 m over nine metres, 6 m in a hall."""
    return 1900.0 + 0.35 * field.length_mm


def camera_priors(lens: type[Lens], terms: tuple[str, ...], settings: Mapping[str, Any], field: Field,
                  image_size: ImageSize, focal_px: float, known: tuple[str, ...] = ()) -> tuple[ScalarPrior, ...]:
    """Return the priors of a lens's parameters. known: those that the options tell otherwise."""
    # the tangent of the angle off the axis in the corner, or as far out as fields are seen
    corner = min(float(np.hypot(*image_size)) / 2 / focal_px, MAX_TANGENT)
    priors = [ScalarPrior("log_focal", float(np.log(FOCAL_SHARE * image_size.width)), FOCAL_SIGMA)]
    if settings["aspect_sigma"] > 0:
        priors.append(ScalarPrior("aspect", 1.0, settings["aspect_sigma"]))
    sigma_px = centre_sigma_px(settings, image_size)
    if sigma_px > 0:
        priors += [ScalarPrior(name, c, sigma_px) for name, c in zip(("centre_x", "centre_y"), image_size.centre,
                                                                     strict=True)]
    for name in terms:
        power = lens.power(name)
        priors.append(ScalarPrior(name, 0.0, TERM_SIGMAS[power] / corner**power))
    if settings["height_mm"]:
        priors.append(ScalarPrior("height", settings["height_mm"]["value"], settings["height_mm"]["sigma"]))
    else:
        priors.append(ScalarPrior("log_height", float(np.log(usual_height_mm(field))), HEIGHT_SIGMA))
    return tuple(p for p in priors if p.name not in known)


def unusual_camera_warnings(state: RayCameraParameters, priors: Sequence[ScalarPrior], image_size: ImageSize,
                            field: Field) -> list[Warning]:
    """Warn of each unknown that ended where hardly a camera's is: ABSURD_SIGMAS or more from its prior."""
    values = {**state.values(), "log_height": float(np.log(max(state.position_mm[2], 1.0)))}
    away = {p.name: (values[p.name] - p.value) / p.sigma for p in priors if p.name in values}
    warnings = []
    if abs(away.get("log_height", 0.0)) > ABSURD_SIGMAS:
        warnings.append(Warning(
            "unusual-height",
            say("warning.unusual-height", "The fitted camera height is {m:.1f} m; about {typical_m:.1f} m is typical "
                "for this field.", m=state.position_mm[2] / 1000, typical_m=usual_height_mm(field) / 1000),
            say("warning.unusual-height.fix",
                "Check the field type and the covered area, or measure and enter the camera height.")))
    if abs(away.get("log_focal", 0.0)) > ABSURD_SIGMAS:
        angle = 2 * np.degrees(np.arctan(image_size.width / 2 / np.exp(state.log_focal)))
        warnings.append(Warning(
            "unusual-focal-length",
            say("warning.unusual-focal-length", "The fitted lens covers {deg:.0f}° across the image; 40° to 90° is "
                "typical.", deg=angle),
            say("warning.unusual-focal-length.fix",
                "Check the field type and the covered area, or calibrate the lens with a board.")))
    off_px = float(np.hypot(*(state.centre_px - np.array(image_size.centre))))
    if np.hypot(away.get("centre_x", 0.0), away.get("centre_y", 0.0)) > ABSURD_SIGMAS:
        warnings.append(Warning(
            "unusual-principal-point",
            say("warning.unusual-principal-point", "The fitted principal point is {px:.0f} px from the image centre.",
                px=off_px),
            say("warning.unusual-principal-point.fix", "If the image was cropped, set centre_sigma_px to the size of "
                "the cut. Otherwise check the line of each point.")))
    if abs(away.get("aspect", 0.0)) > ABSURD_SIGMAS:
        warnings.append(Warning(
            "unusual-aspect",
            say("warning.unusual-aspect", "The fitted pixels are {times:.3f} times as high as wide.",
                times=state.aspect),
            say("warning.unusual-aspect.fix",
                "If the image was stretched, increase aspect_sigma. Otherwise check the field size.")))
    return warnings


def misplaced_line_warnings(offsets_mm: Mapping[str, float], usual_mm: float) -> list[Warning]:
    """Warn of lines that the picture shows where the field has none: another field, or another size of it.

    offsets_mm: by marking, across it. usual_mm: σ of lines about their places. Points on such lines alone cannot say
    that it is not the lens; σ of the lines grows until they are allowed, and what they tell is told as poor.
    """
    far = sorted(((abs(mm), name) for name, mm in offsets_mm.items() if abs(mm) > MISPLACED_SIGMAS * usual_mm),
                 reverse=True)
    if not far:
        return []
    named = [say("line-by", "{line} by {mm:.0f} mm", line=marking_name(name), mm=mm) for mm, name in far[:NAMED_LINES]]
    return [Warning("misplaced-lines", say(
        "warning.misplaced-lines", "Lines in the image are not where the field model has them: {lines}.", lines=named),
        say("warning.misplaced-lines.fix",
            "Check the field type. If it is correct, measure these lines and correct the field."))]


def centre_sigma_px(settings: Mapping[str, Any], image_size: ImageSize) -> float:
    given = settings["centre_sigma_px"]
    return CENTRE_SHARE * image_size.width if given is None else given
