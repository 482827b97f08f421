"""/calibrations/{id}/packet: what teams receive of a version."""

from fastapi import APIRouter

from touchline.api.dependencies import ServicesDep, in_thread
from touchline.api.responses import Json
from touchline.api.schemas.base import JsonObject, Texts, response
from touchline.api.schemas.requests import Id
from touchline.services.publishing_claims import packet_json

router = APIRouter(tags=["judging"])

Packet = response("Packet", calibration=str, exact=bool, loss=JsonObject | None, expected=JsonObject | None,
    fit_expected=JsonObject | None, level=str | None, asked=bool, warnings=list[JsonObject], problem=Texts | None)


@router.get("/calibrations/{id}/packet", response_model=Packet)
@in_thread
def read_packet(services: ServicesDep, id: Id) -> Json:
    """Return what teams receive of a version through the league's packet, whether it is published or not.

    expected: the error of that, on the carpet and at robot tops; fit_expected: the version's own. asked: whether it is
    published only after approval. problem: why a packet cannot hold it.
    """
    return Json(packet_json(services, services.store.calibrations.get(id)))
