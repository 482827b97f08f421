"""POST /fit/…: what the clicks would give, at once; nothing is saved."""

from typing import Annotated

from fastapi import APIRouter, Query, Request

from app.api.answers import Json
from app.api.request_mapping import task_of
from app.api.schemas import responses
from app.api.schemas.requests import BorderRequest, FitRequest
from app.api.work import at_work
from app.core.geometry import ImageSize, as_points
from app.models import parameters_json
from app.workflows import calibration
from app.workflows.calibration_request import CalibrationRequest

router = APIRouter(prefix="/fit", tags=["fit"])

FEW_POINTS = 100  # as many fit in a millisecond or two: quicker done at once than handed to a thread


@router.post("/border", response_model=responses.Border)
async def fit_border(request: Request, body: BorderRequest) -> Json:
    """One border's curve through its clicks: degree, coefficients, residuals, strays, distortion."""
    size = ImageSize.of(body.image_size) if body.image_size else None
    points = as_points(body.points, "The border's points")
    if len(points) <= FEW_POINTS:
        return Json(calibration.fit_border(points, body.axis, body.degree, size))
    return Json(await at_work(request, calibration.fit_border, points, body.axis, body.degree, size))


@router.post("/preview", response_model=responses.Preview)
async def preview_calibration(request: Request, body: FitRequest,
                  quick: Annotated[bool, Query(description="leave the cross-validation out")] = False) -> Json:
    """What POST /calibrations would save for the same body: model, report and the field drawn into the picture."""
    task = await at_work(request, task_of, request, body, (body.model,))
    return Json(await at_work(request, _previewed, task, quick))


def _previewed(task: CalibrationRequest, quick: bool) -> dict[str, object]:
    done = task.run(cross_validate=not quick)
    return {"model": {"name": task.model, "parameters": parameters_json(done.model)}, "report": done.report,
            "corrected_size": list(done.model.corrected_size),
            "overlay": calibration.overlay(done.model, task.field, task.region)}
