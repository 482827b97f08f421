"""One calibration to be made: everything it rests on, looked up and checked; every door makes the same one."""

import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from dataclasses import field as member
from datetime import UTC, datetime
from typing import Any

from app import __version__, pipeline
from app.errors import BadInput
from app.field import Field, Region
from app.geometry import ImageSize
from app.models import Progress, no_progress, parameters_json
from app.pipeline import Calibrated
from app.records import Calibration, Observations


@dataclass(frozen=True, eq=False)
class Task:
    """What to fit, to which clicks, on which picture."""

    observations: Observations
    field: Field
    region: Region
    image_size: ImageSize
    model: str = "polynomial"
    options: Mapping[str, Any] = member(default_factory=dict)
    camera: str | None = None
    snapshot: str | None = None
    image_sha256: str | None = None
    note: str = ""

    def __post_init__(self) -> None:
        if not self.observations:
            raise BadInput("There are no observations.", "Click points on the four borders.", reason="too-few-points")

    def run(self, progress: Progress = no_progress, *, cross_validate: bool = True) -> Calibrated:
        """Fit and judge; nothing is kept."""
        return pipeline.calibrate(self.observations, self.field, self.region, self.image_size, self.model,
                                  self.options, progress, cross_validate=cross_validate)

    def compare(self, models: list[str] | None, progress: Progress = no_progress) -> dict[str, Any]:
        """Several models (all, where none are named) on the same observations, ranked."""
        return pipeline.compare(self.observations, self.field, self.region, self.image_size,
                                tuple(models) if models else None, self.options, progress)

    def record(self, done: Calibrated, *, version: int = 1, parent: str | None = None) -> Calibration:
        """The result as one immutable version, with all that it came from."""
        return Calibration(
            id=secrets.token_hex(8), version=version, camera=self.camera, field=self.field.to_json(),
            region=self.region.name, rotate=self.region.rotate_deg, model_name=self.model,
            model_parameters=parameters_json(done.model), image_size=self.image_size,
            corrected_size=done.model.corrected_size, observations=tuple(o.to_json() for o in self.observations),
            options=dict(self.options), report=done.report,
            created_at=datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z"),
            software=f"touchline {__version__}", snapshot=self.snapshot, image_sha256=self.image_sha256,
            parent=parent, note=self.note)
