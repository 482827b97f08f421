"""The markings of a field as samples of every line and arc, and where a camera should see each of them."""

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Self

import numpy as np

from touchline.core.errors import FitFailed
from touchline.core.field import Arc, Field, Line, Region
from touchline.core.geometry import Array, ImageSize, Indices, Mask, Points, inside_picture, with_z

REACH = 1.0  # of the region's size, beyond its border: what a camera over it may see as well

MARGIN_PX = 6.0
FINE_MM_SHARE = 1 / 400  # of the field's length, between the places that are tried


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
            raise FitFailed(
                "The field has no lines or arcs to detect.",
                "Add markings to the field, or click its landmarks.",
                reason="no-markings",
            )
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
        bare = np.abs(parts[0]).sum(axis=1) < (field.length_mm + field.width_mm) / 2 - cut - (
            cut and step_mm
        )
        return cls(markings, *(part[bare | (cut == 0)] for part in parts))

    def every(self, step: int) -> Self:
        """Return every step-th of the samples."""
        return type(self)(
            self.markings,
            self.points[::step],
            self.along[::step],
            self.marking[::step],
            self.step_mm[::step],
        )


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
            for m in field.lines.values()
        }
        for m in field.arcs.values():
            ends = np.round(sign * m.sample(3), 1) + 0.0
            found.add(
                (
                    *(np.round(sign * np.array(m.centre), 3) + 0.0),
                    m.radius_mm,
                    *sorted(map(tuple, ends[[0, 2]])),
                    *ends[1],
                )
                if m.end_deg - m.start_deg < 359.9
                else (*(np.round(sign * np.array(m.centre), 3) + 0.0), m.radius_mm)
            )
        return found

    return places(1) == places(-1)


@dataclass(frozen=True, eq=False)
class LineSamples:
    """(n,) each: places, unit normals (n, 2) raw px, the paint's width px, the marking's number, length px it covers.

    clear: whether no other marking comes near.
    """

    places: Points
    normals: Points
    width_px: Array
    marking: Indices
    length_px: Array
    clear: Mask

    def of(self, some: Mask | Indices) -> Self:
        """Return those of the samples, by index or mask."""
        return type(self)(*(getattr(self, member.name)[some] for member in fields(self)))


def fine_pattern(field: Field) -> FieldPattern:
    """Sample the field's markings as finely as sample_lines() needs them."""
    return FieldPattern.of(field, field.length_mm * FINE_MM_SHARE)


def sample_lines_evenly(
    project: Callable[[Array], Points],
    pattern: FieldPattern,
    size: ImageSize,
    most: int,
    least_apart_px: float,
    clear_px: float,
) -> LineSamples:
    """Sample lines so far apart that about `most` samples are clear, and never nearer than least_apart_px."""
    places = sample_lines(project, pattern, size, least_apart_px, clear_px)
    apart = max(least_apart_px, float(places.length_px[places.clear].sum()) / most)
    return sample_lines(project, pattern, size, apart, clear_px)


def sample_lines(
    project: Callable[[Array], Points],
    pattern: FieldPattern,
    size: ImageSize,
    apart_px: float,
    clear_px: float,
) -> LineSamples:
    """Sample every marking about every apart_px. project: field mm (n, 3) to raw px. pattern: finely sampled."""
    with np.errstate(all="ignore"):
        half = pattern.along * (pattern.step_mm / 2)[:, None]
        across = np.stack([-pattern.along[:, 1], pattern.along[:, 0]], axis=1)
        width_mm = np.array([m.width_mm for m in pattern.markings])[pattern.marking]
        places = project(with_z(pattern.points))
        ahead = project(with_z(pattern.points + half)) - project(with_z(pattern.points - half))
        side = project(with_z(pattern.points + across * width_mm[:, None] / 2)) - project(
            with_z(pattern.points - across * width_mm[:, None] / 2)
        )
        length = np.linalg.norm(ahead, axis=1)
        tangent = ahead / length[:, None]
        normals = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
        width = np.abs(np.sum(side * normals, axis=1))
        inside = (
            inside_picture(places, size, MARGIN_PX)
            & np.isfinite(length)
            & np.isfinite(width)
            & (length > 0)
        )
    here = np.flatnonzero(inside)
    chosen = _spaced(pattern.marking[here], length[here], apart_px)
    index = here[chosen]
    stands_for = np.zeros(len(chosen))
    np.add.at(
        stands_for, np.searchsorted(chosen, np.arange(len(here)), side="right") - 1, length[here]
    )
    return LineSamples(
        places[index],
        normals[index],
        width[index],
        pattern.marking[index],
        stands_for,
        _clear(places, width, pattern.marking, here, index, clear_px),
    )


def _spaced(marking: Indices, length: Array, apart: float) -> Indices:
    """Return which places in order are at least so far from the one before; each marking starts anew."""
    if not len(length):
        return np.empty(0, int)
    run = np.cumsum(length)
    first = np.concatenate([[True], np.diff(marking) != 0])
    run = run - np.maximum.accumulate(np.where(first, run - length, 0.0)) - length / 2
    bin_ = np.floor(run / apart)
    return np.flatnonzero(first | (np.concatenate([[0.0], np.diff(bin_)]) != 0))


def _clear(
    places: Points, width: Array, marking: Indices, here: Indices, index: Indices, clear_px: float
) -> Mask:
    """Return (k,) whether no place of another marking is nearer than clear_px and both paints' half widths."""
    result = np.ones(len(index), bool)
    x, y = places.astype(np.float32).T
    half = width.astype(np.float32) / 2
    for start in range(0, len(index), 256):
        part = index[start : start + 256]
        gap = np.hypot(x[part, None] - x[here], y[part, None] - y[here])
        near = gap < half[part, None] + (half[here] + np.float32(clear_px))
        result[start : start + 256] = ~(near & (marking[part, None] != marking[here])).any(axis=1)
    return result
