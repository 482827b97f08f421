"""A field with its lines and arcs moved a little, and all that hangs on them moved along.

    JoinedField(field).moved({"goal-line-right": (15.0, 15.0)}, {"centre-circle": (2.0, 0.0, 0.0)})

Where lines met they meet again, ends that lay on a line lie on it, landmarks stay on their lines and arcs, edges of
regions stay along theirs, and the size is that between the outer lines.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from touchline.core.field import Arc, Field, Landmark, Line, Point, Region
from touchline.core.geometry import Array, Points

Shift = tuple[float, float]  # to the left of a line at its start and at its end, mm
ArcChange = tuple[float, float, float]  # of an arc's radius, and of its centre along x and y, mm

SAME_MM = 1.0  # so near, two places are one
CROSSING = 0.2  # sine of the least angle at which two lines cross in a place that is known


class JoinedField:
    """A field, and which of its lines, arcs and landmarks hang together; that is looked up once."""

    def __init__(self, field: Field) -> None:
        self.field = field
        names = list(field.lines)
        ends = np.array([(line.start, line.end) for line in field.lines.values()]).reshape(-1, 2, 2)

        def lines_at(place: Point) -> list[str]:
            return [names[i] for i in np.flatnonzero(_distances(ends, np.asarray(place)) < SAME_MM)]

        self._ends = {(name, end): [other for other in lines_at(getattr(line, end)) if other != name]
                      for name, line in field.lines.items() for end in ("start", "end")}
        self._marks = {name: lines_at(mark.position) for name, mark in field.landmarks.items()}
        self._size = [(self._line_along(axis, sign * side / 2, -other / 2, other / 2), axis, sign * side / 2)
                      for axis, side, other in ((0, field.length_mm, field.width_mm),
                                                (1, field.width_mm, field.length_mm)) for sign in (1, -1)]

    def moved(self, shifts: Mapping[str, Shift], arcs: Mapping[str, ArcChange]) -> Field:
        """Return the field with those lines and arcs moved, in mm; the others stay."""
        field = self.field
        lines = {name: _shifted(line, shifts[name]) if name in shifts else line for name, line in field.lines.items()}
        rings = {name: arc.shifted(arcs[name][0], arcs[name][1:]) if name in arcs else arc
                 for name, arc in field.arcs.items()}
        joined = {name: replace(line, start=self._end(lines, name, "start"), end=self._end(lines, name, "end"))
                  for name, line in lines.items()}
        marks = {name: Landmark(name, self._carried(lines, rings, name)) for name in field.landmarks}
        right, left, top, bottom = (_at(lines[name], axis, 0.0) if name else at for name, axis, at in self._size)
        return replace(field, lines=joined, arcs=rings, landmarks=marks, length_mm=right - left, width_mm=top - bottom,
                       regions={name: self._resized(lines, region) for name, region in field.regions.items()})

    def _end(self, lines: Mapping[str, Line], name: str, end: str) -> Point:
        """Return where a line ends now: on the line that it ended at, else where the shift has taken it."""
        crossings = (_crossing(lines[name], lines[other]) for other in self._ends[name, end])
        return next((there for there in crossings if there is not None), getattr(lines[name], end))

    def _carried(self, lines: Mapping[str, Line], arcs: Mapping[str, Arc], name: str) -> Point:
        """Return where a landmark lies now: where its lines cross, on its line, on its arc, or where it was."""
        place, on = self.field.landmarks[name].position, self._marks[name]
        for one in on[1:]:
            if (there := _crossing(lines[on[0]], lines[one])) is not None:
                return there
        line = lines[on[0]] if on else None
        here = place
        if line is not None:
            before = self.field.lines[on[0]]
            share = float(np.linalg.norm(np.subtract(place, before.start))) / before.length_mm
            here = _point(np.asarray(line.start) * (1 - share) + np.asarray(line.end) * share)
        for arc_name, arc in self.field.arcs.items():
            away = float(np.linalg.norm(np.subtract(place, arc.centre)))
            if abs(away - arc.radius_mm) < SAME_MM:
                return _onto(arcs[arc_name], here, line, arc)
            if away < SAME_MM and line is None:
                return arcs[arc_name].centre
        return here

    def _line_along(self, axis: int, at: float, low: float, high: float) -> str:
        """Name the line along an edge at x (axis 0) or y (1), from end to end; "" where there is none."""
        for name, line in self.field.lines.items():
            ends = sorted((line.start[1 - axis], line.end[1 - axis]))
            if (all(abs(end[axis] - at) < SAME_MM for end in (line.start, line.end))
                    and ends[0] < low + SAME_MM and ends[1] > high - SAME_MM):
                return name
        return ""

    def _resized(self, lines: Mapping[str, Line], region: Region) -> Region:
        def edge(axis: int, at: float, low: float, high: float) -> float:
            name = self._line_along(axis, at, low, high)
            return _at(lines[name], axis, (low + high) / 2) if name else at
        (x0, x1), (y0, y1) = region.x_mm, region.y_mm
        return replace(region, x_mm=(edge(0, x0, y0, y1), edge(0, x1, y0, y1)),
                       y_mm=(edge(1, y0, x0, x1), edge(1, y1, x0, x1)))


def rounded_field(field: Field, digits: int = 1) -> Field:
    """Return the field with places to a tenth of a millimetre, as a tape gives them."""
    def spot(place: Point) -> Point:
        return (round(place[0], digits) + 0.0, round(place[1], digits) + 0.0)
    return replace(
        field, length_mm=round(field.length_mm, digits), width_mm=round(field.width_mm, digits),
        lines={name: replace(line, start=spot(line.start), end=spot(line.end)) for name, line in field.lines.items()},
        arcs={name: replace(arc, centre=spot(arc.centre), radius_mm=round(arc.radius_mm, digits))
              for name, arc in field.arcs.items()},
        landmarks={name: Landmark(name, spot(mark.position)) for name, mark in field.landmarks.items()},
        regions={name: replace(region, x_mm=spot(region.x_mm), y_mm=spot(region.y_mm))
                 for name, region in field.regions.items()})


def _distances(lines: Array, place: Points) -> Array:
    """Return how far a place is from each of the lines (n, 2, 2), between their ends."""
    start, along = lines[:, 0], lines[:, 1] - lines[:, 0]
    share = np.clip(np.sum((place - start) * along, axis=1) / np.sum(along**2, axis=1), 0.0, 1.0)
    return np.linalg.norm(start + share[:, None] * along - place, axis=1)


def _shifted(line: Line, shift: Shift) -> Line:
    start, end = np.asarray(line.start), np.asarray(line.end)
    left = line.normals(start)
    return replace(line, start=_point(start + shift[0] * left), end=_point(end + shift[1] * left))


def _point(place: Array) -> Point:
    return (float(place[0]), float(place[1]))


def _crossing(one: Line, other: Line) -> Point | None:
    """Return where two lines cross, both endless; None where they hardly do."""
    (ax, ay), (bx, by) = np.subtract(one.end, one.start).tolist(), np.subtract(other.end, other.start).tolist()
    sine = ax * by - ay * bx
    if abs(sine) < CROSSING * np.hypot(ax, ay) * np.hypot(bx, by):
        return None
    x, y = other.start[0] - one.start[0], other.start[1] - one.start[1]
    share = (x * by - y * bx) / sine
    return (one.start[0] + share * ax, one.start[1] + share * ay)


def _at(line: Line, axis: int, along: float) -> float:
    """Return a line's x (axis 0) where its y is `along`, or its y (1) at that x."""
    share = (along - line.start[1 - axis]) / (line.end[1 - axis] - line.start[1 - axis])
    return line.start[axis] + share * (line.end[axis] - line.start[axis])


def _onto(arc: Arc, place: Point, line: Line | None, before: Arc) -> Point:
    """Return the place on the moved arc: at the same angle, or where its line meets the arc nearest to it."""
    if line is None:
        arm = np.subtract(place, before.centre) * (arc.radius_mm / before.radius_mm)
        return _point(np.asarray(arc.centre) + arm)
    foot = line.nearest(np.asarray(arc.centre))
    half = np.sqrt(max(0.0, arc.radius_mm**2 - float(np.sum((foot - arc.centre) ** 2))))
    ends = [foot + way * half * line.tangents(foot) for way in (-1.0, 1.0)]
    return _point(min(ends, key=lambda end: float(np.linalg.norm(end - place))))
