"""One calibration with everything that a scene can show of it, or why not; and a place on the carpet in all of them.

camera = SceneCamera.of("north", "North", calibration)
camera.frustum.height_mm, camera.ray_hits.points, describe_place((0.0, 500.0), [camera])
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from touchline.core.errors import TouchlineError
from touchline.core.field import Field, Region
from touchline.core.geometry import Points, inside_picture
from touchline.core.json_values import JsonObject
from touchline.core.records import Calibration, Observations, observations_from_json
from touchline.core.statements import say, stated
from touchline.evaluate.difference import difference_mm
from touchline.evaluate.residuals import feature_residuals
from touchline.evaluate.uncertainty import expected_error, fit_from_json, grid_over
from touchline.fitting import sensitivity_of
from touchline.models import CameraModel, Restored, field_from_raw, raw_from_field
from touchline.models.ray_camera import RayCamera
from touchline.scene.frustum import MAX_FOV_DEG, Frustum
from touchline.scene.shapes import ErrorSurface, TexturedQuad, error_surface

VISIBLE_MM = 200.0  # length of an arrow that is visible on a field of nine metres
SCALES = (1.0, 1000.0)
CHANGE_GRID = (13, 11)  # arrows over the region


@dataclass(frozen=True, eq=False)
class RayHits:
    """points (n, 3) mm; residuals (n, 3) mm, from there to where it should be; outlier (n,): left out by the fit.

    Points that the model does not reach are left out.
    """

    points: NDArray[np.float64]
    residuals: NDArray[np.float64]
    outlier: NDArray[np.bool_]

    @classmethod
    def of(
        cls,
        model: CameraModel,
        observations: Observations,
        field: Field,
        region: Region,
        outliers: Sequence[NDArray[np.bool_]],
    ) -> Self:
        """Return where the model puts the observed points. outliers: of each observation, by its points."""
        hits = [cls(np.empty((0, 3)), np.empty((0, 3)), np.empty(0, bool))]
        for observation, outlier in zip(observations, outliers, strict=True):
            found = feature_residuals(model, observation, field, region)
            reached = np.isfinite(found.place_mm).all(axis=1) & np.isfinite(found.to_place_mm).all(
                axis=1
            )
            points = np.column_stack(
                [found.place_mm, np.full(len(found.place_mm), observation.z_mm)]
            )
            residuals = np.column_stack([found.to_place_mm, np.zeros(len(found.place_mm))])
            hits.append(cls(points[reached], residuals[reached], outlier[reached]))
        return cls(
            np.concatenate([hit.points for hit in hits]),
            np.concatenate([hit.residuals for hit in hits]),
            np.concatenate([hit.outlier for hit in hits]),
        )

    def rays_from(self, position_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return rays (n, 2, 3) from the camera to each point."""
        return np.stack([np.broadcast_to(position_mm, self.points.shape), self.points], axis=1)

    def arrows(self, scale: float) -> NDArray[np.float64]:
        """Return the residuals (n, 2, 3) as arrows enlarged by scale."""
        return np.stack([self.points, self.points + scale * self.residuals], axis=1)


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
    def between(
        cls,
        older: CameraModel,
        newer: CameraModel,
        region: Region,
        before: Frustum | None,
        now: Frustum | None,
    ) -> Self:
        """Return how the picture of the region moves from one version to the next. before, now: the frustum of each."""
        places = grid_over(region, *CHANGE_GRID).reshape(-1, 2)
        # the pixel of the older one, by the newer one
        moved = field_from_raw(newer, raw_from_field(older, places))
        level = np.stack([places, moved], axis=1)[np.isfinite(moved).all(axis=1)]
        arrows = np.concatenate([level, np.zeros((*level.shape[:2], 1))], axis=2)
        _, mm, _ = difference_mm(older, newer, region)
        known = np.isfinite(mm).any()
        shift, turn = None, None
        if before is not None and now is not None:
            shift = now.position_mm - before.position_mm
            rotation = now.field_from_camera @ before.field_from_camera.T
            cosine = (np.trace(rotation) - 1) / 2  # of the angle of a rotation matrix
            turn = float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
        return cls(
            arrows,
            float(np.nanmedian(mm)) if known else None,
            float(np.nanmax(mm)) if known else None,
            shift,
            turn,
        )

    def scaled(self, scale: float) -> NDArray[np.float64]:
        """Return the arrows (n, 2, 3) enlarged by scale."""
        start, end = self.arrows[:, 0], self.arrows[:, 1]
        return np.stack([start, start + scale * (end - start)], axis=1)

    def to_json(self) -> JsonObject:
        return {
            "median_mm": self.median_mm,
            "max_mm": self.max_mm,
            "turn_deg": self.turn_deg,
            "shift_mm": None if self.shift_mm is None else self.shift_mm.tolist(),
        }


@dataclass(frozen=True, eq=False)
class SceneCamera:
    """key: its name on the page. before: an older version of the same camera to compare with, or None."""

    key: str
    title: str
    calibration: Calibration
    model: CameraModel
    field: Field
    region: Region
    before: Self | None = None

    @classmethod
    def of(
        cls, key: str, title: str, calibration: Calibration, before: Calibration | None = None
    ) -> Self:
        """Restore the calibration, and the older one. Errors as Restored.of."""
        older = cls.of(f"{key}-before", title, before) if before is not None else None
        return cls(key, title, calibration, *Restored.of(calibration), older)

    @cached_property
    def frustum(self) -> Frustum | None:
        """None for a model without a pose."""
        return Frustum.of(self.model) if isinstance(self.model, RayCamera) else None

    @cached_property
    def ray_hits(self) -> RayHits:
        observations = observations_from_json(self.calibration.observations)
        outliers = self.calibration.outliers(observations)
        return RayHits.of(self.model, observations, self.field, self.region, outliers)

    @cached_property
    def pose_change(self) -> PoseChange | None:
        if (older := self.before) is None:
            return None
        return PoseChange.between(older.model, self.model, self.region, older.frustum, self.frustum)

    @cached_property
    def carpet_error(self) -> ErrorSurface | TouchlineError:
        return error_surface(self.model, self.calibration.covariance, self.region, 0.0)

    @cached_property
    def robot_top_error(self) -> ErrorSurface | TouchlineError:
        return error_surface(
            self.model, self.calibration.covariance, self.region, self.field.hat_height_mm
        )

    @property
    def arrow_scale(self) -> float:
        """The scale at which the median arrow is VISIBLE_MM long."""
        lengths = [np.linalg.norm(self.ray_hits.residuals[~self.ray_hits.outlier], axis=1)]
        if self.pose_change is not None:
            lengths.append(
                np.linalg.norm(
                    self.pose_change.arrows[:, 1] - self.pose_change.arrows[:, 0], axis=1
                )
            )
        medians = [float(np.median(part)) for part in lengths if len(part)]
        longest = max(medians, default=1.0)
        return float(np.clip(VISIBLE_MM / longest, *SCALES)) if longest > 0 else SCALES[1]

    @property
    def quad(self) -> TexturedQuad:
        """The corrected picture's place on the carpet, from the outer edge of its first pixels to that of its last."""
        width, height = self.model.corrected_size
        corners = np.array([[0, 0], [width, 0], [0, height]]) - 0.5
        return TexturedQuad.through(self.model.field_from_corrected(corners))

    def to_json(self) -> JsonObject:
        """Return what the page shows beside the scene."""
        frustum, (carpet, hat) = self.frustum, (self.carpet_error, self.robot_top_error)
        why_no_frustum, why_cropped = None, None
        if frustum is None:
            why_no_frustum = say(
                "scene.no-frustum",
                "{model}: this model straightens the borders and does not describe a physical "
                "camera. It has no frustum and no height; its corrected image is shown on the field instead.",
                model=self.model.TITLE,
            )
        elif not frustum.complete:
            why_cropped = say(
                "scene.cropped",
                "The image is wider than a frustum can show: only the middle {deg:g}° are shown.",
                deg=MAX_FOV_DEG,
            )
        return stated(
            {
                "key": self.key,
                "title": self.title,
                "version": self.calibration.version,
                "calibration": self.calibration.id,
                "snapshot": self.calibration.snapshot,
                "camera": self.calibration.camera,
                "model": self.model.TITLE,
                "height_mm": frustum.height_mm if frustum else None,
                "tilt_deg": frustum.tilt_deg if frustum else None,
                "why_no_frustum": why_no_frustum,
                "why_not_whole": why_cropped,
                "points": len(self.ray_hits.points),
                "moved": self.pose_change.to_json() if self.pose_change else None,
                "sheet": {
                    "carpet": _surface_json(carpet),
                    "hat": _surface_json(hat),
                    "hat_mm": self.field.hat_height_mm,
                },
            }
        )


def _surface_json(surface: ErrorSurface | TouchlineError) -> JsonObject:
    if isinstance(surface, ErrorSurface):
        return {"max_mm": surface.largest_mm, "why": None, "fix": None}
    return {"max_mm": None, "why": surface.what, "fix": surface.fix}


def carpet_intersection(origin_mm: ArrayLike, direction: ArrayLike) -> Points | None:
    """Return where a ray meets the carpet, field mm (2,); None where it points away."""
    origin, along = np.asarray(origin_mm, np.float64), np.asarray(direction, np.float64)
    if not (np.isfinite(origin).all() and np.isfinite(along).all()) or origin[2] * along[2] >= 0:
        return None
    return origin[:2] - along[:2] * (origin[2] / along[2])


def describe_place(place_mm: ArrayLike, cameras: Sequence[SceneCamera]) -> JsonObject:
    """Describe a place as JSON.

    {"place_mm", "cameras": [{"key", "pixel", "inside", "hat_pixel", "sigma_mm", "hat_sigma_mm"}, …]}.

    null for what a camera does not see or a model does not know.
    """
    place = np.asarray(place_mm, np.float64)
    return {
        "place_mm": place.tolist(),
        "cameras": [_describe_in_camera(place, camera) for camera in cameras],
    }


def _describe_in_camera(place: Points, camera: SceneCamera) -> JsonObject:
    pixel, robot_top_mm = raw_from_field(camera.model, place), camera.field.hat_height_mm
    hat_pixel = (
        camera.frustum.model.project(np.array([*place, robot_top_mm]))
        if camera.frustum
        else np.full(2, np.nan)
    )
    return {
        "key": camera.key,
        "title": camera.title,
        "calibration": camera.calibration.id,
        "snapshot": camera.calibration.snapshot,
        "pixel": pixel.tolist() if np.isfinite(pixel).all() else None,
        "inside": bool(inside_picture(pixel, camera.model.image_size)),
        "hat_pixel": hat_pixel.tolist() if np.isfinite(hat_pixel).all() else None,
        "sigma_mm": _expected_error_mm(camera, place, 0.0),
        "hat_sigma_mm": _expected_error_mm(camera, place, robot_top_mm),
    }


def _expected_error_mm(camera: SceneCamera, place: Points, z_mm: float) -> float | None:
    model = camera.model
    covariance = camera.calibration.covariance
    if covariance is None or sensitivity_of(model) is None or (z_mm and camera.frustum is None):
        return None
    try:
        fit, stand_in = fit_from_json(covariance, model)
        return float(
            expected_error(
                fit, camera.region, z_mm, place.reshape(1, 1, 2), stand_in=stand_in
            ).sigma_mm[0, 0]
        )
    except TouchlineError:  # the model does not see the place, or its covariance is another's
        return None
