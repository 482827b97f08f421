"""Whether a calibration is still right in the current image, and the pose by the lines when it is not."""

from contextlib import suppress
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from pydantic import Field
from typing_extensions import TypedDict

from touchline.api import schemas
from touchline.api.dependencies import CallerDep, ServicesDep
from touchline.api.requests import MAX_PICTURES, AsJob, Id, PictureChoice
from touchline.api.responses import Json, accepted, finished_or_queued
from touchline.core.errors import BadInput, Conflict, TouchlineError
from touchline.core.json_values import JsonObject, PointJson
from touchline.core.sentences import CALIBRATE_AND_ACTIVATE, NOT_CALIBRATED
from touchline.core.statements import say
from touchline.drift.check import CalibrationCheck, run_check
from touchline.drift.reregister import run_register
from touchline.evaluate.field_lines.motion import MOVED_MM
from touchline.evaluate.report_types import Level
from touchline.jobs import Job
from touchline.services.activity import ENTRY_S, DriftEntry
from touchline.services.forms import Name, Note, Strict

router = APIRouter()

NO_DISPLACEMENT: JsonObject = {"calibration": None, "at": None, "image_size": None, "places": []}
DISPLACEMENT_S = 5.0  # for an answer of the camera's process
FRAMES = 13  # over four seconds: who walks by has left most of them


class CheckRequest(PictureChoice):
    """The current image: one of snapshot, snapshots and camera; none of them: the calibration's own camera, now."""

    frames: Annotated[int, Field(ge=1, le=MAX_PICTURES)] = Field(1, description="how many it takes")


@router.post(
    "/calibrations/{id}/check",
    tags=["calibrations"],
    response_model=CalibrationCheck,
    responses=schemas.ACCEPTED,
)
async def check_calibration(
    request: Request, services: ServicesDep, id: Id, body: CheckRequest, job: AsJob = False
) -> Response:
    """Return a verdict and the error of each line in mm; the version, and which one is active, stay as they are."""
    body.check_choice(required=False)
    calibration = await services.run_in_thread(services.store.calibrations.get, id)
    ids = body.ids
    if not ids:
        camera = body.camera or calibration.camera
        if camera is None:
            raise BadInput(
                say("calibration.no-camera", "This calibration has no camera."),
                "Send the snapshot for the check.",
                reason="no-camera",
            )
        ids = [(await services.take_snapshot(camera, request.is_disconnected, body.frames)).id]
    pictures = await services.run_in_thread(services.store.snapshots.all_for_job, ids)
    before = await services.run_in_thread(services.cameras.calibration_picture, calibration)
    spec = {
        "calibration": calibration.to_json(),
        "snapshot": ids[0],
        "pictures": pictures,
        "before": before,
    }
    return await finished_or_queued(request, services, "check", run_check, spec, job)


class DriftPlace(TypedDict):
    """was, now: where the place of a line was when calibrated and is now, raw px; mm: between them, on the carpet."""

    was: PointJson
    now: PointJson
    mm: float
    level: Level


class CameraDisplacement(TypedDict):
    """How far the camera's lines have moved, and had in the last hours; moved_mm: from there on it is an alarm."""

    calibration: str | None
    at: float | None
    image_size: list[int] | None
    places: list[DriftPlace]
    moved_mm: float
    entry_s: int
    history: list[DriftEntry]


Since = Annotated[float, Query(description="only what the history has from then on, unix, s")]


@router.get("/cameras/{id}/drift", tags=["cameras"], response_model=CameraDisplacement)
async def read_camera_drift(services: ServicesDep, id: Id, since: Since = 0.0) -> Json:
    """Return where the lines were and are now, place by place, and the displacement in the last six hours.

    No places while they are not measured. The history ends with the server, and with the camera's process.
    """
    await services.run_in_thread(services.cameras.get, id)
    camera = services.live.get_running(id)
    measured: JsonObject = {}
    if camera is not None and camera.status()["drift"] is not None:
        with suppress(TouchlineError):  # its process ends or starts anew
            measured = (await camera.request("displacement", DISPLACEMENT_S))[0]
    return Json(
        {
            **NO_DISPLACEMENT,
            **measured,
            "moved_mm": MOVED_MM,
            "entry_s": ENTRY_S,
            "history": services.events.drift.of(id, since),
        }
    )


class Reregister(Strict):
    """By default images are taken with the camera now."""

    snapshot: Name | None = Field(
        default=None, description="of this camera, instead of current images"
    )
    frames: Annotated[int, Field(ge=1, le=25)] = Field(
        default=FRAMES, description="taken now; moving objects are removed"
    )
    note: Note = "Pose updated"


@router.post(
    "/cameras/{id}/reregister", tags=["cameras"], status_code=202, response_model=schemas.Job
)
async def reregister_camera(
    request: Request,
    services: ServicesDep,
    caller: CallerDep,
    id: Id,
    body: Reregister | None = None,
) -> Json:
    """Start a job: a child of the active calibration with its lens, and the pose by the field's lines now.

    Its result has the version's id as `calibration`, what moved, and a `sentence`. Nothing is activated.
    """
    body = body or Reregister()
    await services.run_in_thread(services.cameras.get, id)
    calibration, _ = await services.run_in_thread(services.cameras.active_calibration, id)
    if calibration is None:
        raise Conflict(NOT_CALIBRATED, CALIBRATE_AND_ACTIVATE, reason="not-calibrated")
    snapshot = (
        body.snapshot or (await services.take_snapshot(id, request.is_disconnected, body.frames)).id
    )

    def start() -> Job:
        spec = {
            "calibration": calibration.to_json(),
            "snapshot": snapshot,
            "note": body.note,
            "picture": services.store.snapshots.for_job(snapshot, "the image"),
            "before": services.cameras.calibration_picture(calibration),
        }
        return services.jobs.start(
            "register", run_register, spec, "registered", {"by": caller.name}, caller=caller
        )

    return accepted(await services.run_in_thread(start))
