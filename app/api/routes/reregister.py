"""POST /cameras/{id}/reregister: a moved camera's pose found anew with its lens held; nothing is activated."""

from typing import Annotated

from fastapi import APIRouter, Request
from pydantic import Field

from app.api.dependencies import OperatorDep, ServicesDep
from app.api.responses import Json, accepted
from app.api.schemas import responses
from app.api.schemas.requests import Id
from app.core.errors import Conflict
from app.jobs import Job
from app.services.capture import take_snapshot
from app.services.snapshots import job_picture
from app.services.value_types import Name, Note, Strict
from app.workflows.reregister import run_register

router = APIRouter(prefix="/cameras", tags=["cameras"])

FRAMES = 13  # over four seconds: who walks by has left most of them


class Reregister(Strict):
    """By default pictures are taken with the camera now."""

    snapshot: Name | None = Field(None, description="of this camera, in place of pictures that are taken now")
    frames: Annotated[int, Field(ge=1, le=25)] = Field(FRAMES, description="taken now; what moves vanishes")
    note: Note = "Pose registered anew"


@router.post("/{id}/reregister", status_code=202, response_model=responses.Job)
async def reregister_camera(request: Request, services: ServicesDep, by: OperatorDep, id: Id,
                            body: Reregister | None = None) -> Json:
    """Start a job: a child of the active calibration with its lens, and the pose by the field's lines now.

    Its result has the version's id as `calibration`, what moved, and a `sentence`. Nothing is activated.
    """
    body = body or Reregister()
    await services.run_in_thread(services.cameras.get, id)
    calibration, _ = await services.run_in_thread(services.cameras.active_calibration, id)
    if calibration is None:
        raise Conflict("This camera has no active calibration.", "Calibrate it, and activate that version.",
                       reason="not-calibrated")
    snapshot = body.snapshot or (await take_snapshot(services, id, request.is_disconnected, body.frames)).id

    def start() -> Job:
        spec = {"calibration": calibration.to_json(), "snapshot": snapshot, "note": body.note,
                "picture": job_picture(services.store, snapshot, "the picture"),
                "before": services.cameras.calibration_picture(calibration)}
        return services.jobs.start("register", run_register, spec, "registered", {"by": by})
    return accepted(await services.run_in_thread(start))
