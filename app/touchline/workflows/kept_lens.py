"""Whether the lens that a new pose keeps is still the camera's: a zoom would hide in the camera's height.

The lines are fitted again with the focal length free and everything else of the lens as before; those of the picture
that the calibration came from likewise, where it is stored: what is wrong with the lens or the paint is in both. A zoom
bends the picture otherwise than a lower camera does: by its distortion and, where the view is tilted, by its
perspective. Where neither is enough, σ is large, and it cannot be told.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from touchline.core.errors import FitFailed
from touchline.core.field import Field, Region
from touchline.core.records import Observations
from touchline.core.statements import Sentence, say
from touchline.fitting import FITTERS
from touchline.fitting.ray_camera.lens_prior import camera_intrinsics
from touchline.models.intrinsics import Intrinsics
from touchline.models.ray_camera import RayCamera

FREE = 0.1  # σ of the logarithm of a focal length that is free
SIGMAS = 5.0
MIN_ZOOM = 0.005  # a smaller one moves the field by few millimetres, and lines beside their places make as much
MUST_SHOW = 0.02  # or else the lens was not tested
UNKNOWN = float("nan")


@dataclass(frozen=True)
class ZoomCheck:
    """By which share the focal length is longer than before, as the lines have it, and its σ; NaN: no fit tells."""

    zoom: float
    sigma: float

    @classmethod
    def of(cls, lens: Intrinsics, earlier: Observations, now: Observations, field: Field, region: Region,
           options: Mapping[str, Any]) -> "ZoomCheck":
        """Compare the focal lengths that both sets of lines ask for.

        lens: as it was, with its covariance. earlier: lines of the calibration's own picture; none where it is gone,
        then the lens's own focal length counts. options: of the fit of the pose.
        """
        try:
            then = _focal(lens, earlier, field, region, options) if earlier else _own_focal(lens)
            after = _focal(lens, now, field, region, options)
        except FitFailed:
            return cls(UNKNOWN, UNKNOWN)
        return cls(after[0] - then[0], float(np.hypot(after[1], then[1])))

    @property
    def state(self) -> Literal["held", "refuted", "not-tested"]:
        if abs(self.zoom) > max(SIGMAS * self.sigma, MIN_ZOOM):
            return "refuted"
        return "held" if SIGMAS * self.sigma < MUST_SHOW else "not-tested"

    @property
    def changed(self) -> Sentence:
        return say("pose.zoomed", "The zoom or focus has changed: the focal length is {zoom:+.1f} ± {sigma:.1f} % off.",
                   zoom=100 * self.zoom, sigma=100 * self.sigma)

    @property
    def resolution(self) -> Sentence:
        return say("pose.zoom-held", "A zoom of {pct:.1f} % would show.",
                   pct=100 * max(SIGMAS * self.sigma, MIN_ZOOM))

    @property
    def untested(self) -> Sentence:
        if not np.isfinite(self.sigma):
            return say("pose.zoom-unknown", "Whether the zoom has changed could not be tested.")
        return say("pose.zoom-untested", "Whether the zoom has changed could not be tested: these lines would not show "
                   "a change of {pct:.0f} %.", pct=100 * min(SIGMAS * self.sigma, 1.0))

    def to_json(self) -> dict[str, Any]:
        pct, sigma = (round(100 * share, 3) if np.isfinite(share) else None for share in (self.zoom, self.sigma))
        return {"state": self.state, "pct": pct, "sigma_pct": sigma}


def _own_focal(lens: Intrinsics) -> tuple[float, float]:
    return float(np.log(lens.focal_px)), lens.sigma.get("log_focal", UNKNOWN)


def _focal(lens: Intrinsics, lines: Observations, field: Field, region: Region,
           options: Mapping[str, Any]) -> tuple[float, float]:
    """Return the logarithm of the focal length that the lines ask for, and its σ."""
    names = lens.estimated if "log_focal" in lens.estimated else ("log_focal", *lens.estimated)
    own = [names.index(name) for name in lens.estimated]
    covariance = np.zeros((len(names), len(names)))
    covariance[np.ix_(own, own)] = np.reshape(lens.covariance, (len(own), len(own)))
    covariance[names.index("log_focal"), names.index("log_focal")] += FREE**2
    free = replace(lens, estimated=names, covariance=tuple(tuple(row) for row in covariance.tolist()))
    fit = FITTERS[lens.model].fit(lines, field, region, lens.image_size, {
        **options, "lens": {"name": lens.model, "lens": free.to_json()}, "lens_sigma": "own"})
    assert isinstance(fit.model, RayCamera) and fit.covariance is not None
    found = camera_intrinsics(fit.model, {"names": fit.parameter_names, "matrix": fit.covariance.tolist()})
    return _own_focal(found)
