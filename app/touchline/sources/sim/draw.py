"""Draw solids as a camera sees them, each at its height, on the still picture, and erase them after the frame.

layers() computes which share of each pixel every part of a solid covers; the picture takes the parts' colours, the
tests' truth their owners.

A grey level is 32 steps, so that what is still stays exact to 0.03 grey levels. Per frame only the windows of moving
solids are touched; then the whole is scaled by the light, given noise and rounded to 8 bits, strip by strip, so that
no strip leaves the processor's cache on the way.
"""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.sources.sim.camera import SimCamera
from touchline.sources.sim.ground import Ground, inside
from touchline.sources.sim.solids import Ball, Colour, Disc, Plane, Prism, Solid

Window = tuple[slice, slice]
SHINE: Colour = (150.0, 190.0, 255.0)
_EDGE = 4.0  # sigmas; beyond it nothing is covered
_RING = np.linspace(0, 2 * np.pi, 16, endpoint=False)

STEPS = 32  # a grey level; 16 bits then reach four times as bright as white
_ROWS = 8  # of a strip
_SHEET = 1 << 22  # random numbers; each strip takes a random piece


@dataclass(frozen=True, eq=False)
class Layer:
    """cover (rows, columns) 0…1 of a colour, at a place within the window."""

    part: Window
    cover: Plane
    colour: Colour


@dataclass(frozen=True, eq=False)
class Scene:
    """What drawing needs to know of every pixel of a picture, or of a window of it, as planes (rows, columns)."""

    camera: SimCamera
    x_mm: Plane
    y_mm: Plane
    sigma_mm: Plane
    light: Plane

    @classmethod
    def of(cls, ground: Ground, light: Plane, sigma_px: float) -> "Scene":
        x, y = (np.ascontiguousarray(ground.field_mm[..., i], np.float32) for i in (0, 1))
        return cls(
            ground.camera,
            x,
            y,
            (sigma_px * ground.mm_per_px + 1e-3).astype(np.float32),
            np.ascontiguousarray(light, np.float32),
        )

    def windows(self, solids: list[Solid]) -> list[Window | None]:
        """Return the part of the picture in which each solid can be seen, or None."""
        if not solids:
            return []
        ring = np.stack([np.cos(_RING), np.sin(_RING)], axis=-1)
        reach = np.array([1.5 * solid.reach_mm + 20 for solid in solids])
        foot = np.array([solid.centre for solid in solids])[:, None] + reach[:, None, None] * ring
        high = np.broadcast_to(
            np.array([solid.z_high for solid in solids])[:, None, None], (*foot.shape[:2], 1)
        )
        both = np.concatenate(
            [np.concatenate([foot, 0 * high], -1), np.concatenate([foot, high], -1)], axis=1
        )
        return [self._window(raw) for raw in self.camera.raw_from_field(both)]

    def _window(self, raw: NDArray) -> Window | None:
        if not np.isfinite(raw).all():
            return None
        w, h = self.camera.image_size
        (x0, y0), (x1, y1) = (
            np.floor(raw.min(axis=0)).astype(int) - 3,
            np.ceil(raw.max(axis=0)).astype(int) + 4,
        )
        x0, y0, x1, y1 = max(x0, 0), max(y0, 0), min(x1, w), min(y1, h)
        return (slice(y0, y1), slice(x0, x1)) if x1 > x0 and y1 > y0 else None

    def cut(self, part: Window) -> "Scene":
        return Scene(
            self.camera, self.x_mm[part], self.y_mm[part], self.sigma_mm[part], self.light[part]
        )

    def at(self, z_mm: float) -> tuple[Plane, Plane]:
        """Return where the pixels look at height z: on the way from the floor to the camera."""
        eye_x, eye_y, eye_z = self.camera.position_mm
        up = z_mm / eye_z
        return self.x_mm + (eye_x - self.x_mm) * up, self.y_mm + (eye_y - self.y_mm) * up

    @cached_property
    def widest_mm(self) -> float:
        return _EDGE * float(np.nanmax(self.sigma_mm, initial=0))

    def layer(
        self, distance: Plane, colour: Colour, z_mm: float, within: Window | None = None
    ) -> Layer | None:
        """Return the covered part of the window as a layer. within: this cut's place in the window."""
        near = distance < self.widest_mm
        rows, columns = np.flatnonzero(near.any(axis=1)), np.flatnonzero(near.any(axis=0))
        if not rows.size:
            return None
        part = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
        cover = _covered(
            distance[part], self.sigma_mm[part] * (1 - z_mm / self.camera.position_mm[2])
        )
        return Layer(part if within is None else _shifted(part, within), cover, colour)


def _covered(distance: Plane, sigma: Plane | float) -> Plane:
    """Return the coverage, 0 where the pixel looks past the ground."""
    cover = inside(distance, sigma)
    return cover if np.isfinite(cover[0, 0]) and np.isfinite(cover).all() else np.nan_to_num(cover)


def _shifted(part: Window, within: Window) -> Window:
    (rows, columns), (top, left) = part, (within[0].start, within[1].start)
    return slice(rows.start + top, rows.stop + top), slice(
        columns.start + left, columns.stop + left
    )


def draw(
    picture: NDArray,
    scene: Scene,
    solids: Iterable[Solid],
    scale: float = 1.0,
    tint: Colour = (1.0, 1.0, 1.0),
) -> list[tuple[Window, NDArray]]:
    """Draw into a BGR picture in place, farther solids first; return the changed windows, and what was there before.

    A colour becomes colour · tint · scale · light.
    """
    solids = list(solids)
    changed = []
    for solid, window in zip(solids, scene.windows(solids), strict=True):
        if window is None:
            continue
        patch = scene.cut(window)
        changed.append((window, picture[window].copy()))
        # channel by channel is twice as fast
        planes = picture[window].transpose(2, 0, 1).astype(np.float32)
        darker = shadow(patch, solid)
        if darker is not None:
            planes *= darker
        for layer in layers(patch, solid):
            light = layer.cover * patch.light[layer.part]
            bare = 1 - layer.cover
            for plane, value, factor in zip(planes, layer.colour, tint, strict=True):
                part = plane[layer.part]
                part *= bare
                part += light * (value * factor * scale)
        if picture.dtype != np.float32:
            np.rint(planes, out=planes)
            np.clip(planes, 0, np.iinfo(picture.dtype).max, out=planes)
        picture[window] = planes.transpose(1, 2, 0)
    return changed


def shadow(patch: Scene, solid: Solid) -> Plane | None:
    """Return the factor of a solid's soft shadow on what lies around it."""
    if not solid.shadow:
        return None
    if isinstance(solid, Ball):
        away, soft_mm = (
            Disc(solid.centre, solid.radius_mm).distance(patch.x_mm, patch.y_mm),
            0.5 * solid.radius_mm,
        )
    else:
        away, soft_mm = solid.outline.distance(patch.x_mm, patch.y_mm) - 8, 0.28 * solid.reach_mm
    return 1 - solid.shadow * _covered(away, soft_mm)


def layers(patch: Scene, solid: Solid) -> Iterator[Layer]:
    """Yield what covers the carpet: the side, the top, what is painted on it."""
    found = _ball_layers(patch, solid) if isinstance(solid, Ball) else _prism_layers(patch, solid)
    return (layer for layer in found if layer is not None)


def _prism_layers(patch: Scene, solid: Prism) -> Iterator[Layer | None]:
    low, top = patch.at(solid.z_low), patch.at(solid.z_high)
    yield patch.layer(
        solid.outline.swept(*low, top[0] - low[0], top[1] - low[1]), solid.side, solid.z_low
    )
    lid = patch.layer(solid.outline.distance(*top), solid.top, solid.z_high)
    yield lid
    if lid is None or not solid.on_top:
        return
    small, x, y = patch.cut(lid.part), top[0][lid.part], top[1][lid.part]
    for outline, colour in solid.on_top:
        yield small.layer(outline.distance(x, y), colour, solid.z_high, lid.part)


def _ball_layers(patch: Scene, ball: Ball) -> Iterator[Layer | None]:
    """Use each ray's distance from the ball's centre: |ray × to the centre| / |ray|."""
    (ex, ey, ez), r = patch.camera.position_mm, ball.radius_mm
    rx, ry, rz = patch.x_mm - ex, patch.y_mm - ey, -ez
    bx, by, bz = ball.centre[0] - ex, ball.centre[1] - ey, r - ez
    cx, cy, cz = ry * bz - rz * by, rz * bx - rx * bz, rx * by - ry * bx
    off = np.sqrt((cx * cx + cy * cy + cz * cz) / (rx * rx + ry * ry + rz * rz))
    yield patch.layer(off - r, ball.colour, 0.0)
    shine = Disc((ball.centre[0] - 0.3 * r, ball.centre[1] + 0.3 * r), 0.25 * r)
    yield patch.layer(shine.distance(*patch.at(1.8 * r)), SHINE, 0.0)


def in_steps(picture: NDArray, steps: float | Colour) -> NDArray[np.int16]:
    """Return a picture (height, width, 3) times so many, of each colour, as whole numbers."""
    scaled = np.multiply(picture, np.asarray(steps, np.float32))
    np.rint(scaled, out=scaled)
    return np.clip(scaled, 0, np.iinfo(np.int16).max, out=scaled).astype(np.int16)


class Canvas:
    """One still picture (height, width, 3) in steps, ready to be drawn on; untinted, that very array."""

    def __init__(self, still: NDArray[np.int16], scene: Scene, tint: Colour) -> None:
        self._scene, self._tint = scene, tint
        self._picture = still if tint == (1.0, 1.0, 1.0) else in_steps(still, tint)

    @contextmanager
    def drawn(self, solids: list[Solid]) -> Iterator[None]:
        """Have these on it for as long as the context lasts."""
        changed = draw(self._picture, self._scene, solids, STEPS, self._tint)
        try:
            yield
        finally:
            for window, before in reversed(changed):  # they may overlap
                self._picture[window] = before

    def develop(
        self, gain: NDArray | float, noise: float, seed: int, index: int
    ) -> NDArray[np.uint8]:
        """Return a new frame. gain: (height,) of each row, or one number. noise: standard deviation in grey levels."""
        height = self._picture.shape[0]
        tops = range(0, height, _ROWS)
        gains = (
            np.broadcast_to(gain, (height,))[::_ROWS] if np.ndim(gain) else np.full(len(tops), gain)
        )
        sheet = _noise_sheet(seed, noise) if noise else None
        if sheet is not None:
            spare = sheet.size - self._picture[:_ROWS].size
            starts = np.random.default_rng([seed, 4, index]).integers(spare, size=len(tops))
        frame = np.empty(self._picture.shape, np.uint8)
        for i, top in enumerate(tops):
            strip = self._picture[top : top + _ROWS]
            grain = (
                None
                if sheet is None
                else sheet[starts[i] : starts[i] + strip.size].reshape(strip.shape)
            )
            if gains[i] != 1:
                strip = np.asarray(
                    cv2.addWeighted(
                        strip,
                        float(gains[i]),
                        strip if grain is None else grain,
                        0.0 if grain is None else 1.0,
                        0,
                    ),
                    np.int16,
                )
            elif grain is not None:
                strip = np.asarray(cv2.add(strip, grain), np.int16)
            # no grain makes it darker than black
            _, lit = cv2.threshold(strip, 0, 0, cv2.THRESH_TOZERO)
            cv2.convertScaleAbs(
                lit, frame[top : top + _ROWS], 1 / STEPS
            )  # rounds, saturates at 255
        return frame


@lru_cache(maxsize=4)
def _noise_sheet(seed: int, sigma: float) -> NDArray[np.int16]:
    """Return a sheet of noise in steps: cutting pieces out of it is much faster than drawing new noise."""
    drawn = np.random.default_rng([seed, 5]).standard_normal(_SHEET, dtype=np.float32)
    return np.clip(np.rint(drawn * np.float32(sigma * STEPS)), -32767, 32767).astype(np.int16)
