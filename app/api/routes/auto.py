"""POST /calibrations/auto: find the field's lines in a picture, and a calibration from them, without a click."""

from typing import Annotated, Any

from fastapi import APIRouter, Request
from pydantic import Field

from app.api.dependencies import OperatorDep, ServicesDep
from app.api.request_mapping import with_lens
from app.api.responses import Json, accepted
from app.api.schemas import responses
from app.api.schemas.requests import MAX_PICTURES, PictureChoice
from app.jobs import Job
from app.services.capture import take_snapshot
from app.services.container import Services
from app.services.snapshots import job_pictures
from app.services.value_types import Name, Note, OptionValues, Rotate, Strict
from app.workflows.automatic_request import AutomaticRequest, run_auto

router = APIRouter(prefix="/calibrations", tags=["calibrations"])

class PosePriorForm(Strict):
    """What is roughly known of the camera's pose; without it the lines alone decide."""

    height_mm: Annotated[float, Field(ge=100, le=100_000)] | None = Field(None, description="to a third either way")
    turn_deg: Annotated[float, Field(ge=-360, le=360)] | None = Field(
        None, description="how far the region is turned in the picture, clockwise, from how it stands when corrected; "
                          "to 50° either way")


class AutoRequest(PictureChoice):
    """One of snapshot, snapshots and camera; the rest says what is seen."""

    frames: Annotated[int, Field(ge=1, le=MAX_PICTURES)] = Field(MAX_PICTURES, description="how many, with camera")
    field: Name
    region: Name = "full"
    rotate: Rotate | None = None
    model: Name = Field("auto", description="auto: Brown–Conrady, or the first of others that can be fitted")
    options: OptionValues = Field({}, description="as for a fit")
    rough: PosePriorForm | None = None
    keep: bool = Field(True, description="false: find the lines, and save no version")
    note: Note = ""


@router.post("/auto", status_code=202, response_model=responses.Job)
async def find_calibration(request: Request, services: ServicesDep, by: OperatorDep, body: AutoRequest) -> Json:
    """Start a job that finds the field's lines, assigns them, and saves a version if nothing contradicts it.

    Its result has the version's id or null as `calibration`, a `verdict`, the `doubts`, the `candidates`, and what was
    found as `observations`, which can be fitted or put into a draft like any others.
    """
    body.check_choice(required=True)
    task = await services.run_in_thread(_task, services, body)  # refused before a camera takes pictures
    ids = body.ids or [(await take_snapshot(services, body.camera, request.is_disconnected, body.frames)).id]
    return accepted(await services.run_in_thread(_start, services, body, task, ids, by))


def _task(services: Services, body: AutoRequest) -> dict[str, Any]:
    field = services.fields[body.field]
    prior = body.rough.model_dump(exclude_none=True) if body.rough else {}
    return AutomaticRequest(field, field.region(body.region, body.rotate), body.model,
                            with_lens(services, body.options), prior, note=body.note).to_json()


def _start(services: Services, body: AutoRequest, task: dict[str, Any], ids: list[str], by: str) -> Job:
    first = services.store.snapshots.get(ids[0])
    spec = {"task": {**task, "snapshot": first.id, "camera": first.camera},
            "pictures": job_pictures(services.store, ids), "keep": body.keep}
    return services.jobs.start("auto", run_auto, spec, "found-lines", {"by": by})
