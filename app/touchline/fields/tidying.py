"""A field that was read from a picture, made as fields are: markings alike on both halves, that meet and are named.

Of a marking and its mirror images those that were seen are averaged. Where at least half of them were, the others are
added; where fewer were, it is a robot's edge or a shadow, and goes.

A field is 6000 mm long here, whatever its size; scaled() gives it that.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import count
from typing import TypeVar

import numpy as np

from touchline.core.field import Arc, Field, Landmark, Line, Point, Region
from touchline.core.geometry import as_pair

MAX_JOIN_MM = 75.0  # between a line's end and a line across it, or from an axis
MAX_UNBALANCE = 0.25  # of a line across an axis, between what is seen of it on either side
MIN_FRAMED = 0.6  # of the outermost borders, what lies within a frame
SAME_MM = 75.0  # between a marking and the mirror image of another
FULL_CIRCLE_DEG = 359  # from here on all of a circle is painted
MIRRORS = ((1, 1), (-1, 1), (1, -1), (-1, -1))
DEFENCE, GOAL_AREA = "defence", "goal-area"  # the larger and the smaller of two areas
Marking = TypeVar("Marking", Line, Arc)


def tidied(field: Field) -> Field:
    """Return the field with its markings alike on both sides of both axes, named, and with landmarks and areas.

    Lines that run along neither axis go. What stands around the outermost lines as a frame, such as a wall, goes too.
    """
    half = (field.length_mm / 2, field.width_mm / 2)
    upright = [
        _balanced(line)
        for line in field.lines.values()
        if line.start[0] == line.end[0] or line.start[1] == line.end[1]
    ]
    straight = _joined(symmetric(upright), half)
    bent = [_on_axis(arc) for arc in symmetric([_about_middle(arc) for arc in field.arcs.values()])]
    half, straight = _without_frame(straight, bent, half)
    lines = {
        name: replace(line, name=name)
        for name, line in zip(
            _unique(_line_names(straight, bent, half), "line"), straight, strict=True
        )
    }
    arcs = {
        name: replace(arc, name=name)
        for name, arc in zip(
            _unique([_arc_name(arc, half) for arc in bent], "circle"), bent, strict=True
        )
    }
    return replace(
        field,
        length_mm=2 * half[0],
        width_mm=2 * half[1],
        lines=lines,
        arcs=arcs,
        landmarks=_landmarks(half, lines, arcs),
        regions=_regions(half),
    )


def _balanced(line: Line) -> Line:
    """Return a line across an axis as far on either side as it is seen on one, if that is nearly so."""
    axis = 0 if line.start[1] == line.end[1] else 1
    low, high = sorted((line.start[axis], line.end[axis]))
    if low >= 0 or high <= 0 or abs(low + high) > MAX_UNBALANCE * (high - low):
        return line
    far, level = max(-low, high), line.start[1 - axis]
    ends = ((-far, level), (far, level)) if axis == 0 else ((level, -far), (level, far))
    return replace(line, start=ends[0], end=ends[1])


def _about_middle(arc: Arc) -> Arc:
    """Return all of a circle of which some is seen about the middle."""
    is_middle = max(map(abs, arc.centre)) < MAX_JOIN_MM
    return replace(arc, centre=(0.0, 0.0), start_deg=0.0, end_deg=360.0) if is_middle else arc


def _without_frame(
    lines: Sequence[Line], arcs: Sequence[Arc], half: Point
) -> tuple[Point, list[Line]]:
    """Return half the sides of the smallest rectangle of lines that only a frame lies around, and the lines in it."""
    along = {
        line.start[1]: line.end[0]
        for line in lines
        if line.start[1] == line.end[1] > 0 > line.start[0]
    }
    across = {
        line.start[0]: line.end[1]
        for line in lines
        if line.start[0] == line.end[0] > 0 > line.start[1]
    }
    for x, y in sorted((x, y) for x in across for y in along):
        inner = [line for line in lines if not (_is_beyond(line, 0, x) or _is_beyond(line, 1, y))]
        frame = [line for line in lines if _is_beyond(line, 0, x) or _is_beyond(line, 1, y)]
        is_closed = along[y] >= x and across[x] >= y
        is_large = x > MIN_FRAMED * half[0] and y > MIN_FRAMED * half[1]
        # a short line out there is no frame
        is_around = all(line.length_mm > MIN_FRAMED * min(half) for line in frame)
        has_arcs = all(
            abs(arc.centre[0]) <= x + MAX_JOIN_MM and abs(arc.centre[1]) <= y + MAX_JOIN_MM
            for arc in arcs
        )
        if is_closed and is_large and is_around and has_arcs:
            clipped = [
                replace(line, start=_clipped(line.start, (x, y)), end=_clipped(line.end, (x, y)))
                for line in inner
            ]
            return (x, y), [line for line in clipped if line.length_mm > MAX_JOIN_MM]
    return half, list(lines)


def _is_beyond(line: Line, axis: int, half_mm: float) -> bool:
    return line.start[axis] == line.end[axis] and abs(line.start[axis]) > half_mm


def _clipped(place: Point, half: Point) -> Point:
    x, y = (min(max(value, -side), side) for value, side in zip(place, half, strict=True))
    return x, y


def scaled(field: Field, factor: float) -> Field:
    """Return the field so many times as large, in whole millimetres."""

    def mm(value: float) -> float:
        return round(value * factor) + 0.0

    def pair(values: Point) -> Point:
        return mm(values[0]), mm(values[1])

    return replace(
        field,
        length_mm=2 * mm(field.length_mm / 2),
        width_mm=2 * mm(field.width_mm / 2),
        lines={
            name: replace(
                line,
                start=pair(line.start),
                end=pair(line.end),
                width_mm=max(mm(line.width_mm), 1.0),
            )
            for name, line in field.lines.items()
        },
        arcs={
            name: replace(
                arc,
                centre=pair(arc.centre),
                radius_mm=mm(arc.radius_mm),
                width_mm=max(mm(arc.width_mm), 1.0),
            )
            for name, arc in field.arcs.items()
        },
        landmarks={
            name: Landmark(name, pair(mark.position)) for name, mark in field.landmarks.items()
        },
        regions={
            name: Region(name, pair(region.x_mm), pair(region.y_mm))
            for name, region in field.regions.items()
        },
    )


def _joined(lines: Sequence[Line], half: Point) -> list[Line]:
    """Return lines that end on the lines that they all but reach, and lie on an axis that is as near."""
    levels = [
        sorted(
            {
                0.0,
                *(sign * half[axis] for sign in (-1, 1)),
                *(line.start[axis] for line in lines if line.start[axis] == line.end[axis]),
            }
        )
        for axis in (0, 1)
    ]

    def near(value: float, axis: int) -> float:
        fixed = [0.0, half[axis], -half[axis]]  # before what was measured
        return next(
            (level for level in [*fixed, *levels[axis]] if abs(level - value) < MAX_JOIN_MM), value
        )

    return [
        replace(
            line,
            start=(near(line.start[0], 0), near(line.start[1], 1)),
            end=(near(line.end[0], 0), near(line.end[1], 1)),
        )
        for line in lines
    ]


def _on_axis(arc: Arc) -> Arc:
    x, y = (0.0 if abs(value) < MAX_JOIN_MM else value for value in arc.centre)
    return replace(arc, centre=(x, y))


def _line_names(lines: Sequence[Line], arcs: Sequence[Arc], half: Point) -> list[str]:
    """Return what each line is called; "" for one without a standard name."""
    side_starts = {(line.start[0], line.end[1]) for line in lines if line.end[0] == half[0]}
    is_round = any(_arc_name(arc, half).startswith(DEFENCE) for arc in arcs)

    def front_of(line: Line) -> Point | None:
        """Return where the front of an area ends, as (x, y) of its corner on the right half; None for another line."""
        x, y = abs(line.start[0]), line.end[1]
        is_front = line.start[0] == line.end[0] and 0 < x < half[0] and line.start[1] == -y
        return (x, y) if is_front and (is_round or (x, y) in side_starts) else None

    fronts = sorted(
        {front for line in lines if (front := front_of(line)) is not None},
        key=lambda front: -front[1],
    )
    # the wider one first
    stems = (DEFENCE, GOAL_AREA) if len(fronts) > 1 or is_round else (GOAL_AREA,)
    stem_of = dict(zip(fronts, stems, strict=False))
    return [_line_name(line, half, stem_of) for line in lines]


def _line_name(line: Line, half: Point, stem_of: Mapping[Point, str]) -> str:
    (x, y), (x1, y1) = line.start, line.end
    side, edge = "left" if x + x1 < 0 else "right", "top" if y + y1 > 0 else "bottom"
    if x == x1:
        if abs(x) == half[0]:
            return f"goal-line-{side}"
        if x == 0 and y < 0 < y1:
            return "halfway-line"
        front = stem_of.get((abs(x), abs(y))) if y == -y1 else None
        return f"{front}-{side}-front" if front else ""
    if abs(y) == half[1]:
        return f"touch-line-{edge}"
    if y == 0 and x < 0 < x1:
        return "centre-line"
    area = stem_of.get((min(abs(x), abs(x1)), abs(y))) if max(abs(x), abs(x1)) == half[0] else None
    return f"{area}-{side}-{edge}" if area else ""


def _arc_name(arc: Arc, half: Point) -> str:
    x, y = arc.centre
    side, edge = "left" if x < 0 else "right", "top" if y > 0 else "bottom"
    if x == y == 0:
        return "centre-circle" if is_circle(arc) else ""
    if y == 0:
        return f"{GOAL_AREA}-{side}-arc"
    return f"{DEFENCE}-{side}-arc-{edge}" if abs(abs(x) - half[0]) < MAX_JOIN_MM else ""


def _unique(names: Sequence[str], stem: str) -> list[str]:
    """Return the names, and numbered ones for what has none, or that of another."""
    free, taken, result = count(1), set[str](), []
    for name in names:
        result.append(name if name and name not in taken else f"{stem}-{next(free)}")
        taken.add(name)
    return result


def _landmarks(
    half: Point, lines: Mapping[str, Line], arcs: Mapping[str, Arc]
) -> dict[str, Landmark]:
    x, y = half
    places = {
        "centre": (0.0, 0.0),
        "corner-top-left": (-x, y),
        "corner-top-right": (x, y),
        "corner-bottom-left": (-x, -y),
        "corner-bottom-right": (x, -y),
    }
    if "halfway-line" in lines:
        places |= {"halfway-top": (0.0, y), "halfway-bottom": (0.0, -y)}
    if circle := arcs.get("centre-circle"):
        places |= {"circle-top": (0.0, circle.radius_mm), "circle-bottom": (0.0, -circle.radius_mm)}
    return {name: Landmark(name, place) for name, place in places.items()}


def _regions(half: Point) -> dict[str, Region]:
    """Return the areas of a field that one, two or four cameras see."""
    whole = [(-side, side) for side in half]
    low, high = [(-side, 0.0) for side in half], [(0.0, side) for side in half]
    sides = {
        "full": whole,
        "half-left": (low[0], whole[1]),
        "half-right": (high[0], whole[1]),
        "quarter-bottom-left": low,
        "quarter-top-left": (low[0], high[1]),
        "quarter-bottom-right": (high[0], low[1]),
        "quarter-top-right": high,
    }
    return {name: Region(name, (xs[0], xs[1]), (ys[0], ys[1])) for name, (xs, ys) in sides.items()}


def symmetric(markings: Sequence[Marking]) -> list[Marking]:
    """Return the markings and their mirror images, each once, the longest first."""
    waiting = sorted((_mirrored(each, (1, 1)) for each in markings), key=lambda one: -one.length_mm)
    result: list[Marking] = []
    while waiting:
        first = waiting[0]
        images = [[_mirrored(each, mirror) for mirror in MIRRORS] for each in waiting]
        alike = [[image for image in of if _distance_mm(image, first) < SAME_MM] for of in images]
        members = [each for each, of in zip(waiting, alike, strict=True) if of]
        waiting = [each for each, of in zip(waiting, alike, strict=True) if not of]
        distinct = _distinct_images(_mean([image for of in alike for image in of]))
        count_seen = sum(
            any(_distance_mm(image, each) < SAME_MM for each in members) for image in distinct
        )
        if 2 * count_seen >= len(distinct):
            result.extend(distinct)
    return result


def _distinct_images(marking: Marking) -> list[Marking]:
    """Return a marking and its mirror images, but none twice: a line on an axis is its own."""
    distinct: list[Marking] = []
    for mirror in MIRRORS:
        image = _mirrored(marking, mirror)
        if all(_distance_mm(image, other) >= SAME_MM for other in distinct):
            distinct.append(image)
    return distinct


def _mirrored(marking: Marking, mirror: tuple[int, int]) -> Marking:
    """Return it on the other side of one axis, of both, or of none; a line's ends in their order along the axes."""
    if isinstance(marking, Line):
        ends = sorted(_mirrored_point(end, mirror) for end in (marking.start, marking.end))
        return replace(marking, start=ends[0], end=ends[1])
    start, end = marking.start_deg, marking.end_deg
    if mirror[0] < 0:
        start, end = 180 - end, 180 - start
    if mirror[1] < 0:
        start, end = -end, -start
    turns = 360 * (start // 360)
    centre = _mirrored_point(marking.centre, mirror)
    return replace(marking, centre=centre, start_deg=start - turns, end_deg=end - turns)


def _mirrored_point(place: Point, mirror: tuple[int, int]) -> Point:
    return place[0] * mirror[0] + 0.0, place[1] * mirror[1] + 0.0


def _distance_mm(one: Line | Arc, other: Line | Arc) -> float:
    """Return how far two markings of a kind lie apart; arcs by centre, radius and middle, as ends may be hidden."""
    if isinstance(one, Line) or isinstance(other, Line):
        return float(np.abs(one.sample(2) - other.sample(2)).max())
    of_circles = np.abs(
        np.subtract((*one.centre, one.radius_mm), (*other.centre, other.radius_mm))
    ).max()
    of_middles = (
        0.0
        if is_circle(one) or is_circle(other)
        else np.linalg.norm(one.sample(3)[1] - other.sample(3)[1])
    )
    return float(max(of_circles, of_middles / 2))


def is_circle(arc: Arc) -> bool:
    """Return whether all of a circle is painted."""
    return arc.end_deg - arc.start_deg > FULL_CIRCLE_DEG


def _mean(alike: Sequence[Marking]) -> Marking:
    """Return the mean of markings of a kind; an arc as long as the longest of them, as ends may be hidden."""
    first = alike[0]
    if isinstance(first, Line):
        start, end = np.mean([one.sample(2) for one in alike], axis=0)
        return replace(first, start=as_pair(start), end=as_pair(end))
    longest = max(alike, key=lambda arc: arc.end_deg - arc.start_deg)
    centre, radius = (
        np.mean([arc.centre for arc in alike], axis=0),
        float(np.mean([arc.radius_mm for arc in alike])),
    )
    middle = np.mean([arc.sample(3)[1] - arc.centre for arc in alike], axis=0)
    half = (longest.end_deg - longest.start_deg) / 2
    at = float(np.degrees(np.arctan2(middle[1], middle[0])))
    start, end = (0.0, 360.0) if is_circle(longest) else (at - half, at + half)
    return replace(longest, centre=as_pair(centre), radius_mm=radius, start_deg=start, end_deg=end)
