"""What a freer lens makes of the same points. A lens of one term, or none, bends as its formula says and not as glass
does: its residuals and expected error cannot tell how far off that is between the points."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from app.core.errors import TouchlineError
from app.core.field import Field, Region
from app.core.geometry import ImageSize, with_z
from app.core.records import Fit, Observations
from app.evaluate.fit.difference import difference_mm
from app.evaluate.fit.reach import reach_warnings
from app.evaluate.fit.residuals import rms
from app.evaluate.fit.uncertainty import grid_over
from app.fitting import FITTERS
from app.models import CameraModel, RayModel
from app.models.homography import Homography
from app.models.ray_camera import RayCamera

FREER = ("brown-conrady", "fisheye")
MIN_TERMS = 2  # of a lens that can bend as real ones do
OWN = ("terms", "lens", "lens_sigma")  # options that are about one lens


@dataclass(frozen=True)
class Contradiction:
    """How far the freer lens, by its title, places the field elsewhere: rms mm. hat_mm: None without rays."""

    title: str
    carpet_mm: float
    hat_mm: float | None


def is_rigid(fit: Fit, options: Mapping[str, Any] | None) -> bool:
    """Return whether the fit is of a lens of one term or of none, and found that lens by itself."""
    model = fit.model
    few = isinstance(model, Homography) or (isinstance(model, RayCamera) and len(model.lens_terms) < MIN_TERMS)
    return few and (options or {}).get("lens") is None


def freer_lens(observations: Observations, field: Field, region: Region, image_size: ImageSize,
               options: Mapping[str, Any] | None) -> RayCamera | None:
    """Fit the lenses that bend freely to the points; return the most probable one, None where none can be fitted."""
    fits = []
    for name in FREER:
        known = {option.name for option in FITTERS[name].OPTIONS} - set(OWN)
        try:
            fits.append(FITTERS[name].fit(observations, field, region, image_size, {
                key: value for key, value in (options or {}).items() if key in known}))
        except TouchlineError:
            continue
    reaching = [fit for fit in fits if not reach_warnings(fit.model, region, field.hat_height_mm)] or fits
    return max(reaching, key=lambda fit: fit.notes["log_evidence"]).model if fits else None


def contradiction(model: CameraModel, freer: RayCamera, region: Region, hat_height_mm: float) -> Contradiction | None:
    """Return how far apart the two are; None where they see nothing of the region both."""
    carpet_mm = rms(difference_mm(freer, model, region)[1].ravel())
    if carpet_mm is None:
        return None
    return Contradiction(freer.TITLE, carpet_mm, _hat_mm(freer, model, region, hat_height_mm)
                         if isinstance(model, RayModel) else None)


def _hat_mm(freer: RayModel, model: RayModel, region: Region, hat_height_mm: float) -> float | None:
    places = grid_over(region)
    there = model.unproject(freer.project(with_z(places, hat_height_mm)), hat_height_mm)
    return rms(np.linalg.norm(there - places, axis=-1).ravel())
