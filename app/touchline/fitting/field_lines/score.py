"""How much of the drawn field lies on seen ridges, and how much of what was seen it explains; many cameras at once.

Of each camera, the field's samples are projected through the roughly known bend. A sample in the picture finds its
ridge if one runs the same way near by. Found over expected length says whether the drawing is there, found over seen
length whether it is all that is there; a camera is worth their harmonic mean.
"""

from dataclasses import dataclass
from typing import Any, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.geometry import Array, ImageSize, Mask, Points, homogeneous, inside_picture
from touchline.fitting.field_lines.blind_distortion import UndistortedPlane
from touchline.fitting.field_pattern import FieldPattern

LONG_SIDE = 420  # of the map of distances, px: finer than the bend is known
DIRECTIONS = 4  # directions of ridges that are mapped apart
REACH_PX = 5.0  # of the map: further off, nothing is found
BATCH = 3000
CREDIBLE = 0.6  # of a drawn field that is there: what it finds is the field, or part of it


@dataclass(frozen=True, eq=False)
class RidgeMaps:
    """distances (DIRECTIONS, h, w): px to the nearest ridge of about that direction; scale from raw px to the map's.

    length_px: of all ridges, raw px.
    """

    distances: NDArray[np.float32]
    scale: float
    size: ImageSize
    length_px: float

    @classmethod
    def of(cls, points: Points, along: Array, size: ImageSize) -> Self:
        """Make maps of ridges: points (n, 2) raw px, along (n, 2) unit vectors."""
        scale = LONG_SIDE / max(size.width, size.height)
        shape = (int(np.ceil(size.height * scale)) + 1, int(np.ceil(size.width * scale)) + 1)
        x, y = np.rint(points * scale).astype(int).T
        angle = np.arctan2(along[:, 1], along[:, 0]) % np.pi * (DIRECTIONS / np.pi)
        maps = []
        for way in range(DIRECTIONS):
            # in steps; a ridge between two directions counts for both
            off = np.abs((angle - way + DIRECTIONS / 2) % DIRECTIONS - DIRECTIONS / 2)
            empty = np.full(shape, 255, np.uint8)
            near = off < 0.8
            empty[y[near], x[near]] = 0
            maps.append(cv2.distanceTransform(empty, cv2.DIST_L2, 3) if near.any() else np.full(shape, 1e3, np.float32))
        return cls(np.stack(maps), scale, size, float(len(points)))

    def found(self, raw: Points, along: Array) -> Array:
        """Return (...,) 0 to 1: how near a ridge of that direction is; 0 outside the picture."""
        inside = inside_picture(raw, self.size, 2)
        at = np.rint(np.where(inside[..., None], raw, 0) * self.scale).astype(np.int32)
        angle = np.arctan2(along[..., 1], along[..., 0]) % np.pi
        way = np.rint(angle * (DIRECTIONS / np.pi)).astype(np.int32) % DIRECTIONS
        away = self.distances[way, at[..., 1], at[..., 0]]
        return np.where(inside, np.maximum(1 - (away / REACH_PX) ** 2, 0), 0.0)


@dataclass(frozen=True, eq=False)
class Scores:
    """(n,) each: the share of the drawn field that is there, its length, and length of markings within the border."""

    found: Array
    found_px: Array
    inner_px: Array

    @property
    def most_px(self) -> float:
        """The greatest length that one of them finds, if that is most of its drawing."""
        return float(np.max(self.found_px, where=self.found > CREDIBLE, initial=0.0))


def score(homographies: Array, plane: UndistortedPlane, pattern: FieldPattern, ridges: RidgeMaps, inner: Mask,
          ) -> Scores:
    """Score homographies (n, 3, 3) from field mm to the undistorted plane. inner (k,): samples within the border."""
    parts = [_score_batch(homographies[k:k + BATCH], plane, pattern, ridges, inner)
             for k in range(0, len(homographies), BATCH)]
    return Scores(*(np.concatenate([np.empty(0), *(part[i] for part in parts)]) for i in range(3)))


def harmonic_mean(one: Any, other: Any) -> Any:
    """Return it of numbers or arrays that are not negative; 0 for two zeros."""
    return 2 * one * other / np.maximum(one + other, 1e-9)


def _score_batch(maps: Array, plane: UndistortedPlane, pattern: FieldPattern, ridges: RidgeMaps, inner: Mask,
                 ) -> tuple[Array, Array, Array]:
    raw = project(maps, pattern.points, plane)
    ahead = project(maps, pattern.points + pattern.along * (pattern.step_mm / 4)[:, None], plane) - raw
    step_px = np.linalg.norm(ahead, axis=-1) * 4
    inside = inside_picture(raw, ridges.size, 2) & np.isfinite(step_px)
    length = np.where(inside, step_px, 0.0)
    found = ridges.found(np.where(inside[..., None], raw, -1.0), np.where(inside[..., None], ahead, 1.0)) * length
    found_px = found.sum(axis=1)
    return found_px / np.maximum(length.sum(axis=1), 1e-9), found_px, found @ inner


def length_within(maps: Array, outer_mm: Array, plane: UndistortedPlane, points: Points) -> Array:
    """Return how many of the raw points (k, 2) each of (n, 3, 3) sees within the field's border (n,)."""
    flat = homogeneous(np.nan_to_num(plane.undistorted_from_raw(points), nan=1e3)).astype(np.float32)
    field = flat @ np.linalg.inv(maps).transpose(0, 2, 1).astype(np.float32)
    with np.errstate(all="ignore"):
        return (np.abs(field[..., :2] / field[..., 2:]) < outer_mm).all(axis=-1).sum(axis=1)


def project(maps: Array, points: Points, plane: UndistortedPlane) -> Array:
    """Map field mm (k, 2) to raw px (n, k, 2) by each of (n, 3, 3), to a hundredth of a pixel."""
    mapped = homogeneous(points).astype(np.float32) @ maps.transpose(0, 2, 1).astype(np.float32)
    with np.errstate(all="ignore"):
        depth = np.where(mapped[..., 2:] > 0, mapped[..., 2:], np.nan)
        return plane.raw_from_undistorted(mapped[..., :2] / depth)
