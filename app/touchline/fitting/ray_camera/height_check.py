"""The entered camera height against what the points alone say of it: neither is believed where they contradict.

A wrong height bends focal length and lens until the points fit again, and hides itself: the noise is learned larger,
and good points are outliers. So the fit is made once more from where it ended, without the height, with a noise of its
own. How far the two are apart is the lesser of two measures: by σ of both, and by the likelihood ratio under that
noise, √(least cost with the height - without). Where height and focal length trade, the valley is bent, and σ at one
place is not that of the next.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from typing_extensions import TypedDict

from touchline.core.errors import FitFailed
from touchline.core.records import Warning
from touchline.core.statements import say
from touchline.fitting.ray_camera.camera_prior import HEIGHT_SIGMA
from touchline.fitting.ray_camera.parameters import RayCameraParameters
from touchline.fitting.ray_camera.problem import ScalarPrior
from touchline.fitting.ray_camera.search import NEAR, RayFitProblem, RayFitResult, minimum_near, solve

CONTRADICTED_SIGMAS = 3.0
CHECKED_SHARE = 0.1  # of the height: where so much would not be seen, it has not been checked

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

    told: HeightJson
    alone: Result | None = None

    @property
    def is_contradicted(self) -> bool:
        return self.told["state"] == "contradicted"

    def warnings(self) -> list[Warning]:
        if not self.is_contradicted:
            return []
        told = (self.told["points_mm"], self.told["points_sigma_mm"], self.told["entered_mm"])
        points_m, sigma_m, entered_m = ((mm or 0.0) / 1000 for mm in told)
        return [Warning("height-contradicted", say(
            "warning.height-contradicted", "The points give a camera height of {points_m:.2f} ± {sigma_m:.2f} m; "
            "{entered_m:.2f} m was entered.", points_m=points_m, sigma_m=sigma_m, entered_m=entered_m), say(
            "warning.height-contradicted.fix", "Measure the height again, from the carpet to the lens. If it is "
            "correct, check the field size and the lens. Otherwise remove it, so that the points determine it."))]


def check_height(task: RayFitProblem, found: Result, settings: Mapping[str, Any]) -> HeightCheck:
    """Compare the height of a fit's priors with the one that the points alone give. task: with all points."""
    entered = next((p for p in task.priors if p.name == "height"), None)
    if entered is None:
        height, sigma = _height(found)
        return HeightCheck(HeightJson(entered_mm=None, entered_sigma_mm=None, points_mm=height, points_sigma_mm=sigma,
                                      sigmas=None, state="estimated"))
    told = HeightJson(entered_mm=entered.value, entered_sigma_mm=entered.sigma, points_mm=None, points_sigma_mm=None,
                      sigmas=None, state="not-checked")
    # so wide that it only keeps the search in sight
    anywhere = ScalarPrior("log_height", float(np.log(entered.value)), HEIGHT_SIGMA)
    try:
        alone = solve(task.with_prior("height", anywhere), found.minimum.state, settings)
        height, sigma = _height(alone)
    except FitFailed:
        return HeightCheck(told)
    both = replace(alone.task, priors=(*alone.task.priors, entered))
    both.problem.places = np.empty(0)
    taped = minimum_near(both, found.minimum.state, alone.sigma_px * float(np.sqrt(alone.correlation)), 0,
                         tolerance=NEAR)
    spread = float(np.hypot(sigma, entered.sigma))
    sigmas = min(float(np.sqrt(max(taped.cost - alone.minimum.cost, 0.0))), abs(height - entered.value) / spread)
    told |= {"points_mm": height, "points_sigma_mm": sigma, "sigmas": sigmas}
    if sigmas > CONTRADICTED_SIGMAS:
        told["state"] = "contradicted"
    elif CONTRADICTED_SIGMAS * spread <= CHECKED_SHARE * entered.value:
        told["state"] = "agrees"
    return HeightCheck(told, alone)


def _height(found: Result) -> tuple[float, float]:
    """Return the height of a fit and its σ, mm."""
    column = found.free_names.index("height")
    return float(found.minimum.state.position_mm[2]), float(np.sqrt(found.covariance[column, column]))
