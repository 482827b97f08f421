"""/cameras/{id}/seeing and /cameras/{id}/detections: what a live camera is to see, and what it sees."""

import asyncio
from typing import Annotated, Any

from fastapi import APIRouter, Header, Request, WebSocket
from starlette.responses import Response

from app.api.answers import Json
from app.api.middleware.problems import problem, stale_problem
from app.api.mjpeg import TAKE_S
from app.api.operator import operator
from app.api.routes.streams import first_picture, live_camera
from app.api.schemas.live_detection import SeeingBody, SeeingTold, Seen
from app.api.schemas.requests import Id
from app.api.sockets import both, spoken_with, until_gone
from app.api.work import at_work
from app.core.errors import Stale
from app.live import LiveCamera
from app.live.detection_feed import json_text
from app.services.detection import health_json

router = APIRouter(prefix="/cameras", tags=["detections"])

MOST_FPS = 20.0  # what a page can draw; the newest wins
FIRST_S = 30.0  # a camera that was asleep, its stages to be set up, on a busy machine
IfMatch = Annotated[str | None, Header(max_length=200)]


@router.get("/{id}/seeing", response_model=SeeingTold)
async def read_seeing(request: Request, id: Id) -> Json:
    """What this camera is to see; its ETag goes into the next PUT's If-Match."""
    return await at_work(request, _told, request, id)


@router.put("/{id}/seeing", response_model=SeeingTold)
async def set_seeing(request: Request, id: Id, body: SeeingBody, if_match: IfMatch = None) -> Response:
    """Set it; the camera's process follows at once, and it is kept. 428 without If-Match, 412 if that is old.

    Naming the same `colours` for several cameras lets them share a profile.
    """
    state = request.app.state
    await at_work(request, state.camera_shelf.get, id)
    if if_match is None:
        return problem(428, "if-match-needed", "If-Match needed", "The request does not say which state of it it was "
                       "made from.", "Send the ETag of GET as If-Match.")
    etag = if_match.strip().removeprefix("W/").strip('"')
    try:
        await at_work(request, state.seeing.save, id, body.model_dump(), etag, operator(request))
    except Stale as error:
        return stale_problem(error)
    if body.publish and body.on:
        await live_camera(request, id)  # publishing needs nobody who watches
    state.live.refresh(id)
    return await at_work(request, _told, request, id)


def _told(request: Request, id: str) -> Json:
    state = request.app.state
    kept, etag = state.seeing.kept(id)
    live = state.live.get_running(id)
    profile = state.seeing.profile(kept)
    learned = "clicks" if profile is not None else None
    if profile is None and live is not None and live.detections.learned is not None:
        profile, learned = live.detections.learned, "picture"
    problem = live.detections.problem if live is not None else None
    return Json({**kept, "profile": profile, "learned": learned, "health": health_json(profile), "published": {
        "packets": live.detections.packets if live is not None else 0, "problem": None if problem is None else {
            "reason": problem.reason, "what": problem.what, "fix": problem.fix}}},
        headers={"ETag": f'"{etag}"', "Cache-Control": "no-store"})


@router.get("/{id}/detections", response_model=Seen)
async def newest_detections(request: Request, id: Id) -> Response:
    """Ball and robots in the next frame, in field mm with covariance, and what each stage took.

    The camera sees only while somebody asks: for more than a look, listen to the WebSocket of the same name.
    """
    camera = await live_camera(request, id)
    with camera.detections.listening() as viewer:
        body = await first_picture(camera, viewer.next, FIRST_S)
    return Response(json_text(body), media_type="application/json", headers={"Cache-Control": "no-store"})


@router.websocket("/{id}/detections")
async def watch_detections(socket: WebSocket, id: str) -> None:
    """The same for each frame, at most twenty times a second, the newest only."""
    async with spoken_with(socket):
        camera = await live_camera(socket, id)
        await both(until_gone(socket), _send(socket, camera))


async def _send(socket: WebSocket, camera: LiveCamera) -> None:
    with camera.detections.listening(MOST_FPS) as viewer:
        body: Any = await first_picture(camera, viewer.next, FIRST_S)
        while True:
            await asyncio.wait_for(socket.send_text(json_text(body)), TAKE_S)
            body = await viewer.next()
