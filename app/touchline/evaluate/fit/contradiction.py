"""What a freer lens makes of the same points.

A lens of one term, or none, bends as its formula says and not as glass does; curves and splines know nothing between
the points. Neither residuals nor expected error can tell how far off that is; a lens that bends as real ones do can,
where it explains the points as well.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from touchline.core.errors import TouchlineError
from touchline.core.field import Field, Region
from touchline.core.geometry import ImageSize, with_z
from touchline.core.records import Fit, Observations
from touchline.evaluate.fit.difference import difference_mm
from touchline.evaluate.fit.reach import reach_warnings
from touchline.evaluate.fit.residuals import feature_residuals, rms
from touchline.evaluate.fit.uncertainty import grid_over
from touchline.fitting import FITTERS, known_options
from touchline.models import RayModel
from touchline.models.ray_camera import RayCamera

FREER = ("brown-conrady", "fisheye")
MIN_TERMS = 2  # of a lens that can bend as real ones do
EXPLAINS, EXPLAINS_PX = 3.0, 1.0  # how much worse than another model a reference may fit the points
OWN = ("terms", "lens", "lens_sigma")  # options that are about one lens


@dataclass(frozen=True)
class Contradiction:
    """How far the freer lens, by its title, places the field elsewhere: rms mm. hat_mm: None without rays."""

    freer: Fit
    carpet_mm: float
    hat_mm: float | None

    @property
    def title(self) -> str:
        return self.freer.model.TITLE


def bends_otherwise(fit: Fit, options: Mapping[str, Any] | None) -> bool:
    """Return whether the fit's model cannot bend as real lenses do, and no lens was given to it."""
    free = isinstance(fit.model, RayCamera) and len(fit.model.lens_terms) >= MIN_TERMS
    return not free and (options or {}).get("lens") is None


def freer_lens(observations: Observations, field: Field, region: Region, image_size: ImageSize,
               options: Mapping[str, Any] | None) -> Fit | None:
    """Fit the lenses that bend freely to the points; return the most probable one, None where none can be fitted."""
    fits = []
    for name in FREER:
        others = {key: value for key, value in known_options(name, options).items() if key not in OWN}
        try:
            fits.append(FITTERS[name].fit(observations, field, region, image_size, others))
        except TouchlineError:
            continue
    reaching = [fit for fit in fits if not reach_warnings(fit.model, region, field.hat_height_mm)] or fits
    return max(reaching, key=lambda fit: fit.notes["log_evidence"]) if fits else None


def contradiction(fit: Fit, reference: Fit, observations: Observations, field: Field, region: Region,
                  ) -> Contradiction | None:
    """Return how far apart the two are; None where they see nothing of the region both.

    None as well where the reference explains the points much worse: no lens bends as a stretched picture does.
    """
    own_px, other_px = (fit_rms_px(one, observations, field, region) for one in (fit, reference))
    if not explains(other_px, own_px):
        return None
    model, freer, hat_height_mm = fit.model, reference.model, field.hat_height_mm
    carpet_mm = rms(difference_mm(freer, model, region)[1].ravel())
    if carpet_mm is None:
        return None
    return Contradiction(reference, carpet_mm, _hat_mm(freer, model, region, hat_height_mm)
                         if isinstance(model, RayModel) else None)


def explains(reference_px: float | None, own_px: float | None) -> bool:
    """Tell whether a reference with these residuals fits the points about as well as a model with those."""
    return own_px is not None and reference_px is not None and reference_px <= EXPLAINS * own_px + EXPLAINS_PX


def fit_rms_px(fit: Fit, observations: Observations, field: Field, region: Region) -> float | None:
    """Return the residuals of the points that a fit uses, rms px."""
    painted = field.as_painted(fit.notes, region)
    return rms(np.concatenate([np.empty(0), *(
        feature_residuals(fit.model, one, painted, region).px[fine] for one, fine, used in zip(
            observations, fit.inliers, fit.used, strict=True) if used)]))


def _hat_mm(freer: RayModel, model: RayModel, region: Region, hat_height_mm: float) -> float | None:
    places = grid_over(region)
    there = model.unproject(freer.project(with_z(places, hat_height_mm)), hat_height_mm)
    return rms(np.linalg.norm(there - places, axis=-1).ravel())
