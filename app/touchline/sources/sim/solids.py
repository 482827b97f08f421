"""Solids on the field: outlines on the ground, extruded from a height to a height.

Seen from above, a pixel looks at a solid's top where its ray meets the outline at z_high, and at its side where the ray
passes the outline anywhere between; so what counts for the side is the least distance along a short way on the ground.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Colour = tuple[float, float, float]  # BGR
Spot = tuple[float, float]
Plane = NDArray[np.floating]  # float32
_GOLDEN = (np.sqrt(5.0) - 1) / 2
_NARROWINGS = 9  # each leaves 0.62 of the way: 1.3 %, 2 mm of a robot's side


class Outline(Protocol):
    def distance(self, x: Plane, y: Plane) -> Plane:
        """Return the signed distance mm of points from the outline, negative inside."""

    def swept(self, x: Plane, y: Plane, dx: Plane, dy: Plane) -> Plane:
        """Return the least signed distance on the way from (x, y) to (x + dx, y + dy)."""


@dataclass(frozen=True)
class Disc:
    centre: Spot
    radius_mm: float

    def distance(self, x: Plane, y: Plane) -> Plane:
        px, py = x - self.centre[0], y - self.centre[1]
        return np.sqrt(px * px + py * py) - self.radius_mm

    def swept(self, x: Plane, y: Plane, dx: Plane, dy: Plane) -> Plane:
        px, py = x - self.centre[0], y - self.centre[1]
        t = np.clip(-(px * dx + py * dy) / (dx * dx + dy * dy + np.float32(1e-9)), 0, 1)
        px, py = px + t * dx, py + t * dy
        return np.sqrt(px * px + py * py) - self.radius_mm


@dataclass(frozen=True)
class Capsule:
    """Everything within radius_mm of the line from start to end."""

    start: Spot
    end: Spot
    radius_mm: float

    def distance(self, x: Plane, y: Plane) -> Plane:
        bx, by = self._stroke
        return np.sqrt(_to_way(self.start[0] - x, self.start[1] - y, bx, by)) - self.radius_mm

    def swept(self, x: Plane, y: Plane, dx: Plane, dy: Plane) -> Plane:
        """Two ways that do not cross are nearest at an end of one of them."""
        bx, by = self._stroke
        px, py = x - self.start[0], y - self.start[1]
        ends = [
            _to_way(-px, -py, bx, by),
            _to_way(-px - dx, -py - dy, bx, by),
            _to_way(px, py, dx, dy),
            _to_way(px - bx, py - by, dx, dy),
        ]
        turn = by * dx - bx * dy
        safe = np.where(np.abs(turn) > 1e-6, turn, np.float32(np.inf))
        t, s = (bx * py - by * px) / safe, (dx * py - dy * px) / safe
        crossing = (t > 0) & (t < 1) & (s > 0) & (s < 1)
        nearest = np.minimum(np.minimum(ends[0], ends[1]), np.minimum(ends[2], ends[3]))
        return np.sqrt(np.where(crossing, np.float32(0), nearest)) - self.radius_mm

    @property
    def _stroke(self) -> Spot:
        return self.end[0] - self.start[0], self.end[1] - self.start[1]


def _to_way(px: Plane, py: Plane, dx: Plane | float, dy: Plane | float) -> Plane:
    """Squared distance from the origin to the way from (px, py) to (px + dx, py + dy)."""
    t = np.clip(-(px * dx + py * dy) / (dx * dx + dy * dy + np.float32(1e-9)), 0, 1)
    qx, qy = px + t * dx, py + t * dy
    return qx * qx + qy * qy


@dataclass(frozen=True)
class Box:
    centre: Spot
    half: Spot
    angle: float

    def distance(self, x: Plane, y: Plane) -> Plane:
        c, s = float(np.cos(self.angle)), float(np.sin(self.angle))
        px, py = x - self.centre[0], y - self.centre[1]
        qx, qy = np.abs(px * c + py * s) - self.half[0], np.abs(py * c - px * s) - self.half[1]
        ox, oy = np.maximum(qx, 0), np.maximum(qy, 0)
        return np.sqrt(ox * ox + oy * oy) + np.minimum(np.maximum(qx, qy), 0)

    def swept(self, x: Plane, y: Plane, dx: Plane, dy: Plane) -> Plane:
        """The distance from a convex outline has one minimum along a straight way, found by golden sections."""
        g = np.float32(_GOLDEN)
        low, high = np.zeros_like(x), np.ones_like(x)
        left, right = high - g, low + g
        at_left = self.distance(x + left * dx, y + left * dy)
        at_right = self.distance(x + right * dx, y + right * dy)
        best = np.minimum(at_left, at_right)
        for _ in range(_NARROWINGS):
            go_left = at_left < at_right
            low, high = np.where(go_left, low, left), np.where(go_left, right, high)
            fresh = np.where(go_left, high - g * (high - low), low + g * (high - low))
            seen = self.distance(x + fresh * dx, y + fresh * dy)
            left, right = np.where(go_left, fresh, right), np.where(go_left, left, fresh)
            at_left, at_right = np.where(go_left, seen, at_right), np.where(go_left, at_left, seen)
            best = np.minimum(best, seen)
        ends = np.minimum(self.distance(x, y), self.distance(x + dx, y + dy))
        return np.minimum(best, ends)


@dataclass(frozen=True)
class CutDisc:
    """A disc without what lies more than ahead_mm before its centre: a robot with its flat front."""

    centre: Spot
    radius_mm: float
    angle: float
    ahead_mm: float

    def distance(self, x: Plane, y: Plane) -> Plane:
        nx, ny = float(np.cos(self.angle)), float(np.sin(self.angle))
        px, py = x - self.centre[0], y - self.centre[1]
        return np.maximum(
            np.sqrt(px * px + py * py) - self.radius_mm, px * nx + py * ny - self.ahead_mm
        )

    def swept(self, x: Plane, y: Plane, dx: Plane, dy: Plane) -> Plane:
        """The larger of a valley (the disc) and a slope (the front): lowest in the valley, at an end, or where they
        meet, which Newton's method finds from the end, as their difference is convex.
        """
        nx, ny = float(np.cos(self.angle)), float(np.sin(self.angle))
        px, py = x - self.centre[0], y - self.centre[1]
        front, rise = px * nx + py * ny - self.ahead_mm, dx * nx + dy * ny
        dd, pd, pp = dx * dx + dy * dy + np.float32(1e-9), px * dx + py * dy, px * px + py * py

        def valley(t: Plane) -> Plane:
            return np.sqrt(np.maximum(pp + t * (2 * pd + t * dd), np.float32(1e-6)))

        lowest = np.clip(-pd / dd, 0, 1)
        t = np.where(rise > 0, np.float32(0), np.float32(1))
        for _ in range(3):
            arm = valley(t)
            over = arm - self.radius_mm - front - t * rise
            slope = (pd + t * dd) / arm - rise
            step = np.where(
                (over > 0) & (np.abs(slope) > 1e-6),
                over / np.where(slope == 0, 1, slope),
                np.float32(0),
            )
            t = np.clip(t - step, 0, 1)
        bottom = np.maximum(valley(lowest) - self.radius_mm, front + lowest * rise)
        return np.minimum(bottom, np.maximum(valley(t) - self.radius_mm, front + t * rise))


@dataclass(frozen=True, eq=False)
class Prism:
    """An outline swept from z_low to z_high, and what is painted on its top."""

    owner: str  # what this is a part of, such as "yellow 3"
    outline: Outline
    centre: Spot
    reach_mm: float  # no part of the outline is further from the centre
    z_low: float
    z_high: float
    top: Colour
    side: Colour
    on_top: tuple[tuple[Outline, Colour], ...] = ()
    shadow: float = 0.0  # how much darker the carpet around it is, 0…1


@dataclass(frozen=True, eq=False)
class Ball:
    """A sphere lying on the carpet."""

    owner: str
    centre: Spot
    radius_mm: float
    colour: Colour
    shadow: float = 0.25

    @property
    def reach_mm(self) -> float:
        return self.radius_mm

    @property
    def z_high(self) -> float:
        return 2 * self.radius_mm


Solid = Prism | Ball
