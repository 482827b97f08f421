"""/rigs: cameras that share a field: saved, checked, refitted alike, shown as one picture.

/pairs: two calibrations as a rig of two, and the geometry of matched points.
"""

from functools import partial
from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request
from pydantic import Field
from starlette.responses import Response

from touchline.api import schemas
from touchline.api.dependencies import (
    CallerDep,
    IfMatch,
    IfMatchNeeded,
    OperatorDep,
    ServicesDep,
    in_thread,
)
from touchline.api.requests import AsJob, CameraId, Id
from touchline.api.responses import (
    NO_STORE,
    Json,
    accepted,
    finished_or_queued,
    page,
    picture,
    versioned,
)
from touchline.api.schemas import PICTURE, page_of
from touchline.core.errors import BadInput, Conflict
from touchline.core.geometry import ImageSize
from touchline.core.jobs import Progress
from touchline.core.statements import say
from touchline.rigs import service
from touchline.rigs.check import (
    PairLines,
    PairReport,
    RigReport,
    lines_by_calibrations,
    lines_by_matrix,
    run_check,
    run_pair,
)
from touchline.rigs.mosaic import StitchedView
from touchline.rigs.rig import MAX_CAMERAS, refuse_other_sizes
from touchline.rigs.service import RigJson, RigState
from touchline.rigs.verdict import RigTrouble
from touchline.services.container import Services
from touchline.services.forms import HeightForm, Name, Number, Pair, Rotate, Size, Strict
from touchline.workflows.calibration_request import run_refit

router = APIRouter(prefix="/rigs", tags=["rigs"])
pairs = APIRouter(prefix="/pairs", tags=["judging"])

Rigs = page_of("Rigs", RigJson)

MAX_MATCHES = 5000
Width = Annotated[int, Query(ge=64, le=8192, description="of the image, px")]
SnapshotNames = Annotated[
    list[str],
    Query(
        max_length=32,
        description="CAMERA:SNAPSHOT, or the id of a snapshot that one of its cameras took; by default the "
        "newest frames",
    ),
]


class RigCamera(Strict):
    """One of the cameras, and the part of the field that it shows first."""

    camera: CameraId
    region: CameraId | None = Field(
        None, description="by default the region of its active calibration"
    )
    rotate: Rotate | None = None


class RigBody(Strict):
    """A rig to save. Either all four of the rectangles or none: then those that most cameras have are the rig's."""

    title: Annotated[str, Field(max_length=100)] = ""
    field: Name
    cameras: Annotated[list[RigCamera | CameraId], Field(min_length=1, max_length=MAX_CAMERAS)]
    w_max_rectangle_px: Number | None = None
    h_max_rectangle_px: Number | None = None
    n_rectangles_x: int | None = None
    n_rectangles_y: int | None = None


class RigMatches(Strict):
    """The same points in two of its cameras."""

    a: CameraId
    b: CameraId
    points_a: Annotated[list[Pair | None], Field(min_length=1, max_length=MAX_MATCHES)]
    points_b: Annotated[list[Pair | None], Field(min_length=1, max_length=MAX_MATCHES)]
    z_mm: HeightForm | Annotated[list[HeightForm | None], Field(max_length=MAX_MATCHES)] = 0.0


class RigCheck(Strict):
    """What a rig is checked by."""

    snapshots: Annotated[dict[CameraId, Name], Field(max_length=MAX_CAMERAS)] = Field(
        {}, description="a saved image by the camera that took it"
    )
    pictures: Literal["live", "none"] = Field(
        "live",
        description="live: take one now from each camera without a snapshot; none: go by snapshots alone",
    )
    matches: Annotated[list[RigMatches], Field(max_length=120)] = Field(
        [], description="of some of its pairs"
    )


class RigRefit(Strict):
    """Which of its cameras to refit."""

    cameras: Annotated[list[CameraId], Field(min_length=1, max_length=MAX_CAMERAS)] | None = Field(
        None, description="by default all whose rectangles differ from those of the rig"
    )


class PairRequest(Strict):
    """The same points in two images, two calibrations over one field, or both."""

    points_a: Annotated[list[Pair | None], Field(max_length=20_000)] | None = Field(
        None,
        description="[x, y] px in image a; null for a point that is not marked yet and only counts",
    )
    points_b: Annotated[list[Pair | None], Field(max_length=20_000)] | None = Field(
        None, description="[x, y] px in image b; null: not marked yet"
    )
    calibration_a: Name | None = None
    calibration_b: Name | None = None
    z_mm: HeightForm | Annotated[list[HeightForm | None], Field(max_length=20_000)] = Field(
        0.0,
        description="height of the matched points, mm: of all, or of each, null where it is unknown",
    )


class PairLinesRequest(Strict):
    """Points in the images of a pair, for their epipolar lines: by a matrix, or by two calibrations."""

    points_a: Annotated[list[Pair], Field(max_length=200)] = Field(
        [], description="[x, y] px in image a"
    )
    points_b: Annotated[list[Pair], Field(max_length=200)] = Field(
        [], description="[x, y] px in image b"
    )
    matrix: (
        Annotated[
            list[Annotated[list[Number], Field(min_length=3, max_length=3)]],
            Field(min_length=3, max_length=3),
        ]
        | None
    ) = Field(None, description="the fundamental matrix, 3 × 3, as POST /pairs has it")
    image_size_a: Size | None = Field(None, description="[width, height] px, with a matrix")
    image_size_b: Size | None = None
    calibration_a: Name | None = None
    calibration_b: Name | None = None
    z_mm: HeightForm | None = Field(
        0.0, description="height of the points, mm; null where it is unknown"
    )


@router.get("", response_model=Rigs)
@in_thread
def list_rigs(services: ServicesDep) -> Json:
    """List every rig, oldest first, with the state of each camera."""
    return page(service.rig_json(services, rig) for rig in services.store.rigs.all())


@router.get("/{name}", response_model=RigJson)
@in_thread
def read_rig(services: ServicesDep, name: Id) -> Json:
    """Return one rig; its ETag goes into the next PUT's If-Match."""
    rig = services.store.rigs.get(name)
    return versioned(service.rig_json(services, rig), rig.etag)


@router.put("/{name}", response_model=RigJson, responses={201: {"model": RigJson}})
@in_thread
def save_rig(
    services: ServicesDep, by: OperatorDep, name: Id, body: RigBody, if_match: IfMatch = None
) -> Response:
    """Create a rig (201), or replace the one that If-Match names: 428 without, 412 with `current` if that is old."""
    try:
        rig = service.save(services, name, body.model_dump(), if_match, by)
        return versioned(
            service.rig_json(services, rig),
            rig.etag,
            f"rigs/{rig.name}" if if_match is None else None,
        )
    except Conflict as error:
        if error.reason != "rig-exists":
            raise
        raise IfMatchNeeded(
            "This rig already exists, and the request does not state the version that it changes."
        ) from None


@router.delete("/{name}", status_code=204, response_class=Response)
@in_thread
def delete_rig(services: ServicesDep, name: Id, if_match: IfMatch = None) -> None:
    """Delete a rig; its cameras and their calibrations stay. With If-Match only if it is unchanged.

    409 while it is published separately.
    """
    service.delete(services, name, if_match)


@router.get("/{name}/stitched.json", response_model=StitchedView)
async def read_stitched_view(
    request: Request, services: ServicesDep, name: Id, width: Width = 1200
) -> Json:
    """Describe the image of that width: the field lines in its pixels, each camera's share, what no camera covers."""
    return await services.process_picture(
        ImageSize(width, width),
        partial(_describe_stitched, services, name, width),
        request.is_disconnected,
    )


def _describe_stitched(services: Services, name: str, width: int, progress: Progress) -> Json:
    rig = service.rig_of(services, services.store.rigs.get(name))
    stitcher, cameras = service.stitcher_for(services, rig, rig.titles, width, progress)
    return Json(stitcher.description(cameras))


@router.get("/{name}/stitched.{format}", response_class=Response, responses=PICTURE)
async def read_stitched_image(
    request: Request,
    services: ServicesDep,
    name: Id,
    format: Literal["jpg", "png"],
    snapshot: SnapshotNames = [],  # noqa: B006
    width: Width = 1200,
) -> Response:
    """Return the whole field corrected in one image, seams feathered; hatched where no camera covers it.

    X-Unseen-Share says how much of the field that is; X-Rig-Missing names cameras without a picture or calibration.
    """
    saved = services.store.rigs.get(name)
    rig = service.rig_of(services, saved)
    calibrated = [c.camera for c in rig.cameras if c.calibration is not None]
    snapshots = service.snapshots_by_camera(services, saved, snapshot)
    taken = {} if snapshots else (await service.take_frames(services, calibrated))[0]

    def draw(progress: Progress) -> Response:
        frames = {
            camera: services.frame(id) for camera, id in snapshots.items() if camera in calibrated
        }
        frames |= {
            camera: services.decoder.frame_from_bytes(frame.png) for camera, frame in taken.items()
        }
        refuse_other_sizes(rig, {camera: frame.pixels for camera, frame in frames.items()})
        stitcher, cameras = service.stitcher_for(services, rig, frames, width, progress)
        missing = [camera for camera in rig.titles if camera not in cameras]
        return picture(
            stitcher.stitch([frames[camera].pixels for camera in cameras]),
            format,
            {
                "X-Unseen-Share": f"{stitcher.unseen_summary()['share']:.4f}",
                "X-Rig-Missing": ",".join(missing),
                **NO_STORE,
            },
        )

    return await services.process_picture(ImageSize(width, width), draw, request.is_disconnected)


@router.post("/{name}/check", response_model=RigReport, responses=schemas.ACCEPTED)
async def check_rig(
    request: Request, services: ServicesDep, name: Id, body: RigCheck, job: AsJob = False
) -> Response:
    """Compare its cameras where two see the same carpet: mm map, largest, mean, p95, max, there and at
    robot-top height; the fundamental matrix of each pair; and what to do, in plain words.

    By matches and the field's lines in pictures, else by the calibrations' own clicks.
    """
    saved = services.store.rigs.get(name)
    cameras = [c["camera"] for c in saved.body["cameras"]]
    if unknown := set(body.snapshots) - set(cameras):
        raise BadInput(
            f"The rig has no camera called {sorted(unknown)[0]!r}.",
            f"Use {', '.join(cameras)}.",
            reason="unknown-camera",
        )
    pictures = {
        camera: services.store.snapshots.for_job(id) for camera, id in body.snapshots.items()
    }
    missing: list[RigTrouble] = []
    if body.pictures == "live":
        others = [
            c
            for c in cameras
            if c not in pictures and services.store.calibrations.active(c) is not None
        ]
        frames, missing = await service.take_frames(services, others)
        pictures |= await services.run_in_thread(service.save_frames, services, frames)
    rig = await services.run_in_thread(service.rig_of, services, saved, pictures)
    spec = {
        "rig": rig.to_json(),
        "missing": missing,
        "matches": [one.model_dump() for one in body.matches],
    }
    return await finished_or_queued(
        request,
        services,
        "rig-check",
        run_check,
        spec,
        job,
        "rig-check",
        services.part(RigState).checks.context(rig),
    )


@router.post("/{name}/refit", status_code=202, response_model=schemas.Job)
@in_thread
def refit_rig(services: ServicesDep, caller: CallerDep, name: Id, body: RigRefit) -> Response:
    """Start a job that refits cameras to their own points with the rig's rectangles, as new versions of which none is
    activated: {"calibrations": [id, …]}."""
    saved = services.store.rigs.get(name)
    rig, shown = service.rig_of(services, saved), service.rig_json(services, saved)
    others = [
        c["camera"]
        for c in shown["cameras"]
        if any(t["reason"] == "other-rectangles" for t in c["troubles"])
    ]
    chosen = others if body.cameras is None else body.cameras
    calibrations = [
        c.calibration.to_json()
        for c in rig.cameras
        if c.camera in chosen and c.calibration is not None
    ]
    if not calibrations:
        raise Conflict(
            say(
                "rig.all-share-grid",
                "No new versions are needed: all calibrated cameras use the "
                "calibration grid of the rig.",
            )
            if body.cameras is None
            else say("rig.none-active", "None of these cameras has an active calibration."),
            say("rig.select-calibrated", "Select calibrated cameras."),
            reason="nothing-to-refit",
        )
    spec = {"calibrations": calibrations, "rectangles": shown["rectangles"]}
    return accepted(
        services.jobs.start(
            "rig-refit", run_refit, spec, "calibrations", {"by": caller.name}, caller=caller
        )
    )


@pairs.post("", response_model=PairReport)
async def compare_pair(request: Request, services: ServicesDep, body: PairRequest) -> Response:
    """Return the fundamental matrix of matched points, how far they are from it, and the cameras' agreement in mm.

    Each is null where it was not requested; one that cannot be computed is named in `failed`, with what to do.
    """
    a, b = (
        None if id is None else services.store.calibrations.get(id).to_json()
        for id in (body.calibration_a, body.calibration_b)
    )
    spec = {
        "points_a": body.points_a,
        "points_b": body.points_b,
        "calibration_a": a,
        "calibration_b": b,
        "z_mm": body.z_mm,
    }
    return await finished_or_queued(request, services, "pair", run_pair, spec, as_job=False)


@pairs.post("/lines", response_model=PairLines)
@in_thread
def find_epipolar_lines(services: ServicesDep, body: PairLinesRequest) -> Json:
    """Return epipolar lines of points, each in the other image, and the same position there at `z_mm`.

    By a fundamental `matrix` they are straight; by two calibrations they bend as the lenses do, null without rays.
    """
    a, b, size_a, size_b = (
        body.calibration_a,
        body.calibration_b,
        body.image_size_a,
        body.image_size_b,
    )
    if (
        body.matrix is not None
        and size_a is not None
        and size_b is not None
        and a is None
        and b is None
    ):
        return Json(
            lines_by_matrix(
                body.matrix,
                body.points_a,
                body.points_b,
                ImageSize.of(size_a),
                ImageSize.of(size_b),
            )
        )
    if body.matrix is None and a is not None and b is not None:
        get = services.store.calibrations.get
        return Json(lines_by_calibrations(get(a), get(b), body.points_a, body.points_b, body.z_mm))
    raise BadInput(
        "The request has no source for the lines.",
        "Send a matrix and both image sizes, or two calibrations.",
        reason="one-sided",
    )
