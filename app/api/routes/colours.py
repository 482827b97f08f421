"""/colours: what a venue's colours look like, kept by name; and learned from clicks on a live camera's picture."""

from typing import Annotated, Any

from fastapi import APIRouter, Header, Request
from starlette.responses import Response

from app.api.answers import Json
from app.api.middleware.problems import problem, problem_of, stale_problem
from app.api.operator import operator
from app.api.routes.streams import first_picture, live_camera
from app.api.schemas.live_detection import ColoursBody, ColoursList, ColoursTold, Learned, LearnRequest
from app.api.schemas.requests import Id
from app.api.work import at_work
from app.core.colour_profile import ColourProfile
from app.core.errors import BadInput, Conflict, Stale
from app.core.records import Frame
from app.services.detection import health_json
from app.store import Document
from app.vision.colour.automatic import automatic_profile
from app.vision.stage_pipeline import StageConfig
from app.workflows.detection import colour_profile_for

router = APIRouter(tags=["colours"])

STILL_S = 20.0
IfMatch = Annotated[str | None, Header(max_length=200)]


@router.get("/colours", response_model=ColoursList)
def list_colours(request: Request) -> Json:
    """Every kept profile, by name, with how well its colours are told from each other and which cameras name it."""
    store = request.app.state.store
    return Json({"items": [_described(request, kept) for kept in store.colour_profiles.all()], "next_cursor": None})


@router.get("/colours/{name}", response_model=ColoursTold)
def read_colours(request: Request, name: Id) -> Json:
    """One profile; its ETag goes into the next PUT's If-Match."""
    return _answer(request, request.app.state.store.colour_profiles.get(name))


@router.put("/colours/{name}", response_model=ColoursTold, responses={201: {"model": ColoursTold}})
async def save_colours(request: Request, name: Id, body: ColoursBody, if_match: IfMatch = None) -> Response:
    """Make it (201), or save over the one that If-Match names: 428 without, 412 with `current` if that is old.

    Cameras that name it go by it at once.
    """
    state = request.app.state
    profile = ColourProfile.from_json({**body.profile, "name": name}).to_json()
    etag = None if if_match is None else _bare(if_match)
    try:
        kept = await at_work(request, state.store.colour_profiles.save, name, profile, etag, operator(request))
    except Stale as error:
        return stale_problem(error)
    except Conflict as error:
        if error.reason != "colours-exists":
            raise
        return problem(428, "if-match-needed", "If-Match needed", "There are such colours already, and the request "
                       "does not say which state of them it was made from.", "Send the ETag of GET as If-Match.")
    for camera in await at_work(request, state.seeing.used_by, name):
        state.live.refresh(camera)
    return await at_work(request, _answer, request, kept, 201 if etag is None else 200)


@router.delete("/colours/{name}", status_code=204)
async def remove_colours(request: Request, name: Id, if_match: IfMatch = None) -> Response:
    """Forget it; refused while cameras name it. With If-Match only if nobody has changed it since."""
    state = request.app.state

    def remove() -> None:
        if cameras := state.seeing.used_by(name):
            state.store.colour_profiles.get(name)
            raise Conflict(f"Cameras go by the colours {name!r}: {', '.join(cameras)}.", "Give them other colours "
                           "first.", reason="colours-used")
        state.store.colour_profiles.delete(name, _bare(if_match) if if_match else None)
    try:
        await at_work(request, remove)
    except Stale as error:
        return problem_of(error)
    return Response(status_code=204)


@router.post("/cameras/{id}/colours/learn", response_model=Learned)
async def learn_colours(request: Request, id: Id, body: LearnRequest) -> Json:
    """A profile from clicks and boxes on the newest frame or a snapshot, onto another one; or found in the picture.

    Nothing is kept: PUT it as a camera's `profile`, or under a name.
    """
    state = request.app.state
    await at_work(request, state.camera_shelf.get, id)
    kept, _ = await at_work(request, state.seeing.kept, id)
    base = (await at_work(request, state.seeing.colours, body.base) if isinstance(body.base, str) else
            None if body.base is None else ColourProfile.from_json(body.base))
    if not body.automatic and not any(body.clicks.values()) and base is None:
        raise BadInput("No colour is clicked.", "Click the ball and each team's colour, or ask for automatic.",
                       reason="no-colours")
    png = None
    if body.snapshot is None:
        camera = await live_camera(request, id)
        _, png = await first_picture(camera, lambda timeout_s: camera.still(1, timeout_s), STILL_S)

    def learn() -> dict[str, Any]:
        frame: Frame = state.frames[body.snapshot] if png is None else state.decoder.frame_from_bytes(png)
        profile = _learned(frame, StageConfig.from_json(kept["plan"]), base, body)
        return {"profile": profile.to_json(), "health": health_json(profile.to_json()), "notes": list(profile.notes)}
    return Json(await at_work(request, learn))


def _learned(frame: Frame, plan: StageConfig, base: ColourProfile | None, body: LearnRequest) -> ColourProfile:
    """What was clicked wins over what is found."""
    found = base
    if body.automatic:
        found = (colour_profile_for(frame.pixels, plan) if base is None else
                 automatic_profile(base.name, frame.pixels, tuple(base.colours), base))
    if any(body.clicks.values()):
        clicked = colour_profile_for(frame.pixels, plan, base, body.clicks)
        if not body.automatic or found is None:
            return clicked
        others = {c: s for c, s in found.colours.items() if c not in body.clicks}
        return ColourProfile(found.name, {**others, **{c: clicked.colours[c] for c in body.clicks
                                                       if c in clicked.colours}},
                             clicked.background, clicked.light, clicked.reach, clicked.margin, found.notes)
    return found if found is not None else colour_profile_for(frame.pixels, plan)


def _described(request: Request, kept: Document) -> dict[str, Any]:
    return {"name": kept.name, "profile": dict(kept.body), "health": health_json(kept.body),
            "used_by": request.app.state.seeing.used_by(kept.name), "updated_at": kept.updated_at,
            "updated_by": kept.updated_by}


def _answer(request: Request, kept: Document, status: int = 200) -> Json:
    headers = {"ETag": f'"{kept.etag}"', "Cache-Control": "no-store"}
    if status == 201:
        headers["Location"] = f"/api/v1/colours/{kept.name}"
    return Json(_described(request, kept), status, headers=headers)


def _bare(etag: str) -> str:
    return etag.strip().removeprefix("W/").strip('"')
