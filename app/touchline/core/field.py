"""A playing field: its lines, arcs, landmarks and regions, in millimetres (frames: see geometry.py).

All positions are those of line *centres*. A region names the part of the field that one camera sees, and
how it stands in the corrected picture: `rotate` turns the field counter-clockwise, in quarter turns, so that
the region's left and right borders run down the picture and its top and bottom borders across it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from dataclasses import field as member
from functools import lru_cache
from typing import Any, Self

import numpy as np
from typing_extensions import TypedDict

from touchline.core.errors import BadInput, NotFound
from touchline.core.geometry import Points, as_pair, as_points
from touchline.core.json_values import PointJson
from touchline.core.statements import Stated

LineJson = TypedDict(
    "LineJson", {"name": str, "from": PointJson, "to": PointJson, "width_mm": float}
)

BORDERS = ("left", "right", "top", "bottom")
QUARTER_TURNS = (0, 90, 180, 270)
DEFAULT_LINE_WIDTH_MM = 10.0
LINE_SIGMA_MM = 3.0  # of painted lines about their places
# where the pattern of a Small Size League robot is; other leagues' fields say theirs
ROBOT_TOP_MM = 150.0


class ArcJson(TypedDict):
    name: str
    centre: PointJson
    radius_mm: float
    start_deg: float
    end_deg: float
    width_mm: float


class RegionJson(TypedDict):
    """x, y: its smallest and largest mm; width_mm, height_mm: as it stands in the corrected picture."""

    name: str
    x: PointJson
    y: PointJson
    rotate: int
    width_mm: float
    height_mm: float
    left: LineJson
    right: LineJson
    top: LineJson
    bottom: LineJson


class FieldJson(Stated):
    name: str
    title: str
    length_mm: float
    width_mm: float
    lines: list[LineJson]
    arcs: list[ArcJson]
    landmarks: dict[str, PointJson]
    regions: dict[str, RegionJson]
    hat_height_mm: float
    line_sigma_mm: float
    extras: dict[str, Any]


Point = tuple[float, float]


@dataclass(frozen=True)
class Line:
    """A straight marking, or a region's border."""

    name: str
    start: Point
    end: Point
    width_mm: float = DEFAULT_LINE_WIDTH_MM

    def nearest(self, points: Points) -> Points:
        """The foot on the endless line of each point (..., 2) mm, field frame."""
        start, end = np.asarray(self.start), np.asarray(self.end)
        along = (end - start) / np.linalg.norm(end - start)
        return start + ((points - start) @ along)[..., None] * along

    def tangents(self, points: Points) -> Points:
        """Unit vectors along the line, one for each of the points (..., 2)."""
        return np.broadcast_to((np.array(self.end) - self.start) / self.length_mm, points.shape)

    def normals(self, points: Points) -> Points:
        """Unit vectors to the line's left, likewise."""
        along = self.tangents(points)
        return np.stack([-along[..., 1], along[..., 0]], axis=-1)

    def shifted(self, offset_mm: float) -> Self:
        """The same line so far to the left of it."""
        if not offset_mm:
            return self
        start, end = np.asarray(self.start), np.asarray(self.end)
        along = (end - start) / np.linalg.norm(end - start)
        aside = offset_mm * np.array([-along[1], along[0]])
        return replace(self, start=as_pair(start + aside), end=as_pair(end + aside))

    def sample(self, count: int) -> Points:
        """(count, 2) evenly spaced points from start to end."""
        t = np.linspace(0.0, 1.0, count)[:, None]
        return np.asarray(self.start) * (1 - t) + np.asarray(self.end) * t

    @property
    def length_mm(self) -> float:
        return float(np.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1]))

    def to_json(self) -> LineJson:
        return {
            "name": self.name,
            "from": list(self.start),
            "to": list(self.end),
            "width_mm": self.width_mm,
        }


@dataclass(frozen=True)
class Arc:
    """A circular marking, counter-clockwise from start_deg to end_deg."""

    name: str
    centre: Point
    radius_mm: float
    start_deg: float = 0.0
    end_deg: float = 360.0
    width_mm: float = DEFAULT_LINE_WIDTH_MM

    def nearest(self, points: Points) -> Points:
        """The foot on the whole circle of each point (..., 2) mm; NaN at the very centre."""
        arm = points - np.asarray(self.centre)
        length = np.linalg.norm(arm, axis=-1, keepdims=True)
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(self.centre) + arm * (self.radius_mm / length)

    def tangents(self, points: Points) -> Points:
        """Unit vectors along the arc at each of the points (..., 2) on it, counter-clockwise."""
        out = self.normals(points)
        return np.stack([-out[..., 1], out[..., 0]], axis=-1)

    def normals(self, points: Points) -> Points:
        """Unit vectors outwards, likewise."""
        return (points - np.asarray(self.centre)) / self.radius_mm

    def shifted(self, offset_mm: float, centre_mm: Point = (0.0, 0.0)) -> Self:
        """The same arc with so much more of a radius, about a centre so far from its own."""
        if not offset_mm and not any(centre_mm):
            return self
        x, y = self.centre
        return replace(
            self, radius_mm=self.radius_mm + offset_mm, centre=(x + centre_mm[0], y + centre_mm[1])
        )

    def sample(self, count: int) -> Points:
        """(count, 2) evenly spaced points from start_deg to end_deg."""
        angle = np.radians(np.linspace(self.start_deg, self.end_deg, count))
        return np.asarray(self.centre) + self.radius_mm * np.stack(
            [np.cos(angle), np.sin(angle)], axis=-1
        )

    @property
    def length_mm(self) -> float:
        return float(np.radians(abs(self.end_deg - self.start_deg)) * self.radius_mm)

    def to_json(self) -> ArcJson:
        return {
            "name": self.name,
            "centre": list(self.centre),
            "radius_mm": self.radius_mm,
            "start_deg": self.start_deg,
            "end_deg": self.end_deg,
            "width_mm": self.width_mm,
        }


@dataclass(frozen=True)
class Landmark:
    """A single known spot of the field."""

    name: str
    position: Point

    def nearest(self, points: Points) -> Points:
        return np.broadcast_to(np.asarray(self.position), points.shape)


Feature = Line | Arc | Landmark


@dataclass(frozen=True)
class Region:
    """A rectangle of the field, and how it stands in the corrected picture."""

    name: str
    x_mm: tuple[float, float]  # smallest, largest field x
    y_mm: tuple[float, float]
    rotate_deg: int = 0  # the field's turn in the picture, counter-clockwise

    @property
    def _axes(self) -> tuple[np.ndarray, np.ndarray]:
        """Unit vectors of u (right) and v (down) in the field frame."""
        turn = np.radians(self.rotate_deg)
        cos, sin = round(np.cos(turn)), round(np.sin(turn))
        return np.array([cos, -sin], float), np.array([-sin, -cos], float)

    @property
    def _origin(self) -> np.ndarray:
        """The region's top-left corner as it stands in the picture, field mm."""
        u, v = self._axes
        corners = np.array([(x, y) for x in self.x_mm for y in self.y_mm])
        return corners[np.argmin(corners @ (u + v))]

    @property
    def _sides(self) -> tuple[float, float]:
        (x0, x1), (y0, y1) = self.x_mm, self.y_mm
        return (x1 - x0, y1 - y0) if self.rotate_deg % 180 == 0 else (y1 - y0, x1 - x0)

    @property
    def width_mm(self) -> float:
        """Extent along u, across the picture."""
        return self._sides[0]

    @property
    def height_mm(self) -> float:
        """Extent along v, down the picture."""
        return self._sides[1]

    def field_from_region(self, points: Points) -> Points:
        """(..., 2) mm (u, v) to field mm (x, y)."""
        return self._origin + points @ np.stack(self._axes)

    def region_from_field(self, points: Points) -> Points:
        """(..., 2) field mm to (u, v) mm."""
        return (points - self._origin) @ np.stack(self._axes).T

    @lru_cache(maxsize=4096)  # noqa: B019, a region is a few numbers, and every list of fields asks for its borders
    def border(self, name: str) -> Line:
        """One of left, right, top, bottom, as a line in field mm, running right or down the picture."""
        w, h = self.width_mm, self.height_mm
        ends = {
            "left": ((0, 0), (0, h)),
            "right": ((w, 0), (w, h)),
            "top": ((0, 0), (w, 0)),
            "bottom": ((0, h), (w, h)),
        }[name]
        start, end = (self.field_from_region(np.array(p, float)) for p in ends)
        return Line(name, (float(start[0]), float(start[1])), (float(end[0]), float(end[1])))

    def rotated(self, rotate_deg: int) -> Self:
        """The same rectangle, standing otherwise in the picture."""
        if rotate_deg not in QUARTER_TURNS:
            raise BadInput(
                f"A covered area cannot be rotated by {rotate_deg}°.",
                "Use 0, 90, 180 or 270.",
                reason="bad-rotation",
            )
        return replace(self, rotate_deg=rotate_deg)

    def to_json(self) -> RegionJson:
        left, right, top, bottom = (self.border(name).to_json() for name in BORDERS)
        return {
            "name": self.name,
            "x": list(self.x_mm),
            "y": list(self.y_mm),
            "rotate": self.rotate_deg,
            "width_mm": self.width_mm,
            "height_mm": self.height_mm,
            "left": left,
            "right": right,
            "top": top,
            "bottom": bottom,
        }


@dataclass(frozen=True)
class Field:
    """A field by name, with everything that is painted on it.

    hat_height_mm: how high above the carpet robots carry their patterns, where errors are evaluated as well.
    line_sigma_mm: how far its lines may lie beside their places, σ; 0 where they are exact.
    line_offsets_mm: by feature, how far beside its place a fit found it: along a line's normal, of an arc's radius;
    arc_offsets_mm: of an arc's centre.
    """

    name: str
    title: str
    length_mm: float
    width_mm: float
    lines: Mapping[str, Line]
    arcs: Mapping[str, Arc]
    landmarks: Mapping[str, Landmark]
    regions: Mapping[str, Region]
    # goals, boundary, ball: drawn and published, not fitted
    extras: Mapping[str, Any] = member(default_factory=dict)
    hat_height_mm: float = ROBOT_TOP_MM
    line_sigma_mm: float = LINE_SIGMA_MM
    line_offsets_mm: Mapping[str, float] = member(default_factory=dict)
    arc_offsets_mm: Mapping[str, Point] = member(default_factory=dict)

    def as_painted(self, found: Mapping[str, Any], region: Region) -> Self:
        """Return the same field with its markings where a fit found them, and lines along the borders with these.

        found: the fit's notes or report, with "line_offsets_mm" and "arc_offsets_mm" where it knows them.
        """
        every = dict(found.get("line_offsets_mm") or {})
        for name, line in self.lines.items():
            border, side = _border_along(line, region)
            if name not in every and border in every:
                every[name] = side * every[border]
        return replace(
            self, line_offsets_mm=every, arc_offsets_mm=found.get("arc_offsets_mm") or {}
        )

    @property
    def markings(self) -> tuple[Line | Arc, ...]:
        """All lines and arcs, where they lie."""
        return (*map(self._painted, self.lines.values()), *map(self._painted, self.arcs.values()))

    def _painted(self, marking: Line | Arc) -> Line | Arc:
        offset_mm = self.line_offsets_mm.get(marking.name, 0.0)
        if isinstance(marking, Line):
            return marking.shifted(offset_mm)
        return marking.shifted(offset_mm, self.arc_offsets_mm.get(marking.name, (0.0, 0.0)))

    def observed_name(self, marking: str, region: Region) -> str:
        """Return the marking's name, or that of the region's border along it, which every model accepts."""
        return (marking in self.lines and _border_along(self.lines[marking], region)[0]) or marking

    def region(self, name: str, rotate_deg: int | None = None) -> Region:
        """A region by name, turned otherwise if rotate_deg is given."""
        try:
            region = self.regions[name]
        except (KeyError, TypeError):
            raise NotFound(
                f"The field {self.name} has no covered area called {name!r}.",
                f"Use one of: {', '.join(self.regions)}.",
                reason="unknown-region",
            ) from None
        return region if rotate_deg is None else region.rotated(rotate_deg)

    def feature(self, name: str | Point, region: Region) -> Feature:
        """What an observation's feature means: a region's border, a marking, or a spot given in mm."""
        if not isinstance(name, str):
            x, y = as_points(name, "The landmark's field position")
            return Landmark(f"({x:g}, {y:g}) mm", (float(x), float(y)))
        if name in BORDERS:
            return self._painted(region.border(name))
        for table in (self.lines, self.arcs):
            if name in table:
                return self._painted(table[name])
        if name in self.landmarks:
            return self.landmarks[name]
        known = (*BORDERS, *self.lines, *self.arcs, *self.landmarks)
        raise BadInput(
            f"The field {self.name} has no feature called {name!r}.",
            f"Use one of: {', '.join(known)}.",
            reason="unknown-feature",
        )

    def to_json(self) -> FieldJson:
        return {
            "name": self.name,
            "title": self.title,
            "length_mm": self.length_mm,
            "width_mm": self.width_mm,
            "lines": [line.to_json() for line in self.lines.values()],
            "arcs": [arc.to_json() for arc in self.arcs.values()],
            "landmarks": {m.name: list(m.position) for m in self.landmarks.values()},
            "regions": {r.name: r.to_json() for r in self.regions.values()},
            "hat_height_mm": self.hat_height_mm,
            "line_sigma_mm": self.line_sigma_mm,
            "extras": dict(self.extras),
        }


@lru_cache(maxsize=1024)
def _border_along(line: Line, region: Region) -> tuple[str | None, float]:
    """Return the region's border that lies on the line, and 1 or -1 where it runs as the line does, or against it."""
    low, high = np.minimum(line.start, line.end), np.maximum(line.start, line.end)
    for name in BORDERS:
        border = region.border(name)
        ends = np.array([border.start, border.end])
        if (
            np.abs(line.nearest(ends) - ends).max() < 1
            and (ends >= low - 1).all()
            and (ends <= high + 1).all()
        ):
            return name, float(np.sign(line.tangents(ends)[0] @ border.tangents(ends)[0]))
    return None, 0.0
