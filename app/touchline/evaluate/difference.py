"""How far two calibrations of one picture are apart, and what a lens with more terms makes of the same points.

What a lens with more terms makes of the points is asked, since a lens of one term, or none, bends as its formula says
and not as glass does; curves and splines know nothing between the points. Neither residuals nor expected error can tell
how far off that is; a lens that bends as real ones do can, where it explains the points as well.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from typing_extensions import TypedDict

from touchline.core.errors import TouchlineError
from touchline.core.field import Field, Region
from touchline.core.geometry import ImageSize, Points, with_z
from touchline.core.json_values import PointJson, nullable
from touchline.core.records import Fit, Observations
from touchline.evaluate.residuals import feature_residuals, largest, rms
from touchline.evaluate.uncertainty import grid_over, reach_warnings
from touchline.fitting import FITTERS, known_options
from touchline.fitting.ray_camera.lens_prior import camera_intrinsics
from touchline.models import CameraModel, RayModel, field_from_raw, raw_from_field
from touchline.models.intrinsics import lens_difference
from touchline.models.ray_camera import RayCamera

GRID = (25, 19)  # columns, rows over the region

MORE_TERMS = ("brown-conrady", "fisheye")
MIN_TERMS = 2  # of a lens that can bend as real ones do
EXPLAINS, EXPLAINS_PX = 3.0, 1.0  # how much worse than another model a reference may fit the points
OWN = ("terms", "lens", "lens_sigma")  # options that are about one lens


class DifferenceGrid(TypedDict):
    """By rows and columns: places in field mm, and how far apart the two have them, None out of reach."""

    places: list[list[PointJson]]
    mm: list[list[float | None]]
    mm_vector: list[list[list[float | None]]]
    px: list[list[float | None]]


class LensDifference(TypedDict):
    """The ratio of focal lengths, and how far pixels move where either lens may be turned."""

    focal_ratio: float
    max_px: float | None


class Difference(TypedDict):
    rms_mm: float | None
    median_mm: float | None
    max_mm: float | None
    worst_place: PointJson | None
    rms_px: float | None
    max_px: float | None
    grid: DifferenceGrid | None  # None where neither reaches what the other sees
    lens: LensDifference | None  # None without two lenses


def difference_vectors(
    one: CameraModel, other: CameraModel, region: Region
) -> tuple[Points, Points, np.ndarray]:
    """Over the region: places and differences (rows, columns, 2) mm, and distances in raw px; NaN out of reach.

    A place on the carpet goes through `one` to its pixel and through `other` back: mm. The same place through both to
    pixels: px.
    """
    places = grid_over(region, *GRID)
    pixels = raw_from_field(one, places)
    return (
        places,
        field_from_raw(other, pixels) - places,
        np.linalg.norm(raw_from_field(other, places) - pixels, axis=-1),
    )


def difference_mm(
    one: CameraModel, other: CameraModel, region: Region
) -> tuple[Points, np.ndarray, np.ndarray]:
    """The same with distances (rows, columns) in mm."""
    places, vectors, px = difference_vectors(one, other, region)
    return places, np.linalg.norm(vectors, axis=-1), px


def difference_report(one: CameraModel, other: CameraModel, region: Region) -> Difference:
    """Return the map with its rms, median, largest, and where that is; and how the lenses themselves differ."""
    places, vectors, px = difference_vectors(one, other, region)
    mm, lens = np.linalg.norm(vectors, axis=-1), _lens_json(one, other)
    if not np.isfinite(mm).any():
        return {
            "rms_mm": None,
            "median_mm": None,
            "max_mm": None,
            "worst_place": None,
            "rms_px": None,
            "max_px": None,
            "grid": None,
            "lens": lens,
        }
    worst = np.unravel_index(np.nanargmax(mm), mm.shape)
    return {
        "rms_mm": rms(mm.ravel()),
        "median_mm": float(np.nanmedian(mm)),
        "max_mm": float(mm[worst]),
        "worst_place": places[worst].tolist(),
        "rms_px": rms(px.ravel()),
        "max_px": largest(px),
        "grid": {
            "places": places.tolist(),
            "mm": nullable(mm),
            "mm_vector": nullable(vectors),
            "px": nullable(px),
        },
        "lens": lens,
    }


def _lens_json(one: CameraModel, other: CameraModel) -> LensDifference | None:
    if not (isinstance(one, RayCamera) and isinstance(other, RayCamera)):
        return None
    px = np.linalg.norm(lens_difference(camera_intrinsics(one), camera_intrinsics(other)), axis=-1)
    return {
        "focal_ratio": other.focal_px / one.focal_px,
        "max_px": float(np.nanmax(px)) if np.isfinite(px).any() else None,
    }


@dataclass(frozen=True)
class Contradiction:
    """How far the freer lens, by its title, places the field elsewhere: rms mm. hat_mm: None without rays."""

    freer: Fit
    carpet_mm: float
    robot_top_mm: float | None

    @property
    def title(self) -> str:
        return self.freer.model.TITLE


def bends_otherwise(fit: Fit, options: Mapping[str, Any] | None) -> bool:
    """Return whether the fit's model cannot bend as real lenses do, and no lens was given to it."""
    free = isinstance(fit.model, RayCamera) and len(fit.model.lens_terms) >= MIN_TERMS
    return not free and (options or {}).get("lens") is None


def freer_lens(
    observations: Observations,
    field: Field,
    region: Region,
    image_size: ImageSize,
    options: Mapping[str, Any] | None,
) -> Fit | None:
    """Fit the lenses that bend freely to the points; return the most probable one, None where none can be fitted."""
    fits = []
    for name in MORE_TERMS:
        others = {
            key: value for key, value in known_options(name, options).items() if key not in OWN
        }
        try:
            fits.append(FITTERS[name].fit(observations, field, region, image_size, others))
        except TouchlineError:
            continue
    reaching = [
        fit for fit in fits if not reach_warnings(fit.model, region, field.hat_height_mm)
    ] or fits
    return max(reaching, key=lambda fit: fit.notes["log_evidence"]) if fits else None


def contradiction(
    fit: Fit,
    reference: Fit,
    observations: Observations,
    field: Field,
    region: Region,
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
    return Contradiction(
        reference,
        carpet_mm,
        _robot_top_mm(freer, model, region, hat_height_mm) if isinstance(model, RayModel) else None,
    )


def explains(reference_px: float | None, own_px: float | None) -> bool:
    """Tell whether a reference with these residuals fits the points about as well as a model with those."""
    return (
        own_px is not None
        and reference_px is not None
        and reference_px <= EXPLAINS * own_px + EXPLAINS_PX
    )


def fit_rms_px(fit: Fit, observations: Observations, field: Field, region: Region) -> float | None:
    """Return the residuals of the points that a fit uses, rms px."""
    painted = field.as_painted(fit.notes, region)
    return rms(
        np.concatenate(
            [
                np.empty(0),
                *(
                    feature_residuals(fit.model, one, painted, region).px[fine]
                    for one, fine, used in zip(observations, fit.inliers, fit.used, strict=True)
                    if used
                ),
            ]
        )
    )


def _robot_top_mm(
    freer: RayModel, model: RayModel, region: Region, hat_height_mm: float
) -> float | None:
    places = grid_over(region)
    there = model.unproject(freer.project(with_z(places, hat_height_mm)), hat_height_mm)
    return rms(np.linalg.norm(there - places, axis=-1).ravel())
