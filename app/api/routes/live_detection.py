"""/cameras/{id}/seeing and /cameras/{id}/detections: detection settings of a live camera, and what it detects."""

from typing import Any

from fastapi import APIRouter, WebSocket
from starlette.responses import Response

from app.api.dependencies import IfMatch, IfMatchNeeded, OperatorDep, ServicesDep
from app.api.responses import NO_STORE, Json, versioned
from app.api.schemas import responses
from app.api.schemas.detection import DetectionSettingsBody
from app.api.schemas.requests import Id
from app.api.sockets import run_until_first, send_text, until_disconnect, websocket_session
from app.live import LiveCamera
from app.live.detection_feed import json_text
from app.services.container import Services
from app.services.detection import health_json
from app.services.live import when_awake

router = APIRouter(prefix="/cameras", tags=["detections"])

MAX_FPS = 20.0  # what a page can draw; the newest wins
FIRST_S = 30.0  # a camera that was asleep, its stages to be set up, on a busy machine


@router.get("/{id}/seeing", response_model=responses.DetectionSettings)
async def read_seeing(services: ServicesDep, id: Id) -> Json:
    """Return the camera's detection settings; the ETag goes into the next PUT's If-Match."""
    return await services.run_in_thread(_settings, services, id)


@router.put("/{id}/seeing", response_model=responses.DetectionSettings)
async def set_seeing(services: ServicesDep, by: OperatorDep, id: Id, body: DetectionSettingsBody,
                     if_match: IfMatch = None) -> Response:
    """Save the settings; the camera's process follows at once. 428 without If-Match, 412 if that is old.

    Naming the same `colours` for several cameras lets them share a profile.
    """
    await services.run_in_thread(services.cameras.get, id)
    if if_match is None:
        raise IfMatchNeeded("The request does not say which state of it it was made from.")
    await services.run_in_thread(services.detection.save, id, body.model_dump(), if_match, by)
    if body.publish and body.on:
        services.live.get(id)  # publishing needs nobody who watches
    services.live.refresh(id)
    return await services.run_in_thread(_settings, services, id)


def _settings(services: Services, id: str) -> Json:
    settings, etag = services.detection.settings(id)
    live = services.live.get_running(id)
    profile = services.detection.profile(settings)
    learned = "clicks" if profile is not None else None
    if profile is None and live is not None and live.detections.learned is not None:
        profile, learned = live.detections.learned, "picture"
    problem = live.detections.problem if live is not None else None
    return versioned({**settings, "profile": profile, "learned": learned, "health": health_json(profile), "published": {
        "packets": live.detections.packets if live is not None else 0, "problem": None if problem is None else {
            "reason": problem.reason, "what": problem.what, "fix": problem.fix}}}, etag)


@router.get("/{id}/detections", response_model=responses.FrameDetections)
async def newest_detections(services: ServicesDep, id: Id) -> Response:
    """Return ball and robots in the next frame, in field mm with covariance, and the time of each stage.

    Detection runs only while somebody asks: for more than one frame, use the WebSocket of the same name.
    """
    camera = services.live.get(id)
    with camera.detections.listening() as viewer:
        body = await when_awake(camera, viewer.next, FIRST_S)
    return Response(json_text(body), media_type="application/json", headers=NO_STORE)


@router.websocket("/{id}/detections")
async def watch_detections(socket: WebSocket, services: ServicesDep, id: str) -> None:
    """Send the same for each frame, at most twenty times a second, the newest only."""
    async with websocket_session(socket):
        await run_until_first(until_disconnect(socket), _send(socket, services.live.get(id)))


async def _send(socket: WebSocket, camera: LiveCamera) -> None:
    with camera.detections.listening(MAX_FPS) as viewer:
        body: Any = await when_awake(camera, viewer.next, FIRST_S)
        while True:
            await send_text(socket, json_text(body))
            body = await viewer.next()
