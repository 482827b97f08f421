"""Whether two calibrated cameras put the same thing at the same place, in mm, where both see the carpet.

Each model alone agrees with itself everywhere; only things seen by both can tell. Those are matches (a robot, a ball,
a mark), or lines, arcs and landmarks of the field clicked in both pictures: along a line each camera has its own
distance from the line, and the difference of the two, where both have clicks, is what a robot would jump by.

It cannot see an error that both share, such as a field measured wrongly.
"""

from dataclasses import dataclass

import numpy as np
from typing_extensions import TypedDict

from touchline.core.errors import FitFailed
from touchline.core.field import Field, Landmark, Region
from touchline.core.geometry import Array, Indices, Points, root_mean_square
from touchline.core.json_values import PointJson
from touchline.core.records import Observations
from touchline.evaluate.cameras.evidence import along_marking, placed_matches, shared_clicks
from touchline.evaluate.cameras.shared_area import AreaMap, SharedArea
from touchline.models import CameraModel

CELLS = 24  # along the longer side of the map


class AgreementFigures(TypedDict):
    """where: the place of the largest; shift_mm: of both together; covered: of the shared area, what the map knows."""

    n: int
    median_mm: float
    rms_mm: float
    max_mm: float
    where: PointJson
    shift_mm: PointJson
    overlap_m2: float
    covered: float
    map: AreaMap


@dataclass(frozen=True, eq=False)
class PointAgreement:
    """places (n, 2) field mm, offset_mm (n, 2): where camera b puts the thing less where camera a does.

    which (n,): of the matches that were given, by their index.
    """

    places: Points
    offset_mm: Points
    which: Indices

    @property
    def apart_mm(self) -> Array:
        return np.linalg.norm(self.offset_mm, axis=1)

    def to_json(self, shared: SharedArea) -> AgreementFigures:
        apart = self.apart_mm
        worst = int(np.argmax(apart))
        cells = shared.filled(self.places, apart)
        known = np.isfinite(cells)
        shift = np.median(self.offset_mm, axis=0)
        return {"n": len(apart), "median_mm": float(np.median(apart)), "rms_mm": root_mean_square(apart),
                "max_mm": float(apart[worst]), "where": self.places[worst].tolist(), "shift_mm": shift.tolist(),
                "overlap_m2": shared.area_m2, "covered": float(known.sum() / max(shared.both.sum(), 1)),
                "map": shared.map_json(cells)}


def from_matches(a: CameraModel, b: CameraModel, pixels_a: Points, pixels_b: Points,
                 z_mm: float | Array = 0.0) -> PointAgreement:
    """Agreement on the same things seen in both pictures, (n, 2) raw px each, at z_mm above the carpet.

    z_mm: of all, or (n,) of each, NaN where it is not known. Matches without a height are left out, and those that
    one camera cannot place; FitFailed where none remains.
    """
    return _agreement(*placed_matches(a, b, pixels_a, pixels_b, z_mm))


def from_observations(a: CameraModel, seen_a: Observations, region_a: Region, b: CameraModel, seen_b: Observations,
                      region_b: Region, field: Field) -> PointAgreement:
    """Agreement on lines, arcs and landmarks that were clicked in both pictures, on the carpet."""
    at_a, at_b = [np.empty((0, 2))], [np.empty((0, 2))]
    for feature, places_a, places_b in shared_clicks(a, seen_a, region_a, b, seen_b, region_b, field):
        if isinstance(feature, Landmark):
            at_a.append(places_a.mean(axis=0, keepdims=True))
            at_b.append(places_b.mean(axis=0, keepdims=True))
        else:
            found = along_marking(feature, places_a, places_b)
            at_a.append(found.places + found.own_a_mm[:, None] * found.normals)
            at_b.append(found.places + found.own_b_mm[:, None] * found.normals)
    return _agreement(np.concatenate(at_a), np.concatenate(at_b))


def _agreement(at_a: Points, at_b: Points) -> PointAgreement:
    fine = np.isfinite(at_a).all(axis=1) & np.isfinite(at_b).all(axis=1)
    if not fine.any():
        raise FitFailed("The two cameras have no lines or points in common.",
                        "Mark the same lines or landmarks in both images, or send matched points.",
                        reason="nothing-shared")
    return PointAgreement((at_a[fine] + at_b[fine]) / 2, at_b[fine] - at_a[fine], np.flatnonzero(fine))
