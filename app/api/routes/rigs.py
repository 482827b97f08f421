"""/rigs: cameras that share a field: kept, checked against each other, refitted alike, seen as one picture."""

from typing import Annotated, Any, Literal

from fastapi import APIRouter, Header, Query, Request
from starlette.responses import Response

from app.api.answers import Json
from app.api.middleware.problems import problem, problem_of, stale_problem
from app.api.operator import operator
from app.api.routes.jobs import accepted, result_of
from app.api.schemas import rigs as schemas
from app.api.schemas.requests import AsJob, Id
from app.api.schemas.responses import Job
from app.api.work import at_length, at_work
from app.core.errors import BadInput, Conflict, Stale
from app.images import ENCODED_MEDIA_TYPES, encode
from app.services import rigs
from app.store import Document
from app.workflows.rig import refuse_other_sizes, run_check, run_refit

router = APIRouter(prefix="/rigs", tags=["rigs"])

ACCEPTED: dict[int | str, dict[str, Any]] = {202: {"model": Job, "description": "a job: ?job=true"}}
BYTES = {"schema": {"type": "string", "format": "binary"}}
IfMatch = Annotated[str | None, Header(max_length=200)]
Width = Annotated[int, Query(ge=64, le=8192, description="of the picture, px")]
Shown = Annotated[list[str], Query(max_length=32, description="CAMERA:SNAPSHOT, or the id of a snapshot that one of "
                                                              "its cameras took; newest frames when left out")]


@router.get("", response_model=schemas.Rigs)
async def list_rigs(request: Request) -> Json:
    """Every rig, as they were made, with how each camera stands to it."""
    store = request.app.state.store
    return Json({"items": await at_work(request, lambda: [rigs.described(request, rig) for rig in store.rigs.all()]),
                 "next_cursor": None})


@router.get("/{name}", response_model=schemas.Rig)
async def read_rig(request: Request, name: Id) -> Json:
    """One rig; its ETag goes into the next PUT's If-Match."""
    return await at_work(request, lambda: _answer(request, request.app.state.store.rigs.get(name)))


@router.put("/{name}", response_model=schemas.Rig, responses={201: {"model": schemas.Rig}})
async def save_rig(request: Request, name: Id, body: schemas.RigBody, if_match: IfMatch = None) -> Response:
    """Make it (201), or save over the one that If-Match names: 428 without, 412 with `current` if that is old."""
    try:
        return await at_work(request, _saved, request, name, body, if_match)
    except Stale as error:
        return stale_problem(error)
    except Conflict as error:
        if error.reason != "rig-exists":
            raise
        return problem(428, "if-match-needed", "If-Match needed", "There is such a rig already, and the request does "
                       "not say which state of it it was made from.", "Send the ETag of GET as If-Match.")


def _saved(request: Request, name: str, body: schemas.RigBody, if_match: str | None) -> Json:
    store, kept = request.app.state.store, rigs.body_of(request, body)
    etag = None if if_match is None else _bare(if_match)
    return _answer(request, store.rigs.save(name, kept, etag, operator(request)), 201 if etag is None else 200)


@router.delete("/{name}", status_code=204)
async def remove_rig(request: Request, name: Id, if_match: IfMatch = None) -> Response:
    """Forget it: its cameras and their calibrations stay. With If-Match only if nobody has changed it since."""
    try:
        await at_work(request, request.app.state.store.rigs.delete, name, _bare(if_match) if if_match else None)
    except Stale as error:
        return problem_of(error)
    return Response(status_code=204)


@router.get("/{name}/stitched.json", response_model=schemas.Stitched)
async def describe_stitched(request: Request, name: Id, width: Width = 1200) -> Json:
    """What the picture of that width shows: the field's lines in its pixels, each camera's share, what nobody sees."""
    rig = rigs.whole(request, request.app.state.store.rigs.get(name))

    def told() -> dict[str, Any]:
        made, names = rigs.stitcher(request, rig, [c["camera"] for c in rig["cameras"]], width)
        size = made.view.size
        return {"width": size.width, "height": size.height, "px_per_mm": made.view.px_per_mm, "corner":
                made.view.field_from_view_corner(), "overlay": made.view.overlay(), "unseen": made.unseen_summary(),
                "cameras": [{"camera": n, "share": s} for n, s in zip(names, made.shown_share, strict=True)]}
    return Json(await at_work(request, told))


@router.get("/{name}/stitched.{format}", response_class=Response,
            responses={200: {"content": {"image/jpeg": BYTES, "image/png": BYTES}}})
async def show_stitched(request: Request, name: Id, format: Literal["jpg", "png"], snapshot: Shown = [],  # noqa: B006
                        width: Width = 1200) -> Response:
    """The whole field corrected in one picture, seams feathered; hatched where no camera sees.

    X-Unseen-Share says how much of the field that is; X-Rig-Missing names cameras without a picture or calibration.
    """
    state = request.app.state
    kept = state.store.rigs.get(name)
    rig = rigs.whole(request, kept)
    ready = [c["camera"] for c in rig["cameras"] if c["calibration"] is not None]
    given = rigs.snapshots_given(request, kept, snapshot)
    pngs = {} if given else (await rigs.live_pictures(request, ready))[0]

    def drawn() -> Response:
        frames = {camera: state.frames[id] for camera, id in given.items() if camera in ready}
        frames |= {camera: state.decoder.frame_from_bytes(png) for camera, png in pngs.items()}
        refuse_other_sizes(rig, {camera: frame.pixels for camera, frame in frames.items()})
        made, names = rigs.stitcher(request, rig, frames, width)
        picture = made.stitch([frames[camera].pixels for camera in names])
        missing = [c["camera"] for c in rig["cameras"] if c["camera"] not in names]
        return Response(encode(picture, format), media_type=ENCODED_MEDIA_TYPES[format], headers={
            "X-Unseen-Share": f"{made.unseen_summary()['share']:.4f}", "X-Rig-Missing": ",".join(missing),
            "Cache-Control": "no-store"})
    return await at_work(request, drawn)


@router.post("/{name}/check", response_model=schemas.RigChecked, responses=ACCEPTED)
async def check_rig(request: Request, name: Id, body: schemas.RigCheck, job: AsJob = False) -> Response:
    """How far its cameras are apart where two see the same carpet: mm map, worst place, mean, p95, max, there and at
    hat height; the fundamental matrix of each pair; and what to do, in plain words.

    By matches where they are given, else by the field's lines in pictures, else by the calibrations' own clicks.
    """
    store = request.app.state.store
    kept = store.rigs.get(name)
    names = [c["camera"] for c in kept.body["cameras"]]
    if unknown := set(body.snapshots) - set(names):
        raise BadInput(f"The rig has no camera called {sorted(unknown)[0]!r}.", f"Use {', '.join(names)}.",
                       reason="unknown-camera")
    pictures = {camera: rigs.picture_of(request, id) for camera, id in body.snapshots.items()}
    missing: list[dict[str, Any]] = []
    if body.pictures == "live":
        wanted = [n for n in names if n not in pictures and store.calibrations.active(n) is not None]
        pngs, missing = await rigs.live_pictures(request, wanted)
        pictures |= await rigs.kept_pictures(request, pngs)
    rig = await at_work(request, rigs.whole, request, kept, pictures)
    spec = {"rig": rig, "missing": missing, "matches": [one.model_dump() for one in body.matches]}
    if job:
        return accepted(await at_work(request, request.app.state.jobs.start, "rig-check", run_check, spec))
    return result_of(await at_length(request, "rig-check", run_check, spec))


@router.post("/{name}/refit", status_code=202, response_model=Job)
async def refit_rig(request: Request, name: Id, body: schemas.RigRefit) -> Response:
    """A job that refits cameras from their own clicks with the rig's rectangles, as new versions of which none is
    activated: {"calibrations": [id, …]}."""
    kept = request.app.state.store.rigs.get(name)
    rig = await at_work(request, rigs.whole, request, kept)
    told = await at_work(request, rigs.described, request, kept)
    others = [c["camera"] for c in told["cameras"] if any(t["reason"] == "other-rectangles" for t in c["troubles"])]
    chosen = others if body.cameras is None else body.cameras
    calibrations = [c["calibration"] for c in rig["cameras"] if c["camera"] in chosen and c["calibration"] is not None]
    if not calibrations:
        raise Conflict("There is nothing to refit: every calibrated camera has the rig's rectangles."
                       if body.cameras is None else "None of these cameras has an active calibration.",
                       "Name cameras that are calibrated.", reason="nothing-to-refit")
    spec = {"calibrations": calibrations, "rectangles": told["rectangles"]}
    return accepted(await at_work(request, request.app.state.jobs.start, "rig-refit", run_refit, spec,
                                  "calibrations", {"by": operator(request)}))


def _answer(request: Request, kept: Document, status: int = 200) -> Json:
    headers = {"ETag": f'"{kept.etag}"', "Cache-Control": "no-store"}
    if status == 201:
        headers["Location"] = f"/api/v1/rigs/{kept.name}"
    return Json(rigs.described(request, kept), status, headers=headers)


def _bare(etag: str) -> str:
    return etag.strip().removeprefix("W/").strip('"')
