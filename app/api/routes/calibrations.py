"""/calibrations: versions that are made, read, activated, and put to use."""

import json
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request
from starlette.responses import Response

from app.api.answers import Json
from app.api.bodies import uploaded_file
from app.api.file_headers import attachment, error_header
from app.api.operator import operator
from app.api.request_mapping import task_of
from app.api.routes.jobs import accepted, result_of
from app.api.schemas import responses
from app.api.schemas.requests import AsJob, CompareRequest, Cursor, FitRequest, Id, IdQuery, Limit
from app.api.work import at_length, at_work
from app.services.imports import MAX_IMPORT_BYTES, PARTS, keep_import
from app.services.result_savers import keep_version
from app.workflows.calibration_request import run_compare, run_fit
from app.workflows.interchange import export, formats

router = APIRouter(prefix="/calibrations", tags=["calibrations"])

ACCEPTED: dict[int | str, dict[str, Any]] = {202: {"model": responses.Job, "description": "a job: ?job=true"}}
Approximate = Annotated[bool, Query(description="the nearest that the format can hold, with its error")]
CameraId = Annotated[int | None, Query(ge=0, le=2**32 - 1, description="the camera's number in a format that has one")]
BYTES = {"schema": {"type": "string", "format": "binary"}}
FILE: dict[int | str, dict[str, Any]] = {200: {"content": {"application/json": {}, "application/octet-stream": BYTES}}}
IMPORT_BODY = {"requestBody": {"required": True, "content": {"multipart/form-data": {"schema": {
    "type": "object", "required": ["file"], "properties": {
        "file": {"type": "string", "format": "binary"}, **{part: {"type": "string"} for part in PARTS}}}}}}}


@router.post("", status_code=201, response_model=responses.Calibration, responses=ACCEPTED)
async def make_calibration(request: Request, body: FitRequest, job: AsJob = False) -> Json:
    """Fit, judge and keep: a new version of its camera's calibration. Nothing is kept when anything fails.

    With ?job=true a job, whose result is {"calibration": id}.
    """
    task = await at_work(request, task_of, request, body, (body.model,))
    store, by = request.app.state.store, operator(request)
    if job:
        return accepted(await at_work(request, request.app.state.jobs.start, "calibration", run_fit,
                                      {"task": task.to_json()}, "calibration", {"by": by}))
    calibration = await at_work(request, lambda: keep_version(store, task.record(task.run()), by))
    return Json(calibration.to_json(), 201, headers={"Location": f"/api/v1/calibrations/{calibration.id}"})


@router.post("/compare", response_model=responses.Ranking, responses=ACCEPTED)
async def compare_models(request: Request, body: CompareRequest, job: AsJob = False) -> Response:
    """Every model (or those in `models`) on the same clicks, best first; keeps nothing and may take ten seconds.

    With ?job=true a job, whose result is the same ranking.
    """
    task = await at_work(request, task_of, request, body, body.models or ())
    spec = {"task": task.to_json(), "models": body.models}
    if job:
        return accepted(await at_work(request, request.app.state.jobs.start, "comparison", run_compare, spec))
    return result_of(await at_length(request, "comparison", run_compare, spec))


@router.post("/import", status_code=201, response_model=responses.Calibration | responses.Lens,
             openapi_extra=IMPORT_BODY)
async def import_calibration(request: Request) -> Json:
    """Keep what a file holds: multipart with `file` of any format that GET …/exports lists with "reads".

    A calibration as a new version, where the file says where the camera hangs; else a lens, for fits to hold, with its
    Location under /lenses. Texts beside the file say what it does not: field, region, rotate, image_size, camera, …
    """
    data, texts = await uploaded_file(request, MAX_IMPORT_BYTES, PARTS)
    kept, where = await at_work(request, keep_import, request.app.state, data, texts, operator(request))
    return Json(kept, 201, headers={"Location": f"/api/v1/{where}/{kept['id']}"})


@router.get("", response_model=responses.Calibrations)
def list_calibrations(request: Request, camera: Annotated[IdQuery | None, Query()] = None, limit: Limit = 50,
            cursor: Cursor = None) -> Response:
    """Versions, newest first."""
    page = request.app.state.store.calibrations.texts(camera, limit, cursor)
    text = f'{{"items":[{",".join(page.items)}],"next_cursor":{json.dumps(page.next_cursor)}}}'
    return Response(text, media_type="application/json")


@router.get("/{id}", response_model=responses.Calibration)
def read_calibration(request: Request, id: Id) -> Json:
    """One version, with everything it came from."""
    return Json(request.app.state.store.calibrations.get(id).to_json())


@router.delete("/{id}", status_code=204)
def delete_calibration(request: Request, id: Id) -> Response:
    """Forget one version; the active one cannot be forgotten."""
    request.app.state.store.calibrations.delete(id)
    return Response(status_code=204)


@router.post("/{id}/activate", response_model=responses.Calibration)
async def activate_calibration(request: Request, id: Id) -> Json:
    """Make it its camera's; the former one stays, so rolling back is activating that."""
    calibration = await at_work(request, request.app.state.store.calibrations.activate, id, operator(request))
    if calibration.camera is not None:
        request.app.state.live.refresh(calibration.camera)
    request.app.state.publishing.publishing.wake()
    return Json(calibration.to_json())


@router.get("/{id}/exports", response_model=responses.Formats)
async def list_exports(request: Request, id: Id) -> Json:
    """Every format: what it can hold, whether it holds this calibration, and what the nearest costs in mm."""
    calibration = request.app.state.store.calibrations.get(id)
    return Json({"items": await at_work(request, formats, calibration)})


@router.get("/{id}/export/{format}", response_class=Response, responses=FILE)
async def export_calibration(request: Request, id: Id, format: Id, approximate: Approximate = False,
                             camera_id: CameraId = None) -> Response:
    """The calibration as a file of that format; 409 where it cannot hold the model, or with ?approximate=true the
    nearest that it can, its worst error in the header X-Approximation-Error-Mm."""
    calibration = request.app.state.store.calibrations.get(id)
    made = await at_work(request, export, calibration, format, approximate, camera_id)
    return Response(made.data, media_type=made.media_type,
                    headers={"Content-Disposition": attachment(made.name), **error_header(made.loss)})
