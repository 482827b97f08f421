"""Where a calibration's own points had the field's lines: what a check compares with, whatever the model makes of them.

A point on a line lies on it. A landmark on lines, such as a corner, tells of each of them a few pixels away from it,
where no other line is near.
"""

from collections import defaultdict
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from touchline.core.errors import TouchlineError
from touchline.core.field import Arc, Field, Landmark, Line, Region
from touchline.core.geometry import Array, ImageSize, Points, inside_picture
from touchline.core.records import Observation, Observations
from touchline.fitting.field_pattern import FieldPattern, LineSamples, fine_pattern
from touchline.models import CameraModel, field_from_raw, raw_from_field

BESIDE_PX = (-24.0, -14.0, 14.0, 24.0)  # from a landmark, along a line through it
STEP_MM = 2.0  # to either side, for directions and widths in the picture
MARGIN_PX = 6.0


@dataclass(frozen=True, eq=False)
class ObservedLines:
    """Features with their names, places on them in the picture, and px (n,) to the nearest paint of another one."""

    names: tuple[str, ...]
    features: tuple[Line | Arc, ...]
    at: LineSamples
    gap_px: Array

    @classmethod
    def of(cls, model: CameraModel, field: Field, region: Region, observations: Observations, size: ImageSize,
           most: int) -> Self | None:
        """Read at most so many places from the observations; None where they tell of no line."""
        pattern = fine_pattern(field)
        features: dict[str, Line | Arc] = {}
        places: dict[str, list[Points]] = defaultdict(list)
        for observation in observations:
            for name, feature, points in _lines_seen(model, pattern, field, region, observation):
                features.setdefault(name, feature)
                places[name].append(points)
        names = tuple(features)
        parts = [_samples(model, features[name], number, np.concatenate(places[name]), size)
                 for number, name in enumerate(names)]
        if not sum(len(part.places) for part in parts):
            return None
        at = LineSamples(*(np.concatenate([getattr(part, member) for part in parts])
                           for member in ("places", "normals", "width_px", "marking", "length_px", "clear")))
        if len(at.places) > most:
            at = at.of(np.linspace(0, len(at.places) - 1, most).round().astype(int))
        return cls(names, tuple(features.values()), at, _gap_px(model, pattern, field, region, names, at))

    def samples(self, clear_px: float) -> LineSamples:
        """Return the places, of which those are clear that lie so far from other lines."""
        return replace(self.at, clear=self.gap_px > clear_px)


def _lines_seen(model: CameraModel, pattern: FieldPattern, field: Field, region: Region, observation: Observation,
                ) -> list[tuple[str, Line | Arc, Points]]:
    """Return the lines that an observation tells of, by the name it would have, with the places (n, 2) px on each."""
    if observation.z_mm:
        return []
    try:
        feature = field.feature(observation.feature, region)
    except TouchlineError:
        return []  # of a field that had it when this was calibrated
    if not isinstance(feature, Landmark):
        return [(str(observation.feature), feature, observation.points)] if observation.kind == "line" else []
    spot, found = np.array(feature.position), []
    expected = raw_from_field(model, spot[None])
    for number, marking in enumerate(pattern.markings):
        of = pattern.marking == number
        if not of.any() or np.linalg.norm(pattern.points[of] - spot, axis=1).min() > pattern.step_mm[of].max():
            continue
        tangent = marking.tangents(marking.nearest(spot[None]))
        px_per_mm = np.linalg.norm(raw_from_field(model, spot + STEP_MM * tangent) - expected) / STEP_MM
        if not px_per_mm > 0:
            continue
        ways = marking.nearest(spot + np.array(BESIDE_PX)[:, None] / px_per_mm * tangent)
        on = np.linalg.norm(pattern.points[of][:, None] - ways, axis=2).min(axis=0) < pattern.step_mm[of].max()
        aside = raw_from_field(model, ways[on]) - expected
        found.append((field.observed_name(marking.name, region), marking,
                      (observation.points[:, None] + aside).reshape(-1, 2)))
    return found


def _samples(model: CameraModel, feature: Line | Arc, number: int, points: Points, size: ImageSize) -> LineSamples:
    """Return a feature's places in order along it, those in the model's reach."""
    with np.errstate(all="ignore"):
        foot = feature.nearest(field_from_raw(model, points))
        along, across = feature.tangents(foot), feature.normals(foot)
        ahead = raw_from_field(model, foot + STEP_MM * along) - raw_from_field(model, foot - STEP_MM * along)
        side = (raw_from_field(model, foot + across * feature.width_mm / 2)
                - raw_from_field(model, foot - across * feature.width_mm / 2))
        tangent = ahead / np.linalg.norm(ahead, axis=1, keepdims=True)
        normals = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
        width = np.abs(np.sum(side * normals, axis=1))
        fine = np.isfinite(width) & np.isfinite(normals).all(axis=1) & inside_picture(points, size, MARGIN_PX)
    order = np.flatnonzero(fine)
    order = order[np.argsort(_course(feature, foot[order]), kind="stable")]
    one = np.ones(len(order))
    return LineSamples(points[order], normals[order], width[order], np.full(len(order), number), one, one > 0)


def _course(feature: Line | Arc, foot: Points) -> Array:
    """Return how far along the feature each place (n, 2) mm is."""
    if isinstance(feature, Line):
        return (foot - feature.start) @ (np.array(feature.end) - feature.start)
    x, y = (foot - feature.centre).T
    return (np.degrees(np.arctan2(y, x)) - feature.start_deg) % 360


def _gap_px(model: CameraModel, pattern: FieldPattern, field: Field, region: Region, names: tuple[str, ...],
            at: LineSamples) -> Array:
    """Return how far each place is from the paint of any other marking, from edge to edge."""
    paint = raw_from_field(model, pattern.points)
    own = [np.array([name in (m.name, field.observed_name(m.name, region)) for m in pattern.markings])
           for name in names]
    gap = np.full(len(at.places), np.inf)
    for number, mine in enumerate(own):
        of, others = np.flatnonzero(at.marking == number), paint[~mine[pattern.marking]]
        others = others[np.isfinite(others).all(axis=1)]
        if len(of) and len(others):
            gap[of] = np.linalg.norm(at.places[of, None] - others, axis=2).min(axis=1) - at.width_px[of]
    return gap
