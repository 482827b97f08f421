"""/fields: the playing fields, ours and the operator's own."""

from typing import Annotated, Any

from fastapi import APIRouter, Body, Request

from app.api.answers import Json
from app.api.schemas import responses
from app.api.schemas.requests import Id

router = APIRouter(prefix="/fields", tags=["fields"])


@router.get("", response_model=responses.Fields)
def list_fields(request: Request) -> Json:
    """Every field, whole: lines, arcs, landmarks and regions, mm."""
    return Json({"items": [field.to_json() for field in request.app.state.fields.values()], "next_cursor": None})


@router.get("/{name}", response_model=responses.Field)
def read_field(request: Request, name: Id) -> Json:
    """One field by name."""
    return Json(request.app.state.fields[name].to_json())


@router.put("/{name}", response_model=responses.Field)
def write_field(request: Request, name: Id, body: Annotated[dict[str, Any], Body()]) -> Json:
    """Make or change a field of your own; those that come with Touchline stay as they are."""
    return Json(request.app.state.fields.put(name, body).to_json())
