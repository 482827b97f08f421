"""/fields, /models and /fit: what a fit starts from, and what clicks would give, at once; only fields are saved."""

from typing import Annotated, Any

from fastapi import APIRouter, Body, Query

from app.api.dependencies import IfMatch, ServicesDep, in_thread
from app.api.request_mapping import fit_task, image_size
from app.api.responses import Json, page, versioned
from app.api.schemas import responses
from app.api.schemas.requests import BorderRequest, FitRequest, Id
from app.core.errors import FitFailed
from app.core.field import Field
from app.core.geometry import as_points
from app.fitting import FITTERS
from app.models import MODELS, parameters_json
from app.store.fields import field_etag
from app.workflows import calibration
from app.workflows.calibration_request import CalibrationRequest

router = APIRouter()

Quick = Annotated[bool, Query(description="leave the cross-validation out")]
FEW_POINTS = 100  # as many fit in a millisecond or two: quicker done at once than handed to a thread


@router.get("/fields", tags=["fields"], response_model=responses.PlayingFields)
def list_fields(services: ServicesDep) -> Json:
    """List every field with its lines, arcs, landmarks and regions, mm."""
    return page(field.to_json() for field in services.fields.values())


@router.get("/fields/{name}", tags=["fields"], response_model=responses.PlayingField)
def read_field(services: ServicesDep, name: Id) -> Json:
    """Return one field by name; its ETag goes into the next PUT's If-Match."""
    return _field(services.fields[name])


@router.put("/fields/{name}", tags=["fields"], response_model=responses.PlayingField)
def write_field(services: ServicesDep, name: Id, body: Annotated[dict[str, Any], Body()],
                if_match: IfMatch = None) -> Json:
    """Create or change a field of your own; those that come with Touchline cannot be changed.

    With If-Match only if nobody has changed it since: else 412, with `current`.
    """
    return _field(services.fields.put(name, body, if_match))


def _field(field: Field) -> Json:
    return versioned(field.to_json(), field_etag(field))


@router.get("/models", tags=["models"], response_model=responses.Models)
def list_models() -> Json:
    """List every model with its options (name, type, default, range, unit, help) and how few points it needs."""
    return page(map(_model_json, MODELS))


def _model_json(name: str) -> dict[str, Any]:
    model, fitter = MODELS[name], FITTERS[name]
    return {"name": name, "title": model.TITLE, "help": model.HELP, "points_needed": fitter.points_needed(),
            "options": [option.to_json() for option in fitter.OPTIONS]}


@router.post("/fit/border", tags=["fit"], response_model=responses.Border)
async def fit_border(services: ServicesDep, body: BorderRequest) -> Json:
    """Fit one border's curve to its clicks: degree, coefficients, residuals, outliers, distortion."""
    points = as_points(body.points, "The border's points")
    arguments = points, body.axis, body.degree, image_size(body.image_size)
    if len(points) <= FEW_POINTS:
        return Json(calibration.fit_border(*arguments))
    return Json(await services.run_in_thread(calibration.fit_border, *arguments))


@router.post("/fit/preview", tags=["fit"], response_model=responses.Preview)
@in_thread
def preview_calibration(services: ServicesDep, body: FitRequest, quick: Quick = False) -> Json:
    """Return what POST /calibrations would save for the same body: model, report and the field in the picture.

    With the model "auto", the most probable lens; which model is saved, a comparison of all of them decides.
    """
    return Json(_preview(fit_task(services, body, (body.model,)), quick))


@router.post("/fit/attempt", tags=["fit"], response_model=responses.Attempt)
@in_thread
def attempt_calibration(services: ServicesDep, body: FitRequest, quick: Quick = False) -> Json:
    """Return the preview, or why there is none yet: while points are still being placed, too few are no mistake."""
    task = fit_task(services, body, (body.model,))
    try:
        return Json({"preview": _preview(task, quick), "refusal": None})
    except FitFailed as refusal:
        return Json({"preview": None, "refusal": {**refusal.details, **refusal.to_json(), "title": refusal.title}})


def _preview(task: CalibrationRequest, quick: bool) -> dict[str, Any]:
    fitted = task.preview(cross_validate=not quick)
    return {"model": {"name": fitted.model.NAME, "parameters": parameters_json(fitted.model)}, "report": fitted.report,
            "corrected_size": list(fitted.model.corrected_size),
            "overlay": calibration.overlay(fitted.model, task.field, task.region)}
