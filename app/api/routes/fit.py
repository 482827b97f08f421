"""/fields, /models and /fit: what a fit starts from, and what clicks would give, at once; only fields are saved."""

from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Body, Query, Request
from starlette.responses import Response

from app.api.dependencies import IfMatch, ServicesDep
from app.api.fitting import fit
from app.api.request_mapping import image_size
from app.api.responses import Json, page, versioned
from app.api.schemas import responses
from app.api.schemas.requests import BorderRequest, FitRequest, Id
from app.core.field import Field
from app.core.geometry import as_points
from app.fitting import FITTERS
from app.models import MODELS
from app.store.fields import field_etag
from app.workflows import calibration
from app.workflows.calibration_request import CalibrationRequest, run_attempt, run_preview

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
async def preview_calibration(request: Request, services: ServicesDep, body: FitRequest,
                              quick: Quick = False) -> Response:
    """Return what POST /calibrations would save for the same body: model, report and the field in the picture.

    With the model "auto", the most probable lens; which model is saved, a comparison of all of them decides.
    """
    run = partial(CalibrationRequest.preview_json, quick=quick)
    return await fit(request, services, body, run, "preview", run_preview, {"quick": quick})


@router.post("/fit/attempt", tags=["fit"], response_model=responses.Attempt)
async def attempt_calibration(request: Request, services: ServicesDep, body: FitRequest,
                              quick: Quick = False) -> Response:
    """Return the preview, or why there is none yet: while points are still being placed, too few are no mistake."""
    run = partial(CalibrationRequest.attempt_json, quick=quick)
    return await fit(request, services, body, run, "preview", run_attempt, {"quick": quick})
