"""Arrows over the carpet: from clicks to where their rays meet it, and from one version of a camera to the next."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from touchline.core.field import Field, Region
from touchline.core.records import Observations
from touchline.evaluate.fit.difference import difference_mm
from touchline.evaluate.fit.residuals import feature_residuals
from touchline.evaluate.fit.uncertainty import grid_over
from touchline.models import CameraModel, field_from_raw, raw_from_field
from touchline.scene.geometry.frustum import Frustum


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


GRID = (13, 11)  # arrows over the region


@dataclass(frozen=True, eq=False)
class PoseChange:
    """arrows (n, 2, 3) mm on the carpet: from where the older version puts a pixel to where the newer one does.

    shift_mm (3,) and turn_deg: of the camera, None where either version knows none.
    """

    arrows: NDArray[np.float64]
    median_mm: float | None
    max_mm: float | None
    shift_mm: NDArray[np.float64] | None
    turn_deg: float | None

    @classmethod
    def between(cls, older: CameraModel, newer: CameraModel, region: Region, before: Frustum | None,
                now: Frustum | None) -> Self:
        places = grid_over(region, *GRID).reshape(-1, 2)
        there = field_from_raw(newer, raw_from_field(older, places))
        ends = np.stack([places, there], axis=1)[np.isfinite(there).all(axis=1)]
        _, mm, _ = difference_mm(older, newer, region)
        known = np.isfinite(mm).any()
        shift, turn = None, None
        if before is not None and now is not None:
            shift, turned = now.position_mm - before.position_mm, now.field_from_camera @ before.field_from_camera.T
            turn = float(np.degrees(np.arccos(np.clip((np.trace(turned) - 1) / 2, -1, 1))))
        return cls(np.concatenate([ends, np.zeros((*ends.shape[:2], 1))], axis=2),
                   float(np.nanmedian(mm)) if known else None, float(np.nanmax(mm)) if known else None, shift, turn)

    def scaled(self, scale: float) -> NDArray[np.float64]:
        """Return the arrows (n, 2, 3) enlarged by scale."""
        return np.stack([self.arrows[:, 0], self.arrows[:, 0] + scale * (self.arrows[:, 1] - self.arrows[:, 0])],
                        axis=1)

    def to_json(self) -> dict[str, Any]:
        return {"median_mm": self.median_mm, "max_mm": self.max_mm, "turn_deg": self.turn_deg,
                "shift_mm": None if self.shift_mm is None else self.shift_mm.tolist()}
