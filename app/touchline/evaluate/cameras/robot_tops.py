"""How far two calibrated cameras are apart at hat height: by matches there, else by what each camera's fit expects.

Lines and points on the carpet tell how the two differ there. Camera b sees a hat in the direction of the spot of carpet
behind it, shows that spot d beside where it expects it, and so puts the hat where that ray meets the height: d carried.
What the carpet cannot tell is that a camera stands higher or elsewhere than its calibration has it: each then puts all
hats aside along its own rays, though both agree on the carpet. Only its fit knows how large that may be, so

    apart² = |d carried|² + σ_a² + σ_b²        σ: the expected error at hat height (fit/uncertainty.py)

and where a calibration came without a covariance, nothing is told.
"""

from collections.abc import Callable
from typing import Literal

import numpy as np

from touchline.core.errors import TouchlineError
from touchline.core.field_json import field_from_json
from touchline.core.geometry import Array, ImageSize, Points, inside_picture, with_z
from touchline.core.records import Calibration
from touchline.evaluate.cameras.evidence import OffsetMeasurements
from touchline.evaluate.cameras.offsets import OffsetField, fit_offset_field
from touchline.evaluate.fit.covariance_json import fit_from_json
from touchline.evaluate.fit.uncertainty import expected_error
from touchline.models import CameraModel, RayModel, field_from_raw, model_of, raw_from_field

MIN_AT_HEIGHT = 10  # measures, two of a match: a shift, a turn and a scale with something left over

ExpectedAt = Callable[[Points], Array]  # of places (…, 2) mm at hat height: the error to expect there (…,) mm
HatFrom = Literal["carpet", "matches", "expected"]
HatUnknown = Literal["no-rays", "no-covariance", "not-seen"]


def expected_at_tops(calibration: Calibration) -> ExpectedAt | None:
    """Return the expected error at hat height of a calibration; None where it does not know it."""
    field = field_from_json(calibration.field)
    region = field.region(calibration.region, calibration.rotate)
    try:
        fit, stand_in = fit_from_json(calibration.covariance, model_of(calibration))
    except TouchlineError:
        return None
    return lambda places: expected_error(fit, region, field.hat_height_mm, places, stand_in=stand_in).sigma_mm


def carried_mm(a: CameraModel, size_a: ImageSize, b: CameraModel, size_b: ImageSize, z_mm: float, places: Points,
               found: OffsetField) -> Array:
    """Return how far the disagreement on the carpet, carried to z_mm, sets the cameras apart at places (…, 2) mm.

    NaN where it is not known or one of them does not see the place.
    """
    if not (isinstance(a, RayModel) and isinstance(b, RayModel)):
        return np.full(places.shape[:-1], np.nan)
    hats = with_z(places, z_mm)
    raw_a, raw_b = a.project(hats), b.project(hats)
    behind = field_from_raw(b, raw_b)  # the spot of carpet that the hat hides
    shift, _ = found.at(behind)
    apart = np.linalg.norm(b.unproject(raw_from_field(b, behind + shift), z_mm) - places, axis=-1)
    seen = inside_picture(raw_a, size_a) & inside_picture(raw_b, size_b)
    return np.where(seen & np.isfinite(found.known_mm(behind)[0]), apart, np.nan)


def apart_at_tops(a: CameraModel, b: CameraModel, z_mm: float, places: Points, carried: Array,
                  evidence: OffsetMeasurements, expected: tuple[ExpectedAt | None, ExpectedAt | None] | None,
                  ) -> tuple[Array | None, HatFrom | None, HatUnknown | None]:
    """Return how far the cameras are apart at places (…, 2) mm of the height z_mm, by what, and why nothing is known.

    carried: by carried_mm(); expected: None for one camera before and now.
    """
    if not (isinstance(a, RayModel) and isinstance(b, RayModel)):
        return None, None, "no-rays"
    seen = np.isfinite(carried)
    if not seen.any():
        return None, None, "not-seen"
    if expected is None:
        return carried, "carpet", None
    at_height = evidence.at_height(z_mm)
    if len(at_height) >= MIN_AT_HEIGHT:
        measured = np.where(seen, fit_offset_field(at_height).known_mm(places)[0], np.nan)
        if np.isfinite(measured).any():
            return measured, "matches", None
    one, other = expected
    if one is None or other is None:
        return None, None, "no-covariance"
    return np.sqrt(carried**2 + one(places) ** 2 + other(places) ** 2), "expected", None
