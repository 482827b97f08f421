"""One calibration with everything that a scene can show of it, or why not."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np

from touchline.core.errors import TouchlineError
from touchline.core.field import Field, Region
from touchline.core.records import Calibration, observations_from_json
from touchline.core.statements import say, stated
from touchline.models import CameraModel
from touchline.models.ray_camera import RayCamera
from touchline.models.restored import Restored
from touchline.scene.geometry.arrows import PoseChange, RayHits
from touchline.scene.geometry.error_surface import ErrorSurface, error_surface
from touchline.scene.geometry.frustum import MAX_FOV_DEG, Frustum
from touchline.scene.geometry.shapes import TexturedQuad

VISIBLE_MM = 200.0  # length of an arrow that is visible on a field of nine metres
SCALES = (1.0, 1000.0)


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
    def of(cls, key: str, title: str, calibration: Calibration, before: Calibration | None = None) -> Self:
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
    def hat_error(self) -> ErrorSurface | TouchlineError:
        return error_surface(self.model, self.calibration.covariance, self.region, self.field.hat_height_mm)

    @property
    def arrow_scale(self) -> float:
        """The scale at which the median arrow is VISIBLE_MM long."""
        lengths = [np.linalg.norm(self.ray_hits.residuals[~self.ray_hits.outlier], axis=1)]
        if self.pose_change is not None:
            lengths.append(np.linalg.norm(self.pose_change.arrows[:, 1] - self.pose_change.arrows[:, 0], axis=1))
        known = [float(np.median(part)) for part in lengths if len(part)]
        longest = max(known, default=1.0)
        return float(np.clip(VISIBLE_MM / longest, *SCALES)) if longest > 0 else SCALES[1]

    @property
    def quad(self) -> TexturedQuad:
        """The corrected picture's place on the carpet, from the outer edge of its first pixels to that of its last."""
        width, height = self.model.corrected_size
        corners = np.array([[0, 0], [width, 0], [0, height]]) - 0.5
        return TexturedQuad.through(self.model.field_from_corrected(corners))

    def to_json(self) -> dict[str, Any]:
        """Return what the page shows beside the scene."""
        frustum, (carpet, hat) = self.frustum, (self.carpet_error, self.hat_error)
        why_no_frustum, why_cropped = None, None
        if frustum is None:
            why_no_frustum = say(
                "scene.no-frustum", "{model}: this model straightens the borders and does not describe a physical "
                "camera. It has no frustum and no height; its corrected image is shown on the field instead.",
                model=self.model.TITLE)
        elif not frustum.complete:
            why_cropped = say("scene.cropped", "The image is wider than a frustum can show: only the middle {deg:g}° "
                              "are shown.", deg=MAX_FOV_DEG)
        return stated({
            "key": self.key, "title": self.title, "version": self.calibration.version,
            "calibration": self.calibration.id, "snapshot": self.calibration.snapshot,
            "camera": self.calibration.camera, "model": self.model.TITLE,
            "height_mm": frustum.height_mm if frustum else None, "tilt_deg": frustum.tilt_deg if frustum else None,
            "why_no_frustum": why_no_frustum, "why_not_whole": why_cropped,
            "points": len(self.ray_hits.points), "moved": self.pose_change.to_json() if self.pose_change else None,
            "sheet": {"carpet": _surface_json(carpet), "hat": _surface_json(hat),
                      "hat_mm": self.field.hat_height_mm}})


def _surface_json(surface: ErrorSurface | TouchlineError) -> dict[str, Any]:
    if isinstance(surface, ErrorSurface):
        return {"max_mm": surface.largest_mm, "why": None, "fix": None}
    return {"max_mm": None, "why": surface.what, "fix": surface.fix}
