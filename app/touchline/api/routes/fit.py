"""/models and /fit: what clicks would give, at once; nothing is saved."""

from collections.abc import Callable
from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request
from starlette.responses import Response

from touchline.api.bodies import fit_task, image_size
from touchline.api.dependencies import ServicesDep, caller_of
from touchline.api.requests import BorderRequest, FitRequest
from touchline.api.responses import Json, JsonText, finished_or_queued, packed
from touchline.api.schemas import page_of, response
from touchline.core.geometry import as_points
from touchline.core.jobs import Progress
from touchline.core.options import OptionJson
from touchline.core.statements import named, stated
from touchline.fitting import FITTERS
from touchline.models import MODELS
from touchline.services import fit_processes
from touchline.services.container import Services
from touchline.services.forms import Name
from touchline.workflows import calibration
from touchline.workflows.calibration import Attempt, BorderFit, Preview
from touchline.workflows.calibration_request import CalibrationRequest, run_attempt, run_preview

router = APIRouter()

Model = response(
    "Model",
    name=str,
    title=str,
    help=str,
    points_needed=str,
    options=list[OptionJson],
    is_fitted=bool,
)
Models = page_of("Models", Model)

Quick = Annotated[bool, Query(description="without cross-validation")]
MeshMargin = Annotated[
    int | None,
    Query(
        ge=0,
        le=2000,
        description="with `mesh`: the corrected view with so much carpet around the region, px, as GET "
        "/calibrations/{id}/mesh describes it; its nodes in base64 as raw_px, and the field in it as overlay",
    ),
]
Series = Annotated[
    Name | None,
    Query(
        description="any name, such as the window's: a newer request of one series takes the place of one that waits, "
        "which is answered with 409 `superseded`"
    ),
]
# as many fit in a millisecond or two: quicker done at once than handed to a thread
FEW_POINTS = 100


@router.get("/models", tags=["models"], response_model=Models)
def list_models(request: Request) -> Response:
    """List every model with its options (name, type, default, range, unit, help) and how few points it needs.

    is_fitted: false for one that versions of earlier software have, and that no fit makes any more.
    """
    return packed(request, {"items": [*map(_model_json, MODELS)], "next_cursor": None})


def _model_json(name: str) -> dict[str, Any]:
    model, fitter = MODELS[name], FITTERS.find(name)
    return stated(
        {
            "name": name,
            "title": model.TITLE,
            "help": named(f"model.{name}.help", model.HELP),
            "points_needed": ""
            if fitter is None
            else named(f"model.{name}.points", fitter.points_needed()),
            "options": [option.to_json("model") for option in (fitter.OPTIONS if fitter else ())],
            "is_fitted": fitter is not None,
        }
    )


@router.post("/fit/border", tags=["fit"], response_model=BorderFit)
async def fit_border(services: ServicesDep, body: BorderRequest) -> Json:
    """Fit one border's curve to its points: degree, coefficients, residuals, outliers, distortion."""
    points = as_points(body.points, "The border's points")
    arguments = points, body.axis, body.degree, image_size(body.image_size)
    if len(points) <= FEW_POINTS:
        return Json(calibration.fit_border(*arguments))
    return Json(await services.run_in_thread(calibration.fit_border, *arguments))


@router.post("/fit/preview", tags=["fit"], response_model=Preview)
async def preview_calibration(
    request: Request,
    services: ServicesDep,
    body: FitRequest,
    quick: Quick = False,
    mesh_margin_px: MeshMargin = None,
    series: Series = None,
) -> Response:
    """Return what POST /calibrations would save for the same body: model, report and the field in the image.

    With the model "auto", the most probable lens; which model is saved, a comparison of all of them decides.
    """
    return await _fit(
        request,
        services,
        body,
        CalibrationRequest.preview_json,
        run_preview,
        quick,
        mesh_margin_px,
        series,
    )


@router.post("/fit/attempt", tags=["fit"], response_model=Attempt)
async def attempt_calibration(
    request: Request,
    services: ServicesDep,
    body: FitRequest,
    quick: Quick = False,
    mesh_margin_px: MeshMargin = None,
    series: Series = None,
) -> Response:
    """Return the preview, or why there is none yet: while points are still being placed, too few are no mistake."""
    return await _fit(
        request,
        services,
        body,
        CalibrationRequest.attempt_json,
        run_attempt,
        quick,
        mesh_margin_px,
        series,
    )


async def _fit(
    request: Request,
    services: Services,
    body: FitRequest,
    fit: Callable[[CalibrationRequest, bool, int | None], Preview | Attempt],
    run: Callable[[Any, Progress], Preview | Attempt],
    quick: bool,
    mesh_margin_px: int | None,
    series: str | None,
) -> Response:
    """Return what `fit` makes of a few points on a thread, where that is quick, or `run` in a process."""
    task = await services.run_in_thread(fit_task, services, body, (body.model,))
    few = task.n_points <= fit_processes.FEW_POINTS
    if quick and few:
        return Json(
            await services.fit_quickly(
                partial(fit, task, quick, mesh_margin_px), request.is_disconnected
            )
        )
    spec = {"task": task.to_json(), "quick": quick, "mesh_margin_px": mesh_margin_px}
    if few:
        return JsonText(
            await services.fits.run(
                run, spec, (await caller_of(request)).address, request.is_disconnected, series
            )
        )
    return await finished_or_queued(request, services, "preview", run, spec, False)
