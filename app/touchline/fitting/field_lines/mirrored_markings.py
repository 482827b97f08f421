"""Markings that are the same on both halves and both sides of a field, from those that a picture shows.

Of a marking and its mirror images those that were seen are averaged. Where at least half of them were, the others are
added; where fewer were, it is a robot's edge or a shadow, and goes.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from touchline.core.field import Arc, Line, Point
from touchline.core.geometry import as_pair

SAME_MM = 75.0  # between a marking and the mirror image of another, on a field 6000 mm long
MIRRORS = ((1, 1), (-1, 1), (1, -1), (-1, -1))
Marking = TypeVar("Marking", Line, Arc)


def symmetric(markings: Sequence[Marking]) -> list[Marking]:
    """Return the markings and their mirror images, each once, the longest first."""
    waiting = sorted((_mirrored(each, (1, 1)) for each in markings), key=lambda one: -one.length_mm)
    result: list[Marking] = []
    while waiting:
        first = waiting[0]
        images = [[_mirrored(each, mirror) for mirror in MIRRORS] for each in waiting]
        alike = [[image for image in of if _apart_mm(image, first) < SAME_MM] for of in images]
        members = [each for each, of in zip(waiting, alike, strict=True) if of]
        waiting = [each for each, of in zip(waiting, alike, strict=True) if not of]
        middle = _mean([image for of in alike for image in of])
        distinct: list[Marking] = []
        for mirror in MIRRORS:
            image = _mirrored(middle, mirror)
            if all(_apart_mm(image, other) >= SAME_MM for other in distinct):
                distinct.append(image)
        seen = sum(any(_apart_mm(image, each) < SAME_MM for each in members) for image in distinct)
        if 2 * seen >= len(distinct):
            result.extend(distinct)
    return result


def _mirrored(marking: Marking, mirror: tuple[int, int]) -> Marking:
    """Return it on the other side of one axis, of both, or of none; a line's ends in their order along the axes."""
    if isinstance(marking, Line):
        ends = sorted(_times(end, mirror) for end in (marking.start, marking.end))
        return replace(marking, start=ends[0], end=ends[1])
    start, end = marking.start_deg, marking.end_deg
    if mirror[0] < 0:
        start, end = 180 - end, 180 - start
    if mirror[1] < 0:
        start, end = -end, -start
    turns = 360 * (start // 360)
    return replace(marking, centre=_times(marking.centre, mirror), start_deg=start - turns, end_deg=end - turns)


def _times(place: Point, mirror: tuple[int, int]) -> Point:
    return place[0] * mirror[0] + 0.0, place[1] * mirror[1] + 0.0


def _apart_mm(one: Line | Arc, other: Line | Arc) -> float:
    """Return how far two markings of a kind lie apart; arcs by centre, radius and middle, as ends may be hidden."""
    if isinstance(one, Line) or isinstance(other, Line):
        return float(np.abs(one.sample(2) - other.sample(2)).max())
    ring = np.abs(np.subtract((*one.centre, one.radius_mm), (*other.centre, other.radius_mm))).max()
    middles = 0.0 if is_circle(one) or is_circle(other) else np.linalg.norm(one.sample(3)[1] - other.sample(3)[1])
    return float(max(ring, middles / 2))


def is_circle(arc: Arc) -> bool:
    """Return whether all of a circle is painted."""
    return arc.end_deg - arc.start_deg > 359


def _mean(alike: Sequence[Marking]) -> Marking:
    """Return their mean; an arc as long as the longest of them."""
    first = alike[0]
    if isinstance(first, Line):
        start, end = np.mean([one.sample(2) for one in alike], axis=0)
        return replace(first, start=as_pair(start), end=as_pair(end))
    longest = max(alike, key=lambda arc: arc.end_deg - arc.start_deg)
    centre, radius = np.mean([arc.centre for arc in alike], axis=0), float(np.mean([arc.radius_mm for arc in alike]))
    middle = np.mean([arc.sample(3)[1] - arc.centre for arc in alike], axis=0)
    half = (longest.end_deg - longest.start_deg) / 2
    at = float(np.degrees(np.arctan2(middle[1], middle[0])))
    start, end = (0.0, 360.0) if is_circle(longest) else (at - half, at + half)
    return replace(longest, centre=as_pair(centre), radius_mm=radius, start_deg=start, end_deg=end)
