"""How what a model sees moves with its parameters, by the derivatives that its fit uses."""

from dataclasses import dataclass

import numpy as np

from touchline.core.geometry import Array, Points, with_z
from touchline.fitting.homography.parameters import HomographyParameters
from touchline.fitting.ray_camera.parameters import RayCameraParameters

EDGE_ON = 1e-9  # a plane is seen from its edge where it is this much shorter one way than the other


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
            inverse = np.stack([np.stack([d, -b], -1), np.stack([-c, a], -1)], axis=1) / det[:, None, None]
            return -inverse @ columns

    def click_jacobian(self, places: Points, along: Points, names: tuple[str, ...]) -> Array:
        by_point, columns = self._pixel_jacobian(with_z(places), names)
        ahead = np.einsum("nij,nj->ni", by_point, with_z(along))
        across = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1) / np.linalg.norm(ahead, axis=1, keepdims=True)
        return np.einsum("ni,nik->nk", across, columns)

    def _pixel_jacobian(self, points_field_xyz: Array, names: tuple[str, ...]) -> tuple[Array, Array]:
        """Return the pixel's derivative by the field point (n, 2, 3) and by named parameters (n, 2, len(names))."""
        _, by_point, by = self.parameters.project_jacobian(np.asarray(points_field_xyz, float))
        columns = np.zeros((len(by), 2, len(names)))
        for column, name in enumerate(names):
            if name in self.names:
                columns[:, :, column] = by[:, :, self.names.index(name)]
        return by_point, columns
