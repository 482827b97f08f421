"""Ball and robots in a snapshot, live, in saved clips, and tracked over a rig; and the colours by which they are known.

/detections, /stages, /cameras/{id}/seeing and /cameras/{id}/detections; /colours; /clips; /rigs/{name}/tracks.
"""

import asyncio
import time
from collections.abc import Callable
from typing import Annotated, Any, TypeVar

from fastapi import APIRouter, Query, Request, WebSocket
from pydantic import Field
from starlette.responses import Response

from touchline.api import schemas
from touchline.api.dependencies import IfMatch, IfMatchNeeded, OperatorDep, ServicesDep, in_thread
from touchline.api.requests import Format, Id
from touchline.api.responses import NO_STORE, Json, JsonText, created, page, picture, versioned
from touchline.api.schemas import PICTURE, Answer, JsonObject, files, page_of, response
from touchline.api.sockets import run_until_first, send_text, until_disconnect, websocket_session
from touchline.core.errors import BadInput, Conflict, NotFound, Unavailable
from touchline.core.jobs import Progress
from touchline.core.records import Calibration, Frame
from touchline.core.statements import named, say, stated
from touchline.detection.colours import health_json
from touchline.detection.detect import (
    DetectionResult,
    context_for,
    detect,
    detections_image,
    learn_from_frame,
)
from touchline.detection.profile import ColourProfile
from touchline.detection.service import (
    RAW,
    DetectionService,
    TrackFusion,
    detect_in_clip,
    detections_of,
    json_text,
    track_fusion_of,
)
from touchline.detection.stages import STAGES, StageConfig
from touchline.detection.store import ClipRepository, load_plans, named_plan
from touchline.images import screen
from touchline.live.camera import LiveCamera
from touchline.services.container import Services
from touchline.services.forms import Coordinate, Name, Strict
from touchline.services.live import take_frame, when_awake
from touchline.store.documents import Document

router = APIRouter(tags=["detections"])
colours = APIRouter(tags=["colours"])
clips = APIRouter(tags=["clips"])
tracks = APIRouter(prefix="/rigs", tags=["rigs"])

WHOLE = "drawn"  # in place of a stage: the picture with everything that was found
MAX_FPS = 20.0  # what a page can draw; the newest wins
FIRST_S = 30.0  # for a camera that was asleep, its stages to be set up, on a busy machine
MAX_S = 30.0
START_S = 20.0
ANSWER_S = 20.0  # after the seconds that are recorded
FIRST_OF_RIG_S = 20.0  # the same for a rig
FOLLOW_S = 0.6  # for a single response, where nobody else follows

Place = Annotated[list[Coordinate], Field(min_length=2, max_length=4)]
# by colour
Clicks = Annotated[dict[Name, Annotated[list[Place], Field(max_length=40)]], Field(max_length=13)]
Spec = Annotated[dict[str, Any], Field(max_length=8)]  # a plan or a profile; read where it is used
Answered = TypeVar("Answered", bound=Response)
Stage = Annotated[str, Query(max_length=64, description="raw, detections, or the name of a stage")]
PlanName = Annotated[Name | None, Query(description="in place of the camera's own")]


class DetectionBody(Strict):
    """A snapshot, the calibration for positions and sizes, and the colours."""

    snapshot: Name
    calibration: Name | None = Field(
        None, description="of this camera at this size; without it there are no positions"
    )
    stages: Name | Annotated[dict[str, Any], Field(max_length=4)] = Field(
        "ssl", description="a plan by name, or one of your own as GET /stages describes them"
    )
    colours: Spec | None = Field(None, description="a profile, as `colours` of an earlier answer")
    clicks: Clicks | None = Field(
        None, description="by colour: [x, y] of a point, or [x0, y0, x1, y1] of a box, raw px"
    )
    mm_per_px: Annotated[float, Field(ge=0.01, le=1000)] | None = Field(
        None, description="size of a px on the carpet, mm, if there is no calibration"
    )
    eye_mm: Annotated[list[Coordinate], Field(min_length=3, max_length=3)] | None = Field(
        None,
        description="[x, y, height] of the camera, field mm, for a model that is not a physical lens model",
    )

    @property
    def eye(self) -> tuple[float, float, float] | None:
        return None if self.eye_mm is None else (self.eye_mm[0], self.eye_mm[1], self.eye_mm[2])


class DetectionSettingsBody(Strict):
    """The detection settings of a camera: what GET answers, without what it only reports."""

    on: bool
    plan: Name | Spec = Field(description="by name, or complete, as GET /stages describes them")
    colours: Name | None = Field(
        None,
        description="a saved profile, including its later changes; or a copy from another camera",
    )
    profile: Spec | None = Field(
        None, description="own colours of this camera; they override `colours`"
    )
    publish: bool = Field(False, description="as SSL_DetectionFrame on the league's group")


class ColoursBody(Strict):
    """A profile under the name in the path."""

    profile: Spec


class LearnBody(Strict):
    """Points and boxes by colour in the newest frame or a snapshot; or none."""

    clicks: Clicks = Field(
        {},
        description="[x, y] of a point, or [x0, y0, x1, y1] of a box, raw px; `background` for areas without a "
        "colour",
    )
    base: Name | Spec | None = Field(
        None, description="a profile, by name or complete, whose other colours stay as they are"
    )
    snapshot: Name | None = Field(None, description="by default the newest frame")
    automatic: bool = Field(False, description="detect the colours in the image")


class RecordRequest(Strict):
    seconds: Annotated[float, Field(ge=1, le=MAX_S)] = 5.0


DetectionSettings = response(
    "DetectionSettings",
    on=bool,
    plan=JsonObject,
    colours=str | None,
    profile=JsonObject | None,
    learned=str | None,
    health=list[JsonObject],
    publish=bool,
    published=JsonObject,
    teams=JsonObject,
)
Colours = response(
    "Colours", name=str, profile=JsonObject, health=list[JsonObject], used_by=list[str]
)
ColoursList = page_of("ColoursList", Colours)
LearnedColours = response(
    "LearnedColours", profile=JsonObject, health=list[JsonObject], notes=list[str]
)
Clip = response("Clip", clip=str, camera=str, frames=int, seconds=float)
Clips = page_of("Clips", Clip)
Tracks = response(
    "Tracks", time_s=float, items=list[JsonObject], seams=JsonObject, cameras=list[JsonObject]
)


@router.get("/stages", response_model=Answer)
def list_stages() -> Json:
    """List every stage with its options, and the plans that come with Touchline."""
    return Json(
        {
            "items": [_stage_json(name) for name in STAGES],
            "plans": [plan.to_json() for plan in load_plans().values()],
            "next_cursor": None,
        }
    )


def _stage_json(name: str) -> dict[str, Any]:
    stage = STAGES[name]
    return stated(
        {
            "name": name,
            "title": named(f"stage.{name}", stage.TITLE),
            "help": named(f"stage.{name}.help", stage.HELP),
            "options": [option.to_json(name) for option in stage.OPTIONS],
        }
    )


@router.post("/detections", response_model=Answer)
async def detect_objects(request: Request, services: ServicesDep, body: DetectionBody) -> Json:
    """Detect ball and robots in a snapshot, in field mm with covariance; nothing is saved.

    Colours are those of a profile, clicked in this picture, or both; without either they are found in the picture.
    """
    return await _detect(request, services, body, lambda found, *_: Json(found.to_json()))


@router.post("/detections/picture.{format}", response_class=Response, responses=PICTURE)
async def draw_detections(
    request: Request,
    services: ServicesDep,
    format: Format,
    body: DetectionBody,
    stage: Annotated[str, Query(max_length=64)] = WHOLE,
) -> Response:
    """Return the snapshot with detections drawn, or the image of one stage: `?stage=colours`."""

    def draw(found: DetectionResult, frame: Frame, calibration: Calibration | None) -> Response:
        pixels: Any = found.seen.pictures.get(stage)
        if pixels is None:
            view = context_for(
                frame.size, found.profile, calibration, body.mm_per_px, body.eye
            ).view
            pixels = detections_image(frame.pixels, found.seen.detections, view)
        return picture(pixels, format)

    return await _detect(request, services, body, draw, stage)


async def _detect(
    request: Request,
    services: Services,
    body: DetectionBody,
    tell: Callable[[DetectionResult, Frame, Calibration | None], Answered],
    stage: str = WHOLE,
) -> Answered:
    """Detect objects in a snapshot while the caller waits, and return what `tell` makes of them."""
    snapshot = await services.run_in_thread(services.store.snapshots.get, body.snapshot)

    def work(progress: Progress) -> Answered:
        plan = (
            named_plan(body.stages)
            if isinstance(body.stages, str)
            else StageConfig.from_json(body.stages)
        )
        names = [WHOLE, *(name for name, _ in plan.stages)]
        if stage not in names:
            raise NotFound(
                f"The plan {plan.name} has no stage called {stage!r}.",
                f"Use one of: {', '.join(names)}.",
                reason="unknown-stage",
            )
        profile = None if body.colours is None else ColourProfile.from_json(body.colours)
        calibration = (
            None if body.calibration is None else services.store.calibrations.get(body.calibration)
        )
        frame = services.frame(snapshot.id)
        found = detect(
            frame.pixels,
            plan,
            calibration=calibration,
            profile=profile,
            clicks=body.clicks,
            mm_per_px=body.mm_per_px,
            eye_mm=body.eye,
            team_z_mm=services.part(DetectionService).team_heights(),
            pictures=() if stage == WHOLE else (stage,),
            progress=progress,
            clock=time.perf_counter,
        )
        return tell(found, frame, calibration)

    return await services.process_picture(snapshot.size, work, request.is_disconnected)


@router.get("/cameras/{id}/seeing", response_model=DetectionSettings)
@in_thread
def read_detection_settings(services: ServicesDep, id: Id) -> Json:
    """Return the camera's detection settings; the ETag goes into the next PUT's If-Match."""
    return _settings(services, id)


@router.put("/cameras/{id}/seeing", response_model=DetectionSettings)
async def save_detection_settings(
    services: ServicesDep,
    by: OperatorDep,
    id: Id,
    body: DetectionSettingsBody,
    if_match: IfMatch = None,
) -> Response:
    """Save the settings; the camera's process follows at once. 428 without If-Match, 412 if that is old.

    Naming the same `colours` for several cameras lets them share a profile.
    """
    await services.run_in_thread(services.cameras.get, id)
    if if_match is None:
        raise IfMatchNeeded("The request does not state which version of the settings it changes.")
    await services.run_in_thread(
        services.part(DetectionService).save, id, body.model_dump(), if_match, by
    )
    if body.publish and body.on:
        services.live.get(id)  # publishing needs nobody who watches
    services.live.refresh(id)
    return await services.run_in_thread(_settings, services, id)


def _settings(services: Services, id: str) -> Json:
    detection = services.part(DetectionService)
    settings, etag = detection.settings(id)
    camera = services.live.get_running(id)
    feed = None if camera is None else detections_of(camera)
    profile = detection.profile(settings)
    learned = "clicks" if profile is not None else None
    if profile is None and feed is not None and feed.learned is not None:
        profile, learned = feed.learned, "picture"
    problem = feed.problem if feed is not None else None
    return versioned(
        {
            **settings,
            "profile": profile,
            "learned": learned,
            "health": health_json(profile),
            "teams": detection.teams(id),
            "published": {
                "packets": feed.packets if feed is not None else 0,
                "problem": None if problem is None else problem.to_json(),
            },
        },
        etag,
    )


@router.get("/cameras/{id}/detections", response_model=schemas.FrameDetections)
async def read_detections(services: ServicesDep, id: Id) -> Response:
    """Return ball and robots in the next frame, in field mm with covariance, and the time of each stage.

    Detection runs only while somebody asks: for more than one frame, use the WebSocket of the same name.
    """
    camera = services.live.get(id)
    with detections_of(camera).listening() as viewer:
        body = await when_awake(camera, viewer.next, FIRST_S)
    return JsonText(json_text(body), headers=NO_STORE)


@router.websocket("/cameras/{id}/detections")
async def watch_detections(socket: WebSocket, services: ServicesDep, id: str) -> None:
    """Send the same for each frame, at most twenty times a second, the newest only."""
    async with websocket_session(socket):
        camera = services.live.get(id)
        await run_until_first(until_disconnect(socket), _send_detections(socket, camera))


async def _send_detections(socket: WebSocket, camera: LiveCamera) -> None:
    with detections_of(camera).listening(MAX_FPS) as viewer:
        body: Any = await when_awake(camera, viewer.next, FIRST_S)
        while True:
            await send_text(socket, json_text(body))
            body = await viewer.next()


@colours.get("/colours", response_model=ColoursList)
def list_colours(services: ServicesDep) -> Json:
    """List every profile by name, with how well its colours are separated and which cameras use it."""
    return page(_profile_json(services, preset) for preset in services.store.colour_profiles.all())


@colours.get("/colours/{name}", response_model=Colours)
def read_colours(services: ServicesDep, name: Id) -> Json:
    """Return one profile; its ETag goes into the next PUT's If-Match."""
    preset = services.store.colour_profiles.get(name)
    return versioned(_profile_json(services, preset), preset.etag)


@colours.put("/colours/{name}", response_model=Colours, responses={201: {"model": Colours}})
async def save_colours(
    services: ServicesDep, by: OperatorDep, name: Id, body: ColoursBody, if_match: IfMatch = None
) -> Response:
    """Create a profile (201), or replace the one that If-Match names: 428 without, 412 with `current` if that is old.

    Cameras that use it follow at once.
    """
    profile = ColourProfile.from_json({**body.profile, "name": name}).to_json()
    try:
        preset = await services.run_in_thread(
            services.store.colour_profiles.save, name, profile, if_match, by
        )
    except Conflict as error:
        if error.reason != "colours-exists":
            raise
        raise IfMatchNeeded(
            "This colour profile already exists, and the request does not state the "
            "version that it changes."
        ) from None
    for camera in await services.run_in_thread(services.part(DetectionService).used_by, name):
        services.live.refresh(camera)
    return versioned(
        await services.run_in_thread(_profile_json, services, preset),
        preset.etag,
        f"colours/{preset.name}" if if_match is None else None,
    )


@colours.delete("/colours/{name}", status_code=204, response_class=Response)
@in_thread
def delete_colours(services: ServicesDep, name: Id, if_match: IfMatch = None) -> None:
    """Delete a profile; refused while cameras use it. With If-Match only if it is unchanged."""
    services.part(DetectionService).remove_colours(name, if_match)


@colours.post("/cameras/{id}/colours/learn", response_model=LearnedColours)
async def learn_colours(services: ServicesDep, id: Id, body: LearnBody) -> Json:
    """Learn a profile from points and boxes on the newest frame or a snapshot, added to another one; or automatically.

    Nothing is saved: PUT it as a camera's `profile`, or under a name.
    """
    detection = services.part(DetectionService)
    settings, _ = await services.run_in_thread(detection.settings, id)
    base = (
        await services.run_in_thread(detection.colours, body.base)
        if isinstance(body.base, str)
        else None
        if body.base is None
        else ColourProfile.from_json(body.base)
    )
    if not body.automatic and not any(body.clicks.values()) and base is None:
        raise BadInput(
            say("colours.none-marked", "No colour is marked."),
            say("colours.mark", "Mark the ball and each team colour, or use automatic detection."),
            reason="no-colours",
        )
    picture = body.snapshot or (await take_frame(services.live.get(id))).png

    def learn() -> dict[str, Any]:
        frame = (
            services.frame(picture)
            if isinstance(picture, str)
            else services.decoder.frame_from_bytes(picture)
        )
        profile = learn_from_frame(
            frame, StageConfig.from_json(settings["plan"]), base, body.clicks, body.automatic
        )
        return stated(
            {
                "profile": profile.to_json(),
                "health": health_json(profile.to_json()),
                "notes": list(profile.notes),
            }
        )

    return Json(await services.run_in_thread(learn))


def _profile_json(services: Services, preset: Document) -> dict[str, Any]:
    return {
        "name": preset.name,
        "profile": dict(preset.body),
        "health": health_json(preset.body),
        "used_by": services.part(DetectionService).used_by(preset.name),
        "updated_at": preset.updated_at,
        "updated_by": preset.updated_by,
    }


@clips.post("/cameras/{id}/clip", status_code=201, response_model=Clip)
async def record_clip(services: ServicesDep, id: Id, body: RecordRequest | None = None) -> Json:
    """Save the last seconds, if somebody has watched a stage's picture for so long; else the next ones.

    Ten pictures a second; some 120 MB at most, so that large pictures make shorter clips.
    """
    seconds = (body or RecordRequest()).seconds
    camera = services.live.get(id)
    head, jpegs = await when_awake(
        camera, lambda _left_s: camera.request("clip", seconds + ANSWER_S, seconds=seconds), START_S
    )
    clip = await services.run_in_thread(
        services.store.repository(ClipRepository).add, id, head, jpegs
    )
    return created(clip.to_json(), f"clips/{clip.id}")


@clips.get("/clips", response_model=Clips)
def list_clips(services: ServicesDep) -> Json:
    """List clips, newest first."""
    return page(clip.to_json() for clip in services.store.repository(ClipRepository).all())


@clips.get("/clips/{id}", response_model=Clip)
def read_clip(services: ServicesDep, id: Id) -> Json:
    """Return one clip, with the times of its frames; its ETag goes into If-Match of DELETE."""
    clip = services.store.repository(ClipRepository).get(id)
    return versioned(
        {**clip.to_json(), "times_s": [frame["time_s"] for frame in clip.frames]}, clip.etag
    )


@clips.delete("/clips/{id}", status_code=204, response_class=Response)
def delete_clip(services: ServicesDep, id: Id, if_match: IfMatch = None) -> None:
    """Delete a clip. With If-Match only that very one."""
    services.store.repository(ClipRepository).delete(id, if_match)


@clips.get(
    "/clips/{id}/frames/{number}.jpg", response_class=Response, responses=files("image/jpeg")
)
@in_thread
def read_clip_image(
    services: ServicesDep, id: Id, number: int, stage: Stage = RAW, plan: PlanName = None
) -> Response:
    """Return a frame, counted from 0: as it was, with detections drawn, or the image of a stage."""
    if stage == RAW:
        jpeg = services.store.repository(ClipRepository).frame(id, number)
        if screen(jpeg, services.decoder.limits).is_plain:
            return Response(jpeg, media_type="image/jpeg")
        # a browser would turn the camera's own
        return picture(services.decoder.frame_from_bytes(jpeg).pixels, "jpg")
    return picture(detect_in_clip(services, id, number, plan, stage)[1](), "jpg")


@clips.get("/clips/{id}/frames/{number}", response_model=schemas.FrameDetections)
@in_thread
def read_clip_detections(services: ServicesDep, id: Id, number: int, plan: PlanName = None) -> Json:
    """Return detections in a frame, as of a live camera, by the camera's plan, colours and calibration of now."""
    return Json(detect_in_clip(services, id, number, plan)[0])


@tracks.get("/{name}/tracks", response_model=Tracks)
async def read_tracks(services: ServicesDep, name: Id) -> Response:
    """Return ball and robots now, fused from all cameras of the rig: positions, speeds, covariance, and the seam in mm.

    Detection runs only while somebody asks: for more than one moment, use the WebSocket of the same name.
    """
    fusion = await track_fusion_of(services, name)
    loop = asyncio.get_running_loop()
    with fusion.listening() as viewer:
        end_s = loop.time() + FOLLOW_S
        text = await _first_tracks(viewer)
        while loop.time() < end_s:
            text = await viewer.next(FIRST_OF_RIG_S)
    return JsonText(text, headers=NO_STORE)


@tracks.websocket("/{name}/tracks")
async def watch_tracks(socket: WebSocket, services: ServicesDep, name: str) -> None:
    """Send the same, twenty times a second."""
    async with websocket_session(socket):
        fusion = await track_fusion_of(services, name)
        await run_until_first(until_disconnect(socket), _send_tracks(socket, fusion))


async def _send_tracks(socket: WebSocket, fusion: TrackFusion) -> None:
    with fusion.listening() as viewer:
        text = await _first_tracks(viewer)
        while True:
            await send_text(socket, text.decode())
            text = await viewer.next()


async def _first_tracks(viewer: Any) -> bytes:
    try:
        return await viewer.next(FIRST_OF_RIG_S)
    except TimeoutError:
        raise Unavailable(
            say("rig.no-frame-yet", "No camera of this rig has delivered a frame yet."),
            say("rig.check-states", "Check the camera states, then try again."),
            reason="camera-silent",
        ) from None
