"""/cameras: those of the settings and of operators, their status and controls, and what has happened to them."""

import asyncio
import base64
from typing import Any

from fastapi import APIRouter
from starlette.responses import Response

from touchline.api import requests
from touchline.api.dependencies import IfMatch, IfMatchNeeded, OperatorDep, ServicesDep
from touchline.api.requests import Id, Limit
from touchline.api.responses import Json, created, page
from touchline.api.schemas import JsonObject, Texts, described, list_of, page_of, response
from touchline.core.errors import Busy, Conflict
from touchline.core.sentences import NOT_CALIBRATED
from touchline.core.statements import named, say, stated
from touchline.images import encode
from touchline.live.messages import CameraStatus, ListedCameraStatus
from touchline.services import activity
from touchline.services.activity import newest_events
from touchline.settings import CameraSettings
from touchline.sources import SOURCES
from touchline.sources.discover import discover_cameras
from touchline.store.repository import check_etag

router = APIRouter(prefix="/cameras", tags=["cameras"])

ActiveVersion = response(
    "ActiveVersion",
    id=str,
    version=int,
    model=str,
    created_at=str,
    verdict=JsonObject,
    expected_mm=float | None,
    expected_hat_mm=float | None,
    hat_height_mm=float | None,
    field=str,
    region=str,
    rotate=int,
    field_changes=described(
        list[str], "parts of its field whose position has changed since it was made"
    ),
)
Camera = response(
    "Camera",
    id=str,
    name=str,
    field=str | None,
    region=str | None,
    source=str,
    editable=bool,
    active_calibration=str | None,
    active=ActiveVersion | None,
    updated_at=str | None,
    updated_by=str | None,
)
Cameras = page_of("Cameras", Camera)
CameraTest = response(
    "CameraTest", width=int, height=int, fps=float, identity=Texts | None, picture=str
)
FoundCameras = response("FoundCameras", items=list[JsonObject])
Sources = response("Sources", items=list[JsonObject])
Controls = response("Controls", items=list[JsonObject])
CameraStatuses = response(
    "CameraStatuses",
    items=list[ListedCameraStatus],
    fields=described(str, "a different revision after each change of a field"),
    restored=described(int, "how many backups were restored since the server started"),
)

WAIT_SECONDS = say("advice.wait-seconds", "Wait a few seconds.")
TESTS = asyncio.Semaphore(2)  # cameras that are tried out at once
SEARCHES = asyncio.Semaphore(1)  # each starts some processes


@router.get("", response_model=Cameras)
def list_cameras(services: ServicesDep) -> Json:
    """List every camera with its name and the field and region that it looks at."""
    return page(services.cameras.all_json())


@router.post("", status_code=201, response_model=Camera)
async def create_camera(services: ServicesDep, by: OperatorDep, body: requests.NewCamera) -> Json:
    """Add a camera. Its address is checked, not whether it answers: try that with POST /cameras/test."""
    camera = await services.run_in_thread(
        services.cameras.add, CameraSettings(**body.model_dump()), by
    )
    return created(services.cameras.to_json(camera), f"cameras/{camera.id}")


@router.post("/test", response_model=CameraTest)
async def test_camera(services: ServicesDep, body: requests.CameraTestRequest) -> Json:
    """Open a source in a process of its own and return one image, or the reason why there is none. Nothing is saved."""
    if TESTS.locked():
        raise Busy(
            say("camera.tests-running", "Two camera tests are already running."),
            WAIT_SECONDS,
            reason="too-many-tests",
        )
    async with TESTS:
        status, png = await services.cameras.try_source(body.source)
    frame = await services.run_in_thread(services.decoder.frame_from_bytes, png)
    jpeg = await services.run_in_thread(lambda: encode(frame.pixels, "jpg", 85))
    return Json(
        {
            "width": frame.size.width,
            "height": frame.size.height,
            "fps": status["fps"],
            "identity": status["identity"],
            "picture": f"data:image/jpeg;base64,{base64.b64encode(jpeg).decode()}",
        }
    )


@router.get("/found", response_model=FoundCameras)
async def find_cameras(services: ServicesDep) -> Json:
    """Find connected cameras and their addresses from this machine; takes up to five seconds."""
    if SEARCHES.locked():
        raise Busy(
            say("camera.search-running", "A camera search is already running."),
            WAIT_SECONDS,
            reason="already-looking",
        )
    async with SEARCHES:
        return Json({"items": await services.run_in_thread(discover_cameras)})


@router.get("/sources", response_model=Sources)
def list_camera_sources() -> Json:
    """List the kinds of source, with the options of their addresses."""
    return Json({"items": [_source(name) for name in SOURCES]})


@router.get("/status", response_model=CameraStatuses)
async def list_camera_statuses(services: ServicesDep) -> Json:
    """Return the status of every camera at once and start none: the state of one that does not run is `idle`.

    fields: another revision whenever somebody has changed a field. restored: how many backups were restored since the
    server started: after each, what was read before may be gone.
    """
    # never behind work that fills the services' threads
    cameras = await asyncio.to_thread(services.cameras.all)
    return Json(
        {
            "items": [{"id": camera.id, **services.live.status(camera.id)} for camera in cameras],
            "fields": services.fields.revision,
            "restored": services.store.restored,
        }
    )


@router.get("/{id}", response_model=Camera)
def read_camera(services: ServicesDep, id: Id) -> Json:
    """Return one camera. The ETag of one that was added goes into If-Match of PATCH and DELETE."""
    etag = services.cameras.etag(id)
    return _camera(services, services.cameras.get(id), etag)


@router.patch("/{id}", response_model=Camera)
async def update_camera(
    services: ServicesDep,
    by: OperatorDep,
    id: Id,
    body: requests.CameraChanges,
    if_match: IfMatch = None,
) -> Response:
    """Change a camera that was added; omitted values stay. Its process restarts if its source has changed."""
    if if_match is None:
        raise IfMatchNeeded(
            "The request does not state the version of the definition that it changes."
        )
    changes = {
        name: value
        for name, value in body.model_dump(exclude_unset=True).items()
        if name != "source" or value
    }
    camera = await services.run_in_thread(services.cameras.change, id, changes, if_match, by)
    if body.source is not None:
        await services.live.forget(id)
        services.live.refresh(id)
    return _camera(services, camera, services.cameras.etag(id))


@router.delete("/{id}", status_code=204, response_class=Response)
async def delete_camera(services: ServicesDep, id: Id, if_match: IfMatch = None) -> None:
    """Remove a camera that was added. Its images and calibrations stay."""
    await services.run_in_thread(services.cameras.remove, id, if_match)
    await services.live.forget(id)


@router.get("/{id}/status", response_model=CameraStatus)
async def read_camera_status(services: ServicesDep, id: Id) -> Json:
    """Return the camera's state now, what is wrong and what to do; the first request starts it."""
    return Json(services.live.get(id).status())


@router.get("/{id}/controls", response_model=Controls)
async def list_camera_controls(services: ServicesDep, id: Id) -> Json:
    """List what can be set on the camera, read back from it now."""
    return Json({"items": await services.live.get(id).controls()})


@router.patch("/{id}/controls", response_model=Controls)
async def update_camera_controls(
    services: ServicesDep, id: Id, body: requests.ControlChanges
) -> Json:
    """Set some controls, in the order given; return what the camera reports afterwards."""
    camera = services.live.get(id)
    return Json(
        {"items": [await camera.set_control(name, value) for name, value in body.controls.items()]}
    )


@router.post("/{id}/confirm", response_model=CameraStatus)
async def confirm_camera(
    services: ServicesDep, by: OperatorDep, id: Id, if_match: IfMatch = None
) -> Json:
    """Confirm that this is the calibrated camera, although it looks like another: apply its calibration again.

    With If-Match, the id of the version that you saw as the active one, only if it still is: else 412.
    """
    camera = services.live.get(id)
    if camera.identity is None:
        raise Conflict(
            say("camera.not-live-yet", "The camera has not been live yet."),
            say("camera.confirm-when-live", "Wait until it is live, then confirm it."),
            reason="camera-silent",
        )
    if camera.calibration is None:
        raise Conflict(
            NOT_CALIBRATED,
            say("camera.nothing-to-confirm", "There is no calibration to confirm."),
            reason="not-calibrated",
        )
    check_etag(
        if_match,
        camera.calibration.id,
        say("stale.confirmed", "Another version has become active since you opened this page."),
        "stale-activation",
        {"calibration": camera.calibration.id},
    )
    await services.run_in_thread(services.cameras.confirm, camera.calibration, camera.identity, by)
    services.live.refresh(id)
    return Json(camera.status())


def _camera(services: ServicesDep, camera: CameraSettings, etag: str | None) -> Json:
    return Json(services.cameras.to_json(camera), headers={"ETag": f'"{etag}"'} if etag else None)


def _source(name: str) -> dict[str, Any]:
    kind = SOURCES[name]
    return stated(
        {
            "scheme": name,
            "title": named(f"source.{name}", kind.TITLE),
            "help": named(f"source.{name}.help", kind.HELP),
            "target": kind.TARGET,
            "options": [option.to_json() for option in kind.OPTIONS],
        }
    )


events_router = APIRouter(tags=["cameras"])

Event = response(
    "Event",
    says=True,
    at=str,
    kind=activity.Kind,
    camera=described(str | None, "null: images from files"),
    version=int | None,
    by=str | None,
    despite=list[str],
    text=str,
)
Events = response("Events", items=list_of(Event))


@events_router.get("/events", response_model=Events)
def list_events(services: ServicesDep, limit: Limit = 20) -> Json:
    """List activations, and since the server was started which cameras went offline, came back or moved; newest first.

    Each has one plain sentence as `text`.
    """
    return Json(
        {"items": newest_events(services.events.noted, services.store, services.cameras, limit)}
    )
