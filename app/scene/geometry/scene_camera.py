"""One calibration as it stands in the room, with all that can be shown of it; what cannot says why."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from app.core.errors import TouchlineError
from app.core.field import Field, Region
from app.core.field_json import field_from_json
from app.core.records import Calibration, Observations, observations_from_json
from app.models import CameraModel, model_from_json
from app.models.ray_camera import RayCamera
from app.scene.geometry.error_surface import Sheet, sheet_of
from app.scene.geometry.frustum import WIDEST_DEG, Hung
from app.scene.geometry.pose_change import Moved
from app.scene.geometry.ray_hits import Landings
from app.scene.geometry.textured_quad import Lying

SEEN_MM = 200.0  # an arrow so long is seen on a field of nine metres
SCALES = (1.0, 1000.0)


@dataclass(frozen=True, eq=False)
class Standing:
    """key: how the page calls it. before: an older version of the same camera to see what moved, or None."""

    key: str
    title: str
    calibration: Calibration
    model: CameraModel
    field: Field
    region: Region
    before: Self | None = None

    @classmethod
    def of(cls, key: str, title: str, calibration: Calibration, before: Calibration | None = None) -> Self:
        field = field_from_json(calibration.field)
        model = model_from_json(calibration.model_name, calibration.model_parameters)
        older = cls.of(f"{key}-before", title, before) if before is not None else None
        return cls(key, title, calibration, model, field, field.region(calibration.region, calibration.rotate), older)

    @property
    def label(self) -> str:
        return f"{self.title}, version {self.calibration.version}"

    @cached_property
    def hung(self) -> Hung | None:
        """None for a model that knows of no camera."""
        return Hung.of(self.model) if isinstance(self.model, RayCamera) else None

    @property
    def why_no_frustum(self) -> str | None:
        if self.hung is not None:
            return None
        return (f"{self.model.TITLE}: this model bends the picture until the borders are straight and knows of no "
                "camera. It has no rays, so there is neither a frustum nor a height; its corrected picture lies on the "
                "field instead.")

    @property
    def why_not_whole(self) -> str | None:
        if self.hung is None or self.hung.whole:
            return None
        return f"Its picture reaches further than a frustum can: the middle {WIDEST_DEG:g}° at most are drawn on it."

    @cached_property
    def landings(self) -> Landings:
        observations = observations_from_json(self.calibration.observations)
        return Landings.of(self.model, observations, self.field, self.region, strays_of(self.calibration, observations))

    @cached_property
    def moved(self) -> Moved | None:
        older = self.before
        return None if older is None else Moved.between(older.model, self.model, self.region, older.hung, self.hung)

    @cached_property
    def carpet_sheet(self) -> Sheet | TouchlineError:
        return sheet_of(self.model, self.calibration.covariance, self.region, 0.0)

    @cached_property
    def hat_sheet(self) -> Sheet | TouchlineError:
        return sheet_of(self.model, self.calibration.covariance, self.region, self.field.hat_height_mm)

    @property
    def fair_scale(self) -> float:
        """How many times enlarged residuals and what moved are SEEN_MM long: most of them, not the longest."""
        lengths = [np.linalg.norm(self.landings.missed[~self.landings.stray], axis=1)]
        if self.moved is not None:
            lengths.append(np.linalg.norm(self.moved.arrows[:, 1] - self.moved.arrows[:, 0], axis=1))
        known = [float(np.median(part)) for part in lengths if len(part)]
        longest = max(known, default=1.0)
        return float(np.clip(SEEN_MM / longest, *SCALES)) if longest > 0 else SCALES[1]

    @property
    def lying(self) -> Lying:
        """Where the corrected picture lies, from the outer edge of its first pixels to that of its last."""
        width, height = self.model.corrected_size
        corners = np.array([[0, 0], [width, 0], [0, height]]) - 0.5
        return Lying.through(self.model.field_from_corrected(corners))

    def to_json(self) -> dict[str, Any]:
        """What is told beside the scene."""
        hung, (carpet, hat) = self.hung, (self.carpet_sheet, self.hat_sheet)
        return {"key": self.key, "title": self.title, "version": self.calibration.version,
                "calibration": self.calibration.id, "snapshot": self.calibration.snapshot,
                "camera": self.calibration.camera, "model": self.model.TITLE,
                "height_mm": hung.height_mm if hung else None, "tilt_deg": hung.tilt_deg if hung else None,
                "why_no_frustum": self.why_no_frustum, "why_not_whole": self.why_not_whole,
                "points": len(self.landings.feet), "moved": self.moved.to_json() if self.moved else None,
                "sheet": {"carpet": _told(carpet), "hat": _told(hat), "hat_mm": self.field.hat_height_mm}}


def _told(sheet: Sheet | TouchlineError) -> dict[str, Any]:
    if isinstance(sheet, Sheet):
        return {"max_mm": sheet.largest_mm, "why": None, "fix": None}
    return {"max_mm": None, "why": sheet.what, "fix": sheet.fix}


def strays_of(calibration: Calibration, observations: Observations) -> list[NDArray[np.bool_]]:
    """For each observation, which of its points (n,) the report calls strays; a stranger's report may tell nothing."""
    report = calibration.report if isinstance(calibration.report, Mapping) else {}
    told = report.get("per_feature")
    rows = told if isinstance(told, (list, tuple)) else ()
    strays = []
    for index, observation in enumerate(observations):
        out = np.zeros(len(observation.points), bool)
        row = rows[index] if index < len(rows) and isinstance(rows[index], Mapping) else {}
        residuals = row.get("residuals")
        for place, one in enumerate((residuals if isinstance(residuals, (list, tuple)) else ())[:len(out)]):
            out[place] = isinstance(one, Mapping) and one.get("outlier") is True
        strays.append(out)
    return strays
