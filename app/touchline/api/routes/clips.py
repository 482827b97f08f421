"""/clips: some seconds of a camera's frames, saved to be stepped through: each frame, each stage, what was detected."""

from typing import Annotated

from fastapi import APIRouter, Query
from pydantic import Field
from starlette.responses import Response

from touchline.api.dependencies import IfMatch, ServicesDep, in_thread
from touchline.api.responses import Json, created, page, picture, versioned
from touchline.api.schemas import responses
from touchline.api.schemas.base import page_of, response
from touchline.api.schemas.media import files
from touchline.api.schemas.requests import Id
from touchline.images import screen
from touchline.services.clips import RAW, detect_in_clip
from touchline.services.forms import Name, Strict
from touchline.services.live import when_awake

router = APIRouter(tags=["clips"])

Clip = response("Clip", clip=str, camera=str, frames=int, seconds=float)
Clips = page_of("Clips", Clip)

MAX_S = 30.0
START_S = 20.0
ANSWER_S = 20.0  # after the seconds that are recorded
Stage = Annotated[str, Query(max_length=64, description="raw, detections, or the name of a stage")]
PlanName = Annotated[Name | None, Query(description="in place of the camera's own")]


class RecordRequest(Strict):
    seconds: Annotated[float, Field(ge=1, le=MAX_S)] = 5.0


@router.post("/cameras/{id}/clip", status_code=201, response_model=Clip)
async def record_clip(services: ServicesDep, id: Id, body: RecordRequest | None = None) -> Json:
    """Save the last seconds, if somebody has watched a stage's picture for so long; else the next ones.

    Ten pictures a second; some 120 MB at most, so that large pictures make shorter clips.
    """
    seconds = (body or RecordRequest()).seconds
    camera = services.live.get(id)
    head, jpegs = await when_awake(camera, lambda _left_s: camera.request("clip", seconds + ANSWER_S, seconds=seconds),
                                   START_S)
    clip = await services.run_in_thread(services.store.clips.add, id, head, jpegs)
    return created(clip.to_json(), f"clips/{clip.id}")


@router.get("/clips", response_model=Clips)
def list_clips(services: ServicesDep) -> Json:
    """List clips, newest first."""
    return page(clip.to_json() for clip in services.store.clips.all())


@router.get("/clips/{id}", response_model=Clip)
def read_clip(services: ServicesDep, id: Id) -> Json:
    """Return one clip, with the times of its frames; its ETag goes into If-Match of DELETE."""
    clip = services.store.clips.get(id)
    return versioned({**clip.to_json(), "times_s": [frame["time_s"] for frame in clip.frames]}, clip.etag)


@router.delete("/clips/{id}", status_code=204, response_class=Response)
def delete_clip(services: ServicesDep, id: Id, if_match: IfMatch = None) -> None:
    """Delete a clip. With If-Match only that very one."""
    services.store.clips.delete(id, if_match)


@router.get("/clips/{id}/frames/{number}.jpg", response_class=Response, responses=files("image/jpeg"))
@in_thread
def read_clip_image(services: ServicesDep, id: Id, number: int, stage: Stage = RAW,
                    plan: PlanName = None) -> Response:
    """Return a frame, counted from 0: as it was, with detections drawn, or the image of a stage."""
    if stage == RAW:
        jpeg = services.store.clips.frame(id, number)
        if screen(jpeg, services.decoder.limits).is_plain:
            return Response(jpeg, media_type="image/jpeg")
        return picture(services.decoder.frame_from_bytes(jpeg).pixels, "jpg")  # a browser would turn the camera's own
    return picture(detect_in_clip(services, id, number, plan, stage)[1](), "jpg")


@router.get("/clips/{id}/frames/{number}", response_model=responses.FrameDetections)
@in_thread
def read_clip_detections(services: ServicesDep, id: Id, number: int, plan: PlanName = None) -> Json:
    """Return detections in a frame, as of a live camera, by the camera's plan, colours and calibration of now."""
    return Json(detect_in_clip(services, id, number, plan)[0])
