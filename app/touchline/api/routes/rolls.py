"""/cameras/{id}/rolls and /motion: a ball that rolls straight measures distortion, and gives a lens."""

import asyncio
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Query, WebSocket
from pydantic import Field
from starlette.responses import Response

from touchline.api.dependencies import CallerDep, IfMatch, ServicesDep, in_thread
from touchline.api.responses import Json, accepted
from touchline.api.schemas import responses
from touchline.api.schemas.base import JsonObject, response
from touchline.api.schemas.requests import Id
from touchline.api.sockets import SessionLimit, run_until_first, send_json, until_disconnect, websocket_session
from touchline.core.errors import BadInput, Conflict
from touchline.core.geometry import MAX_COORDINATE
from touchline.core.statements import say, sentence_in, stated
from touchline.live.camera import LiveCamera
from touchline.services.container import Services
from touchline.services.forms import Name, Note, Number, Pair, Size, Strict
from touchline.services.live import when_awake
from touchline.sources.local.files import file_within
from touchline.store.rolls import rolls_etag
from touchline.store.store import Store
from touchline.workflows.rolling_request import check, check_refinable, run_motion, stored_rolls_json

router = APIRouter(tags=["rolls"])

Rolls = response("Rolls", items=list[JsonObject], report=JsonObject | None, etag=str)

MIN_INTERVAL_S = 0.1  # between two messages: ten a second at most
REQUEST_S = 10.0
MAX_ROLLS = 1000
SAVED = ("at", "seconds", "points", "rms_px", "straight_px")
SESSIONS = SessionLimit(4, "Another user is recording rolls with this camera.",
                        "Wait until the recording ends, or read GET /api/v1/cameras/{id}/rolls.", "rolls-watched")


class RollChange(Strict):
    left_out: bool


@router.get("/cameras/{id}/rolls", response_model=Rolls)
def list_rolls(services: ServicesDep, id: Id) -> Json:
    """List saved rolls, oldest first, and their straightness: Eq. (9) of each, of zones, along the image edge.

    Corrected as well, where the camera's active calibration is of pictures of their size. `etag`, and that of each,
    goes into If-Match of DELETE and PATCH.
    """
    services.cameras.get(id)
    return Json(_rolls_json(services.store, id))


@router.patch("/cameras/{id}/rolls/{roll}", response_model=Rolls)
def update_roll(services: ServicesDep, id: Id, roll: Id, body: RollChange, if_match: IfMatch = None) -> Json:
    """Leave one out, or take it in again; return the list. With If-Match, its `etag`, only if it is unchanged."""
    services.store.rolls.leave_out(id, roll, body.left_out, if_match)
    return Json(_rolls_json(services.store, id))


@router.delete("/cameras/{id}/rolls/{roll}", status_code=204, response_class=Response)
def delete_roll(services: ServicesDep, id: Id, roll: Id, if_match: IfMatch = None) -> None:
    """Delete one roll. With If-Match, its `etag`, only if it is unchanged."""
    services.store.rolls.delete(id, roll, if_match)


@router.delete("/cameras/{id}/rolls", status_code=204, response_class=Response)
def delete_rolls(services: ServicesDep, id: Id, if_match: IfMatch = None) -> None:
    """Delete all rolls of this camera, as after it was moved. With If-Match, the list's `etag`, only if unchanged."""
    services.cameras.get(id)
    services.store.rolls.clear(id, if_match)


@router.websocket("/cameras/{id}/rolls/stream")
async def watch_rolls(socket: WebSocket, services: ServicesDep, id: str,
                      keep: Annotated[bool, Query()] = True) -> None:
    """Send JSON texts, up to ten a second: `tracks` of what moves, ids of `new` rolls, and `told` whenever it changes.

    told is what GET /cameras/{id}/rolls returns. Rolls are followed only while somebody watches; with keep=false
    they are not saved, and `new` has the rolls themselves.
    """
    async with websocket_session(socket):
        with SESSIONS.session(id):
            camera = services.live.get(id)
            await run_until_first(until_disconnect(socket), _send(socket, services, camera, keep))


async def _send(socket: WebSocket, services: Services, camera: LiveCamera, keep: bool) -> None:
    loop, store = asyncio.get_running_loop(), services.store
    watch, after, seq, sent_state = "", 0, 0, None

    async def follow(_left_s: float) -> dict[str, Any]:
        return (await camera.request("rolls", REQUEST_S, watch=watch, after=after, seq=seq))[0]

    while True:
        start_s = loop.time()
        result = await when_awake(camera, follow)
        new = result["rolls"]
        if result["watch"] != watch:
            watch, after = result["watch"], 0
        after, seq = max([after, *(roll["number"] for roll in new)]), result["seq"]
        if keep and new:
            await services.run_in_thread(_save, store, camera.id, new, [result["width"], result["height"]])
        state = (store.rolls.revision, camera.calibration.id if camera.calibration else None)
        summary = None
        if state != sent_state:
            summary, sent_state = await services.run_in_thread(_rolls_json, store, camera.id), state
        await send_json(socket, stated({
            **{name: result[name] for name in ("seq", "time", "width", "height", "tracks")},
            "hint": sentence_in(result, "hint"),
            "new": [roll["id"] for roll in new] if keep else new, "told": summary}))
        await asyncio.sleep(max(MIN_INTERVAL_S - (loop.time() - start_s), 0.0))


def _save(store: Store, camera: str, new: list[dict[str, Any]], image_size: list[int]) -> None:
    for roll in new:
        store.rolls.add(camera, roll["id"], {**{name: roll[name] for name in SAVED}, "image_size": image_size})


def _rolls_json(store: Store, camera: str) -> dict[str, Any]:
    saved = store.rolls.of(camera)
    shown = stored_rolls_json(saved, store.calibrations.active(camera))
    items = [{**item, "etag": rolls_etag([roll])} for item, roll in zip(shown["items"], saved, strict=True)]
    return {**shown, "items": items, "etag": rolls_etag(saved)}


class RollForm(Strict):
    """Where something rolled straight, in order, and for how long."""

    points: Annotated[list[Pair], Field(min_length=5, max_length=2000)] = Field(description="[x, y] px, raw")
    seconds: Annotated[Number, Field(gt=0, le=3600)]


class MotionRequest(Strict):
    """One of camera, film and rolls; the rest says what is made from them."""

    camera: Name | None = Field(None, description="its saved rolls, without excluded rolls")
    film: Annotated[str, Field(min_length=1, max_length=300)] | None = Field(
        None, description="of a fixed camera, by its name in the pictures folder, as for a video source")
    rolls: Annotated[list[RollForm], Field(min_length=1, max_length=MAX_ROLLS)] | None = None
    image_size: Size | None = Field(None, description="of the images, with rolls")
    calibration: Name | None = Field(None, description="to judge or to refine; with camera its active one")
    make: Literal["report", "lens", "refined"] = "report"
    lens: Name = Field("auto", description="division, division-even, brown-conrady, or auto")
    centre_sigma_px: Annotated[float, Field(ge=0, le=MAX_COORDINATE)] | None = Field(
        0.0, description="uncertainty of the lens centre around the image centre, px; 0: fixed")
    note: Note = ""


@router.post("/motion", status_code=202, response_model=responses.Job)
@in_thread
def evaluate_rolls(services: ServicesDep, caller: CallerDep, body: MotionRequest) -> Json:
    """Start a job: {"report", "lens": id | null, "calibration": id | null}. No version is activated.

    make "lens": the rolls as plumb lines, kept under /lenses for a fit to hold; "refined": the calibration fitted anew
    to its own clicks and these rolls, a new version.
    """
    store = services.store
    if sum(given is not None for given in (body.camera, body.film, body.rolls)) != 1:
        raise BadInput("The request has no source for the rolls.", "Send one of camera, film and rolls.",
                       reason="bad-request")
    check(body.make, body.lens, body.centre_sigma_px)
    calibration, film, rolls, size = None, None, [], body.image_size
    if body.camera is not None:
        services.cameras.get(body.camera)
        saved = store.rolls.of(body.camera)
        size = saved[-1]["image_size"] if saved else None
        rolls = [roll for roll in saved if roll["image_size"] == size and not roll["left_out"]]
        if not rolls:
            raise Conflict(say("rolls.none-saved", "This camera has no saved rolls."),
                           say("rolls.start-recording", "Start the recording, then roll a ball across the field."),
                           reason="no-rolls")
        calibration = store.calibrations.active(body.camera) if body.calibration is None else None
    elif body.film is not None:
        film = str(file_within(services.settings.shown_pictures, body.film, "video"))
    elif body.rolls is not None:
        rolls = [roll.model_dump() for roll in body.rolls]
        if size is None:
            raise BadInput("The request has no image size.", 'Send "image_size": [width, height].',
                           reason="no-image-size")
    if body.calibration is not None:
        calibration = store.calibrations.get(body.calibration)
    if calibration is not None and size is not None and list(calibration.image_size) != list(size):
        if body.calibration is not None or body.make == "refined":
            raise Conflict(say("rolls.not-of-calibration", "The rolls do not have the image size of the calibration, "
                               "{size}.", size=calibration.image_size),
                           say("rolls.same-camera", "Use rolls of the calibrated camera at the same resolution."),
                           reason="size-mismatch")
        calibration = None  # it was only at hand
    if body.make == "refined":
        check_refinable(calibration)
    spec = {"film": film, "rolls": rolls, "image_size": size, "make": body.make, "lens": body.lens,
            "calibration": None if calibration is None else calibration.to_json(), "note": body.note,
            "centre_sigma_px": body.centre_sigma_px, "camera": body.camera}
    return accepted(services.jobs.start("motion", run_motion, spec, "motion", {"by": caller.name}, caller=caller))
