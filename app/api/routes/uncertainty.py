"""/calibrations/{id}/uncertainty and difference: how far to trust a version, and how far two are apart, in mm."""

from typing import Annotated, Any

from fastapi import APIRouter, Query
from starlette.responses import Response

from app.api.dependencies import ServicesDep
from app.api.responses import Json, picture
from app.api.schemas import responses
from app.api.schemas.media import files
from app.api.schemas.requests import Id
from app.core.records import Calibration
from app.services.calibrations import field_and_region, model_of
from app.workflows import calibration as workflow

router = APIRouter(prefix="/calibrations", tags=["judging"])

HeightMm = Annotated[float, Query(ge=0, le=5000, allow_inf_nan=False, description="height of the plane, mm")]
PNG = files("image/png")


@router.get("/{id}/uncertainty.json", response_model=responses.Uncertainty)
async def uncertainty_of(services: ServicesDep, id: Id, z_mm: HeightMm = 0.0) -> Json:
    """Return the expected error in mm on a grid over the region, in the plane at z_mm; 409 for a model without it."""
    return Json(await services.run_in_thread(_uncertainty, services.store.calibrations.get(id), z_mm))


@router.get("/{id}/uncertainty.png", response_class=Response, responses=PNG)
async def uncertainty_picture(services: ServicesDep, id: Id, z_mm: HeightMm = 0.0) -> Response:
    """Draw the same as a heat map with a scale in mm and the worst place marked, oriented as the corrected picture."""
    calibration = services.store.calibrations.get(id)

    def draw() -> Response:
        grid = _uncertainty(calibration, z_mm)["grid"]
        return _heat_map(grid["sigma_mm"], calibration, f"expected error at z = {z_mm:g} mm")
    return await services.run_in_thread(draw)


@router.get("/{id}/difference/{other}.json", response_model=responses.Difference)
async def difference_between(services: ServicesDep, id: Id, other: Id) -> Json:
    """Return how far two calibrations of one picture are apart over the region: mm on the carpet and px in it."""
    pair = services.store.calibrations.get(id), services.store.calibrations.get(other)
    return Json(await services.run_in_thread(_difference, *pair))


@router.get("/{id}/difference/{other}.png", response_class=Response, responses=PNG)
async def difference_picture(services: ServicesDep, id: Id, other: Id) -> Response:
    """Draw the same as a heat map with a scale in mm."""
    a, b = services.store.calibrations.get(id), services.store.calibrations.get(other)

    def draw() -> Response:
        return _heat_map(_difference(a, b)["grid"]["mm"], a, f"version {b.version} from version {a.version}")
    return await services.run_in_thread(draw)


def _uncertainty(calibration: Calibration, z_mm: float) -> dict[str, Any]:
    return workflow.uncertainty(model_of(calibration), calibration.covariance, field_and_region(calibration)[1], z_mm)


def _difference(a: Calibration, b: Calibration) -> dict[str, Any]:
    return workflow.difference(model_of(a), model_of(b), field_and_region(a)[1])


def _heat_map(values_mm: Any, calibration: Calibration, title: str) -> Response:
    return picture(workflow.error_map_image(values_mm, field_and_region(calibration)[1], title), "png")
