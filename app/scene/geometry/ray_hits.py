"""Where rays of clicked points land on the carpet, and how far that is from the line or spot they were clicked on."""

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
class Landings:
    """feet (n, 3) mm; missed (n, 3) mm, from there to where the point should be; stray (n,): left out by the fit.

    Points that the model does not reach are not among them.
    """

    feet: NDArray[np.float64]
    missed: NDArray[np.float64]
    stray: NDArray[np.bool_]

    @classmethod
    def of(cls, model: CameraModel, observations: Observations, field: Field, region: Region,
           strays: Sequence[NDArray[np.bool_]]) -> Self:
        feet, missed, stray = [np.empty((0, 3))], [np.empty((0, 3))], [np.empty(0, bool)]
        for observation, out in zip(observations, strays, strict=True):
            residuals = feature_residuals(model, observation, field, region)
            foot = residuals.place_mm
            known = np.isfinite(foot).all(axis=1) & np.isfinite(residuals.to_place_mm).all(axis=1)
            feet.append(np.column_stack([foot, np.full(len(foot), observation.z_mm)])[known])
            missed.append(np.column_stack([residuals.to_place_mm, np.zeros(len(foot))])[known])
            stray.append(out[known])
        return cls(np.concatenate(feet), np.concatenate(missed), np.concatenate(stray))

    def rays_from(self, position_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """(n, 2, 3): from the camera to each foot."""
        return np.stack([np.broadcast_to(position_mm, self.feet.shape), self.feet], axis=1)

    def arrows(self, scale: float) -> NDArray[np.float64]:
        """(n, 2, 3): what each misses, so many times its length."""
        return np.stack([self.feet, self.feet + scale * self.missed], axis=1)
