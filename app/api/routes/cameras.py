"""/cameras: those that the settings name and those that operators added; how each is, and what can be set on it."""

import asyncio
import base64
from typing import Annotated, Any

from fastapi import APIRouter, Header, Request
from starlette.responses import Response

from app.api.answers import Json
from app.api.middleware.problems import problem, problem_of
from app.api.operator import operator
from app.api.routes.streams import live_camera
from app.api.schemas import requests, responses
from app.api.schemas.requests import Id
from app.api.work import at_work
from app.core.errors import Busy, Conflict, Stale
from app.images import encode
from app.services.cameras import CameraShelf, tried
from app.settings import CameraSettings
from app.sources import SOURCES, without_password
from app.sources.discover import discover_cameras

router = APIRouter(prefix="/cameras", tags=["cameras"])

TESTS = asyncio.Semaphore(2)  # cameras that are tried out at once
LOOKS = asyncio.Semaphore(1)  # each starts some processes
IfMatch = Annotated[str | None, Header(max_length=200)]


@router.get("", response_model=responses.Cameras)
def list_cameras(request: Request) -> Json:
    """Every camera: what it is called, and the field and region that it looks at."""
    items = [_described(request, camera) for camera in _shelf(request).all()]
    return Json({"items": items, "next_cursor": None})


@router.post("", status_code=201, response_model=responses.Camera)
async def add_camera(request: Request, body: requests.NewCamera) -> Json:
    """Add a camera. Its address is checked, not whether it answers: try that with POST /cameras/test."""
    camera = await at_work(request, _added, request, body)
    return Json(_described(request, camera), 201, headers={"Location": f"/api/v1/cameras/{camera.id}"})


def _added(request: Request, body: requests.NewCamera) -> CameraSettings:
    camera = CameraSettings(**body.model_dump())
    _refuse_nonsense(request, camera)
    return _shelf(request).add(camera, operator(request))


@router.post("/test", response_model=responses.CameraTest)
async def test_camera(request: Request, body: requests.CameraTest) -> Json:
    """Open a source in a process of its own and take one picture: what was seen, or why not. Nothing is kept."""
    if TESTS.locked():
        raise Busy("Two cameras are being tried out already.", "Wait some seconds.", reason="too-many-tests")
    async with TESTS:
        status, png = await tried(_shelf(request), body.source)
    frame = await at_work(request, request.app.state.decoder.frame_from_bytes, png)
    jpeg = await at_work(request, lambda: encode(frame.pixels, "jpg", 85))
    return Json({"width": frame.size.width, "height": frame.size.height, "fps": status["fps"],
                 "identity": status["identity"],
                 "picture": f"data:image/jpeg;base64,{base64.b64encode(jpeg).decode()}"})


@router.get("/found", response_model=responses.FoundCameras)
async def find_cameras(request: Request) -> Json:
    """What is plugged in, with the address of each, as far as this machine can tell; takes up to five seconds."""
    if LOOKS.locked():
        raise Busy("Cameras are being looked for already.", "Wait some seconds.", reason="already-looking")
    async with LOOKS:
        return Json({"items": await at_work(request, discover_cameras, _shelf(request).surroundings())})


@router.get("/sources", response_model=responses.Sources)
def list_sources() -> Json:
    """The kinds of source there are, with the options of their addresses."""
    return Json({"items": [_source(name) for name in SOURCES]})


@router.get("/{id}", response_model=responses.Camera)
def read_camera(request: Request, id: Id) -> Json:
    """One camera. The ETag of one that was added goes into If-Match of PATCH and DELETE."""
    etag = _shelf(request).etag(id)
    return Json(_described(request, _shelf(request).get(id)), headers={"ETag": f'"{etag}"'} if etag else None)


@router.patch("/{id}", response_model=responses.Camera)
async def change_camera(request: Request, id: Id, body: requests.CameraChanges, if_match: IfMatch = None) -> Response:
    """Change a camera that was added; what is left out stays. Its process starts anew where its source changed."""
    if if_match is None:
        return problem(428, "if-match-needed", "If-Match needed", "The request does not say which definition it was "
                       "made from.", "Send the ETag of GET as If-Match.")
    try:
        camera = await at_work(request, _changed, request, id, body, _bare(if_match))
    except Stale as error:
        return problem_of(error)
    if body.source is not None:
        await request.app.state.live.forget(id)
    etag = _shelf(request).etag(id)
    return Json(_described(request, camera), headers={"ETag": f'"{etag}"'})


def _changed(request: Request, id: str, body: requests.CameraChanges, etag: str) -> CameraSettings:
    shelf = _shelf(request)
    changes = {name: value for name, value in body.model_dump(exclude_unset=True).items() if name != "source" or value}
    _refuse_nonsense(request, shelf.get(id).model_copy(update=changes))
    return shelf.change(id, changes, etag, operator(request))


@router.delete("/{id}", status_code=204)
async def remove_camera(request: Request, id: Id, if_match: IfMatch = None) -> Response:
    """Remove a camera that was added. Its pictures and calibrations stay."""
    await at_work(request, _shelf(request).remove, id, _bare(if_match) if if_match else None)
    await request.app.state.live.forget(id)
    return Response(status_code=204)


@router.get("/{id}/status", response_model=responses.CameraStatus)
async def camera_status(request: Request, id: Id) -> Json:
    """How it is now, what is wrong and what to do; the first question wakes it."""
    return Json((await live_camera(request, id)).status())


@router.get("/{id}/controls", response_model=responses.Controls)
async def camera_controls(request: Request, id: Id) -> Json:
    """What can be set on it, read back from it now."""
    return Json({"items": await (await live_camera(request, id)).controls()})


@router.patch("/{id}/controls", response_model=responses.Controls)
async def set_controls(request: Request, id: Id, body: requests.ControlChanges) -> Json:
    """Set some, in the order given; the answer is what the camera says they are afterwards."""
    camera = await live_camera(request, id)
    return Json({"items": [await camera.set_control(name, value) for name, value in body.controls.items()]})


@router.post("/{id}/confirm", response_model=responses.CameraStatus)
async def confirm_camera(request: Request, id: Id) -> Json:
    """This is the camera that was calibrated, although it looks like another: its calibration is applied again."""
    camera = await live_camera(request, id)
    if camera.identity is None:
        raise Conflict("The camera has not been seen yet.", "Wait until it is live, then confirm it.",
                       reason="camera-silent")
    if camera.calibration is None:
        raise Conflict("This camera has no active calibration.", "There is nothing to confirm.",
                       reason="not-calibrated")
    await at_work(request, _shelf(request).confirm, camera.calibration, camera.identity,
                  operator(request))
    request.app.state.live.refresh(id)
    return Json(camera.status())


def _shelf(request: Request) -> CameraShelf:
    return request.app.state.camera_shelf


def _described(request: Request, camera: CameraSettings) -> dict[str, Any]:
    """Passwords in the source's address stay here."""
    active = request.app.state.store.calibrations.active(camera.id)
    ours = any(named.id == camera.id for named in request.app.state.settings.cameras)
    return {"id": camera.id, "name": camera.title, "field": camera.field, "region": camera.region,
            "source": without_password(camera.source), "editable": not ours,
            "active_calibration": active.id if active else None, **_shelf(request).told(camera.id)}


def _refuse_nonsense(request: Request, camera: CameraSettings) -> None:
    """What can be known without opening it: the address' form, its kind and options, the field and the region."""
    _shelf(request).check_address(camera.source)
    if camera.field is not None:
        field = request.app.state.fields[camera.field]
        if camera.region is not None:
            field.region(camera.region)


def _bare(etag: str) -> str:
    return etag.strip().removeprefix("W/").strip('"')


def _source(name: str) -> dict[str, Any]:
    kind = SOURCES[name]
    return {"scheme": name, "title": kind.TITLE, "help": kind.HELP, "target": kind.TARGET,
            "options": [option.to_json() for option in kind.OPTIONS]}
