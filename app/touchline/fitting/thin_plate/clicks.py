"""Clicks as constraints on a thin-plate spline: each lies on the nearest place of its line."""

from dataclasses import dataclass, replace

import numpy as np

from touchline.core.field import Arc, Feature, Field, Landmark, Region
from touchline.core.geometry import Array, Indices, Mask, Points
from touchline.core.records import Observations
from touchline.fitting.clicks import first_of_each_place
from touchline.fitting.thin_plate.smoothing import Constraints
from touchline.models import CameraModel
from touchline.models.thin_plate import spline_frame

MAX_CLICKS = 400  # a spline through n clicks solves n × n equations, and every drawn pixel sums over n knots
HALF_PX = 0.5  # step of the derivative of the stretch of raw pixels


@dataclass(frozen=True, eq=False)
class Clicks:
    """raw, base (n, 2) px: as clicked, and as the base corrects them. feature (n,): index of the feature of each."""

    raw: Points
    base: Points
    stretch: Array  # (n, 2, 2) d base / d raw
    feature: Indices
    owners: Indices  # (n, 2) observation, point
    features: tuple[Feature, ...]

    def only(self, keep: Mask) -> "Clicks":
        return replace(self, raw=self.raw[keep], base=self.base[keep], stretch=self.stretch[keep],
                       feature=self.feature[keep], owners=self.owners[keep])


def gather_clicks(observations: Observations, field: Field, region: Region, base: CameraModel) -> Clicks:
    """Gather the clicks on the carpet, evenly thinned to MAX_CLICKS."""
    total = sum(len(o.points) for o in observations)
    every = max(1, -(-total // MAX_CLICKS))
    features = tuple(field.feature(o.feature, region) for o in observations)
    owners = [(i, int(k)) for i, o in enumerate(observations)
              for k in np.unique(first_of_each_place(o.points))[::every]]
    raw = np.array([observations[i].points[k] for i, k in owners]).reshape(-1, 2)
    steps = HALF_PX * np.eye(2)
    stretch = np.stack([(base.corrected_from_raw(raw + s) - base.corrected_from_raw(raw - s)) / (2 * HALF_PX)
                        for s in steps], axis=-1)
    owners_array = np.array(owners, int).reshape(-1, 2)
    return Clicks(raw, base.corrected_from_raw(raw), stretch, owners_array[:, 0], owners_array, features)


def constraints_of(clicks: Clicks, base: CameraModel, guess: Points) -> tuple[Constraints, Points, Indices]:
    """Return a spline's constraints from clicks near guess (n, 2) corrected px, each on the nearest place of its line.

    Also those places (n, 2), and which click each row is of.
    """
    middle, unit = spline_frame(base)
    places = np.empty_like(guess)
    rows: list[tuple[int, Array]] = []
    for i in np.unique(clicks.feature):
        feature, of = clicks.features[i], np.flatnonzero(clicks.feature == i)
        foot = feature.nearest(base.field_from_corrected(guess[of]))
        if isinstance(feature, Arc):  # its very centre is as near to any place
            foot = np.where(np.isfinite(foot), foot, feature.sample(1)[0])
        places[of] = base.corrected_from_field(foot)
        if isinstance(feature, Landmark):
            rows += [(j, axis) for j in of.tolist() for axis in np.eye(2)]
            continue
        along = base.corrected_from_field(foot + feature.tangents(foot)) - places[of]
        across = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.linalg.norm(along, axis=1, keepdims=True)
        rows += list(zip(of.tolist(), across, strict=True))
    index = np.array([j for j, _ in rows], int)
    directions = np.array([d for _, d in rows]).reshape(-1, 2)
    values = np.einsum("ni,ni->n", directions, (clicks.base - places)[index])
    stretched = np.linalg.norm(np.einsum("ni,nij->nj", directions, clicks.stretch[index]), axis=1)
    return Constraints((places[index] - middle) / unit, directions, values, 1 / stretched), places, index


def largest_per_click(rows: Array, index: Indices, clicks: int) -> Array:
    """Return the largest magnitude among each click's rows."""
    found = np.zeros(clicks)
    np.maximum.at(found, index, np.abs(rows))
    return found
