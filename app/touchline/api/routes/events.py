"""GET /events: what has happened to cameras, over all of them."""


from fastapi import APIRouter

from touchline.api.dependencies import ServicesDep
from touchline.api.requests import Limit
from touchline.api.responses import Json
from touchline.api.schemas import described, list_of, response
from touchline.services import events
from touchline.services.events import newest_events

router = APIRouter(tags=["cameras"])

Event = response("Event", says=True, at=str, kind=events.Kind, camera=described(str | None, "null: images from files"),
    version=int | None, by=str | None, despite=list[str], text=str)
Events = response("Events", items=list_of(Event))


@router.get("/events", response_model=Events)
def list_events(services: ServicesDep, limit: Limit = 20) -> Json:
    """List activations, and since the server was started which cameras went offline, came back or moved; newest first.

    Each has one plain sentence as `text`.
    """
    return Json({"items": newest_events(services.events.noted, services.store, services.cameras, limit)})
