"""What responses look like that several resources have; those of one are beside its routes."""

from touchline import jobs
from touchline.api.schemas.base import JsonObject, response
from touchline.api.schemas.media import Responses
from touchline.core.json_values import SizeJson
from touchline.core.records import ObservationJson
from touchline.evaluate.report_types import SavedReport
from touchline.store import snapshots
from touchline.workflows.calibration_types import ModelParameters

Job = response("Job", says=True, record=jobs.Job, without=("spec",))
ACCEPTED: Responses = {202: {"model": Job, "description": "a job: ?job=true"}}

Calibration = response("Calibration", id=str, version=int, camera=str | None, field=str, region=str, rotate=int,
    model=ModelParameters, image_size=SizeJson, corrected_size=SizeJson, observations=list[ObservationJson],
    options=JsonObject, report=SavedReport, created_at=str, software=str, snapshot=str | None, image_sha256=str | None,
    parent=str | None, note=str, made_by=str, active=bool, field_definition=JsonObject)

LensSummary = response("LensSummary", id=str, created_at=str, camera=str | None, note=str, model=str,
    board=JsonObject | None, image_size=list[int])
Lens = response("Lens", LensSummary, lens=JsonObject, report=JsonObject, snapshots=list[str] | None, software=str)

Snapshot = response("Snapshot", record=snapshots.Snapshot)

FrameDetections = response("FrameDetections", seq=int, time_s=float, items=list[JsonObject], stages=list[JsonObject],
    ms=float, notes=list[str], fps=float)

