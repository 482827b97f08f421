"""/calibrations/{id}/uncertainty and difference: how far to trust a version, and how far two are apart, in mm."""

from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Query, Request
from numpy.typing import NDArray
from starlette.responses import Response

from app.api.answers import Json
from app.api.schemas import responses
from app.api.schemas.requests import Id
from app.api.work import at_work
from app.core.field import Region
from app.core.field_json import field_from_json
from app.core.records import Calibration
from app.images import encode
from app.models import CameraModel, model_from_json
from app.workflows import calibration as workflow

router = APIRouter(prefix="/calibrations", tags=["judging"])

HeightMm = Annotated[float, Query(ge=0, le=5000, allow_inf_nan=False, description="height of the plane, mm")]
PNG: dict[int | str, dict[str, Any]] = {
    200: {"content": {"image/png": {"schema": {"type": "string", "format": "binary"}}}}}


@router.get("/{id}/uncertainty.json", response_model=responses.Uncertainty)
async def uncertainty_of(request: Request, id: Id, z_mm: HeightMm = 0.0) -> Json:
    """Expected field error in mm on a grid over the region, in the plane at z_mm; 409 for a model that knows none."""
    calibration = request.app.state.store.calibrations.get(id)
    return Json(await at_work(request, _uncertainty, calibration, z_mm))


@router.get("/{id}/uncertainty.png", response_class=Response, responses=PNG)
async def uncertainty_picture(request: Request, id: Id, z_mm: HeightMm = 0.0) -> Response:
    """The same as a heat map with a scale in mm, the worst place marked, standing as the corrected picture does."""
    calibration = request.app.state.store.calibrations.get(id)
    return await at_work(request, _uncertainty_picture, calibration, z_mm)


@router.get("/{id}/difference/{other}.json", response_model=responses.Difference)
async def difference_between(request: Request, id: Id, other: Id) -> Json:
    """How far two calibrations of one picture are apart over the region: in mm on the carpet and px in the picture."""
    store = request.app.state.store
    return Json(await at_work(request, _difference, store.calibrations.get(id), store.calibrations.get(other)))


@router.get("/{id}/difference/{other}.png", response_class=Response, responses=PNG)
async def difference_picture(request: Request, id: Id, other: Id) -> Response:
    """The same as a heat map with a scale in mm."""
    store = request.app.state.store
    return await at_work(request, _difference_picture, store.calibrations.get(id), store.calibrations.get(other))


def _model(calibration: Calibration) -> CameraModel:
    return model_from_json(calibration.model_name, calibration.model_parameters)


def _region(calibration: Calibration) -> Region:
    return field_from_json(calibration.field).region(calibration.region, calibration.rotate)


def _uncertainty(calibration: Calibration, z_mm: float) -> dict[str, Any]:
    return workflow.uncertainty(_model(calibration), calibration.covariance, _region(calibration), z_mm)


def _uncertainty_picture(calibration: Calibration, z_mm: float) -> Response:
    found = _uncertainty(calibration, z_mm)
    title = f"expected error at z = {z_mm:g} mm"
    return _png(workflow.error_map_image(found["grid"]["sigma_mm"], _region(calibration), title))


def _difference(one: Calibration, other: Calibration) -> dict[str, Any]:
    return workflow.difference(_model(one), _model(other), _region(one))


def _difference_picture(one: Calibration, other: Calibration) -> Response:
    found = _difference(one, other)
    title = f"version {other.version} from version {one.version}"
    return _png(workflow.error_map_image(found["grid"]["mm"], _region(one), title))


def _png(pixels: NDArray[np.uint8]) -> Response:
    return Response(encode(pixels), media_type="image/png")
