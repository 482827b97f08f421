"""How far two calibrated cameras are apart over the part of the carpet that both see, there and at hat height.

On the carpet it is |d(p)|, as far as it is known (rig_offsets.py). At a height the disagreement is carried: camera b
sees a hat in the direction of the spot of carpet behind it, shows that spot d beside where it expects it, and so puts
the hat where that ray meets the height. Exact for a camera that was turned; one moved by t is told a share
height / camera height too small.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from app.core.errors import FitFailed
from app.core.field import Field
from app.core.geometry import Array, ImageSize, Points
from app.evaluate.cameras.evidence import Evidence
from app.evaluate.cameras.offsets import Offsets, offsets
from app.models import CameraModel, RayModel, field_from_raw, raw_from_field

COARSE, FINE = 96, 40  # cells along the longer side: to find the shared part, and to draw it
NEAR_MM = 400.0  # so far from a measure the map rests on it
TWO = 2  # directions of the carpet


@dataclass(frozen=True, eq=False)
class Shared:
    """A grid over the part that both see: x (w,), y (h,) mm; both (h, w) bool."""

    x: Array
    y: Array
    both: Array

    @property
    def places(self) -> Points:
        return np.stack(np.meshgrid(self.x, self.y), axis=-1)

    @property
    def area_m2(self) -> float:
        cell = (self.x[1] - self.x[0]) * (self.y[1] - self.y[0])
        return float(self.both.sum() * cell / 1e6)


def shared_part(a: CameraModel, size_a: ImageSize, b: CameraModel, size_b: ImageSize, field: Field) -> Shared:
    """Where on the field both pictures show the carpet; FitFailed no-overlap where nowhere."""
    sides = (field.length_mm, field.width_mm)
    x, y = _cells([-s / 2 for s in sides], [s / 2 for s in sides], COARSE)
    both = _both(a, size_a, b, size_b, x, y)
    if not both.any():
        raise FitFailed("The two cameras see no common part of the field.",
                        "Choose cameras whose pictures overlap.", reason="no-overlap")
    half = np.array([x[1] - x[0], y[1] - y[0]]) / 2
    spans = [(axis[seen][0], axis[seen][-1]) for axis, seen in ((x, both.any(axis=0)), (y, both.any(axis=1)))]
    x, y = _cells([spans[0][0] - half[0], spans[1][0] - half[1]], [spans[0][1] + half[0], spans[1][1] + half[1]], FINE)
    return Shared(x, y, _both(a, size_a, b, size_b, x, y))


def _cells(low: list[float], high: list[float], count: int) -> tuple[Array, Array]:
    sides = np.subtract(high, low)
    counts = np.maximum(4, np.round(count * sides / sides.max())).astype(int)
    x, y = (start + (np.arange(n) + 0.5) / n * side for start, n, side in zip(low, counts, sides, strict=True))
    return x, y


def _both(a: CameraModel, size_a: ImageSize, b: CameraModel, size_b: ImageSize, x: Array, y: Array) -> Array:
    places = np.stack(np.meshgrid(x, y), axis=-1)
    return inside(raw_from_field(a, places), size_a) & inside(raw_from_field(b, places), size_b)


def inside(raw: Points, size: ImageSize) -> Array:
    """(…,) bool: whether raw px lie in a picture of that size."""
    with np.errstate(invalid="ignore"):
        return ((raw >= -0.5) & (raw <= np.array(tuple(size)) - 0.5)).all(axis=-1)


def agreement(a: CameraModel, size_a: ImageSize, b: CameraModel, size_b: ImageSize, field: Field,
              evidence: Evidence) -> dict[str, Any]:
    """Plain JSON: "carpet" and "hat" (None without rays) with map, mean, p95, max and where; what it rests on."""
    shared = shared_part(a, size_a, b, size_b, field)
    found = offsets(evidence)
    places = np.where(shared.both[..., None], shared.places, np.nan)
    carpet, directions = found.known_mm(places)
    if not np.isfinite(carpet).any():
        raise FitFailed("What both cameras saw tells too little about how far they are apart.",
                        "Give more: more lines or more matches, all over the part that both see.", reason="not-known")
    near = np.min([np.linalg.norm(places - place, axis=-1) for place in evidence.places[found.good]], axis=0,
                  initial=np.inf) <= NEAR_MM
    known = np.isfinite(carpet)
    return {"n": len(evidence), "believed": int(found.good.sum()), "noise_mm": found.residual_mm,
            "degree": found.degree, "both_directions": bool(np.median(directions[known]) == TWO),
            "overlap_m2": shared.area_m2, "covered": float((near & known).sum() / max(shared.both.sum(), 1)),
            "own_mm": {"a": _rms(evidence.own_a_mm[found.good]), "b": _rms(evidence.own_b_mm[found.good])},
            "shift_mm": [float(v) for v in np.mean(found.at(evidence.places)[0], axis=0)],
            "carpet": _told(shared, carpet, 0.0),
            "hat": _hat(a, size_a, b, size_b, field.hat_height_mm, shared, found)}


def _hat(a: CameraModel, size_a: ImageSize, b: CameraModel, size_b: ImageSize, z_mm: float, shared: Shared,
         found: Offsets) -> dict[str, Any] | None:
    if not (isinstance(a, RayModel) and isinstance(b, RayModel)):
        return None
    hats = np.concatenate([shared.places, np.full((*shared.both.shape, 1), z_mm)], axis=-1)
    raw_a, raw_b = a.project(hats), b.project(hats)
    both = inside(raw_a, size_a) & inside(raw_b, size_b)
    behind = field_from_raw(b, raw_b)  # the spot of carpet that the hat hides
    shift, _ = found.at(behind)
    known = np.isfinite(found.known_mm(behind)[0])
    apart = np.linalg.norm(b.unproject(raw_from_field(b, behind + shift), z_mm) - shared.places, axis=-1)
    apart = np.where(both & known, apart, np.nan)
    return _told(shared, apart, z_mm) if np.isfinite(apart).any() else None


def _told(shared: Shared, mm: Array, z_mm: float) -> dict[str, Any]:
    worst = np.unravel_index(np.nanargmax(mm), mm.shape)
    values = mm[np.isfinite(mm)]
    return {"z_mm": z_mm, "mean_mm": float(values.mean()), "p95_mm": float(np.percentile(values, 95)),
            "max_mm": float(values.max()), "where": [float(shared.x[worst[1]]), float(shared.y[worst[0]])],
            "map": {"x": shared.x.tolist(), "y": shared.y.tolist(),
                    "mm": [[float(v) if np.isfinite(v) else None for v in row] for row in mm]}}


def _rms(values: Array) -> float | None:
    values = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(values**2))) if values.size else None
