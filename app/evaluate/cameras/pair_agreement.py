"""Whether two calibrated cameras put the same thing at the same place, in mm, where both see the carpet.

Each model alone agrees with itself everywhere; only things seen by both can tell. Those are matches (a robot, a ball,
a mark), or lines and landmarks of the field clicked in both pictures: along a line each camera has its own distance
from the line, and the difference of the two, where both have clicks, is what a robot would jump by.

It cannot see an error that both share, such as a field measured wrongly.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from app.core.errors import FitFailed
from app.core.field import Field, Landmark, Line, Region
from app.core.geometry import Array, ImageSize, Points
from app.core.records import Observations
from app.fitting.two_view.fundamental_matrix import as_matches
from app.models import CameraModel, RayModel, field_from_raw, raw_from_field

CELLS = 24  # along the longer side of the map
NEAR_CELLS = 2.0  # how far from a measured place a cell still speaks of it


@dataclass(frozen=True, eq=False)
class Agreement:
    """places (n, 2) field mm, offset_mm (n, 2): where camera b puts the thing less where camera a does.

    which (n,): of the matches that were given, by their index.
    """

    places: Points
    offset_mm: Points
    which: Array

    @property
    def apart_mm(self) -> Array:
        return np.linalg.norm(self.offset_mm, axis=1)

    def to_json(self, overlap: "Overlap") -> dict[str, Any]:
        """Median, rms, worst and where, common shift, and a map over the overlap; plain JSON."""
        apart = self.apart_mm
        worst = int(np.argmax(apart))
        cells = overlap.filled(self.places, apart)
        known = np.isfinite(cells)
        shift = np.median(self.offset_mm, axis=0)
        return {"n": len(apart), "median_mm": float(np.median(apart)), "rms_mm": float(np.sqrt(np.mean(apart**2))),
                "max_mm": float(apart[worst]), "where": self.places[worst].tolist(),
                "shift_mm": shift.tolist(), "overlap_m2": overlap.area_mm2 / 1e6,
                "covered": float(known.sum() / max(overlap.both.sum(), 1)),
                "map": {"x": overlap.x.tolist(), "y": overlap.y.tolist(),
                        "mm": [[float(v) if np.isfinite(v) else None for v in row] for row in cells]}}


@dataclass(frozen=True, eq=False)
class Overlap:
    """A grid over the field: x (w,), y (h,) mm, both (h, w) bool where both cameras see the carpet."""

    x: Array
    y: Array
    both: Array

    @property
    def area_mm2(self) -> float:
        return float(self.both.sum() * self._cell[0] * self._cell[1])

    @property
    def _cell(self) -> tuple[float, float]:
        return float(self.x[1] - self.x[0]), float(self.y[1] - self.y[0])

    def filled(self, places: Points, values: Array) -> Array:
        """(h, w): at each shared cell the mean of the values near it, NaN where none is."""
        grid = np.stack(np.meshgrid(self.x, self.y), axis=-1)
        cells = (grid[:, :, None] - places) / np.array(self._cell)
        near = np.maximum(0.0, 1 - np.sum(cells**2, axis=-1) / NEAR_CELLS**2)  # falls to nothing at NEAR_CELLS
        with np.errstate(all="ignore"):
            mean = (near @ values) / near.sum(axis=-1)
        return np.where(self.both & (near.sum(axis=-1) > 0), mean, np.nan)


def overlap(a: CameraModel, size_a: ImageSize, b: CameraModel, size_b: ImageSize, field: Field) -> Overlap:
    """Where on the field both pictures show the carpet. FitFailed no-overlap where nowhere."""
    longer = max(field.length_mm, field.width_mm)
    counts = [max(2, round(CELLS * side / longer)) for side in (field.length_mm, field.width_mm)]
    x, y = ((np.arange(n) + 0.5) / n * side - side / 2 for n, side in zip(counts, (field.length_mm, field.width_mm),
                                                                        strict=True))
    grid = np.stack(np.meshgrid(x, y), axis=-1)
    both = _seen(a, size_a, grid) & _seen(b, size_b, grid)
    if not both.any():
        raise FitFailed("The two cameras see no common part of the field.",
                        "Choose cameras whose pictures overlap.", reason="no-overlap")
    return Overlap(x, y, both)


def _seen(model: CameraModel, size: ImageSize, places: Points) -> Array:
    raw = raw_from_field(model, places)
    with np.errstate(invalid="ignore"):
        return ((raw >= -0.5) & (raw <= np.array(tuple(size)) - 0.5)).all(axis=-1)


def from_matches(a: CameraModel, b: CameraModel, pixels_a: Points, pixels_b: Points,
                 z_mm: float | Array = 0.0) -> Agreement:
    """Agreement on the same things seen in both pictures, (n, 2) raw px each, at z_mm above the carpet.

    z_mm: of all, or (n,) of each, NaN where it is not known. Matches without a height are left out, and those that
    one camera cannot place; FitFailed where none remains.
    """
    pixels_a, pixels_b = as_matches(pixels_a, pixels_b)
    z = np.broadcast_to(np.asarray(z_mm, float), len(pixels_a))
    on_carpet, up = z == 0, np.isfinite(z) & (z != 0)
    at_a, at_b = (np.full((len(z), 2), np.nan) for _ in range(2))
    for model, pixels, places in ((a, pixels_a, at_a), (b, pixels_b, at_b)):
        places[on_carpet] = field_from_raw(model, pixels[on_carpet])
        if isinstance(model, RayModel):
            places[up] = model.unproject(pixels[up], z[up])
        elif not on_carpet.any() and up.any():
            raise FitFailed(f"A model without rays cannot place what is {z[up][0]:g} mm above the carpet.",
                            "Calibrate both cameras with a lens model.", reason="no-rays")
    return _agreement(at_a, at_b)


def from_observations(a: CameraModel, seen_a: Observations, b: CameraModel, seen_b: Observations, field: Field,
                      region_a: Region, region_b: Region) -> Agreement:
    """Agreement on lines and landmarks that were clicked in both pictures, on the carpet.

    A region's borders count as the field's lines they lie on, whatever each camera calls them.
    """
    at_a, at_b = [np.empty((0, 2))], [np.empty((0, 2))]
    for one in seen_a:
        feature = field.feature(one.feature, region_a)
        for other in seen_b:
            if one.z_mm or other.z_mm or not len(one.points) or not len(other.points):
                continue
            there = field.feature(other.feature, region_b)
            places_a, places_b = field_from_raw(a, one.points), field_from_raw(b, other.points)
            if isinstance(feature, Landmark) and isinstance(there, Landmark):
                if np.allclose(feature.position, there.position):
                    at_a.append(places_a.mean(axis=0, keepdims=True))
                    at_b.append(places_b.mean(axis=0, keepdims=True))
            elif isinstance(feature, Line) and isinstance(there, Line) and _same_line(feature, there):
                on_a, on_b = _along(feature, places_a, places_b)
                at_a.append(on_a)
                at_b.append(on_b)
    return _agreement(np.concatenate(at_a), np.concatenate(at_b))


def _same_line(one: Line, other: Line) -> bool:
    ends = np.array([other.start, other.end])
    return bool(np.linalg.norm(one.nearest(ends) - ends, axis=1).max() < 1.0)  # mm


def _along(line: Line, places_a: Points, places_b: Points) -> tuple[Points, Points]:
    """Where along the line both cameras have clicks: each camera's place of the line there, as pairs (n, 2)."""
    start, end = np.array(line.start), np.array(line.end)
    along = (end - start) / np.linalg.norm(end - start)
    across = np.array([-along[1], along[0]])
    tracks = []
    for places in (places_a, places_b):
        places = places[np.isfinite(places).all(axis=1)]
        order = np.argsort((places - start) @ along)
        tracks.append(((places[order] - start) @ along, (places[order] - start) @ across))
    (s_a, off_a), (s_b, off_b) = tracks
    if len(s_a) < 2 or len(s_b) < 2:
        return np.empty((0, 2)), np.empty((0, 2))
    shared = np.concatenate([s_a, s_b])
    shared = np.sort(shared[(shared >= max(s_a[0], s_b[0])) & (shared <= min(s_a[-1], s_b[-1]))])
    on = start + shared[:, None] * along
    return (on + np.interp(shared, s_a, off_a)[:, None] * across, on + np.interp(shared, s_b, off_b)[:, None] * across)


def _agreement(at_a: Points, at_b: Points) -> Agreement:
    fine = np.isfinite(at_a).all(axis=1) & np.isfinite(at_b).all(axis=1)
    if not fine.any():
        raise FitFailed("Nothing was seen by both cameras.", "Click the same lines or landmarks in both pictures, or "
                        "send matched points.", reason="nothing-shared")
    return Agreement((at_a[fine] + at_b[fine]) / 2, at_b[fine] - at_a[fine], np.flatnonzero(fine))
