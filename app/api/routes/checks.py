"""POST /calibrations/{id}/check: whether a calibration still fits today's picture. Nothing is saved."""

from typing import Annotated

from fastapi import APIRouter, Request, Response
from pydantic import Field

from app.api.dependencies import ServicesDep
from app.api.responses import finished_or_queued
from app.api.routes.calibrations import ACCEPTED, AsJob
from app.api.schemas import responses
from app.api.schemas.requests import MAX_PICTURES, Id, PictureChoice
from app.core.errors import BadInput
from app.services.capture import take_snapshot
from app.services.snapshots import job_pictures
from app.workflows.check import run_check

router = APIRouter(prefix="/calibrations", tags=["calibrations"])


class CheckRequest(PictureChoice):
    """Today's picture: one of snapshot, snapshots and camera; none of them: the calibration's own camera, now."""

    frames: Annotated[int, Field(ge=1, le=MAX_PICTURES)] = Field(1, description="how many it takes")


@router.post("/{id}/check", response_model=responses.CalibrationCheck, responses=ACCEPTED)
async def check_calibration(request: Request, services: ServicesDep, id: Id, body: CheckRequest,
                            job: AsJob = False) -> Response:
    """Return a verdict and the error of each line in mm; the version, and which one is active, stay as they are."""
    body.check_choice(required=False)
    calibration = await services.run_in_thread(services.store.calibrations.get, id)
    ids = body.ids
    if not ids:
        camera = body.camera or calibration.camera
        if camera is None:
            raise BadInput("This calibration is of no camera.", "Send the snapshot to check it with.",
                           reason="no-camera")
        ids = [(await take_snapshot(services, camera, request.is_disconnected, body.frames)).id]
    pictures = await services.run_in_thread(job_pictures, services.store, ids)
    spec = {"calibration": calibration.to_json(), "snapshot": ids[0], "pictures": pictures}
    return await finished_or_queued(request, services, "check", run_check, spec, job)
