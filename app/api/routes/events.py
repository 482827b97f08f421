"""GET /events: what has happened to cameras, over all of them."""

from fastapi import APIRouter

from app.api.dependencies import ServicesDep
from app.api.responses import Json
from app.api.schemas import responses
from app.api.schemas.requests import Limit
from app.services.events import newest_events

router = APIRouter(tags=["cameras"])


@router.get("/events", response_model=responses.Events)
def list_events(services: ServicesDep, limit: Limit = 20) -> Json:
    """List activations, and since the server was started which cameras went offline, came back or moved; newest first.

    Each has one plain sentence as `text`.
    """
    return Json({"items": newest_events(services.events.noted, services.store, services.cameras, limit)})
