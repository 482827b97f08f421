"""/clips: seconds of a camera's picture that are kept, to be stepped through: each frame, each stage, what was seen."""

import time
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request
from pydantic import Field
from starlette.responses import Response

from app.api.answers import Json, picture
from app.api.routes.streams import BYTES, first_picture, live_camera
from app.api.schemas.live_detection import Seen as SeenAnswer
from app.api.schemas.requests import Id, Name, Strict
from app.api.schemas.responses.base import Answer
from app.api.work import at_work
from app.core.colour_profile import ColourProfile
from app.core.errors import NotFound
from app.live.detector import detection_json
from app.live.stream_spec import DETECTIONS
from app.store.stages import named_plan
from app.vision.stage_pipeline import FrameResult, StageConfig, StagePipeline
from app.vision.stages.localisation import FieldLocator
from app.workflows.detection import colour_profile_for, detections_image, pipeline_for

router = APIRouter(tags=["clips"])

MOST_S = 30.0
START_S = 20.0
RAW = "raw"
Number = Annotated[int, Field(ge=0, le=100_000)]
Stage = Annotated[str, Query(max_length=64, description="raw, detections, or the name of a stage")]
PlanName = Annotated[Name | None, Query(description="in place of the camera's own")]


class Record(Strict):
    seconds: Annotated[float, Field(ge=1, le=MOST_S)] = 5.0


class ClipTold(Answer):
    clip: str
    camera: str
    frames: int
    seconds: float


class ClipList(Answer):
    items: list[ClipTold]
    next_cursor: str | None


@router.post("/cameras/{id}/clip", status_code=201, response_model=ClipTold)
async def record_clip(request: Request, id: Id, body: Record | None = None) -> Json:
    """Keep the last seconds, if somebody has been looking at a stage's picture for so long; else the next ones.

    Ten pictures a second; some 120 MB at most, so that large pictures make shorter clips.
    """
    seconds = (body or Record()).seconds
    camera = await live_camera(request, id)
    head, jpegs = await first_picture(camera, lambda _timeout_s: camera.clip(seconds), START_S)
    clip = await at_work(request, request.app.state.store.clips.add, id, head, jpegs)
    return Json(clip.to_json(), 201, headers={"Location": f"/api/v1/clips/{clip.id}"})


@router.get("/clips", response_model=ClipList)
def list_clips(request: Request) -> Json:
    """Newest first."""
    return Json({"items": [clip.to_json() for clip in request.app.state.store.clips.all()], "next_cursor": None})


@router.get("/clips/{id}", response_model=ClipTold)
def read_clip(request: Request, id: Id) -> Json:
    """One clip, with when each of its frames was taken."""
    clip = request.app.state.store.clips.get(id)
    return Json({**clip.to_json(), "times_s": [frame["time_s"] for frame in clip.frames]})


@router.delete("/clips/{id}", status_code=204)
def delete_clip(request: Request, id: Id) -> Response:
    """Forget it."""
    request.app.state.store.clips.delete(id)
    return Response(status_code=204)


@router.get("/clips/{id}/frames/{number}.jpg", response_class=Response,
            responses={200: {"content": {"image/jpeg": BYTES}}})
async def show_frame_of_clip(request: Request, id: Id, number: int, stage: Stage = RAW,
                             plan: PlanName = None) -> Response:
    """A frame, counted from 0: as it was, with what was found marked, or what a stage made of it."""
    def show() -> Response:
        if stage == RAW:
            return Response(request.app.state.store.clips.frame(id, number), media_type="image/jpeg")
        pixels, seen, _, view, _ = _seen(request, id, number, plan, stage)
        made: Any = seen.pictures.get(stage) if stage != DETECTIONS else detections_image(pixels, seen.detections, view)
        return picture(made, "jpg")
    return await at_work(request, show)


@router.get("/clips/{id}/frames/{number}", response_model=SeenAnswer)
async def detections_of_clip(request: Request, id: Id, number: int, plan: PlanName = None) -> Json:
    """What a frame shows, as a live camera tells it: by the camera's plan, colours and calibration as they are now."""
    return Json(await at_work(request, lambda: _seen(request, id, number, plan)[4]))


def _seen(request: Request, id: str, number: int, plan_name: str | None,
          stage: str = DETECTIONS) -> tuple[Any, FrameResult, StagePipeline, FieldLocator, dict[str, Any]]:
    """Each frame for itself: what the stages remember must not depend on which frames were asked for before."""
    state = request.app.state
    clip = state.store.clips.get(id)
    jpeg = state.store.clips.frame(id, number)
    wanted = state.seeing.still(clip.camera)
    plan = named_plan(plan_name) if plan_name is not None else StageConfig.from_json(wanted["plan"])
    if stage != DETECTIONS and stage not in [name for name, _ in plan.stages]:
        raise NotFound(f"The plan {plan.name} has no stage called {stage!r}.", f"Use one of: {RAW}, {DETECTIONS}, "
                       f"{', '.join(name for name, _ in plan.stages)}.", reason="unknown-stage")
    frame = state.decoder.frame_from_bytes(jpeg)
    calibration = state.store.calibrations.active(clip.camera)
    calibration = calibration if calibration is not None and calibration.image_size == frame.size else None
    profile = (ColourProfile.from_json(wanted["profile"]) if wanted["profile"] is not None
               else colour_profile_for(frame.pixels, plan))
    diagonal_px = (frame.size.width**2 + frame.size.height**2) ** 0.5
    scale = None if calibration else wanted["extent_mm"] / diagonal_px
    sight = pipeline_for(plan, frame.size, profile, calibration, scale)
    about = clip.frames[number]
    seen = sight.process(frame.pixels, clock=time.thread_time, pictures=() if stage == DETECTIONS else (stage,),
                         camera=clip.camera, frame=about["seq"], time_s=about["time_s"])
    told = detection_json(seen, about["seq"], about["time_s"], frame.size, calibration, profile.notes,
                          clip.to_json()["fps"])
    return frame.pixels, seen, sight, sight.context.view, told
