"""/colours: colour profiles of a venue, saved by name; and learned from clicks on a live camera's picture."""

from typing import Any

from fastapi import APIRouter
from starlette.responses import Response

from touchline.api.dependencies import IfMatch, IfMatchNeeded, OperatorDep, ServicesDep, in_thread
from touchline.api.responses import Json, page, versioned
from touchline.api.schemas.base import JsonObject, page_of, response
from touchline.api.schemas.detection import ColoursBody, LearnBody
from touchline.api.schemas.requests import Id
from touchline.core.colour_profile import ColourProfile
from touchline.core.errors import BadInput, Conflict
from touchline.core.statements import say, stated
from touchline.services.container import Services
from touchline.services.detection import health_json, learn_profile
from touchline.services.live import take_frame
from touchline.store.documents import Document
from touchline.vision.stage_pipeline import StageConfig

router = APIRouter(tags=["colours"])

Colours = response("Colours", name=str, profile=JsonObject, health=list[JsonObject], used_by=list[str])
ColoursList = page_of("ColoursList", Colours)
LearnedColours = response("LearnedColours", profile=JsonObject, health=list[JsonObject], notes=list[str])


@router.get("/colours", response_model=ColoursList)
def list_colours(services: ServicesDep) -> Json:
    """List every profile by name, with how well its colours are separated and which cameras use it."""
    return page(_profile_json(services, preset) for preset in services.store.colour_profiles.all())


@router.get("/colours/{name}", response_model=Colours)
def read_colours(services: ServicesDep, name: Id) -> Json:
    """Return one profile; its ETag goes into the next PUT's If-Match."""
    preset = services.store.colour_profiles.get(name)
    return versioned(_profile_json(services, preset), preset.etag)


@router.put("/colours/{name}", response_model=Colours, responses={201: {"model": Colours}})
async def save_colours(services: ServicesDep, by: OperatorDep, name: Id, body: ColoursBody,
                       if_match: IfMatch = None) -> Response:
    """Create a profile (201), or replace the one that If-Match names: 428 without, 412 with `current` if that is old.

    Cameras that use it follow at once.
    """
    profile = ColourProfile.from_json({**body.profile, "name": name}).to_json()
    try:
        preset = await services.run_in_thread(services.store.colour_profiles.save, name, profile, if_match, by)
    except Conflict as error:
        if error.reason != "colours-exists":
            raise
        raise IfMatchNeeded("This colour profile already exists, and the request does not state the "
                            "version that it changes.") from None
    for camera in await services.run_in_thread(services.detection.used_by, name):
        services.live.refresh(camera)
    return versioned(await services.run_in_thread(_profile_json, services, preset), preset.etag,
                     f"colours/{preset.name}" if if_match is None else None)


@router.delete("/colours/{name}", status_code=204, response_class=Response)
@in_thread
def delete_colours(services: ServicesDep, name: Id, if_match: IfMatch = None) -> None:
    """Delete a profile; refused while cameras use it. With If-Match only if it is unchanged."""
    services.detection.remove_colours(name, if_match)


@router.post("/cameras/{id}/colours/learn", response_model=LearnedColours)
async def learn_colours(services: ServicesDep, id: Id, body: LearnBody) -> Json:
    """Learn a profile from points and boxes on the newest frame or a snapshot, added to another one; or automatically.

    Nothing is saved: PUT it as a camera's `profile`, or under a name.
    """
    settings, _ = await services.run_in_thread(services.detection.settings, id)
    base = (await services.run_in_thread(services.detection.colours, body.base) if isinstance(body.base, str) else
            None if body.base is None else ColourProfile.from_json(body.base))
    if not body.automatic and not any(body.clicks.values()) and base is None:
        raise BadInput(say("colours.none-marked", "No colour is marked."),
                       say("colours.mark", "Mark the ball and each team colour, or use automatic detection."),
                       reason="no-colours")
    picture = body.snapshot or (await take_frame(services.live.get(id))).png

    def learn() -> dict[str, Any]:
        frame = services.frame(picture) if isinstance(picture, str) else services.decoder.frame_from_bytes(picture)
        profile = learn_profile(frame, StageConfig.from_json(settings["plan"]), base, body.clicks, body.automatic)
        return stated({"profile": profile.to_json(), "health": health_json(profile.to_json()),
                       "notes": list(profile.notes)})
    return Json(await services.run_in_thread(learn))


def _profile_json(services: Services, preset: Document) -> dict[str, Any]:
    return {"name": preset.name, "profile": dict(preset.body), "health": health_json(preset.body),
            "used_by": services.detection.used_by(preset.name), "updated_at": preset.updated_at,
            "updated_by": preset.updated_by}
