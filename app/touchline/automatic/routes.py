"""/calibrations/auto: a calibration by the field's lines in an image, without a point of an operator."""

from typing import Annotated, Any

from fastapi import APIRouter, Request
from pydantic import Field

from touchline.api import schemas
from touchline.api.bodies import with_lens
from touchline.api.dependencies import CallerDep, ServicesDep
from touchline.api.requests import MAX_PICTURES, PictureChoice
from touchline.api.responses import Json, accepted
from touchline.automatic.recognition import AUTO, request_for, run_auto
from touchline.jobs import Job
from touchline.services.container import Services
from touchline.services.forms import Name, Note, OptionValues, Pair, Rotate, Strict

router = APIRouter()


class PosePriorForm(Strict):
    """What is roughly known of the camera's pose; without it the lines alone decide."""

    height_mm: Annotated[float, Field(ge=100, le=100_000)] | None = Field(
        None, description="height of the camera, mm, to a third either way"
    )
    turn_deg: Annotated[float, Field(ge=-360, le=360)] | None = Field(
        None,
        description="clockwise rotation of the region in the raw image, relative to the corrected image; within "
        "±50°",
    )


class AutoRequest(PictureChoice):
    """One of snapshot, snapshots and camera; the rest describes the camera."""

    frames: Annotated[int, Field(ge=1, le=MAX_PICTURES)] = Field(
        MAX_PICTURES, description="how many, with camera"
    )
    field: Name = Field(AUTO, description="auto: the one that the image shows")
    region: Name = Field(AUTO, description="auto: the part of the field that the image shows")
    rotate: Rotate | None = None
    model: Name = Field(
        "auto", description="auto: Brown–Conrady, or the first of others that can be fitted"
    )
    options: OptionValues = Field({}, description="options by name, as GET /models describes them")
    rough: PosePriorForm | None = None
    corners: Annotated[list[Pair], Field(min_length=4, max_length=4)] | None = Field(
        None,
        description="top left, top right, bottom right and bottom left corner of the region as it is when "
        "corrected, px of the raw image, a few pixels off: with field and region, where detection "
        "fails without",
    )
    keep: bool = Field(True, description="false: detect the lines without saving a version")
    note: Note = ""


@router.post(
    "/calibrations/auto", tags=["calibrations"], status_code=202, response_model=schemas.Job
)
async def detect_calibration(
    request: Request, services: ServicesDep, caller: CallerDep, body: AutoRequest
) -> Json:
    """Start a job that recognises the field, finds its lines, and saves a version if nothing contradicts it.

    Its result has the version's id or null as `calibration`, a `verdict`, the `doubts`, the `candidates`, and what was
    found as `observations`, which can be fitted or put into a draft like any others. What was not given is under
    `recognised`: several `choices` where the image may show several, and then no version is saved.
    """
    body.check_choice(required=True)
    # refused before a camera takes pictures
    task = await services.run_in_thread(_task, services, body)
    ids = body.ids
    if body.camera is not None:
        ids = [(await services.take_snapshot(body.camera, request.is_disconnected, body.frames)).id]

    def start() -> Job:
        first = services.store.snapshots.get(ids[0])
        spec = {
            "task": {**task, "snapshot": first.id, "camera": first.camera},
            "pictures": services.store.snapshots.all_for_job(ids),
            "keep": body.keep,
        }
        return services.jobs.start(
            "auto", run_auto, spec, "found-lines", {"by": caller.name}, caller=caller
        )

    return accepted(await services.run_in_thread(start))


def _task(services: Services, body: AutoRequest) -> dict[str, Any]:
    prior = body.rough.model_dump(exclude_none=True) if body.rough else {}
    if body.corners is not None:
        prior["corners"] = body.corners
    return request_for(
        services.fields,
        body.field,
        body.region,
        body.rotate,
        model=body.model,
        options=with_lens(services, body.options),
        rough=prior,
        note=body.note,
    ).to_json()
