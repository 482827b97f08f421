"""/calibrations: make, read, annotate, activate, delete and export versions."""

import json
from collections.abc import Mapping
from functools import partial
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Query, Request
from pydantic import Field
from starlette.responses import Response

from touchline.api import schemas
from touchline.api.bodies import fit_task, uploaded_file
from touchline.api.dependencies import (
    IfMatch,
    OperatorDep,
    ServicesDep,
    VersionDep,
    caller_of,
    in_thread,
)
from touchline.api.middleware.problems import json_bytes
from touchline.api.requests import AsJob, CompareRequest, Cursor, Id, IdQuery, Limit, SaveRequest
from touchline.api.responses import (
    Json,
    JsonText,
    attachment,
    cached_response,
    created,
    error_header,
    finished_or_queued,
    versioned,
)
from touchline.api.schemas import (
    EXPORTED,
    UNCHANGED,
    JsonObject,
    list_of,
    page_of,
    response,
    upload,
)
from touchline.core.errors import TouchlineError
from touchline.core.jobs import Progress
from touchline.core.records import Calibration
from touchline.formats.document import MAX_FILE_BYTES
from touchline.services.answer_cache import CachedAnswer
from touchline.services.claims import activate
from touchline.services.container import Services
from touchline.services.fit_processes import FEW_POINTS
from touchline.services.forms import Name, Note, Strict
from touchline.services.import_file import OPTIONS, import_file
from touchline.services.result_savers import save_new_version
from touchline.services.turned_version import save_turned_version
from touchline.store.calibrations import NOTHING_ACTIVE, FoundVersion, version_etag
from touchline.store.store import Store
from touchline.workflows.calibration_request import (
    CalibrationRequest,
    run_attempt,
    run_compare,
    run_fit,
    run_preview,
)
from touchline.workflows.interchange import export, formats
from touchline.workflows.model_choice import Ranking

router = APIRouter(prefix="/calibrations", tags=["calibrations"])

Calibrations = page_of("Calibrations", schemas.Calibration)
Activation = response(
    "Activation", calibration=str, version=int | None, at=str, by=str, despite=list[str]
)
Activations = response("Activations", items=list_of(Activation))
Format = response(
    "Format",
    format=str,
    title=str,
    holds=str,
    suffix=str,
    reads=bool,
    exact=bool,
    loss=JsonObject | None,
    problem=JsonObject | None,
)
Formats = response("Formats", items=list_of(Format))


class NoteChange(Strict):
    note: Note


class TurnRequest(Strict):
    """How the images of a camera are turned since a version was made."""

    turn: Literal[90, 180, 270] = Field(description="clockwise, degrees")


class ActivationRequest(Strict):
    """What a version is activated in spite of."""

    despite: Annotated[list[Name], Field(max_length=50)] = Field(
        [], description="codes of claims that stand against it"
    )


@router.get("/activations", response_model=Activations)
def list_activations(
    services: ServicesDep, camera: Annotated[IdQuery | None, Query()] = None
) -> Json:
    """List activations of a camera, when and by whom, newest first; without a camera, for images from files.

    The ETag, the id of the version that is active now or "none", goes into If-Match of the next activation.
    """
    store = services.store
    history = store.calibrations.history(camera)
    versions = {id: _version(store, id) for id in {row["calibration"] for row in history}}
    return versioned(
        {"items": [{**row, "version": versions[row["calibration"]]} for row in history]},
        store.calibrations.active_id(camera) or NOTHING_ACTIVE,
    )


@router.patch("/{id}", response_model=schemas.Calibration)
def update_calibration_note(
    services: ServicesDep, id: Id, body: NoteChange, if_match: IfMatch = None
) -> Json:
    """Change the note of a version: nothing else of it ever changes.

    With If-Match, the ETag of GET, only if nobody has changed it since: else 412, with `current`.
    """
    return _version_json(services.store.calibrations.annotate(id, body.note, if_match))


@router.post("/{id}/restore", response_model=schemas.Calibration)
def restore_calibration(services: ServicesDep, id: Id, if_match: IfMatch = None) -> Json:
    """Undo a deletion: the version is there again under its number. With If-Match only if it is unchanged."""
    return _version_json(services.store.calibrations.restore(id, if_match))


def _version_json(calibration: Calibration) -> Json:
    return versioned(calibration.to_json(), version_etag(calibration))


def _version(store: Store, id: str) -> Any:
    try:
        return store.calibrations.get(id).version
    except TouchlineError:  # deleted, or damaged: the history says that it was, all the same
        return None


Approximate = Annotated[
    bool, Query(description="the best approximation in the format, with its error")
]
CameraNumber = Annotated[
    int | None,
    Query(ge=0, le=2**32 - 1, description="the camera's number in a format that has one"),
]
IMPORT_BODY = {"requestBody": upload({option: {"type": "string"} for option in OPTIONS})}


@router.post("", status_code=201, response_model=schemas.Calibration, responses=schemas.ACCEPTED)
async def create_calibration(
    request: Request, services: ServicesDep, by: OperatorDep, body: SaveRequest, job: AsJob = False
) -> Response:
    """Fit, evaluate and save a new version of a camera's calibration. Nothing is saved if anything fails.

    With ?job=true a job, whose result is {"calibration": id}.
    """
    task = await services.run_in_thread(fit_task, services, body, (body.model,))
    spec = {"task": task.to_json(), "compare": body.compare}
    if not job and task.n_points <= FEW_POINTS:
        is_compared = task.chooses and body.compare
        fit = _fit_after_comparing if is_compared else _fit_as_previewed
        calibration = await fit(request, services, task)
        return _created(
            await services.run_in_thread(save_new_version, services.store, calibration, by)
        )
    return await finished_or_queued(
        request,
        services,
        "calibration",
        run_fit,
        spec,
        job,
        "calibration",
        {"by": by},
        lambda record_json: _created(services.store.calibrations.get(record_json["calibration"])),
    )


async def _fit_after_comparing(
    request: Request, services: Services, task: CalibrationRequest
) -> Calibration:
    address = (await caller_of(request)).address
    record_json = await services.comparisons.run(
        run_fit, {"task": task.to_json()}, address, request.is_disconnected
    )
    return Calibration.from_json(json.loads(record_json))


async def _fit_as_previewed(
    request: Request, services: Services, task: CalibrationRequest
) -> Calibration:
    """Return the fit of POST /fit/attempt: a page that has just shown it need not wait for a second one."""
    address = (await caller_of(request)).address
    spec = {"task": task.to_json(), "quick": False, "mesh_margin_px": None}
    attempt = await services.fits.run(run_attempt, spec, address, request.is_disconnected)
    preview = json.loads(attempt)["preview"]
    if preview is None:  # the same fit raises why
        preview = json.loads(
            await services.fits.run(run_preview, spec, address, request.is_disconnected)
        )
    return task.record_preview(preview)


def _created(calibration: Calibration) -> Json:
    return created(calibration.to_json(), f"calibrations/{calibration.id}")


@router.post("/compare", response_model=Ranking, responses=schemas.ACCEPTED)
async def compare_models(
    request: Request, services: ServicesDep, body: CompareRequest, job: AsJob = False
) -> Response:
    """Rank every model (or those in `models`) on the same points; saves nothing and may take ten seconds.

    With ?job=true a job, whose result is the same ranking.
    """
    task = await services.run_in_thread(fit_task, services, body, body.models or ())
    spec = {"task": task.to_json(), "models": body.models}
    return await finished_or_queued(request, services, "comparison", run_compare, spec, job)


@router.post(
    "/import",
    status_code=201,
    response_model=schemas.Calibration | schemas.Lens,
    openapi_extra=IMPORT_BODY,
)
async def import_calibration(request: Request, services: ServicesDep, by: OperatorDep) -> Json:
    """Save the content of a file: multipart with `file` of any format that GET …/exports lists with "reads".

    A calibration as a new version, if the file has the camera's pose; else a lens, which fits can hold fixed, with its
    Location under /lenses. Texts beside the file say what it does not: field, region, rotate, image_size, camera, …
    """
    data, texts = await uploaded_file(request, MAX_FILE_BYTES, OPTIONS)
    record, collection = await services.run_in_thread(import_file, services, data, texts, by)
    return created(record, f"{collection}/{record['id']}")


@router.get("", response_model=Calibrations)
def list_calibrations(
    services: ServicesDep,
    camera: Annotated[IdQuery | None, Query()] = None,
    snapshot: Annotated[IdQuery | None, Query()] = None,
    limit: Limit = 50,
    cursor: Cursor = None,
    brief: Annotated[
        bool,
        Query(
            description="without points, residuals, covariances and the field's definition, with the "
            "changes of the field since then"
        ),
    ] = False,
) -> Response:
    """List versions, newest first; those of one camera, from one snapshot, or all."""
    page = services.store.calibrations.found(camera, limit, cursor, snapshot)
    texts = [_brief(services, one) if brief else one.text.encode() for one in page.items]
    return JsonText(
        b'{"items":[%b],"next_cursor":%b}' % (b",".join(texts), json_bytes(page.next_cursor))
    )


def _brief(services: Services, version: FoundVersion) -> bytes:
    """Return the JSON of a version's brief form; made once, until it or a field has changed."""

    def record_json() -> CachedAnswer:
        calibration = version.calibration
        report = {**calibration.report, "per_feature": []}
        report.pop("model_choice", None)
        # which parameters were found, lists do tell; an imported one may be anything
        if "covariance" in report:
            known = report["covariance"]
            names = known.get("names") if isinstance(known, Mapping) else None
            report["covariance"] = (
                {"names": names, "matrix": []} if isinstance(names, list) else None
            )
        return CachedAnswer.of(
            json_bytes(
                {
                    **calibration.to_json(),
                    "observations": [],
                    "field_definition": {},
                    "report": report,
                    "field_changes": services.cameras.field_changes(calibration),
                }
            )
        )

    return services.answers.get_or_make(
        (_brief, version.stamp, services.fields.revision), record_json
    ).content


@router.get("/{id}", response_model=schemas.Calibration)
def read_calibration(services: ServicesDep, id: Id) -> Json:
    """Return one version, with everything it was made from; its ETag goes into If-Match of PATCH and DELETE."""
    return _version_json(services.store.calibrations.get(id))


@router.delete("/{id}", status_code=204, response_class=Response)
def delete_calibration(services: ServicesDep, id: Id, if_match: IfMatch = None) -> None:
    """Delete one version; the active one cannot be deleted. With If-Match only if it is unchanged."""
    services.store.calibrations.delete(id, if_match)


@router.post("/{id}/activate", response_model=schemas.Calibration)
async def activate_calibration(
    request: Request,
    services: ServicesDep,
    by: OperatorDep,
    id: Id,
    body: ActivationRequest | None = None,
    if_match: IfMatch = None,
) -> Json:
    """Make a version its camera's active one; the former stays, so rolling back is activating that.

    Its claims are tried first, with a frame of its camera where that is live. 409 `problems-found` where some stand
    against it: with those as `claims`, and their codes as `despite`, which the body must name to activate it all the
    same. With If-Match, the id of the version that you saw as the active one or "none", only if it still is: else 412,
    with who has activated what as `current`.
    """
    despite = [] if body is None else body.despite
    return _version_json(
        await activate(services, id, by, if_match, despite, request.is_disconnected)
    )


@router.post("/{id}/turned", status_code=201, response_model=schemas.Calibration)
async def turn_calibration(
    request: Request, services: ServicesDep, by: OperatorDep, id: Id, body: TurnRequest
) -> Json:
    """Save a new version for images that are turned since: exact, with the points, the image and the lens turned.

    The corrected image and every error in mm are those of the former version, its `parent`. It is not activated.
    """
    before = await services.run_in_thread(services.store.calibrations.get, id)

    def save(_: Progress) -> Calibration:
        return save_turned_version(services, id, body.turn, by)

    return _created(
        await services.process_picture(before.image_size, save, request.is_disconnected)
    )


@router.get("/{id}/exports", response_model=Formats, responses=UNCHANGED)
@cached_response
@in_thread
def list_exports(services: ServicesDep, version: VersionDep) -> Json:
    """List every format: what it can represent, whether this calibration is exact in it, else the error in mm."""
    return Json({"items": formats(version.calibration)})


@router.get("/{id}/export/{format}", response_class=Response, responses=EXPORTED)
async def export_calibration(
    request: Request,
    services: ServicesDep,
    id: Id,
    format: Id,
    approximate: Approximate = False,
    camera_id: CameraNumber = None,
) -> Response:
    """Return the calibration in that format; 409 if that cannot represent the model, or with ?approximate=true the
    nearest that it can, its worst error in the header X-Approximation-Error-Mm."""
    calibration = await services.run_in_thread(services.store.calibrations.get, id)
    write = partial(export, calibration, format, approximate, camera_id)
    # a remap table is as large as the corrected picture
    file = await services.process_picture(
        calibration.corrected_size, write, request.is_disconnected
    )
    return Response(
        file.data,
        media_type=file.media_type,
        headers={"Content-Disposition": attachment(file.name), **error_header(file.loss)},
    )
