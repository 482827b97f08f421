"""POST /cameras/{id}/reregister: a knocked camera's pose anew, its lens kept; a version that nobody has activated."""

from typing import Annotated, Any

from fastapi import APIRouter, Request
from pydantic import Field

from app.api.answers import Json
from app.api.operator import operator
from app.api.routes.jobs import accepted
from app.api.routes.snapshots import take_snapshot
from app.api.schemas import responses
from app.api.schemas.requests import CameraSnapshot, Id, Name, Strict
from app.api.work import at_work
from app.core.errors import Conflict
from app.services.cameras import CameraShelf
from app.workflows.reregister import run_register

router = APIRouter(prefix="/cameras", tags=["cameras"])

FRAMES = 13  # over four seconds: who walks by has left most of them


class Reregister(Strict):
    """Nothing has to be said: pictures are taken with the camera now."""

    snapshot: Name | None = Field(None, description="of this camera, in place of pictures that are taken now")
    frames: Annotated[int, Field(ge=1, le=25)] = Field(FRAMES, description="taken now; what moves vanishes")
    note: Annotated[str, Field(max_length=2000)] = "Pose registered anew"


@router.post("/{id}/reregister", status_code=202, response_model=responses.Job)
async def reregister_camera(request: Request, id: Id, body: Reregister | None = None) -> Json:
    """A job: the active calibration's lens, and the pose that the field's lines say now, as its new child.

    Its result has the version's id as `calibration`, what moved, and a `sentence`. Nothing is activated.
    """
    body = body or Reregister()
    shelf: CameraShelf = request.app.state.camera_shelf
    calibration, _ = await at_work(request, lambda: (shelf.get(id), shelf.kept(id))[1])
    if calibration is None:
        raise Conflict("This camera has no active calibration.", "Calibrate it, and activate that version.",
                       reason="not-calibrated")
    taken = body.snapshot or (await take_snapshot(request, CameraSnapshot(camera=id, frames=body.frames))).id

    def start() -> Any:
        state = request.app.state
        snapshot = state.store.snapshots.get(taken)
        picture = {"name": "the picture", "path": str(state.store.snapshots.path(snapshot)),
                   "sha256": snapshot.sha256}
        spec = {"calibration": calibration.to_json(), "snapshot": snapshot.id, "note": body.note, "picture": picture,
                "before": shelf.picture(calibration)}
        return state.jobs.start("register", run_register, spec, "registered", {"by": operator(request)})
    return accepted(await at_work(request, start))
