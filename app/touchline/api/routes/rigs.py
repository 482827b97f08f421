"""/rigs: cameras that share a field: saved, checked, refitted alike, shown as one picture, and what they track."""

import asyncio
from functools import partial
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Query, Request, WebSocket
from starlette.responses import Response

from touchline.api.dependencies import CallerDep, IfMatch, IfMatchNeeded, OperatorDep, ServicesDep, in_thread
from touchline.api.responses import NO_STORE, Json, JsonText, accepted, finished_or_queued, page, picture, versioned
from touchline.api.schemas import responses
from touchline.api.schemas import rigs as schemas
from touchline.api.schemas.base import JsonObject, page_of, response
from touchline.api.schemas.media import PICTURE
from touchline.api.schemas.requests import AsJob, Id
from touchline.api.sockets import run_until_first, send_text, until_disconnect, websocket_session
from touchline.core.errors import BadInput, Conflict, Unavailable
from touchline.core.geometry import ImageSize
from touchline.core.progress import Progress
from touchline.core.statements import say
from touchline.evaluate.cameras.rig_verdict import RigTrouble
from touchline.imaging.mosaic import StitchedView
from touchline.live.track_fusion import TrackFusion
from touchline.services import rigs
from touchline.services.container import Services
from touchline.services.rig_checks import RigState
from touchline.services.rigs import RigJson
from touchline.workflows.refit import run_refit
from touchline.workflows.rig import refuse_other_sizes, run_check
from touchline.workflows.rig_types import RigReport

router = APIRouter(prefix="/rigs", tags=["rigs"])

Tracks = response("Tracks", time_s=float, items=list[JsonObject], seams=JsonObject, cameras=list[JsonObject])
Rigs = page_of("Rigs", RigJson)

FIRST_S = 20.0  # cameras that were asleep, their stages to be set up, on a busy machine
FOLLOW_S = 0.6  # for a single response, where nobody else follows
Width = Annotated[int, Query(ge=64, le=8192, description="of the image, px")]
SnapshotNames = Annotated[list[str], Query(
    max_length=32, description="CAMERA:SNAPSHOT, or the id of a snapshot that one of its cameras took; by default the "
                               "newest frames")]


@router.get("", response_model=Rigs)
@in_thread
def list_rigs(services: ServicesDep) -> Json:
    """List every rig, oldest first, with the state of each camera."""
    return page(rigs.rig_json(services, rig) for rig in services.store.rigs.all())


@router.get("/{name}", response_model=RigJson)
@in_thread
def read_rig(services: ServicesDep, name: Id) -> Json:
    """Return one rig; its ETag goes into the next PUT's If-Match."""
    rig = services.store.rigs.get(name)
    return versioned(rigs.rig_json(services, rig), rig.etag)


@router.put("/{name}", response_model=RigJson, responses={201: {"model": RigJson}})
@in_thread
def save_rig(services: ServicesDep, by: OperatorDep, name: Id, body: schemas.RigBody,
             if_match: IfMatch = None) -> Response:
    """Create a rig (201), or replace the one that If-Match names: 428 without, 412 with `current` if that is old."""
    try:
        rig = rigs.save(services, name, body.model_dump(), if_match, by)
        return versioned(rigs.rig_json(services, rig), rig.etag, f"rigs/{rig.name}" if if_match is None else None)
    except Conflict as error:
        if error.reason != "rig-exists":
            raise
        raise IfMatchNeeded("This rig already exists, and the request does not state the "
                            "version that it changes.") from None


@router.delete("/{name}", status_code=204, response_class=Response)
@in_thread
def delete_rig(services: ServicesDep, name: Id, if_match: IfMatch = None) -> None:
    """Delete a rig; its cameras and their calibrations stay. With If-Match only if it is unchanged."""
    services.store.rigs.delete(name, if_match)


@router.get("/{name}/stitched.json", response_model=StitchedView)
async def read_stitched_view(request: Request, services: ServicesDep, name: Id, width: Width = 1200) -> Json:
    """Describe the image of that width: the field lines in its pixels, each camera's share, what no camera covers."""
    return await services.process_picture(ImageSize(width, width), partial(_describe_stitched, services, name, width),
                               request.is_disconnected)


def _describe_stitched(services: Services, name: str, width: int, progress: Progress) -> Json:
    rig = rigs.rig_spec(services, services.store.rigs.get(name))
    stitcher, cameras = rigs.stitcher_for(services, rig, [c["camera"] for c in rig["cameras"]], width, progress)
    return Json(stitcher.description(cameras))


@router.get("/{name}/stitched.{format}", response_class=Response, responses=PICTURE)
async def read_stitched_image(request: Request, services: ServicesDep, name: Id, format: Literal["jpg", "png"],
                              snapshot: SnapshotNames = [],  # noqa: B006
                              width: Width = 1200) -> Response:
    """Return the whole field corrected in one image, seams feathered; hatched where no camera covers it.

    X-Unseen-Share says how much of the field that is; X-Rig-Missing names cameras without a picture or calibration.
    """
    saved = services.store.rigs.get(name)
    rig = rigs.rig_spec(services, saved)
    calibrated = [c["camera"] for c in rig["cameras"] if c["calibration"] is not None]
    snapshots = rigs.snapshots_by_camera(services, saved, snapshot)
    taken = {} if snapshots else (await rigs.take_frames(services, calibrated))[0]

    def draw(progress: Progress) -> Response:
        frames = {camera: services.frame(id) for camera, id in snapshots.items() if camera in calibrated}
        frames |= {camera: services.decoder.frame_from_bytes(frame.png) for camera, frame in taken.items()}
        refuse_other_sizes(rig, {camera: frame.pixels for camera, frame in frames.items()})
        stitcher, cameras = rigs.stitcher_for(services, rig, frames, width, progress)
        missing = [c["camera"] for c in rig["cameras"] if c["camera"] not in cameras]
        return picture(stitcher.stitch([frames[camera].pixels for camera in cameras]), format, {
            "X-Unseen-Share": f"{stitcher.unseen_summary()['share']:.4f}", "X-Rig-Missing": ",".join(missing),
            **NO_STORE})
    return await services.process_picture(ImageSize(width, width), draw, request.is_disconnected)


@router.post("/{name}/check", response_model=RigReport, responses=responses.ACCEPTED)
async def check_rig(request: Request, services: ServicesDep, name: Id, body: schemas.RigCheck,
                    job: AsJob = False) -> Response:
    """Compare its cameras where two see the same carpet: mm map, largest, mean, p95, max, there and at
    hat height; the fundamental matrix of each pair; and what to do, in plain words.

    By matches where they are given, else by the field's lines in pictures, else by the calibrations' own clicks.
    """
    saved = services.store.rigs.get(name)
    cameras = [c["camera"] for c in saved.body["cameras"]]
    if unknown := set(body.snapshots) - set(cameras):
        raise BadInput(f"The rig has no camera called {sorted(unknown)[0]!r}.", f"Use {', '.join(cameras)}.",
                       reason="unknown-camera")
    pictures = {camera: services.store.snapshots.for_job(id) for camera, id in body.snapshots.items()}
    missing: list[RigTrouble] = []
    if body.pictures == "live":
        others = [c for c in cameras if c not in pictures and services.store.calibrations.active(c) is not None]
        frames, missing = await rigs.take_frames(services, others)
        pictures |= await services.run_in_thread(rigs.save_frames, services, frames)
    rig = await services.run_in_thread(rigs.rig_spec, services, saved, pictures)
    spec = {"rig": rig, "missing": missing, "matches": [one.model_dump() for one in body.matches]}
    return await finished_or_queued(request, services, "rig-check", run_check, spec, job, "rig-check",
                                    services.part(RigState).checks.context(rig))


@router.post("/{name}/refit", status_code=202, response_model=responses.Job)
@in_thread
def refit_rig(services: ServicesDep, caller: CallerDep, name: Id, body: schemas.RigRefit) -> Response:
    """Start a job that refits cameras to their own points with the rig's rectangles, as new versions of which none is
    activated: {"calibrations": [id, …]}."""
    saved = services.store.rigs.get(name)
    rig, shown = rigs.rig_spec(services, saved), rigs.rig_json(services, saved)
    others = [c["camera"] for c in shown["cameras"] if any(t["reason"] == "other-rectangles" for t in c["troubles"])]
    chosen = others if body.cameras is None else body.cameras
    calibrations = [c["calibration"] for c in rig["cameras"] if c["camera"] in chosen and c["calibration"] is not None]
    if not calibrations:
        raise Conflict(say("rig.all-share-grid", "No new versions are needed: all calibrated cameras use the "
                           "calibration grid of the rig.") if body.cameras is None
                       else say("rig.none-active", "None of these cameras has an active calibration."),
                       say("rig.select-calibrated", "Select calibrated cameras."), reason="nothing-to-refit")
    spec = {"calibrations": calibrations, "rectangles": shown["rectangles"]}
    return accepted(services.jobs.start("rig-refit", run_refit, spec, "calibrations", {"by": caller.name},
                                        caller=caller))


@router.get("/{name}/tracks", response_model=Tracks)
async def read_tracks(services: ServicesDep, name: Id) -> Response:
    """Return ball and robots now, fused from all cameras of the rig: positions, speeds, covariance, and the seam in mm.

    Detection runs only while somebody asks: for more than one moment, use the WebSocket of the same name.
    """
    fusion = await track_fusion_of(services, name)
    loop = asyncio.get_running_loop()
    with fusion.listening() as viewer:
        end_s = loop.time() + FOLLOW_S
        text = await _first(viewer)
        while loop.time() < end_s:
            text = await viewer.next(FIRST_S)
    return JsonText(text, headers=NO_STORE)


@router.websocket("/{name}/tracks")
async def watch_tracks(socket: WebSocket, services: ServicesDep, name: str) -> None:
    """Send the same, twenty times a second."""
    async with websocket_session(socket):
        fusion = await track_fusion_of(services, name)
        await run_until_first(until_disconnect(socket), _send(socket, fusion))


async def track_fusion_of(services: Services, name: str) -> TrackFusion:
    """Return the rig's fusion, shared by all who watch; a new one where its cameras have changed; NotFound."""
    rig = await services.run_in_thread(services.store.rigs.get, name)
    cameras = tuple(camera["camera"] for camera in rig.body["cameras"])
    fusions = services.part(RigState).fusions
    fusion = fusions.get(name)
    if fusion is None or fusion.names != cameras:
        if fusion is not None:
            fusion.end()
        fusion = fusions[name] = TrackFusion(cameras, services.live.get)
    return fusion


async def _send(socket: WebSocket, fusion: TrackFusion) -> None:
    with fusion.listening() as viewer:
        text = await _first(viewer)
        while True:
            await send_text(socket, text.decode())
            text = await viewer.next()


async def _first(viewer: Any) -> bytes:
    try:
        return await viewer.next(FIRST_S)
    except TimeoutError:
        raise Unavailable(say("rig.no-frame-yet", "No camera of this rig has delivered a frame yet."),
                          say("rig.check-states", "Check the camera states, then try again."),
                          reason="camera-silent") from None
