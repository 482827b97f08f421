"""How what a model sees moves with its parameters: what expected error and the next best click are made of."""

from typing import Protocol

import numpy as np

from app.core.geometry import Points
from app.models.lens import Array

EDGE_ON = 1e-9  # a plane is seen from its edge where it is this much shorter one way than the other


class FittedState(Protocol):
    """A model's parameters as a fit moves them: their names, and pixels with derivatives."""

    @property
    def names(self) -> tuple[str, ...]: ...

    def project_jacobian(self, points: Array) -> tuple[Array, Array, Array]: ...


class Sensitive:
    """For models whose fit knows a covariance: fit_state() gives the parameters that it is of."""

    def fit_state(self) -> FittedState:
        raise TypeError(f"{type(self).__name__} has no parameters in common")

    @property
    def covariance_names(self) -> tuple[str, ...]:
        """Parameters that a covariance of this model may have; lines' own offsets come beside them."""
        return self.fit_state().names

    def field_jacobian(self, points_field_xyz: Array, names: tuple[str, ...]) -> Array:
        """How the place where a pixel's ray meets the plane moves when named parameters do: (n, 2, len(names)) mm.

        points_field_xyz (n, 3): the places. Names as in Fit.parameter_names; a line's own offset moves no ray. NaN
        where the camera does not see the place, or sees the plane from its edge.
        """
        by_point, columns = self._pixel_jacobian(points_field_xyz, names)
        (a, b), (c, d) = (by_point[:, i, :2].T for i in range(2))
        with np.errstate(all="ignore"):
            det = a * d - b * c
            det = np.where(np.abs(det) > EDGE_ON * (a * a + b * b + c * c + d * d), det, np.nan)
            inverse = np.stack([np.stack([d, -b], -1), np.stack([-c, a], -1)], axis=1) / det[:, None, None]
            return -inverse @ columns

    def click_jacobian(self, places: Points, along: Points, names: tuple[str, ...]) -> Array:
        """How a click's distance from the curve at places (n, 2) mm running along (n, 2) moves: (n, len(names)) px."""
        flat = np.zeros((len(places), 1))
        by_point, columns = self._pixel_jacobian(np.concatenate([places, flat], axis=1), names)
        seen = np.einsum("nij,nj->ni", by_point, np.concatenate([along, flat], axis=1))
        across = np.stack([-seen[:, 1], seen[:, 0]], axis=1) / np.linalg.norm(seen, axis=1, keepdims=True)
        return np.einsum("ni,nik->nk", across, columns)

    def _pixel_jacobian(self, points_field_xyz: Array, names: tuple[str, ...]) -> tuple[Array, Array]:
        """The pixel's derivative by the field point (n, 2, 3) and by named parameters (n, 2, len(names))."""
        state = self.fit_state()
        _, by_point, by = state.project_jacobian(np.asarray(points_field_xyz, float))
        columns = np.zeros((len(by), 2, len(names)))
        for column, name in enumerate(names):
            if name in state.names:
                columns[:, :, column] = by[:, :, state.names.index(name)]
        return by_point, columns
