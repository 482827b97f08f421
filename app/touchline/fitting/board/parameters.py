"""A lens and the poses of a board as a fit moves them; all views side by side in padded arrays.

    point  = place + warp_x (1 - u²) ẑ + warp_y (1 - v²) ẑ      u, v from -1 to 1 across the board
    ray    = R_view point + shift_view
    pixel  = centre + focal · (1, aspect) · distort(ray)

A printed board is never flat; two numbers for its bow take most of it (D. Kogan's mrcal does the same).
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from touchline.core.board import BoardView
from touchline.core.geometry import Array, ImageSize, Indices, Mask
from touchline.models.intrinsics import PINHOLE_PARAMETERS, Intrinsics
from touchline.models.lenses import Lens
from touchline.models.rotation import matrix_from_vector

WARP = ("warp_x", "warp_y")  # mm, at the middle against the edges


@dataclass(frozen=True, eq=False)
class BoardObservations:
    """The corners of v views, padded to m each; present (v, m) marks what is no padding."""

    pixels: Array  # (v, m, 2) raw
    places: Array  # (v, m, 3) mm
    present: Mask  # (v, m)
    bow: Array  # (v, m, 2): 1 - u², 1 - v²
    size_mm: float  # half the board's diagonal
    names: tuple[str, ...]

    @classmethod
    def of(cls, views: tuple[BoardView, ...]) -> Self:
        """Pad with each view's first corner, so that padding is finite too."""
        most = max(len(view.pixels) for view in views)
        every = np.concatenate([view.places_mm[:, :2] for view in views])
        low, high = every.min(axis=0), every.max(axis=0)
        half = np.maximum((high - low) / 2, 1e-9)
        pixels, places = np.empty((len(views), most, 2)), np.empty((len(views), most, 3))
        present = np.zeros((len(views), most), bool)
        for i, view in enumerate(views):
            n = len(view.pixels)
            pixels[i, :n], places[i, :n], present[i, :n] = view.pixels, view.places_mm, True
            pixels[i, n:], places[i, n:] = view.pixels[0], view.places_mm[0]
        across = (places[..., :2] - (low + high) / 2) / half
        return cls(pixels, places, present, 1 - across**2, float(np.linalg.norm(half)),
                   tuple(view.name for view in views))

    def only(self, keep: Mask | Indices) -> Self:
        """Return some of the views."""
        index = np.arange(len(self.names))[keep]
        return replace(self, pixels=self.pixels[index], places=self.places[index], present=self.present[index],
                       bow=self.bow[index], names=tuple(self.names[i] for i in index))

    def without(self, outliers: Mask) -> Self:
        """Return the same without some corners (v, m)."""
        return replace(self, present=self.present & ~outliers)


@dataclass(frozen=True, eq=False)
class BoardParameters:
    """Focal length as its logarithm, so that it stays positive; rotations as matrices, updated from the left."""

    lens: type[Lens]
    log_focal: float
    aspect: float
    centre_px: Array
    terms: Array
    warp_mm: Array
    rotations: Array  # (v, 3, 3) camera_from_board
    shifts_mm: Array  # (v, 3)

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the shared parameters in order: what a free mask refers to."""
        return (*PINHOLE_PARAMETERS, *self.lens.TERMS, *WARP)

    @property
    def shared(self) -> Array:
        """Return the values of names."""
        return np.array([self.log_focal, self.aspect, *self.centre_px, *self.terms, *self.warp_mm])

    def with_shared(self, values: Array) -> Self:
        n = 4 + len(self.terms)
        return replace(self, log_focal=float(values[0]), aspect=float(values[1]), centre_px=np.array(values[2:4]),
                       terms=np.array(values[4:n]), warp_mm=np.array(values[n:]))

    def only(self, keep: Mask | Indices) -> Self:
        return replace(self, rotations=self.rotations[keep], shifts_mm=self.shifts_mm[keep])

    def with_poses_of(self, full: Self, keep: Mask | Indices) -> Self:
        """Return this state of some of the views, with the other views' poses from `full`."""
        rotations, shifts = full.rotations.copy(), full.shifts_mm.copy()
        rotations[keep], shifts[keep] = self.rotations, self.shifts_mm
        return replace(self, rotations=rotations, shifts_mm=shifts)

    def retract(self, delta: Array, free: Mask, own: Array) -> Self:
        """Apply a step: delta for the free shared parameters, own (v, 6) a rotation and a shift of every pose."""
        full = np.zeros(len(free))
        full[free] = delta
        full[0] = np.clip(full[0], -1, 1)
        turned = matrix_from_vector(own[:, :3]) @ self.rotations
        return replace(self.with_shared(self.shared + full), rotations=turned, shifts_mm=self.shifts_mm + own[:, 3:])

    def rays(self, observations: BoardObservations) -> Array:
        """Return the corners in the camera's frame, mm (v, m, 3)."""
        return self._points(observations) @ self.rotations.transpose(0, 2, 1) + self.shifts_mm[:, None]

    def project(self, observations: BoardObservations) -> Array:
        """Return the corners' raw pixels (v, m, 2)."""
        return self.lens.distort(self.terms, self.rays(observations)) * self._focal + self.centre_px

    def project_jacobian(self, observations: BoardObservations, free: Mask) -> tuple[Array, Array, Array]:
        """Return pixels (v, m, 2), derivatives by the free ones of names (v, m, 2, n), and by the pose (v, m, 2, 6)."""
        arms = self._points(observations) @ self.rotations.transpose(0, 2, 1)
        plane, by_ray, by_terms = self.lens.distort_jacobian(self.terms, arms + self.shifts_mm[:, None])
        focal = self._focal
        by_ray = by_ray * focal[:, None]
        normal = self.rotations[:, None, None, :, 2]  # where the board's z points: a bow moves corners along it
        shared = np.zeros((*plane.shape, int(free.sum())), by_terms.dtype)
        for column, index in enumerate(np.flatnonzero(free)):
            name, into = self.names[index], shared[..., column]
            if name == "log_focal":
                into[...] = plane * focal
            elif name == "aspect":
                into[..., 1] = plane[..., 1] * focal[0]
            elif name in ("centre_x", "centre_y"):
                into[..., int(name == "centre_y")] = 1.0
            elif name in WARP:
                into[...] = np.sum(by_ray * normal, axis=-1) * observations.bow[..., WARP.index(name), None]
            else:
                into[...] = by_terms[..., index - 4] * focal
        own = np.empty((*plane.shape, 6), by_ray.dtype)
        # A turn ω before the rotation moves a corner by ω × arm: d pixel / d ω = arm × (d pixel / d ray), row by row.
        ax, ay, az = (arms[..., None, i] for i in range(3))
        bx, by, bz = (by_ray[..., i] for i in range(3))
        own[..., 0], own[..., 1], own[..., 2] = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        own[..., 3:] = by_ray
        return plane * focal + self.centre_px, shared, own

    def lens_of(self, model: str, image_size: ImageSize, estimated: tuple[str, ...] = (),
                covariance: Array | None = None) -> Intrinsics:
        """Return the lens alone."""
        rows = () if covariance is None else tuple(tuple(map(float, row)) for row in covariance)
        return Intrinsics(model, tuple(map(float, self.terms)), float(np.exp(self.log_focal)), float(self.aspect),
                           (float(self.centre_px[0]), float(self.centre_px[1])), image_size, estimated, rows)

    def _points(self, observations: BoardObservations) -> Array:
        points = observations.places.astype(np.result_type(self.warp_mm, float))
        points[..., 2] = points[..., 2] + observations.bow @ self.warp_mm
        return points

    @property
    def _focal(self) -> Array:
        return np.exp(self.log_focal) * np.array([1.0, self.aspect])
