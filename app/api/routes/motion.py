"""POST /motion: the distortion that straight rolling shows, and a lens or a refined calibration from it."""

from typing import Annotated, Literal

from fastapi import APIRouter
from pydantic import Field

from app.api.dependencies import OperatorDep, ServicesDep
from app.api.responses import Json, accepted
from app.api.schemas import responses
from app.core.errors import BadInput, Conflict
from app.core.geometry import MAX_COORDINATE
from app.core.records import Calibration
from app.jobs import Job
from app.services.container import Services
from app.services.value_types import Name, Note, Number, Pair, Size, Strict
from app.sources.local.files import file_within
from app.workflows.rolling_request import check, check_refinable, run_motion

router = APIRouter(prefix="/motion", tags=["rolls"])

MAX_ROLLS = 1000


class RollForm(Strict):
    """Where something rolled straight, in order, and for how long."""

    points: Annotated[list[Pair], Field(min_length=5, max_length=2000)] = Field(description="[x, y] px, raw")
    seconds: Annotated[Number, Field(gt=0, le=3600)]


class MotionRequest(Strict):
    """One of camera, film and rolls; the rest says what is made from them."""

    camera: Name | None = Field(None, description="the rolls that are kept of it, without those left out")
    film: Annotated[str, Field(min_length=1, max_length=300)] | None = Field(
        None, description="of a still camera, by its name in the pictures folder, as a video source has it")
    rolls: Annotated[list[RollForm], Field(min_length=1, max_length=MAX_ROLLS)] | None = None
    image_size: Size | None = Field(None, description="of the pictures, with rolls")
    calibration: Name | None = Field(None, description="to judge or to refine; with camera its active one")
    make: Literal["report", "lens", "refined"] = "report"
    lens: Name = Field("auto", description="division, division-even, brown-conrady, or auto")
    centre_sigma_px: Annotated[float, Field(ge=0, le=MAX_COORDINATE)] | None = Field(
        0.0, description="how far the lens' centre may be from the picture's; 0 holds it there")
    note: Note = ""


@router.post("", status_code=202, response_model=responses.Job)
async def judge_motion(services: ServicesDep, by: OperatorDep, body: MotionRequest) -> Json:
    """Start a job: {"report", "lens": id | null, "calibration": id | null}. No version is activated.

    make "lens": the rolls as plumb lines, kept under /lenses for a fit to hold; "refined": the calibration fitted anew
    to its own clicks and these rolls, a new version.
    """
    return accepted(await services.run_in_thread(_start, services, body, by))


def _start(services: Services, body: MotionRequest, by: str) -> Job:
    """Refuse at once what can be, and start the job."""
    store = services.store
    if sum(given is not None for given in (body.camera, body.film, body.rolls)) != 1:
        raise BadInput("It is not clear what rolled.", "Send one of camera, film and rolls.", reason="bad-request")
    check(body.make, body.lens, body.centre_sigma_px)
    calibration, film, rolls, size = None, None, [], body.image_size
    if body.camera is not None:
        services.cameras.get(body.camera)
        saved = store.rolls.of(body.camera)
        size = saved[-1]["image_size"] if saved else None
        rolls = [roll for roll in saved if roll["image_size"] == size and not roll["left_out"]]
        if not rolls:
            raise Conflict("No roll of this camera is kept.", "Watch it, and let a ball roll across the field.",
                           reason="no-rolls")
        calibration = store.calibrations.active(body.camera) if body.calibration is None else None
    elif body.film is not None:
        film = str(file_within(services.settings.shown_pictures, body.film, "video"))
    else:
        rolls = [roll.model_dump() for roll in body.rolls]
        if size is None:
            raise BadInput("The size of the pictures is not given.", 'Send "image_size": [width, height].',
                           reason="no-image-size")
    if body.calibration is not None:
        calibration = store.calibrations.get(body.calibration)
    if calibration is not None and size is not None and list(calibration.image_size) != list(size):
        calibration = _of_another_size(calibration, body)
    if body.make == "refined":
        check_refinable(calibration)
    spec = {"film": film, "rolls": rolls, "image_size": size, "make": body.make, "lens": body.lens,
            "calibration": None if calibration is None else calibration.to_json(), "note": body.note,
            "centre_sigma_px": body.centre_sigma_px, "camera": body.camera}
    return services.jobs.start("motion", run_motion, spec, "motion", {"by": by})


def _of_another_size(calibration: Calibration, body: MotionRequest) -> None:
    """Ignore a calibration that was only at hand; refuse one that was asked for."""
    if body.calibration is None and body.make != "refined":
        return None
    raise Conflict(f"The calibration is of pictures of {calibration.image_size.width} × "
                   f"{calibration.image_size.height} px, the rolls are not.",
                   "Use rolls of the camera and mode that was calibrated.", reason="size-mismatch")
