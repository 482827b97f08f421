"""/calibrations/{id}/transform, overlay.json, residuals.json: points between frames, and what is drawn on a picture."""

from collections.abc import Mapping
from functools import partial
from typing import Annotated, Any, Literal

import numpy as np
from fastapi import APIRouter, Query, Request
from numpy.typing import NDArray
from starlette.responses import Response

from app.api.answers import Json, points_or_null
from app.api.bodies import BINARY, binary_points, content_type, json_body
from app.api.schemas import responses
from app.api.schemas.requests import FrameName, Id, MarginPx, TransformRequest, WidthPx
from app.api.work import at_work
from app.core.errors import BadInput, Conflict
from app.core.field_json import field_from_json
from app.core.geometry import ImageSize, as_points
from app.core.records import Calibration, observations_from_json
from app.imaging.correction import CorrectedView
from app.models import model_from_json
from app.workflows import calibration as workflow

router = APIRouter(prefix="/calibrations/{id}", tags=["using a calibration"])

FEW_POINTS = 1000  # as many are through before a thread has been found for them
BYTES = {"schema": {"type": "string", "format": "binary"}}
BODY = {"requestBody": {"required": True, "content": {
    "application/json": {"schema": TransformRequest.model_json_schema(ref_template="#/components/schemas/{model}")},
    BINARY: BYTES}}}
ANSWER: dict[int | str, dict[str, Any]] = {200: {"content": {BINARY: BYTES}}}


@router.post("/transform", response_model=responses.Transformed, openapi_extra=BODY, responses=ANSWER)
async def transform_points(request: Request, id: Id, source: Annotated[FrameName | None, Query(alias="from")] = None,
                    target: Annotated[FrameName | None, Query(alias="to")] = None,
                    z_mm: Annotated[float, Query(ge=-10_000, le=10_000, allow_inf_nan=False)] = 0.0) -> Response:
    """Points from one frame to another.

    JSON, answered with null for a point out of reach. Or, for millions, application/octet-stream: little-endian
    float64 pairs with `from`, `to` and `z_mm` in the query, answered in kind, NaN for a point out of reach.
    """
    calibration = request.app.state.store.calibrations.get(id)
    binary = content_type(request) == BINARY
    if binary:
        if source is None or target is None:
            raise BadInput("The query does not say from which frame to which.",
                           "Add ?from=image&to=field (image, corrected or field).", reason="no-frames")
        points = await binary_points(request)
    else:
        asked = await json_body(request, TransformRequest)
        source, target, z_mm, points = asked.source, asked.target, asked.z_mm, as_points(asked.points)
        refuse_other_size(calibration, ImageSize.of(asked.image_size) if asked.image_size else None)
    run = partial(workflow.transform, model_from_json(calibration.model_name, calibration.model_parameters), points,
                  source, target, z_mm)
    found = run() if len(points) <= FEW_POINTS else await at_work(request, run)
    if binary:
        return Response(found.astype("<f8").tobytes(), media_type=BINARY)
    return Json({"points": points_or_null(found)})


@router.get("/overlay.json", response_model=responses.Overlay)
def draw_field(request: Request, id: Id, frame: Literal["raw", "corrected"] = "raw", margin_px: MarginPx = 0,
            width: WidthPx = None) -> Json:
    """The region's borders and all that is painted on the field, as polylines; null where out of reach."""
    calibration = request.app.state.store.calibrations.get(id)
    field = field_from_json(calibration.field)
    return Json({"features": workflow.overlay(
        model_from_json(calibration.model_name, calibration.model_parameters), field,
        field.region(calibration.region, calibration.rotate), frame, CorrectedView(margin_px, width))})


@router.get("/residuals.json", response_model=responses.Arrows)
async def draw_residuals(request: Request, id: Id, frame: Literal["raw", "corrected"] = "raw", margin_px: MarginPx = 0,
                         width: WidthPx = None) -> Json:
    """From each clicked point to where the model puts it: the nearest place of its line, or its landmark."""
    calibration = request.app.state.store.calibrations.get(id)
    return Json(await at_work(request, _arrows, calibration, frame, CorrectedView(margin_px, width)))


def _arrows(calibration: Calibration, frame: Literal["raw", "corrected"], view: CorrectedView) -> dict[str, Any]:
    field = field_from_json(calibration.field)
    observations = observations_from_json(calibration.observations)
    strays = [_strays(calibration.report, i, len(o.points)) for i, o in enumerate(observations)]
    return workflow.residual_vectors(model_from_json(calibration.model_name, calibration.model_parameters),
                                     observations, field, field.region(calibration.region, calibration.rotate), strays,
                                     frame, view)


def _strays(report: Mapping[str, Any], index: int, count: int) -> NDArray[np.bool_]:
    """Which points of an observation the fit left out; none, where an imported report does not tell."""
    try:
        told = [bool(point["outlier"]) for point in report["per_feature"][index]["residuals"]]
    except (KeyError, IndexError, TypeError):
        told = []
    return np.array(told if len(told) == count else [False] * count, bool)


def refuse_other_size(calibration: Calibration, size: ImageSize | None) -> None:
    """A calibration holds for one picture size only."""
    if size is not None and size != calibration.image_size:
        raise Conflict(f"The picture is {size.width} × {size.height} px; the calibration was made for "
                       f"{calibration.image_size.width} × {calibration.image_size.height} px.",
                       "Use a picture of that size, or calibrate this one.", reason="size-mismatch")
