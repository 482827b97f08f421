"""/straightness: how far straight edges bend in images, and an image without that; /lenses/picture, by any lens.

/cameras/{id}/rolls and /motion: a ball that rolls straight measures distortion, and gives a lens.
"""

import asyncio
from typing import Annotated, Literal, Self

from fastapi import APIRouter, Query, Request, WebSocket
from pydantic import Field, model_validator
from starlette.responses import Response

from touchline.api import schemas
from touchline.api.bodies import image_size, pictures_of_one_size
from touchline.api.dependencies import CallerDep, IfMatch, ServicesDep, in_thread
from touchline.api.requests import AsJob, Format, Id, WidthPx
from touchline.api.responses import Json, accepted, finished_or_queued, picture
from touchline.api.schemas import PICTURE, response
from touchline.api.sockets import (
    SessionLimit,
    run_until_first,
    send_json,
    until_disconnect,
    websocket_session,
)
from touchline.core.errors import BadInput
from touchline.core.geometry import MAX_COORDINATE
from touchline.core.json_values import JsonObject
from touchline.core.statements import sentence_in, stated
from touchline.live.camera import LiveCamera
from touchline.models.distortion import Distortion
from touchline.models.intrinsics import Intrinsics
from touchline.services.container import Services
from touchline.services.forms import Coordinate, Name, Note, Number, OptionText, Pair, Size, Strict
from touchline.services.live import FIRST_FRAME_S, take_frame, when_awake
from touchline.straight import service
from touchline.straight.rolling import run_motion
from touchline.straight.rolls import check_times
from touchline.straight.straightness import (
    StraightLinesRequest,
    run_straightness,
    square_grid,
    undistort,
)

router = APIRouter(prefix="/straightness", tags=["lenses"])
lenses = APIRouter(prefix="/lenses", tags=["lenses"])
rolls = APIRouter(tags=["rolls"])

Straightness = response(
    "Straightness",
    says=True,
    lens=JsonObject,
    sigma=dict[str, float],
    straightness_px=dict[str, float],
    bow=JsonObject,
    distortion=Literal["significant", "none", "unknown"],
    sentence=str,
    lines=list[JsonObject],
    lines_used=int,
    objects=int,
    pictures=list[str],
    cannot_see=str,
)
Rolls = response(
    "Rolls",
    items=list[JsonObject],
    report=JsonObject | None,
    deceleration=JsonObject | None,
    etag=str,
)

MAX_ROLLS = 1000  # of one request
MIN_INTERVAL_S = 0.1  # between two messages: ten a second at most
REQUEST_S = 10.0
SESSIONS = SessionLimit(
    4,
    "Another user is recording rolls with this camera.",
    "Wait until the recording ends, or read GET /api/v1/cameras/{id}/rolls.",
    "rolls-watched",
)


class StraightnessRequest(Strict):
    """Images of one camera, lines marked in the first of them (or in none), or both."""

    snapshots: Annotated[list[Name], Field(max_length=50)] = Field([])
    lines: Annotated[
        list[Annotated[list[Pair], Field(max_length=20_000)]], Field(max_length=2000)
    ] = Field([], description="[[x, y], …] px along one straight edge each")
    image_size: Size | None = Field(
        None, description="of the image, required if there are only lines"
    )
    lens: Name = Field("auto", description="division, division-even, brown-conrady, or auto")
    centre_sigma_px: Annotated[float, Field(ge=0, le=MAX_COORDINATE)] | None = Field(
        None,
        description="uncertainty of the lens centre around the image centre, px; 0: fixed; by default 1 % of "
        "the diagonal",
    )


class PlumbLensForm(Strict):
    """A lens as `lens` of a response on straightness."""

    name: Name
    terms: Annotated[dict[OptionText, Coordinate], Field(max_length=10)]
    centre_px: Pair
    image_size: Size
    unit: Literal["half-diagonal"] = "half-diagonal"
    unit_px: Number | None = None


class StraightenedRequest(Strict):
    """An image, and the lens whose distortion is removed."""

    snapshot: Name
    lens: PlumbLensForm


@router.post("", response_model=Straightness, responses=schemas.ACCEPTED)
async def measure_straightness(
    request: Request, services: ServicesDep, body: StraightnessRequest, job: AsJob = False
) -> Response:
    """Measure edges of images, or lines marked in one: how far the lens bends them, and what correction leaves.

    Needs no field and no board, and gives no focal length. With ?job=true a job, whose result is the same.
    """
    spec = await services.run_in_thread(_straightness_spec, services, body)
    return await finished_or_queued(request, services, "straightness", run_straightness, spec, job)


def _straightness_spec(services: Services, body: StraightnessRequest) -> JsonObject:
    """Refuse at once what can be, and return what the job takes."""
    size = image_size(body.image_size)
    task = StraightLinesRequest(body.lens, body.centre_sigma_px, tuple(body.lines), size)
    task.check_given(len(body.snapshots))
    pictures = pictures_of_one_size(
        services, body.snapshots, size, "Use images of one camera at one resolution."
    )
    return {"task": task.to_json(), "pictures": pictures}


@router.post("/picture.{format}", response_class=Response, responses=PICTURE)
@in_thread
def straighten_image(
    services: ServicesDep, format: Format, body: StraightenedRequest, width: WidthPx = None
) -> Response:
    """Return a snapshot without distortion, by the `lens` of a response; `straight` of its lines is in its px."""
    lens = Distortion.from_json(body.lens.model_dump())
    return picture(undistort(services.frame(body.snapshot).pixels, lens, width), format)


class LensPictureRequest(Strict):
    """The lens, and at most one of snapshot and camera: without them, a grid of squares is drawn."""

    lens: JsonObject = Field(
        description="with a focal length, as `lens` of GET /lenses/{id} and of a refused import's `lenses`"
    )
    snapshot: Name | None = None
    camera: Name | None = Field(None, description="whose live image is used")


@lenses.post("/picture.{format}", response_class=Response, responses=PICTURE)
async def draw_lens(
    services: ServicesDep, format: Format, body: LensPictureRequest, width: WidthPx = None
) -> Response:
    """Return an image without a lens's distortion; without one, the squares of a plane across the lens's axis, with it.

    The image is a snapshot, or a camera's live image. The lens is scaled to images of the same shape.
    """
    if body.snapshot is not None and body.camera is not None:
        raise BadInput(
            "The request has a snapshot and a camera.", "Send one of them.", reason="bad-request"
        )
    lens = Intrinsics.from_json(body.lens)
    live = body.camera and await take_frame(services.live.get(body.camera), FIRST_FRAME_S)

    def draw() -> Response:
        if live:
            frame = services.decoder.frame_from_bytes(live.png)
        elif body.snapshot is not None:
            frame = services.frame(body.snapshot)
        else:
            return picture(square_grid(lens, width), format)
        return picture(undistort(frame.pixels, lens, width), format)

    return await services.run_in_thread(draw)


class RollChange(Strict):
    left_out: bool


@rolls.get("/cameras/{id}/rolls", response_model=Rolls)
def list_rolls(services: ServicesDep, id: Id) -> Json:
    """List saved rolls, oldest first, and their straightness: Eq. (9) of each, of zones, along the image edge.

    Corrected as well, where the camera's active calibration is of pictures of their size. `etag`, and that of each,
    goes into If-Match of DELETE and PATCH.
    """
    services.cameras.get(id)
    return Json(service.rolls_json(services, id))


@rolls.patch("/cameras/{id}/rolls/{roll}", response_model=Rolls)
def update_roll(
    services: ServicesDep, id: Id, roll: Id, body: RollChange, if_match: IfMatch = None
) -> Json:
    """Leave one out, or take it in again; return the list. With If-Match, its `etag`, only if it is unchanged."""
    service.saved_rolls(services).leave_out(id, roll, body.left_out, if_match)
    return Json(service.rolls_json(services, id))


@rolls.delete("/cameras/{id}/rolls/{roll}", status_code=204, response_class=Response)
def delete_roll(services: ServicesDep, id: Id, roll: Id, if_match: IfMatch = None) -> None:
    """Delete one roll. With If-Match, its `etag`, only if it is unchanged."""
    service.saved_rolls(services).delete(id, roll, if_match)


@rolls.delete("/cameras/{id}/rolls", status_code=204, response_class=Response)
def delete_rolls(services: ServicesDep, id: Id, if_match: IfMatch = None) -> None:
    """Delete all rolls of this camera, as after it was moved. With If-Match, the list's `etag`, only if unchanged."""
    services.cameras.get(id)
    service.saved_rolls(services).clear(id, if_match)


@rolls.websocket("/cameras/{id}/rolls/stream")
async def watch_rolls(
    socket: WebSocket, services: ServicesDep, id: str, keep: Annotated[bool, Query()] = True
) -> None:
    """Send JSON texts, up to ten a second: `tracks` of what moves, ids of `new` rolls, and `told` whenever it changes.

    told is what GET /cameras/{id}/rolls returns. Rolls are followed only while somebody watches; with keep=false
    they are not saved, and `new` has the rolls themselves.
    """
    async with websocket_session(socket):
        with SESSIONS.session(id):
            camera = services.live.get(id)
            await run_until_first(
                until_disconnect(socket), _send_rolls(socket, services, camera, keep)
            )


async def _send_rolls(
    socket: WebSocket, services: Services, camera: LiveCamera, keep: bool
) -> None:
    loop, saved = asyncio.get_running_loop(), service.saved_rolls(services)
    watch, after, seq, sent_state = "", 0, 0, None

    async def follow(_left_s: float) -> JsonObject:
        return (await camera.request("rolls", REQUEST_S, watch=watch, after=after, seq=seq))[0]

    while True:
        start_s = loop.time()
        result = await when_awake(camera, follow)
        new = result["rolls"]
        if result["watch"] != watch:
            watch, after = result["watch"], 0
        after, seq = max([after, *(roll["number"] for roll in new)]), result["seq"]
        if keep and new:
            await services.run_in_thread(
                service.save_rolls, services, camera.id, new, [result["width"], result["height"]]
            )
        state = (saved.revision, camera.calibration.id if camera.calibration else None)
        summary = None
        if state != sent_state:
            summary, sent_state = (
                await services.run_in_thread(service.rolls_json, services, camera.id),
                state,
            )
        await send_json(
            socket,
            stated(
                {
                    **{name: result[name] for name in ("seq", "time", "width", "height", "tracks")},
                    "hint": sentence_in(result, "hint"),
                    "new": [roll["id"] for roll in new] if keep else new,
                    "told": summary,
                }
            ),
        )
        await asyncio.sleep(max(MIN_INTERVAL_S - (loop.time() - start_s), 0.0))


class RollForm(Strict):
    """Where something rolled straight, in order, and for how long."""

    points: Annotated[list[Pair], Field(min_length=5, max_length=2000)] = Field(
        description="[x, y] px, raw"
    )
    seconds: Annotated[Number, Field(gt=0, le=3600)]
    times: Annotated[list[Annotated[Number, Field(ge=0, le=3600)]], Field(max_length=2000)] = Field(
        [],
        description="of each point since the first one, s, increasing; without them no deceleration",
    )

    @model_validator(mode="after")
    def check(self) -> Self:
        check_times(self.times, self.points)
        return self


class MotionRequest(Strict):
    """One of camera, film and rolls; the rest says what is made from them."""

    camera: Name | None = Field(None, description="its saved rolls, without excluded rolls")
    film: Annotated[str, Field(min_length=1, max_length=300)] | None = Field(
        None,
        description="of a fixed camera, by its name in the pictures folder, as for a video source",
    )
    rolls: Annotated[list[RollForm], Field(min_length=1, max_length=MAX_ROLLS)] | None = None
    image_size: Size | None = Field(None, description="of the images, with rolls")
    calibration: Name | None = Field(
        None, description="to judge or to refine; with camera its active one"
    )
    make: Literal["report", "lens", "refined"] = "report"
    lens: Name = Field("auto", description="division, division-even, brown-conrady, or auto")
    centre_sigma_px: Annotated[float, Field(ge=0, le=MAX_COORDINATE)] | None = Field(
        0.0, description="uncertainty of the lens centre around the image centre, px; 0: fixed"
    )
    note: Note = ""


@rolls.post("/motion", status_code=202, response_model=schemas.Job)
@in_thread
def evaluate_rolls(services: ServicesDep, caller: CallerDep, body: MotionRequest) -> Json:
    """Start a job: {"report", "lens": id | null, "calibration": id | null}. No version is activated.

    make "lens": the rolls as plumb lines, kept under /lenses for a fit to hold; "refined": the calibration fitted anew
    to its own clicks and these rolls, a new version.
    """
    spec = service.motion_spec(services, **body.model_dump())
    return accepted(
        services.jobs.start(
            "motion", run_motion, spec, "motion", {"by": caller.name}, caller=caller
        )
    )
