"""The weakest direction in the parameters: named, in millimetres, and with a fix.

The information matrix says how well each combination of parameters is known. The combination that costs most at hat
height is found as an eigenvector, named by the parameters that make it up, and weighed again with the cure in place.
"""

from dataclasses import dataclass

import numpy as np

from touchline.core.field import HAT_MM, Region
from touchline.core.geometry import Array, with_z
from touchline.core.records import Fit, Warning
from touchline.core.statements import Sentence, say
from touchline.evaluate.fit.uncertainty import expected_error, grid_over
from touchline.fitting import sensitivity_of
from touchline.models import RayModel

WARN_MM = 5.0  # expected error, rms over the field, from which the operator is told
TAPE_MM = 30.0  # how well a height is taped

GROUPS = {"log_focal": "focal length", "aspect": "pixel aspect", "centre_x": "lens centre",
          "centre_y": "lens centre", "turn_x": "tilt", "turn_y": "tilt", "turn_z": "rotation", "x": "position",
          "y": "position", "height": "height"}
NAMES = {part: say(f"parameter.{part.replace(' ', '-')}", part) for part in (
    *GROUPS.values(), "lens", "perspective")}


@dataclass(frozen=True)
class WeakDirection:
    """The costliest combination of parameters, one σ of it: what it is made of and what it costs, mm rms."""

    parts: tuple[str, ...]
    carpet_mm: float
    hat_mm: float
    taped_hat_mm: float


def weakest_direction(fit: Fit, region: Region, hat_height_mm: float = HAT_MM) -> WeakDirection | None:
    """The combination that costs most at hat height (on the carpet, for a model without rays)."""
    sensitivity = sensitivity_of(fit.model)
    if sensitivity is None or fit.covariance is None:
        return None
    z = hat_height_mm if isinstance(fit.model, RayModel) else 0.0
    by = sensitivity.field_jacobian(with_z(grid_over(region).reshape(-1, 2), z), fit.parameter_names)
    flat = by.reshape(-1, by.shape[-1])
    flat = flat[np.isfinite(flat).all(axis=1)]
    if not len(flat):
        return None
    root = _root(fit.covariance)
    _, vectors = np.linalg.eigh(root.T @ flat.T @ flat @ root)
    direction = root @ vectors[:, -1]
    share = np.abs(direction) * np.linalg.norm(flat, axis=0)
    strong = np.argsort(share)[::-1]
    parts: list[str] = []
    for index in strong[share[strong] > 0.3 * share.max()]:
        part = GROUPS.get(fit.parameter_names[index], "lens" if isinstance(fit.model, RayModel) else "perspective")
        if part not in parts:
            parts.append(part)
    taped = _with_taped_height(fit.covariance, fit.parameter_names)
    return WeakDirection(tuple(parts), expected_error(fit, region).rms, expected_error(fit, region, z).rms,
                         expected_error(fit, region, z, covariance=taped).rms)


def _root(covariance: Array) -> Array:
    values, vectors = np.linalg.eigh((covariance + covariance.T) / 2)
    return vectors * np.sqrt(np.maximum(values, 0))


def _with_taped_height(covariance: Array, names: tuple[str, ...]) -> Array:
    """The covariance if the height were known to TAPE_MM: one measurement more (Sherman–Morrison)."""
    if "height" not in names:
        return covariance
    column = covariance[:, names.index("height")]
    return covariance - np.outer(column, column) / (TAPE_MM**2 + column[names.index("height")])


def observability_warnings(fit: Fit, region: Region, hat_height_mm: float = HAT_MM) -> list[Warning]:
    """Warn where the weak direction costs more than WARN_MM on the carpet or at hat height."""
    weak = weakest_direction(fit, region, hat_height_mm)
    if weak is None or max(weak.carpet_mm, weak.hat_mm) <= WARN_MM:
        return []
    rays = isinstance(fit.model, RayModel)
    cost = say("cost.carpet", "{mm:.1f} mm on the carpet", mm=weak.carpet_mm)
    if rays:
        cost = say("cost.robot-tops", "{mm:.1f} mm on the carpet, {tops_mm:.0f} mm at robot-top height "
                   "({height_mm:g} mm)", mm=weak.carpet_mm, tops_mm=weak.hat_mm, height_mm=hat_height_mm)
    if weak.taped_hat_mm < 0.7 * weak.hat_mm and {"focal length", "height"} & set(weak.parts):
        return [Warning("height-unknown",
                        say("warning.height-unknown",
                            "The points cannot separate height and focal length. Expected error: {cost}.", cost=cost),
                        say("warning.height-unknown.fix",
                            "Measure and enter the camera height (± {cm:.0f} cm is enough). This reduces the "
                            "error at robot tops from {mm:.0f} to {measured_mm:.1f} mm. Four points at a known height, "
                            "or a board calibration of the lens, also help.", cm=TAPE_MM / 10, mm=weak.hat_mm,
                            measured_mm=weak.taped_hat_mm))]
    return [Warning("weakly-determined", _not_determined(weak.parts, cost), say(
        "warning.weakly-determined.board.fix", "Add points all over the image, first at the suggested next point, or "
        "use a lens from a board calibration.") if rays else say(
        "warning.weakly-determined.fix", "Add points all over the image, first at the suggested next point, or use a "
        "lens model."))]


def _not_determined(parts: tuple[str, ...], cost: Sentence) -> Sentence:
    *others, last = (NAMES[part] for part in parts)
    if not others:
        return say("warning.weakly-determined.one", "The points do not determine {part} well. Expected error: {cost}.",
                   part=last, cost=cost)
    return say("warning.weakly-determined", "The points do not determine {parts} and {last} well. Expected error: "
               "{cost}.", parts=others, last=last, cost=cost)
