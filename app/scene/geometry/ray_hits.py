"""Where the rays of clicked points meet the carpet, and the residuals to the lines or points that were clicked."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from app.core.field import Field, Region
from app.core.records import Observations
from app.evaluate.fit.residuals import feature_residuals
from app.models import CameraModel


@dataclass(frozen=True, eq=False)
class RayHits:
    """points (n, 3) mm; residuals (n, 3) mm, from there to where it should be; outlier (n,): left out by the fit.

    Points that the model does not reach are left out.
    """

    points: NDArray[np.float64]
    residuals: NDArray[np.float64]
    outlier: NDArray[np.bool_]

    @classmethod
    def of(cls, model: CameraModel, observations: Observations, field: Field, region: Region,
           outliers: Sequence[NDArray[np.bool_]]) -> Self:
        points, missed, outlier = [np.empty((0, 3))], [np.empty((0, 3))], [np.empty(0, bool)]
        for observation, out in zip(observations, outliers, strict=True):
            residuals = feature_residuals(model, observation, field, region)
            foot = residuals.place_mm
            known = np.isfinite(foot).all(axis=1) & np.isfinite(residuals.to_place_mm).all(axis=1)
            points.append(np.column_stack([foot, np.full(len(foot), observation.z_mm)])[known])
            missed.append(np.column_stack([residuals.to_place_mm, np.zeros(len(foot))])[known])
            outlier.append(out[known])
        return cls(np.concatenate(points), np.concatenate(missed), np.concatenate(outlier))

    def rays_from(self, position_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return rays (n, 2, 3) from the camera to each point."""
        return np.stack([np.broadcast_to(position_mm, self.points.shape), self.points], axis=1)

    def arrows(self, scale: float) -> NDArray[np.float64]:
        """Return the residuals (n, 2, 3) as arrows enlarged by scale."""
        return np.stack([self.points, self.points + scale * self.residuals], axis=1)
