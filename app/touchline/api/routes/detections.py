"""/detections, /stages, /cameras/{id}/seeing and /cameras/{id}/detections: ball and robots in a snapshot and live."""

from collections.abc import Callable
from typing import Annotated, Any, TypeVar

from fastapi import APIRouter, Query, Request, WebSocket
from starlette.responses import Response

from touchline.api.dependencies import IfMatch, IfMatchNeeded, OperatorDep, ServicesDep, in_thread
from touchline.api.responses import NO_STORE, Json, JsonText, picture, versioned
from touchline.api.schemas import responses
from touchline.api.schemas.base import Answer, JsonObject, response
from touchline.api.schemas.detection import DetectionBody, DetectionSettingsBody
from touchline.api.schemas.media import PICTURE
from touchline.api.schemas.requests import Format, Id
from touchline.api.sockets import run_until_first, send_text, until_disconnect, websocket_session
from touchline.core.colour_profile import ColourProfile
from touchline.core.errors import NotFound
from touchline.core.progress import Progress
from touchline.core.records import Calibration, Frame
from touchline.core.statements import named, stated
from touchline.live.camera import LiveCamera
from touchline.live.detection_feed import json_text
from touchline.services.container import Services
from touchline.services.detection import health_json
from touchline.services.live import when_awake
from touchline.store.stages import load_plans, named_plan
from touchline.vision.stage_pipeline import StageConfig
from touchline.vision.stages import STAGES
from touchline.workflows.detection import DetectionResult, context_for, detect, detections_image

router = APIRouter(tags=["detections"])

DetectionSettings = response("DetectionSettings", on=bool, plan=JsonObject, colours=str | None,
    profile=JsonObject | None, learned=str | None, health=list[JsonObject], publish=bool, published=JsonObject)
Answered = TypeVar("Answered", bound=Response)

DRAWN = "drawn"  # in place of a stage: the picture with everything that was found
MAX_FPS = 20.0  # what a page can draw; the newest wins
FIRST_S = 30.0  # a camera that was asleep, its stages to be set up, on a busy machine


@router.get("/stages", response_model=Answer)
def list_stages() -> Json:
    """List every stage with its options, and the plans that come with Touchline."""
    return Json({"items": [_stage_json(name) for name in STAGES],
                 "plans": [plan.to_json() for plan in load_plans().values()], "next_cursor": None})


def _stage_json(name: str) -> dict[str, Any]:
    stage = STAGES[name]
    return stated({"name": name, "title": named(f"stage.{name}", stage.TITLE),
                   "help": named(f"stage.{name}.help", stage.HELP),
                   "options": [option.to_json(name) for option in stage.OPTIONS]})


@router.post("/detections", response_model=Answer)
async def detect_objects(request: Request, services: ServicesDep, body: DetectionBody) -> Json:
    """Detect ball and robots in a snapshot, in field mm with covariance; nothing is saved.

    Colours are those of a profile, clicked in this picture, or both; without either they are found in the picture.
    """
    return await _detect(request, services, body, lambda found, *_: Json(found.to_json()))


@router.post("/detections/picture.{format}", response_class=Response, responses=PICTURE)
async def draw_detections(request: Request, services: ServicesDep, format: Format, body: DetectionBody,
                          stage: Annotated[str, Query(max_length=64)] = DRAWN) -> Response:
    """Return the snapshot with detections drawn, or the image of one stage: `?stage=colours`."""
    def draw(found: DetectionResult, frame: Frame, calibration: Calibration | None) -> Response:
        pixels: Any = found.seen.pictures.get(stage)
        if pixels is None:
            view = context_for(frame.size, found.profile, calibration, body.mm_per_px, body.eye).view
            pixels = detections_image(frame.pixels, found.seen.detections, view)
        return picture(pixels, format)
    return await _detect(request, services, body, draw, stage)


async def _detect(request: Request, services: Services, body: DetectionBody,
                  tell: Callable[[DetectionResult, Frame, Calibration | None], Answered],
                  stage: str = DRAWN) -> Answered:
    """Detect objects in a snapshot while the caller waits, and return what `tell` makes of them."""
    snapshot = await services.run_in_thread(services.store.snapshots.get, body.snapshot)

    def work(progress: Progress) -> Answered:
        plan = named_plan(body.stages) if isinstance(body.stages, str) else StageConfig.from_json(body.stages)
        names = [DRAWN, *(name for name, _ in plan.stages)]
        if stage not in names:
            raise NotFound(f"The plan {plan.name} has no stage called {stage!r}.", f"Use one of: {', '.join(names)}.",
                           reason="unknown-stage")
        profile = None if body.colours is None else ColourProfile.from_json(body.colours)
        calibration = None if body.calibration is None else services.store.calibrations.get(body.calibration)
        frame = services.frame(snapshot.id)
        found = detect(frame.pixels, plan, calibration=calibration, profile=profile, clicks=body.clicks,
                       mm_per_px=body.mm_per_px, eye_mm=body.eye,
                       pictures=() if stage == DRAWN else (stage,), progress=progress)
        return tell(found, frame, calibration)
    return await services.process_picture(snapshot.size, work, request.is_disconnected)


@router.get("/cameras/{id}/seeing", response_model=DetectionSettings)
@in_thread
def read_detection_settings(services: ServicesDep, id: Id) -> Json:
    """Return the camera's detection settings; the ETag goes into the next PUT's If-Match."""
    return _settings(services, id)


@router.put("/cameras/{id}/seeing", response_model=DetectionSettings)
async def save_detection_settings(services: ServicesDep, by: OperatorDep, id: Id, body: DetectionSettingsBody,
                                  if_match: IfMatch = None) -> Response:
    """Save the settings; the camera's process follows at once. 428 without If-Match, 412 if that is old.

    Naming the same `colours` for several cameras lets them share a profile.
    """
    await services.run_in_thread(services.cameras.get, id)
    if if_match is None:
        raise IfMatchNeeded("The request does not state which version of the settings it changes.")
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
        "packets": live.detections.packets if live is not None else 0,
        "problem": None if problem is None else problem.to_json()}}, etag)


@router.get("/cameras/{id}/detections", response_model=responses.FrameDetections)
async def read_detections(services: ServicesDep, id: Id) -> Response:
    """Return ball and robots in the next frame, in field mm with covariance, and the time of each stage.

    Detection runs only while somebody asks: for more than one frame, use the WebSocket of the same name.
    """
    camera = services.live.get(id)
    with camera.detections.listening() as viewer:
        body = await when_awake(camera, viewer.next, FIRST_S)
    return JsonText(json_text(body), headers=NO_STORE)


@router.websocket("/cameras/{id}/detections")
async def watch_detections(socket: WebSocket, services: ServicesDep, id: str) -> None:
    """Send the same for each frame, at most twenty times a second, the newest only."""
    async with websocket_session(socket):
        camera = services.live.get(id)
        await run_until_first(until_disconnect(socket), _send(socket, camera))


async def _send(socket: WebSocket, camera: LiveCamera) -> None:
    with camera.detections.listening(MAX_FPS) as viewer:
        body: Any = await when_awake(camera, viewer.next, FIRST_S)
        while True:
            await send_text(socket, json_text(body))
            body = await viewer.next()
