"""/fields: the playing fields, ours and the operator's own."""

from typing import Annotated, Any

from fastapi import APIRouter, Body

from app.api.dependencies import ServicesDep
from app.api.responses import Json, page
from app.api.schemas import responses
from app.api.schemas.requests import Id

router = APIRouter(prefix="/fields", tags=["fields"])


@router.get("", response_model=responses.PlayingFields)
def list_fields(services: ServicesDep) -> Json:
    """List every field with its lines, arcs, landmarks and regions, mm."""
    return page(field.to_json() for field in services.fields.values())


@router.get("/{name}", response_model=responses.PlayingField)
def read_field(services: ServicesDep, name: Id) -> Json:
    """Return one field by name."""
    return Json(services.fields[name].to_json())


@router.put("/{name}", response_model=responses.PlayingField)
def write_field(services: ServicesDep, name: Id, body: Annotated[dict[str, Any], Body()]) -> Json:
    """Create or change a field of your own; those that come with Touchline cannot be changed."""
    return Json(services.fields.put(name, body).to_json())
