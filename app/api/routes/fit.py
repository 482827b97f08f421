"""POST /fit/…: what the clicks would give, at once; nothing is saved."""

from typing import Annotated

from fastapi import APIRouter, Query

from app.api.dependencies import ServicesDep
from app.api.request_mapping import fit_task, image_size
from app.api.responses import Json
from app.api.schemas import responses
from app.api.schemas.requests import BorderRequest, FitRequest
from app.core.geometry import as_points
from app.models import parameters_json
from app.workflows import calibration
from app.workflows.calibration_request import CalibrationRequest

router = APIRouter(prefix="/fit", tags=["fit"])

FEW_POINTS = 100  # as many fit in a millisecond or two: quicker done at once than handed to a thread


@router.post("/border", response_model=responses.Border)
async def fit_border(services: ServicesDep, body: BorderRequest) -> Json:
    """Fit one border's curve to its clicks: degree, coefficients, residuals, outliers, distortion."""
    points = as_points(body.points, "The border's points")
    arguments = points, body.axis, body.degree, image_size(body.image_size)
    if len(points) <= FEW_POINTS:
        return Json(calibration.fit_border(*arguments))
    return Json(await services.run_in_thread(calibration.fit_border, *arguments))


@router.post("/preview", response_model=responses.Preview)
async def preview_calibration(services: ServicesDep, body: FitRequest, quick: Annotated[bool, Query(
        description="leave the cross-validation out")] = False) -> Json:
    """Return what POST /calibrations would save for the same body: model, report and the field in the picture."""
    task = await services.run_in_thread(fit_task, services, body, (body.model,))
    return Json(await services.run_in_thread(_preview, task, quick))


def _preview(task: CalibrationRequest, quick: bool) -> dict[str, object]:
    fitted = task.run(cross_validate=not quick)
    return {"model": {"name": task.model, "parameters": parameters_json(fitted.model)}, "report": fitted.report,
            "corrected_size": list(fitted.model.corrected_size),
            "overlay": calibration.overlay(fitted.model, task.field, task.region)}
