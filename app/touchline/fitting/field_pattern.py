"""The markings of a field as samples of every line and arc, with their directions."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from touchline.core.errors import FitFailed
from touchline.core.field import Arc, Field, Line, Region
from touchline.core.geometry import Array, Indices

REACH = 1.0  # of the region's size, beyond its border: what a camera over it may see as well


@dataclass(frozen=True, eq=False)
class FieldPattern:
    """Samples (n, 2) mm along all markings, unit directions (n, 2), the marking's number (n,), mm to the next (n,)."""

    markings: tuple[Line | Arc, ...]
    points: Array
    along: Array
    marking: Indices
    step_mm: Array

    @classmethod
    def of(cls, field: Field, step_mm: float, min_samples: int = 3) -> Self:
        """Sample markings about every step_mm, but for corners that are cut off."""
        markings = field.markings
        if not markings:
            raise FitFailed("The field has no lines or arcs to detect.",
                            "Add markings to the field, or click its landmarks.", reason="no-markings")
        points, along, owner, step = [], [], [], []
        for number, marking in enumerate(markings):
            count = max(min_samples, round(marking.length_mm / step_mm))
            fine = marking.sample(2 * count + 1)
            points.append(fine[1::2])  # the middles of equal pieces: ends are shared with others
            way = fine[2::2] - fine[:-1:2]
            along.append(way / np.linalg.norm(way, axis=1, keepdims=True))
            owner.append(np.full(count, number))
            step.append(np.full(count, marking.length_mm / count))
        parts = [np.concatenate(part) for part in (points, along, owner, step)]
        cut = float(field.extras.get("corner_cut_mm", 0.0))
        bare = np.abs(parts[0]).sum(axis=1) < (field.length_mm + field.width_mm) / 2 - cut - (cut and step_mm)
        return cls(markings, *(part[bare | (cut == 0)] for part in parts))

    def every(self, step: int) -> Self:
        """Return every step-th of the samples."""
        return type(self)(self.markings, self.points[::step], self.along[::step], self.marking[::step],
                          self.step_mm[::step])


def levels(field: Field, region: Region) -> tuple[Array, Array]:
    """Return x of the lines along y, and y of those along x, near enough to the region to be seen with it; mm."""
    found: tuple[set[float], set[float]] = (set(), set())
    reach = [REACH * float(np.ptp(side)) for side in (region.x_mm, region.y_mm)]
    low = np.array([region.x_mm[0] - reach[0], region.y_mm[0] - reach[1]])
    high = np.array([region.x_mm[1] + reach[0], region.y_mm[1] + reach[1]])
    for line in field.lines.values():
        start, end = np.array(line.start), np.array(line.end)
        near = (np.minimum(start, end) <= high).all() and (np.maximum(start, end) >= low).all()
        for axis in (0, 1):
            if near and start[axis] == end[axis]:
                found[axis].add(float(start[axis]))
    return np.array(sorted(found[0])), np.array(sorted(found[1]))


def is_half_turn_symmetric(field: Field) -> bool:
    """Return whether the field's markings, turned by 180°, are the same."""
    def places(sign: int) -> set[tuple[object, ...]]:
        found: set[tuple[object, ...]] = {
            tuple(sorted(tuple(np.round(sign * np.array(p), 3) + 0.0) for p in (m.start, m.end)))
            for m in field.lines.values()}
        for m in field.arcs.values():
            ends = np.round(sign * m.sample(3), 1) + 0.0
            found.add((*(np.round(sign * np.array(m.centre), 3) + 0.0), m.radius_mm, *sorted(map(tuple, ends[[0, 2]])),
                       *ends[1]) if m.end_deg - m.start_deg < 359.9 else
                      (*(np.round(sign * np.array(m.centre), 3) + 0.0), m.radius_mm))
        return found
    return places(1) == places(-1)
