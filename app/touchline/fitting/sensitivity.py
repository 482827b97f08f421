"""How what a model sees moves with its parameters, by the derivatives that its fit uses; and a homography's parameters.

A homography as a fit moves it:

    raw ~ H (I + Δ) U (X, Y, 1),   U brings the region to about [-1, 1] × [-1, 1]

Δ has eight free entries and 0 in its last corner: every neighbour of H but for scale, and no chart to fall off from.
"""

from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from touchline.core.field import Region
from touchline.core.geometry import Array, Mask, Points, homogeneous, with_z
from touchline.fitting.ray_camera.parameters import RayCameraParameters
from touchline.models.homography import Homography, normalise

ENTRIES = tuple((i, j) for i in range(3) for j in range(3))[:8]
EDGE_ON = 1e-9  # a plane is seen from its edge where it is this much shorter one way than the other


@dataclass(frozen=True, eq=False)
class HomographyParameters:
    """raw_from_unit (3, 3) is H; unit_from_field (3, 3) is U."""

    raw_from_unit: Array
    unit_from_field: Array
    offsets_mm: Array  # of each line across itself, where the field may err

    lens_names: ClassVar[tuple[str, ...]] = ()  # there is no lens

    @classmethod
    def of_camera(cls, raw_from_field: Array, region: Region, lines: int = 0) -> Self:
        (x0, x1), (y0, y1) = region.x_mm, region.y_mm
        length = max(x1 - x0, y1 - y0) / 2
        unit = np.array([[1, 0, -(x0 + x1) / 2], [0, 1, -(y0 + y1) / 2], [0, 0, length]]) / length
        raw_from_unit = raw_from_field @ np.linalg.inv(unit)
        return cls(raw_from_unit / np.linalg.norm(raw_from_unit), unit, np.zeros(lines))

    @classmethod
    def of(cls, model: Homography) -> Self:
        return cls.of_camera(model.raw_from_field, model.region)

    def parameters(self) -> dict[str, Any]:
        """Return the fields of a Homography that a fit finds."""
        field_from_raw = np.linalg.inv(self.raw_from_unit @ self.unit_from_field)
        return {"field_from_raw": normalise(np.asarray(field_from_raw, np.float64))}

    @property
    def names(self) -> tuple[str, ...]:
        """Return every parameter's name in order: what a free mask refers to."""
        return (
            *(f"h{i + 1}{j + 1}" for i, j in ENTRIES),
            *(f"line_{i}" for i in range(len(self.offsets_mm))),
        )

    def values(self) -> dict[str, float]:
        """Return the values by name of the parameters that may have a prior."""
        return {f"line_{i}": o for i, o in enumerate(self.offsets_mm)}

    def retract(self, delta: Array, free: Mask) -> Self:
        """Apply a step: delta for the free parameters, in the order of names."""
        full = np.zeros(len(free))
        full[free] = delta
        bent = self.raw_from_unit @ (np.eye(3) + np.append(full[:8], 0.0).reshape(3, 3))
        return replace(
            self, raw_from_unit=bent / np.linalg.norm(bent), offsets_mm=self.offsets_mm + full[8:]
        )

    def project_jacobian(self, points: Array) -> tuple[Array, Array, Array]:
        """Return pixels (n, 2), their derivatives by the field point (n, 2, 3) and by all parameters but line offsets.

        points (n, 3) field mm, on the carpet: what stands above it a homography cannot see, so z is left alone.
        """
        unit = points[:, :2] @ self.unit_from_field[:, :2].T + self.unit_from_field[:, 2]
        projected = unit @ self.raw_from_unit.T
        depth = np.where(projected[:, 2] > 0, projected[:, 2], np.nan)
        pixel = projected[:, :2] / depth[:, None]
        by_seen = np.zeros((len(points), 2, 3))  # of the pixel by H U (X, Y, 1)
        by_seen[:, 0, 0] = by_seen[:, 1, 1] = 1 / depth
        by_seen[:, :, 2] = -pixel / depth[:, None]
        by_unit = by_seen @ self.raw_from_unit
        by_point = np.zeros((len(points), 2, 3))
        by_point[:, :, :2] = by_unit @ self.unit_from_field[:, :2]
        by = (by_unit[:, :, :, None] * unit[:, None, None, :]).reshape(len(points), 2, 9)[:, :, :8]
        return pixel, by_point, by

    def unproject(self, pixels: Array, z_mm: Array) -> Array:
        """Map raw px (n, 2) to field mm (n, 2), also beyond the horizon; z_mm is 0."""
        lifted = homogeneous(pixels)
        field = lifted @ np.linalg.inv(self.raw_from_unit @ self.unit_from_field).T
        return field[:, :2] / field[:, 2:]


@dataclass(frozen=True, eq=False)
class ParameterSensitivity:
    """contract.Sensitivity for models whose fit moves `parameters`."""

    parameters: RayCameraParameters | HomographyParameters

    @property
    def names(self) -> tuple[str, ...]:
        return self.parameters.names

    def field_jacobian(self, points_field_xyz: Array, names: tuple[str, ...]) -> Array:
        by_point, columns = self._pixel_jacobian(points_field_xyz, names)
        (a, b), (c, d) = (by_point[:, i, :2].T for i in range(2))
        with np.errstate(all="ignore"):
            det = a * d - b * c
            det = np.where(np.abs(det) > EDGE_ON * (a * a + b * b + c * c + d * d), det, np.nan)
            inverse = (
                np.stack([np.stack([d, -b], -1), np.stack([-c, a], -1)], axis=1)
                / det[:, None, None]
            )
            return -inverse @ columns

    def click_jacobian(self, places: Points, along: Points, names: tuple[str, ...]) -> Array:
        by_point, columns = self._pixel_jacobian(with_z(places), names)
        ahead = np.einsum("nij,nj->ni", by_point, with_z(along))
        across = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1) / np.linalg.norm(
            ahead, axis=1, keepdims=True
        )
        return np.einsum("ni,nik->nk", across, columns)

    def _pixel_jacobian(
        self, points_field_xyz: Array, names: tuple[str, ...]
    ) -> tuple[Array, Array]:
        """Return the pixel's derivative by the field point (n, 2, 3) and by named parameters (n, 2, len(names))."""
        _, by_point, by = self.parameters.project_jacobian(np.asarray(points_field_xyz, float))
        columns = np.zeros((len(by), 2, len(names)))
        for column, name in enumerate(names):
            if name in self.names:
                columns[:, :, column] = by[:, :, self.names.index(name)]
        return by_point, columns
