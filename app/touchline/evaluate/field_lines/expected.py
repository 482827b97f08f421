"""Places on the field's lines in a picture: where the model expects them, or where a calibration's own points had them.

The own points are what a check compares with, whatever the model makes of them. A point on a line lies on it. A
landmark on lines, such as a corner, tells of each of them a few pixels away from it, where no other line is near.
"""

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from touchline.core.errors import TouchlineError
from touchline.core.field import Arc, Field, Landmark, Line, Region
from touchline.core.geometry import Array, ImageSize, Pixels, Points, inside_picture
from touchline.core.records import Observation, Observations
from touchline.fitting.field_pattern import (
    FieldPattern,
    LineSamples,
    fine_pattern,
    sample_lines_evenly,
)
from touchline.models import CameraModel, field_from_raw, raw_from_field
from touchline.vision.profiles import across_lines

REGION_MARGIN_MM = 20.0  # about a region: its borders belong to it
BESIDE_LANDMARK_PX = (-24.0, -14.0, 14.0, 24.0)  # along a line through it
STEP_MM = 2.0  # to either side, for directions and widths in the picture
IMAGE_MARGIN_PX = 6.0


def expected_lines(
    model: CameraModel,
    pattern: FieldPattern,
    size: ImageSize,
    count: int,
    apart_px: float,
    clear_px: float,
    region: Region | None = None,
) -> LineSamples:
    """Return about `count` clear places on the lines, at least apart_px apart; only those of the region if given."""

    def project(points: Array) -> Points:
        raw = raw_from_field(model, points[:, :2])
        if region is None:
            return raw
        low, high = np.transpose([region.x_mm, region.y_mm])
        of_region = (
            (points[:, :2] >= low - REGION_MARGIN_MM) & (points[:, :2] <= high + REGION_MARGIN_MM)
        ).all(axis=1)
        return np.where(of_region[:, None], raw, np.nan)

    return sample_lines_evenly(project, pattern, size, count, apart_px, clear_px)


def lines_in(
    gray: Pixels, lines: LineSamples, reach_px: float
) -> tuple[LineSamples, Mapping[int, float]]:
    """Return those of the lines that are seen within reach_px of where they are expected, with their places there.

    gray (h, w), with its lines bright. Also returned is how wide each marking is painted, of how wide it should be.
    """
    profiles = across_lines(
        gray, lines.places, lines.normals, lines.width_px, lines.marking, reach_px
    )
    middles = lines.places + np.where(profiles.found, profiles.middle, 0.0)[:, None] * lines.normals
    return replace(lines, places=middles).of(profiles.found), profiles.widths


@dataclass(frozen=True, eq=False)
class ObservedLines:
    """Features with their names, places on them in the picture, and px (n,) to the nearest paint of another one."""

    names: tuple[str, ...]
    features: tuple[Line | Arc, ...]
    at: LineSamples
    gap_px: Array

    @classmethod
    def of(
        cls,
        model: CameraModel,
        field: Field,
        region: Region,
        observations: Observations,
        size: ImageSize,
        max_places: int,
    ) -> Self | None:
        """Read at most so many places from the observations; None where they tell of no line."""
        pattern = fine_pattern(field)
        features: dict[str, Line | Arc] = {}
        places: dict[str, list[Points]] = defaultdict(list)
        for observation in observations:
            for name, feature, points in _observed_features(
                model, pattern, field, region, observation
            ):
                features.setdefault(name, feature)
                places[name].append(points)
        names = tuple(features)
        parts = [
            _samples(model, features[name], number, np.concatenate(places[name]), size)
            for number, name in enumerate(names)
        ]
        if not sum(len(part.places) for part in parts):
            return None
        at = LineSamples(
            *(
                np.concatenate([getattr(part, member) for part in parts])
                for member in ("places", "normals", "width_px", "marking", "length_px", "clear")
            )
        )
        if len(at.places) > max_places:
            at = at.of(np.linspace(0, len(at.places) - 1, max_places).round().astype(int))
        return cls(
            names, tuple(features.values()), at, _gap_px(model, pattern, field, region, names, at)
        )

    def samples(self, clear_px: float) -> LineSamples:
        """Return the places, of which those are clear that lie so far from other lines."""
        return replace(self.at, clear=self.gap_px > clear_px)


def _observed_features(
    model: CameraModel,
    pattern: FieldPattern,
    field: Field,
    region: Region,
    observation: Observation,
) -> list[tuple[str, Line | Arc, Points]]:
    """Return the lines that an observation tells of, by the name it would have, with the places (n, 2) px on each."""
    if observation.z_mm:
        return []
    try:
        feature = field.feature(observation.feature, region)
    except TouchlineError:
        return []  # of a field that had it when this was calibrated
    if isinstance(feature, Landmark):
        return _lines_through(model, pattern, field, region, feature, observation)
    return (
        [(str(observation.feature), feature, observation.points)]
        if observation.kind == "line"
        else []
    )


def _lines_through(
    model: CameraModel,
    pattern: FieldPattern,
    field: Field,
    region: Region,
    landmark: Landmark,
    observation: Observation,
) -> list[tuple[str, Line | Arc, Points]]:
    """Return the lines through an observed landmark, with places (n, 2) px that lie beside it on each."""
    spot = np.array(landmark.position)
    expected = raw_from_field(model, spot[None])
    found = []
    for number, marking in enumerate(pattern.markings):
        of = pattern.marking == number
        if (
            not of.any()
            or np.linalg.norm(pattern.points[of] - spot, axis=1).min() > pattern.step_mm[of].max()
        ):
            continue
        tangent = marking.tangents(marking.nearest(spot[None]))
        px_per_mm = (
            np.linalg.norm(raw_from_field(model, spot + STEP_MM * tangent) - expected) / STEP_MM
        )
        if not px_per_mm > 0:
            continue
        beside = marking.nearest(spot + np.array(BESIDE_LANDMARK_PX)[:, None] / px_per_mm * tangent)
        # Where the line ends at the landmark, it is to one side only.
        is_painted = (
            np.linalg.norm(pattern.points[of][:, None] - beside, axis=2).min(axis=0)
            < pattern.step_mm[of].max()
        )
        # The model tells the way along the line; where the landmark is, the observation does.
        offsets = raw_from_field(model, beside[is_painted]) - expected
        found.append(
            (
                field.observed_name(marking.name, region),
                marking,
                (observation.points[:, None] + offsets).reshape(-1, 2),
            )
        )
    return found


def _samples(
    model: CameraModel, feature: Line | Arc, number: int, points: Points, size: ImageSize
) -> LineSamples:
    """Return a feature's places in order along it, those in the model's reach."""
    with np.errstate(all="ignore"):
        foot = feature.nearest(field_from_raw(model, points))
        along, across = feature.tangents(foot), feature.normals(foot)
        ahead = raw_from_field(model, foot + STEP_MM * along) - raw_from_field(
            model, foot - STEP_MM * along
        )
        side = raw_from_field(model, foot + across * feature.width_mm / 2) - raw_from_field(
            model, foot - across * feature.width_mm / 2
        )
        tangent = ahead / np.linalg.norm(ahead, axis=1, keepdims=True)
        normals = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
        width = np.abs(np.sum(side * normals, axis=1))
        fine = (
            np.isfinite(width)
            & np.isfinite(normals).all(axis=1)
            & inside_picture(points, size, IMAGE_MARGIN_PX)
        )
    order = np.flatnonzero(fine)
    order = order[np.argsort(_position_along(feature, foot[order]), kind="stable")]
    one = np.ones(len(order))
    return LineSamples(
        points[order], normals[order], width[order], np.full(len(order), number), one, one > 0
    )


def _position_along(feature: Line | Arc, foot: Points) -> Array:
    """Return how far along the feature each place (n, 2) mm is."""
    if isinstance(feature, Line):
        return (foot - feature.start) @ (np.array(feature.end) - feature.start)
    x, y = (foot - feature.centre).T
    return (np.degrees(np.arctan2(y, x)) - feature.start_deg) % 360


def _gap_px(
    model: CameraModel,
    pattern: FieldPattern,
    field: Field,
    region: Region,
    names: tuple[str, ...],
    at: LineSamples,
) -> Array:
    """Return how far each place is from the paint of any other marking, from edge to edge."""
    paint = raw_from_field(model, pattern.points)
    own = [
        np.array([name in (m.name, field.observed_name(m.name, region)) for m in pattern.markings])
        for name in names
    ]
    gap = np.full(len(at.places), np.inf)
    for number, mine in enumerate(own):
        of, others = np.flatnonzero(at.marking == number), paint[~mine[pattern.marking]]
        others = others[np.isfinite(others).all(axis=1)]
        if len(of) and len(others):
            gap[of] = (
                np.linalg.norm(at.places[of, None] - others, axis=2).min(axis=1) - at.width_px[of]
            )
    return gap
