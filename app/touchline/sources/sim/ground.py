"""The ground of a simulated field: markings blurred as by a real lens and pixel, carpet, floor, lamps that change.

The blur is a Gaussian of sigma_px. Across a straight edge at signed distance d it has a closed form, so nothing is
sampled: coverage = Φ((half width - d) / σ) - Φ((-half width - d) / σ), with d and σ in mm on the ground. σ is
sigma_px times how fast d changes per pixel, which the lens makes different from pixel to pixel.

A lamp on the mains shines 1 + flicker · sin(2π f t). A sensor adds that up while it is exposed, which damps it by
sinc(f · exposure): to nothing when the exposure is a whole number of flickers. With a rolling shutter each row is
exposed a little later than the one above, so that the flicker stands in the picture as bands.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.field import Arc, Field, Line
from touchline.core.geometry import ImageSize, normal_cdf
from touchline.sources.sim.camera import SimCamera

Plane = NDArray[np.floating]  # (height, width) float32
Pick = NDArray[np.intp]  # (n,) flat pixel numbers
_REACH = 3.5  # sigmas; beyond it the blur leaves less than a grey level
DRIFT_PERIOD_S = 60.0
GREEN, BLACK = (44.0, 112.0, 60.0), (36.0, 34.0, 34.0)

_TILE = 512  # texels
# (mm a texel, smoothing in texels, strength): fibres, tufts, and where people walked
_GRAINS = ((7.0, 0.7, 0.05), (38.0, 1.5, 0.02), (420.0, 3.0, 0.03))
_STRIP_MM = 2000.0  # carpets are laid in strips of this width


def band(d: NDArray, half_mm: float | NDArray, sigma_mm: NDArray) -> NDArray:
    """Return the coverage of -half_mm < d < half_mm."""
    return normal_cdf((d + half_mm) / sigma_mm) - normal_cdf((d - half_mm) / sigma_mm)


def inside(d: NDArray, sigma_mm: NDArray | float) -> NDArray:
    """Return the coverage of d < 0."""
    return normal_cdf(-d / sigma_mm)


@dataclass(frozen=True, eq=False)
class Ground:
    """Where each pixel's centre looks on the carpet, and how far the next pixel looks from there."""

    camera: SimCamera
    field_mm: NDArray[np.float64]  # (height, width, 2); NaN above the horizon

    @classmethod
    def of(cls, camera: SimCamera) -> Self:
        w, h = camera.image_size
        rows = []
        # in strips: the rays of a whole picture do not fit a processor's cache
        for top in range(0, h, 128):
            y, x = np.mgrid[top : min(top + 128, h), 0:w]
            rows.append(camera.field_from_raw(np.stack([x, y], axis=-1).astype(np.float64)))
        return cls(camera, np.concatenate(rows))

    @property
    def size(self) -> ImageSize:
        return self.camera.image_size

    @cached_property
    def flat(self) -> NDArray[np.float64]:
        return self.field_mm.reshape(-1, 2)

    @cached_property
    def per_pixel(self) -> NDArray[np.float32]:
        """(h · w, 2, 2) mm: [field axis, pixel axis]."""
        across = np.gradient(self.field_mm, axis=1)
        down = np.gradient(self.field_mm, axis=0)
        return np.stack([across, down], axis=-1).astype(np.float32).reshape(-1, 2, 2)

    @cached_property
    def mm_per_px(self) -> Plane:
        """(height, width) the square root of a pixel's area on the ground."""
        j = self.per_pixel
        area = np.abs(j[:, 0, 0] * j[:, 1, 1] - j[:, 0, 1] * j[:, 1, 0])
        return np.sqrt(area).reshape(self.size.height, self.size.width)

    def sigma_across(self, pick: Pick, normal: NDArray, sigma_px: float) -> NDArray:
        """Return the blur in mm along a unit normal (2,) or (n, 2) on the ground, at the picked pixels."""
        normal = np.broadcast_to(normal, (len(pick), 2))
        return (
            sigma_px
            * np.linalg.norm(np.einsum("ni,nij->nj", normal, self.per_pixel[pick]), axis=-1)
            + 1e-9
        )

    def near(self, points_mm: NDArray, half_mm: float, sigma_px: float) -> Pick:
        """Return the pixels that a stroke through the points (n, 2) can touch."""
        w, h = self.size
        raw = self.camera.raw_from_field(points_mm)
        reach = self.camera.raw_from_field(points_mm + half_mm) - raw
        wide = np.nanmax(np.abs(reach), initial=0) * 3 + 2 * _REACH * sigma_px + 3
        mask = np.zeros((h, w), np.uint8)
        a, b = raw[:-1], raw[1:]
        far = 4 * max(w, h)
        ok = (np.isfinite(a) & np.isfinite(b) & (np.abs(a) < far) & (np.abs(b) < far)).all(axis=1)
        segments = np.rint(np.stack([a[ok], b[ok]], axis=1)).astype(np.int32)
        cv2.polylines(mask, list(segments), False, 1, thickness=int(min(np.ceil(wide), 4000)))
        return np.flatnonzero(mask.ravel() & np.isfinite(self.flat[:, 0]))


def line_coverage(ground: Ground, line: Line, sigma_px: float) -> tuple[Pick, NDArray]:
    """Return pixels near a line and its coverage of each; its ends reach half its width further."""
    start, end = np.array(line.start), np.array(line.end)
    along = (end - start) / line.length_mm
    across = np.array([-along[1], along[0]])
    half = line.width_mm / 2
    pick = ground.near(
        Line("", tuple(start - along * half), tuple(end + along * half)).sample(129), half, sigma_px
    )
    place = ground.flat[pick] - (start + end) / 2
    cover = band(place @ across, half, ground.sigma_across(pick, across, sigma_px))
    cover *= band(
        place @ along, line.length_mm / 2 + half, ground.sigma_across(pick, along, sigma_px)
    )
    return pick, cover


def arc_coverage(ground: Ground, arc: Arc, sigma_px: float) -> tuple[Pick, NDArray]:
    """Return pixels near an arc and its coverage of each."""
    half = arc.width_mm / 2
    pick = ground.near(arc.sample(361), half, sigma_px)
    arm = ground.flat[pick] - np.array(arc.centre)
    radius = np.linalg.norm(arm, axis=-1)
    normal = arm / np.maximum(radius, 1e-9)[:, None]
    cover = band(radius - arc.radius_mm, half, ground.sigma_across(pick, normal, sigma_px))
    sweep = np.radians(arc.end_deg - arc.start_deg)
    if sweep < 2 * np.pi - 1e-9:
        middle = np.radians(arc.start_deg + arc.end_deg) / 2
        turn = np.arctan2(arm[:, 1], arm[:, 0]) - middle
        turn = (turn + np.pi) % (2 * np.pi) - np.pi
        tangent = np.stack([-normal[:, 1], normal[:, 0]], axis=-1)
        cover *= band(
            turn * arc.radius_mm,
            sweep / 2 * arc.radius_mm,
            ground.sigma_across(pick, tangent, sigma_px),
        )
    return pick, cover


def markings_coverage(
    ground: Ground, lines: Iterable[Line], arcs: Iterable[Arc], sigma_px: float
) -> Plane:
    """Return the coverage (height, width) by all markings together; where two meet, paint counts once."""
    bare = np.ones(ground.size.width * ground.size.height, np.float32)
    for pick, cover in (
        *(line_coverage(ground, m, sigma_px) for m in lines),
        *(arc_coverage(ground, m, sigma_px) for m in arcs),
    ):
        bare[pick] *= (1 - cover).astype(np.float32)
    return (1 - bare).reshape(ground.size.height, ground.size.width)


@dataclass(frozen=True)
class Lamps:
    """flicker, drift: shares of the light, 0…1, up and down."""

    flicker: float = 0.0
    flicker_hz: float = 100.0
    drift: float = 0.0

    def brightness(self, time_s: NDArray | float, exposure_s: float) -> NDArray | float:
        """Return the mean light from time_s - exposure_s / 2 to time_s + exposure_s / 2, 1 where nothing changes."""
        damped = self.flicker * np.sinc(self.flicker_hz * exposure_s)
        return (1 + damped * np.sin(2 * np.pi * self.flicker_hz * np.asarray(time_s))) * (
            1 + self.drift * np.sin(2 * np.pi * np.asarray(time_s) / DRIFT_PERIOD_S)
        )


Colour = tuple[float, float, float]  # BGR, 0…255, as it looks in full light
PAINT: Colour = (226.0, 236.0, 232.0)
FLOOR: Colour = (112.0, 122.0, 128.0)
WALL: Colour = (52.0, 54.0, 56.0)


@dataclass(frozen=True)
class Light:
    """How the picture is lit. All strengths 0…1."""

    vignette: float = 0.35  # darkening in the corners
    unevenness: float = 0.18  # lamps that are nearer to some places than to others
    glare: float = 0.10  # one lamp mirrored in the paint and the fibres
    gain: float = 1.0
    grain: float = 1.0  # of carpet and floor; 0 leaves them plain


def ground_colour(
    ground: Ground, field: Field, light: Light, sigma_px: float, seed: int
) -> NDArray[np.float32]:
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
    around = field.extras.get(
        "boundary", {"touch_mm": 0.05 * field.width_mm, "goal_mm": 0.05 * field.width_mm}
    )
    carpet = _rectangle(
        place,
        field.length_mm / 2 + around["goal_mm"],
        field.width_mm / 2 + around["touch_mm"],
        sigma,
    )
    if green:
        # 0.31 keeps the seams away from the lines, whose centre a step of brightness would seem to move.
        lighter = np.floor(place[..., 1] / _STRIP_MM + 0.31) % 2 == 0
        carpet_grain = grain + np.float32(light.grain) * np.where(lighter, 0.018, -0.018)
    _lay(colour, carpet, GREEN if green else WALL, 1 + (carpet_grain if green else grain))
    if not green:  # a wall of the boundary's thickness, and the carpet within
        _lay(
            colour,
            _rectangle(place, field.length_mm / 2, field.width_mm / 2, sigma),
            BLACK,
            1 + grain,
        )
        goal = field.extras.get("goal", {"width_mm": 0.0, "depth_mm": 0.0})
        floors = _rectangle(
            place, field.length_mm / 2 + goal["depth_mm"], goal["width_mm"] / 2, sigma
        )
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
            lines += [
                Line("", (x - half, y), (x + half, y), width),
                Line("", (x, y - half), (x, y + half), width),
            ]
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
    # of the field's length and width: three lamps
    for at_x, at_y in ((-0.30, 0.22), (0.26, 0.30), (0.08, -0.34)):
        near = (
            (place[..., 0] / field.length_mm - at_x) ** 2
            + (place[..., 1] / field.width_mm - at_y) ** 2
        ) / 0.12
        shade *= 1 + light.unevenness * (np.exp(-near) - 0.4)
    return shade


def glare(ground: Ground, light: Light, field: Field) -> Plane:
    """Return the grey levels (height, width) that a lamp's reflection adds."""
    place = np.nan_to_num(ground.field_mm, nan=1e6).astype(np.float32)
    size = 0.09 * field.length_mm
    away = ((place[..., 0] - 0.21 * field.length_mm) / size) ** 2 + (
        (place[..., 1] - 0.2 * field.width_mm) / size
    ) ** 2
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
    over = (
        np.abs(place[..., 0]) + np.abs(place[..., 1]) - (field.length_mm + field.width_mm) / 2 + cut
    )
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
        total += np.float32(strength) * cv2.remap(
            noise / noise.std(),
            at[..., 0],
            at[..., 1],
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_WRAP,
        )
    return total
