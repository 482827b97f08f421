"""Coverage of pixels by markings, blurred as by a real lens and pixel, exact to a few thousandths of a pixel.

The blur is a Gaussian of sigma_px. Across a straight edge at signed distance d it has a closed form, so nothing is
sampled: coverage = Φ((half width - d) / σ) - Φ((-half width - d) / σ), with d and σ in mm on the ground. σ is
sigma_px times how fast d changes per pixel, which the lens makes different from pixel to pixel.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.field import Arc, Line
from touchline.core.geometry import ImageSize, normal_cdf
from touchline.sources.sim.camera import SimCamera

Plane = NDArray[np.floating]  # (height, width) float32
Pick = NDArray[np.intp]  # (n,) flat pixel numbers
_REACH = 3.5  # sigmas; beyond it the blur leaves less than a grey level


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
        for top in range(0, h, 128):  # in strips: the rays of a whole picture do not fit a processor's cache
            y, x = np.mgrid[top:min(top + 128, h), 0:w]
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
        return sigma_px * np.linalg.norm(np.einsum("ni,nij->nj", normal, self.per_pixel[pick]), axis=-1) + 1e-9

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
    pick = ground.near(Line("", tuple(start - along * half), tuple(end + along * half)).sample(129), half, sigma_px)
    place = ground.flat[pick] - (start + end) / 2
    cover = band(place @ across, half, ground.sigma_across(pick, across, sigma_px))
    cover *= band(place @ along, line.length_mm / 2 + half, ground.sigma_across(pick, along, sigma_px))
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
        cover *= band(turn * arc.radius_mm, sweep / 2 * arc.radius_mm, ground.sigma_across(pick, tangent, sigma_px))
    return pick, cover


def markings_coverage(ground: Ground, lines: Iterable[Line], arcs: Iterable[Arc], sigma_px: float) -> Plane:
    """Return the coverage (height, width) by all markings together; where two meet, paint counts once."""
    bare = np.ones(ground.size.width * ground.size.height, np.float32)
    for pick, cover in (*(line_coverage(ground, m, sigma_px) for m in lines),
                        *(arc_coverage(ground, m, sigma_px) for m in arcs)):
        bare[pick] *= (1 - cover).astype(np.float32)
    return (1 - bare).reshape(ground.size.height, ground.size.width)
