"""POST /calibrations/auto: the field's lines found in a picture, and a calibration from them, without a click."""

from typing import Annotated, Any

from fastapi import APIRouter, Request
from pydantic import Field

from app.api.answers import Json
from app.api.operator import operator
from app.api.routes.jobs import accepted
from app.api.routes.snapshots import take_snapshot
from app.api.schemas import responses
from app.api.schemas.requests import CameraSnapshot, Name, OptionValue, Rotate, Strict
from app.api.work import at_work
from app.core.errors import BadInput
from app.services.lens_options import lens_option
from app.store import Snapshot
from app.workflows.automatic_request import AutomaticRequest, run_auto

router = APIRouter(prefix="/calibrations", tags=["calibrations"])

MOST_PICTURES = 25  # a background keeps no more


class Rough(Strict):
    """What is roughly known of the camera; where nothing is, the lines alone decide."""

    height_mm: Annotated[float, Field(ge=100, le=100_000)] | None = Field(None, description="to a third either way")
    turn_deg: Annotated[float, Field(ge=-360, le=360)] | None = Field(
        None, description="how far the region is turned in the picture, clockwise, from how it stands when corrected; "
                          "to 50° either way")


class AutoRequest(Strict):
    """One of snapshot, snapshots and camera; the rest says what is seen."""

    snapshot: Name | None = None
    snapshots: Annotated[list[Name], Field(min_length=1, max_length=MOST_PICTURES)] | None = Field(
        None, description="several of one camera: what moves vanishes")
    camera: Name | None = Field(None, description="take pictures with it now, and keep what they have in common")
    frames: Annotated[int, Field(ge=1, le=MOST_PICTURES)] = Field(MOST_PICTURES, description="how many, with camera")
    field: Name
    region: Name = "full"
    rotate: Rotate | None = None
    model: Name = Field("auto", description="auto: Brown–Conrady, or the first of others that can be fitted")
    options: Annotated[dict[str, OptionValue], Field(max_length=50)] = Field({}, description="as for a fit")
    rough: Rough | None = None
    keep: bool = Field(True, description="false: find the lines, and save no version")
    note: Annotated[str, Field(max_length=2000)] = ""


@router.post("/auto", status_code=202, response_model=responses.Job)
async def find_calibration(request: Request, body: AutoRequest) -> Json:
    """A job: the lines that are seen, which is which, and a version where nothing speaks against it.

    Its result has the version's id or null as `calibration`, a `verdict`, the `doubts`, the `candidates`, and what was
    found as `observations`, which can be fitted, or put into a draft, like any others.
    """
    if sum(given is not None for given in (body.snapshot, body.snapshots, body.camera)) != 1:
        raise BadInput("It is not clear which picture is meant.", "Send one of snapshot, snapshots and camera.",
                       reason="bad-request")
    task = await at_work(request, _task, request, body)  # refused before a camera is asked
    if body.camera is not None:
        ids = [(await take_snapshot(request, CameraSnapshot(camera=body.camera, frames=body.frames))).id]
    else:
        ids = body.snapshots or [body.snapshot]
    return accepted(await at_work(request, _started, request, body, task, ids))


def _task(request: Request, body: AutoRequest) -> dict[str, Any]:
    state = request.app.state
    field = state.fields[body.field]
    options = {**body.options}
    if isinstance(options.get("lens"), str):  # by its id: the fit is given the lens itself, and keeps it
        options["lens"] = lens_option(state.store, options["lens"])
    rough = {name: value for name, value
             in (body.rough.model_dump() if body.rough else {}).items() if value is not None}
    return AutomaticRequest(field, field.region(body.region, body.rotate), body.model, options, rough,
                            note=body.note).to_json()


def _started(request: Request, body: AutoRequest, task: dict[str, Any], ids: list[str]) -> Any:
    state = request.app.state
    snapshots: list[Snapshot] = [state.store.snapshots.get(id) for id in ids]
    task = {**task, "snapshot": snapshots[0].id, "camera": snapshots[0].camera}
    pictures = [{"name": f"picture {number}", "path": str(state.store.snapshots.path(snapshot)),
                 "sha256": snapshot.sha256} for number, snapshot in enumerate(snapshots, 1)]
    return state.jobs.start("auto", run_auto, {"task": task, "pictures": pictures, "keep": body.keep}, "found-lines",
                            {"by": operator(request)})
