"""/calibrations/{id}/claims and /readiness: what is claimed of a version and of the site, and what was tried."""

from collections.abc import Sequence
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request

from touchline.api.dependencies import ServicesDep
from touchline.api.requests import Id
from touchline.api.responses import NO_STORE, Json
from touchline.api.schemas import response
from touchline.evaluate.claims import Claim, ClaimJson, Gate, gate_of
from touchline.services.claims import all_claims, known_claims, readiness

router = APIRouter()

Claims = response("Claims", calibration=str, gate=Gate, items=list[ClaimJson])
Readiness = response("Readiness", gate=Gate, items=list[ClaimJson])

Look = Annotated[bool, Query(description="false: only what is known without looking at an image")]


@router.get("/calibrations/{id}/claims", tags=["judging"], response_model=Claims)
async def list_claims(request: Request, services: ServicesDep, id: Id, look: Look = True) -> Json:
    """List what is claimed of a version, and what was tried to refute it: with a frame of its camera, taken now.

    A claim is `held` only where something was tried that would have refuted it. gate: `problems` where claims stand
    against activating the version, which then wants their codes in `despite`; `not-tested` where some could not be
    tested; else `ready`.
    """
    calibration = await services.run_in_thread(services.store.calibrations.get, id)
    claims = (await all_claims(services, calibration, request.is_disconnected) if look else
              await services.run_in_thread(known_claims, services, calibration))
    return _answer(claims, calibration=id)


@router.get("/readiness", tags=["health"], response_model=Readiness)
async def read_readiness(services: ServicesDep) -> Json:
    """List what a match rests on: cameras that are live, calibrated and in place, rigs that agree, publishing.

    gate: `ready` only if nothing stands against it and everything was tested. No camera is started by this.
    """
    return _answer(await readiness(services))


def _answer(claims: Sequence[Claim], **more: Any) -> Json:
    return Json({**more, "gate": gate_of(claims), "items": [claim.to_json() for claim in claims]}, headers=NO_STORE)
