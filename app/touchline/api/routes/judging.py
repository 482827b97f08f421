"""How far to trust a version and the site, how far two versions are apart, and what teams receive of one."""

from collections.abc import Sequence
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query, Request
from starlette.responses import Response

from touchline.api.dependencies import ServicesDep, VersionDep, in_thread
from touchline.api.requests import Id
from touchline.api.responses import NO_STORE, Json, cached_response, picture
from touchline.api.schemas import UNCHANGED, files, response
from touchline.core.records import Calibration
from touchline.evaluate.claims import Claim, ClaimJson, Gate, gate_of
from touchline.evaluate.difference import Difference
from touchline.models import Restored, model_of
from touchline.services.claims import all_claims, known_claims, readiness
from touchline.store.calibrations import FoundVersion
from touchline.workflows import calibration as workflow
from touchline.workflows.calibration import Uncertainty

router = APIRouter(tags=["judging"])


HeightMm = Annotated[
    float, Query(ge=0, le=5000, allow_inf_nan=False, description="height of the plane, mm")
]
PNG = files("image/png") | UNCHANGED


def _other_of(services: ServicesDep, other: Id) -> FoundVersion:
    return services.store.calibrations.find(other)


OtherDep = Annotated[FoundVersion, Depends(_other_of)]


@router.get("/calibrations/{id}/uncertainty.json", response_model=Uncertainty, responses=UNCHANGED)
@cached_response
@in_thread
def read_uncertainty(services: ServicesDep, version: VersionDep, z_mm: HeightMm = 0.0) -> Json:
    """Return the expected error in mm on a grid over the region, in the plane at z_mm; 409 for a model without it."""
    return Json(_uncertainty(version.calibration, z_mm))


@router.get("/calibrations/{id}/uncertainty.png", response_class=Response, responses=PNG)
@cached_response
@in_thread
def read_uncertainty_image(
    services: ServicesDep, version: VersionDep, z_mm: HeightMm = 0.0
) -> Response:
    """Draw the same as a heat map with a scale in mm and the largest error marked, oriented as the corrected image."""
    calibration = version.calibration
    grid = _uncertainty(calibration, z_mm)["grid"]
    return _heat_map(grid["sigma_mm"], calibration, f"expected error at z = {z_mm:g} mm")


@router.get(
    "/calibrations/{id}/difference/{other}.json", response_model=Difference, responses=UNCHANGED
)
@cached_response
@in_thread
def read_difference(services: ServicesDep, version: VersionDep, against: OtherDep) -> Json:
    """Return the difference of two calibrations of one image over the region: mm on the carpet and px in it."""
    return Json(_difference(version.calibration, against.calibration))


@router.get("/calibrations/{id}/difference/{other}.png", response_class=Response, responses=PNG)
@cached_response
@in_thread
def read_difference_image(
    services: ServicesDep, version: VersionDep, against: OtherDep
) -> Response:
    """Draw the same as a heat map with a scale in mm."""
    a, b = version.calibration, against.calibration
    grid = workflow.difference_grid(_difference(a, b))
    return _heat_map(grid["mm"], a, f"version {b.version} from version {a.version}")


def _uncertainty(calibration: Calibration, z_mm: float) -> Uncertainty:
    model, _, region = Restored.of(calibration)
    return workflow.uncertainty(model, calibration.covariance, region, z_mm)


def _difference(a: Calibration, b: Calibration) -> Difference:
    model, _, region = Restored.of(a)
    return workflow.difference(model, model_of(b), region)


def _heat_map(values_mm: Any, calibration: Calibration, title: str) -> Response:
    return picture(
        workflow.error_map_image(values_mm, Restored.of(calibration).region, title), "png"
    )


claims_router = APIRouter()

Claims = response("Claims", calibration=str, gate=Gate, items=list[ClaimJson])
Readiness = response("Readiness", gate=Gate, items=list[ClaimJson])

Look = Annotated[bool, Query(description="false: only what is known without looking at an image")]


@claims_router.get("/calibrations/{id}/claims", tags=["judging"], response_model=Claims)
async def list_claims(request: Request, services: ServicesDep, id: Id, look: Look = True) -> Json:
    """List what is claimed of a version, and what was tried to refute it: with a frame of its camera, taken now.

    A claim is `held` only where something was tried that would have refuted it. gate: `problems` where claims stand
    against activating the version, which then wants their codes in `despite`; `not-tested` where some could not be
    tested; else `ready`.
    """
    calibration = await services.run_in_thread(services.store.calibrations.get, id)
    claims = (
        await all_claims(services, calibration, request.is_disconnected)
        if look
        else await services.run_in_thread(known_claims, services, calibration)
    )
    return _answer(claims, calibration=id)


@claims_router.get("/readiness", tags=["health"], response_model=Readiness)
async def read_readiness(services: ServicesDep) -> Json:
    """List what a match rests on: cameras that are live, calibrated and in place, rigs that agree, publishing.

    gate: `ready` only if nothing stands against it and everything was tested. No camera is started by this.
    """
    return _answer(await readiness(services))


def _answer(claims: Sequence[Claim], **more: Any) -> Json:
    return Json(
        {**more, "gate": gate_of(claims), "items": [claim.to_json() for claim in claims]},
        headers=NO_STORE,
    )
