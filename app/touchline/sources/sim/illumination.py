"""The ground's appearance and its lighting: carpet, floor beyond it, lamps, vignette."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.field import Arc, Field, Line
from touchline.sources.sim.paint import Ground, Plane, band, inside, markings_coverage

Colour = tuple[float, float, float]  # BGR, 0…255, as it looks in full light
GREEN, BLACK = (44.0, 112.0, 60.0), (36.0, 34.0, 34.0)
PAINT: Colour = (226.0, 236.0, 232.0)
FLOOR: Colour = (112.0, 122.0, 128.0)
WALL: Colour = (52.0, 54.0, 56.0)
_TILE = 512  # texels
# (mm a texel, smoothing in texels, strength): fibres, tufts, and where people walked
_GRAINS = ((7.0, 0.7, 0.05), (38.0, 1.5, 0.02), (420.0, 3.0, 0.03))
_STRIP_MM = 2000.0  # carpets are laid in strips of this width


@dataclass(frozen=True)
class Light:
    """How the picture is lit. All strengths 0…1."""

    vignette: float = 0.35  # darkening in the corners
    unevenness: float = 0.18  # lamps that are nearer to some places than to others
    glare: float = 0.10  # one lamp mirrored in the paint and the fibres
    gain: float = 1.0
    grain: float = 1.0  # of carpet and floor; 0 leaves them plain


def ground_colour(ground: Ground, field: Field, light: Light, sigma_px: float, seed: int) -> NDArray[np.float32]:
    """Return the picture (height, width, 3) BGR of everything flat, in full light."""
    h, w = ground.size.height, ground.size.width
    rng = np.random.default_rng(seed)
    place = np.nan_to_num(ground.field_mm, nan=1e6).astype(np.float32)
    grain = np.float32(light.grain) * _texture(place, rng)
    sigma = sigma_px * np.nan_to_num(ground.mm_per_px, nan=1e3) + 1e-3
    colour = np.empty((h, w, 3), np.float32)
    colour[:] = FLOOR
    colour *= (1 + 0.6 * grain)[..., None]

    green = field.extras.get("carpet", "green") == "green"
    around = field.extras.get("boundary", {"touch_mm": 0.05 * field.width_mm, "goal_mm": 0.05 * field.width_mm})
    carpet = _rectangle(place, field.length_mm / 2 + around["goal_mm"], field.width_mm / 2 + around["touch_mm"], sigma)
    if green:
        # 0.31 keeps the seams away from the lines, whose centre a step of brightness would seem to move.
        lighter = np.floor(place[..., 1] / _STRIP_MM + 0.31) % 2 == 0
        carpet_grain = grain + np.float32(light.grain) * np.where(lighter, 0.018, -0.018)
    _lay(colour, carpet, GREEN if green else WALL, 1 + (carpet_grain if green else grain))
    if not green:  # a wall of the boundary's thickness, and the carpet within
        _lay(colour, _rectangle(place, field.length_mm / 2, field.width_mm / 2, sigma), BLACK, 1 + grain)
        goal = field.extras.get("goal", {"width_mm": 0.0, "depth_mm": 0.0})
        floors = _rectangle(place, field.length_mm / 2 + goal["depth_mm"], goal["width_mm"] / 2, sigma)
        _lay(colour, floors, BLACK, 1 + grain)
    lines, arcs = painted(field)
    _lay(colour, markings_coverage(ground, lines, arcs, sigma_px), PAINT, 1 + 0.4 * grain)
    _lay(colour, _corner_solids(place, field, sigma), WALL, 1 + grain)
    return colour


def painted(field: Field) -> tuple[list[Line], list[Arc]]:
    """Return all lines and arcs, crosses as two lines and dots as filled rings."""
    lines, arcs = list(field.lines.values()), list(field.arcs.values())
    width = min((line.width_mm for line in lines), default=10.0)
    for mark in field.extras.get("marks", ()):
        (x, y), half = field.landmarks[mark["at"]].position, mark["size_mm"] / 2
        if mark["shape"] == "cross":
            lines += [Line("", (x - half, y), (x + half, y), width), Line("", (x, y - half), (x, y + half), width)]
        else:
            arcs.append(Arc("", (x, y), half / 2, width_mm=half))
    return lines, arcs


def lighting(ground: Ground, light: Light, field: Field) -> Plane:
    """Return the light's factor (height, width) on every colour."""
    w, h = ground.size
    x, y = np.meshgrid(np.arange(w, dtype=np.float32), np.arange(h, dtype=np.float32))
    cx, cy = ground.camera.centre_px
    off = ((x - cx) ** 2 + (y - cy) ** 2) / (cx * cx + cy * cy)
    shade = light.gain / (1 + light.vignette * off) ** 2
    place = np.nan_to_num(ground.field_mm, nan=1e6).astype(np.float32)
    for at_x, at_y in ((-0.30, 0.22), (0.26, 0.30), (0.08, -0.34)):  # of the field's length and width: three lamps
        near = ((place[..., 0] / field.length_mm - at_x) ** 2 + (place[..., 1] / field.width_mm - at_y) ** 2) / 0.12
        shade *= 1 + light.unevenness * (np.exp(-near) - 0.4)
    return shade


def glare(ground: Ground, light: Light, field: Field) -> Plane:
    """Return the grey levels (height, width) that a lamp's reflection adds."""
    place = np.nan_to_num(ground.field_mm, nan=1e6).astype(np.float32)
    size = 0.09 * field.length_mm
    away = ((place[..., 0] - 0.21 * field.length_mm) / size) ** 2 + ((place[..., 1] - 0.2 * field.width_mm) / size) ** 2
    return np.float32(160 * light.glare) * (np.exp(-away) + 0.5 * np.exp(-6 * away))


def _lay(colour: NDArray, cover: NDArray, paint: Colour, shade: NDArray | float) -> None:
    """Paint over, in place, only where anything is covered."""
    rows = np.flatnonzero(cover.max(axis=1) > 1e-3)
    if rows.size:
        part = slice(rows[0], rows[-1] + 1)
        shade = np.broadcast_to(np.asarray(shade, np.float32), cover.shape)[part, :, None]
        weight = cover[part, :, None].astype(np.float32)
        colour[part] += weight * (np.array(paint, np.float32) * shade - colour[part])


def _rectangle(place: NDArray, half_x: float, half_y: float, sigma: NDArray) -> NDArray:
    return band(place[..., 0], half_x, sigma) * band(place[..., 1], half_y, sigma)


def _corner_solids(place: NDArray, field: Field, sigma: NDArray) -> NDArray:
    """Return the coverage of the triangles that fill the corners."""
    cut = field.extras.get("corner_cut_mm", 0.0)
    if not cut:
        return np.zeros(place.shape[:2], np.float32)
    over = np.abs(place[..., 0]) + np.abs(place[..., 1]) - (field.length_mm + field.width_mm) / 2 + cut
    solid = inside(-over / np.sqrt(2), sigma)
    return solid * _rectangle(place, field.length_mm / 2, field.width_mm / 2, sigma)


def _texture(place: NDArray, rng: np.random.Generator) -> Plane:
    """Return a grain of about ±0.06 that is fixed to the ground, from three sizes of noise."""
    total = np.zeros(place.shape[:2], np.float32)
    for texel_mm, smooth, strength in _GRAINS:
        noise = rng.standard_normal((_TILE, _TILE), dtype=np.float32)
        wrapped = cv2.GaussianBlur(np.pad(noise, 16, mode="wrap"), (0, 0), smooth)
        noise = np.asarray(wrapped, np.float32)[16:-16, 16:-16]
        at = np.mod(place / np.float32(texel_mm), _TILE)
        total += np.float32(strength) * cv2.remap(noise / noise.std(), at[..., 0], at[..., 1], cv2.INTER_LINEAR,
                                                  borderMode=cv2.BORDER_WRAP)
    return total
