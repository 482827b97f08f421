"""A lens's distortion as a prior: found from straight lines, before a field is clicked, at whatever focal length.

Straight lines leave the focal length open, and the terms of a camera's lens depend on it (distortion.py). So what is
known is not a lens but a condition on terms and focal length together:

    term · (unit / f)^power = its value ± σ,    one for each term, all with one covariance

The clicks then determine the focal length, and the lines the terms.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from touchline.core.errors import BadInput
from touchline.core.geometry import Array, ImageSize
from touchline.fitting.ray_camera.lens_prior import GaussianPrior, refuse_other_camera
from touchline.fitting.ray_camera.parameters import RayCameraParameters
from touchline.models.distortion import LINE_LENSES, Distortion

FIXED_SIGMA = 1e-3  # of its σ, for a distortion that is to be fixed
CENTRE = ("centre_x", "centre_y")


@dataclass(frozen=True, eq=False)
class DistortionEstimate:
    """A lens from straight lines with its covariance; names: of terms (per unit), perhaps of the centre (px)."""

    distortion: Distortion
    names: tuple[str, ...]
    covariance: Array

    def to_json(self) -> dict[str, Any]:
        return {**self.distortion.to_json(), "names": list(self.names), "covariance": self.covariance.tolist()}

    @classmethod
    def from_json(cls, value: Any) -> Self:
        """Read what to_json wrote; BadInput for anything else."""
        bend = Distortion.from_json(value)
        try:
            names, covariance = tuple(value["names"]), np.array(value["covariance"], float)
            known = (*LINE_LENSES[bend.name][1], *CENTRE)
            fine = (len(set(names)) == len(names) > 0 and set(names) <= set(known) and np.isfinite(covariance).all()
                    and covariance.shape == (len(names), len(names)) and (np.diag(covariance) >= 0).all())
            if not fine:
                raise ValueError
        except (KeyError, TypeError, ValueError, OverflowError):
            raise BadInput("The uncertainty of this lens from straight lines is unknown.",
                           "Give a lens as POST /motion saves it.", reason="bad-lens") from None
        return cls(bend, names, (covariance + covariance.T) / 2)

    @property
    def terms(self) -> tuple[str, ...]:
        return tuple(name for name in self.names if name not in CENTRE)


def read_distortion(model: str, settings: Mapping[str, Any], image_size: ImageSize) -> DistortionEstimate | None:
    """Read the lens from straight lines in the options, None for any other; BadInput if it is not this model's,
    or of another picture."""
    given = settings.get("lens")
    if given is None or "unit" not in given.get("lens", {}):
        return None
    lens = DistortionEstimate.from_json(given["lens"])
    refuse_other_camera(lens.distortion.name, lens.distortion.image_size, model, image_size, "found")
    return lens


def distortion_prior(lens: DistortionEstimate, settings: Mapping[str, Any]) -> GaussianPrior:
    """Return the prior of an estimate: fixed, or with its covariance."""
    own = dict(zip(lens.distortion.lens.TERMS, lens.distortion.terms, strict=True)) | dict(
        zip(CENTRE, lens.distortion.centre_px, strict=True))
    prior = GaussianPrior.of(lens.names, np.array([own[name] for name in lens.names]), lens.covariance,
                             lens.distortion.lens, lens.distortion.unit_px)
    return prior if settings.get("lens_sigma") == "own" else replace(prior, rows=prior.rows / FIXED_SIGMA)


def with_distortion(state: RayCameraParameters, lens: DistortionEstimate) -> RayCameraParameters:
    """Return the state with that distortion at its focal length."""
    estimate = lens.distortion.terms_for(float(np.exp(state.log_focal)))
    return replace(state, terms=np.array([estimate.get(name, 0.0) for name in state.lens.TERMS]),
                   centre_px=np.array(lens.distortion.centre_px))
