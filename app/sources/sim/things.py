"""Things that stand on the field, drawn where a camera really sees them: at their own height.

A tall thing is an outline on the ground, swept from z_low to z_high. Seen from above, a pixel shows its top where the
ray meets the outline at z_high, and its side where the ray passes the outline anywhere between.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.sources.sim.paint import Ground, Plane, inside

Colour = tuple[float, float, float]  # BGR
Outline = Callable[[NDArray], NDArray]  # points (..., 2) mm → signed distance mm, negative inside
Spot = tuple[float, float]
_STEP_MM = 8.0  # of a side's sweep, at most: less than half of the thinnest wall


def disc(centre: Spot, radius_mm: float) -> Outline:
    return lambda p: np.hypot(p[..., 0] - centre[0], p[..., 1] - centre[1]) - radius_mm


def capsule(start: Spot, end: Spot, radius_mm: float) -> Outline:
    a, ab = np.array(start), np.subtract(end, start)

    def distance(p: NDArray) -> NDArray:
        t = np.clip(((p - a) @ ab) / (ab @ ab), 0, 1)
        return np.linalg.norm(p - a - t[..., None] * ab, axis=-1) - radius_mm
    return distance


def box(centre: Spot, half: Spot, angle: float) -> Outline:
    c, s = np.cos(angle), np.sin(angle)

    def distance(p: NDArray) -> NDArray:
        q = np.abs((p - np.array(centre)) @ np.array([[c, -s], [s, c]])) - np.array(half)
        return np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(axis=-1), 0)
    return distance


def cut(outline: Outline, centre: Spot, angle: float, ahead_mm: float) -> Outline:
    """The outline without what lies more than ahead_mm before its centre: a robot's flat front."""
    n = np.array([np.cos(angle), np.sin(angle)])
    return lambda p: np.maximum(outline(p), (p - np.array(centre)) @ n - ahead_mm)


@dataclass(frozen=True, eq=False)
class Tall:
    """An outline swept from z_low to z_high, and what is painted on its top."""

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

    centre: Spot
    radius_mm: float
    colour: Colour
    shadow: float = 0.25


def draw(picture: NDArray[np.float32], ground: Ground, light: Plane, things: Iterable[Tall | Ball],
         sigma_px: float) -> None:
    """Draw the things into a BGR picture in place, in the order given: the farther ones first."""
    for thing in things:
        high = thing.z_high if isinstance(thing, Tall) else 2 * thing.radius_mm
        reach = thing.reach_mm if isinstance(thing, Tall) else thing.radius_mm
        part = _window(ground, thing.centre, 1.5 * reach + 20, high)
        if part is not None:
            patch = _Patch(picture[part], ground.field_mm[part], light[part],
                           sigma_px * ground.mm_per_px[part] + 1e-3, ground.camera.position_mm)
            (_draw_tall if isinstance(thing, Tall) else _draw_ball)(patch, thing)


@dataclass(frozen=True, eq=False)
class _Patch:
    """A window of the picture with everything that drawing needs."""

    picture: NDArray[np.float32]
    floor: NDArray  # field mm
    light: Plane
    sigma_mm: NDArray
    eye: tuple[float, float, float]

    def at(self, z_mm: float) -> NDArray:
        """Where the pixels look at height z: on the way from the floor to the eye."""
        return self.floor + (np.array(self.eye[:2]) - self.floor) * (z_mm / self.eye[2])

    def lay(self, distance: NDArray, colour: Colour, within: NDArray | float = 1.0, z_mm: float = 0.0) -> None:
        sigma = self.sigma_mm * (1 - z_mm / self.eye[2])
        cover = (np.nan_to_num(inside(distance, sigma)) * within)[..., None].astype(np.float32)
        self.picture[:] += cover * (np.float32(colour) * self.light[..., None] - self.picture)

    def darken(self, distance: NDArray, soft_mm: float, strength: float) -> None:
        shade = 1 - strength * np.nan_to_num(inside(distance, np.float64(soft_mm)))
        self.picture[:] *= shade[..., None].astype(np.float32)


def _window(ground: Ground, centre: Spot, reach_mm: float, z_high: float) -> tuple[slice, slice] | None:
    """The part of the picture in which a thing can be seen, or None."""
    angle = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    ring = np.array(centre) + reach_mm * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    around = [np.concatenate([ring, np.full((16, 1), z)], axis=1) for z in (0.0, z_high)]
    raw = ground.camera.raw_from_field(np.concatenate(around))
    if not np.isfinite(raw).all():
        return None
    w, h = ground.size
    (x0, y0), (x1, y1) = np.floor(raw.min(axis=0)).astype(int) - 3, np.ceil(raw.max(axis=0)).astype(int) + 4
    x0, y0, x1, y1 = max(x0, 0), max(y0, 0), min(x1, w), min(y1, h)
    return (slice(y0, y1), slice(x0, x1)) if x1 > x0 and y1 > y0 else None


def _draw_tall(patch: _Patch, thing: Tall) -> None:
    if thing.shadow:
        patch.darken(thing.outline(patch.floor) - 8, 0.28 * thing.reach_mm, thing.shadow)
    lean = np.hypot(*np.subtract(thing.centre, patch.eye[:2])) / patch.eye[2]
    step_mm = min(_STEP_MM, 2 * float(patch.sigma_mm.min()))  # as fine as the blur: no stairs are seen
    steps = int(np.clip(lean * (thing.z_high - thing.z_low) / step_mm, 2, 64))
    levels = np.linspace(thing.z_low, thing.z_high, steps)
    patch.lay(np.min([thing.outline(patch.at(z)) for z in levels], axis=0), thing.side, z_mm=thing.z_low)
    top = patch.at(thing.z_high)
    patch.lay(thing.outline(top), thing.top, z_mm=thing.z_high)
    for outline, colour in thing.on_top:
        patch.lay(outline(top), colour, z_mm=thing.z_high)


def _draw_ball(patch: _Patch, ball: Ball) -> None:
    middle = np.array([*ball.centre, ball.radius_mm])
    patch.darken(disc(ball.centre, ball.radius_mm)(patch.floor), 0.5 * ball.radius_mm, ball.shadow)
    ray = np.concatenate([patch.floor, np.zeros((*patch.floor.shape[:-1], 1))], axis=-1) - np.array(patch.eye)
    to_ball = middle - np.array(patch.eye)
    off = np.linalg.norm(np.cross(ray, to_ball), axis=-1) / np.linalg.norm(ray, axis=-1)
    patch.lay(off - ball.radius_mm, ball.colour)
    shine = disc((ball.centre[0] - 0.3 * ball.radius_mm, ball.centre[1] + 0.3 * ball.radius_mm), 0.25 * ball.radius_mm)
    patch.lay(shine(patch.at(1.8 * ball.radius_mm)), (150.0, 190.0, 255.0))
