"""A ray camera's parameters as a fit moves them, with the derivatives of its pixels."""

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from touchline.core.geometry import Array, Mask
from touchline.models.lenses import Lens
from touchline.models.ray_camera import RayCamera
from touchline.models.rotation import cross_matrix, matrix_from_vector, vector_from_matrix

NO_LINES = np.empty(0)


@dataclass(frozen=True, eq=False)
class RayCameraParameters:
    """Focal length as its logarithm, so that it stays positive; the rotation as a matrix, updated from the left."""

    lens: type[Lens]
    log_focal: float
    aspect: float
    centre_px: Array
    terms: Array
    camera_from_field: Array
    position_mm: Array
    offsets_mm: Array  # of each line across itself, where the field may err

    @classmethod
    def of(cls, model: RayCamera, offsets_mm: Array = NO_LINES) -> Self:
        return cls(
            model.LENS,
            float(np.log(model.focal_px)),
            model.aspect,
            np.array(model.centre_px),
            np.array(model.lens_terms, float),
            model.camera_from_field,
            np.array(model.position_mm),
            offsets_mm,
        )

    def parameters(self) -> dict[str, Any]:
        """Return the fields of a RayCamera that a fit finds."""
        return {
            "lens_terms": tuple(map(float, self.terms)),
            "focal_px": float(np.exp(self.log_focal)),
            "aspect": float(self.aspect),
            "centre_px": tuple(map(float, self.centre_px)),
            "rotation": tuple(map(float, vector_from_matrix(self.camera_from_field))),
            "position_mm": tuple(map(float, self.position_mm)),
        }

    @property
    def names(self) -> tuple[str, ...]:
        """Return every parameter's name in order: what a free mask refers to."""
        return (
            "log_focal",
            "aspect",
            "centre_x",
            "centre_y",
            *self.lens.TERMS,
            "turn_x",
            "turn_y",
            "turn_z",
            "x",
            "y",
            "height",
            *(f"line_{i}" for i in range(len(self.offsets_mm))),
        )

    def with_only_terms(self, terms: tuple[str, ...]) -> Self:
        keep = np.array([name in terms for name in self.lens.TERMS], bool)
        return replace(self, terms=np.where(keep, self.terms, 0.0))

    def with_square_pixels(self) -> Self:
        """Return the camera with aspect 1, between both of its focal lengths."""
        return replace(self, aspect=1.0, log_focal=self.log_focal + float(np.log(self.aspect)) / 2)

    def retract(self, delta: Array, free: Mask) -> Self:
        """Apply a step: delta for the free parameters, in the order of names.

        Focal length and height move by factors: straight from above they compensate each other, with the lens's terms,
        and a step that adds to one and multiplies the other leaves that valley.
        """
        full = np.zeros(len(free))
        full[free] = delta
        n = 4 + len(self.terms)
        longer = min(max(float(full[0]), -1.0), 1.0)
        terms = self.lens.rescaled(self.terms, full[4:n], longer)
        return type(self)(
            self.lens,
            log_focal=min(max(self.log_focal + longer, -5.0), 20.0),
            aspect=min(max(self.aspect + float(full[1]), 0.5), 2.0),
            centre_px=self.centre_px + full[2:4],
            terms=np.where(free[4:n], terms, self.terms),
            camera_from_field=matrix_from_vector(full[n : n + 3]) @ self.camera_from_field,
            position_mm=self.position_mm + full[n + 3 : n + 6] * self._stretch(full[n + 5]),
            offsets_mm=self.offsets_mm + full[n + 6 :],
        )

    def _stretch(self, rise_mm: float) -> float:
        """Return (eˢ - 1) / s, s = rise / height: the whole shift is scaled by it, so that it keeps its direction."""
        share = (
            min(max(float(rise_mm / self.position_mm[2]), -1.0), 1.0)
            if self.position_mm[2]
            else 0.0
        )
        return float(np.expm1(share) / share) if share else 1.0

    @property
    def lens_names(self) -> tuple[str, ...]:
        """Return the names of the lens's terms."""
        return self.lens.TERMS

    def values(self) -> dict[str, float]:
        """Return the values by name of the parameters that may have a prior."""
        return {
            "log_focal": self.log_focal,
            "aspect": self.aspect,
            "centre_x": self.centre_px[0],
            "centre_y": self.centre_px[1],
            "height": self.position_mm[2],
            **dict(zip(self.lens.TERMS, self.terms, strict=True)),
            **{f"line_{i}": o for i, o in enumerate(self.offsets_mm)},
        }

    def project(self, points: Array) -> Array:
        """Map field mm (n, 3) to raw px (n, 2)."""
        plane = self.lens.distort(
            self.terms, (points - self.position_mm) @ self.camera_from_field.T
        )
        return plane * self._focal + self.centre_px

    def project_jacobian(self, points: Array) -> tuple[Array, Array, Array]:
        """Return pixels (n, 2), their derivatives by the field point (n, 2, 3) and by all names but line offsets."""
        rays = (points - self.position_mm) @ self.camera_from_field.T
        plane, by_ray, by_terms = self.lens.distort_jacobian(self.terms, rays)
        focal = self._focal
        by_ray = by_ray * focal[:, None]
        by_point = by_ray @ self.camera_from_field
        n = 4 + len(self.terms)
        by = np.empty((len(points), 2, n + 6))
        by[:, :, 0] = plane * focal
        by[:, 0, 1], by[:, 1, 1] = 0.0, plane[:, 1] * focal[0]
        by[:, :, 2:4] = np.eye(2)
        by[:, :, 4:n] = by_terms * focal[:, None]
        # a turn ω before the rotation moves the ray by ω × ray
        by[:, :, n : n + 3] = by_ray @ cross_matrix(-rays)
        by[:, :, n + 3 :] = -by_point
        return plane * focal + self.centre_px, by_point, by

    def unproject(self, pixels: Array, z_mm: Array) -> Array:
        """Map raw px (n, 2) to field mm (n, 2) at heights z_mm (n,), also behind the camera."""
        rays = (
            self.lens.undistort(self.terms, (pixels - self.centre_px) / self._focal)
            @ self.camera_from_field
        )
        return (
            self.position_mm[:2]
            + rays[:, :2] * ((z_mm - self.position_mm[2]) / rays[:, 2])[:, None]
        )

    @property
    def _focal(self) -> Array:
        return np.exp(self.log_focal) * np.array([1.0, self.aspect])
