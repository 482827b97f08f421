"""POST /calibrations/{id}/check: whether a calibration still holds in today's picture. Nothing is fitted or kept."""

from typing import Annotated, Any, Literal

from fastapi import APIRouter, Request, Response
from pydantic import Field

from app.api.routes.calibrations import ACCEPTED, AsJob
from app.api.routes.jobs import accepted, result_of
from app.api.routes.snapshots import take_snapshot
from app.api.schemas.requests import CameraSnapshot, Id, Name, Strict
from app.api.schemas.responses.base import Answer
from app.api.work import at_length, at_work
from app.core.errors import BadInput
from app.store import Snapshot, Store
from app.workflows.check import run_check

router = APIRouter(prefix="/calibrations", tags=["calibrations"])

MOST_PICTURES = 25


class CheckRequest(Strict):
    """Today's picture: one of snapshot, snapshots and camera; none of them: the calibration's own camera, now."""

    snapshot: Name | None = None
    snapshots: Annotated[list[Name], Field(min_length=1, max_length=MOST_PICTURES)] | None = Field(
        None, description="several of one camera: what moves vanishes")
    camera: Name | None = Field(None, description="take pictures with it now")
    frames: Annotated[int, Field(ge=1, le=MOST_PICTURES)] = Field(1, description="how many it takes")


class CheckVerdict(Answer):
    level: Literal["good", "fair", "poor"] | None = Field(description="null: the picture does not tell")
    sentence: str
    fix: str
    reason: str = Field(description="holds, moved, lens, as-made, elsewhere or not-seen")


class LineChecked(Answer):
    """One marking; mm is across it on the carpet, and null where nothing was found."""

    feature: str
    places: int
    found: int
    found_share: float
    mean_mm: float | None
    rms_mm: float | None
    worst_mm: float | None
    rms_px: float | None


class PlaceChecked(Answer):
    feature: str
    expected: Annotated[list[float], Field(description="raw px, where the calibration has it")]
    found: Annotated[list[float], Field(description="raw px")]
    off_mm: float


class CheckedCalibration(Answer):
    """How far the field's lines are today from where the calibration has them."""

    calibration: str
    version: int | None
    camera: str | None
    snapshot: str
    model: str
    field: str
    region: str
    image_size: list[int]
    verdict: CheckVerdict
    lines: list[LineChecked]
    found_share: float = Field(description="of the length of the lines that should be seen")
    lines_found: int
    others_share: float = Field(description="length of other long lines, as a share of what should be seen; 0 where "
                                            "most of that was found")
    own_mm: float | None = Field(description="what the calibration told of itself when it was made")
    rms_mm: float | None
    p95_mm: float | None
    rms_px: float | None
    left_mm: float | None = Field(description="rms of what no motion of the camera explains")
    carpet: dict[str, Any] | None = Field(description="z_mm, mean_mm, p95_mm, max_mm, where, and the map")
    hat: dict[str, Any] | None
    points: list[PlaceChecked]


@router.post("/{id}/check", response_model=CheckedCalibration, responses=ACCEPTED)
async def check_calibration(request: Request, id: Id, body: CheckRequest, job: AsJob = False) -> Response:
    """A verdict and mm a line, in seconds; the version, and which one is active, stay as they are."""
    given = [name for name in ("snapshot", "snapshots", "camera") if getattr(body, name) is not None]
    if len(given) > 1:
        raise BadInput("It is not clear which picture is meant.", "Send one of snapshot, snapshots and camera.",
                       reason="bad-request")
    store: Store = request.app.state.store
    calibration = await at_work(request, store.calibrations.get, id)
    if body.snapshot or body.snapshots:
        snapshots: list[Snapshot] = [await at_work(request, store.snapshots.get, one)
                                     for one in body.snapshots or [body.snapshot]]
    else:
        camera = body.camera or calibration.camera
        if camera is None:
            raise BadInput("This calibration is of no camera.", "Send the snapshot to check it with.",
                           reason="no-camera")
        snapshots = [await take_snapshot(request, CameraSnapshot(camera=camera, frames=body.frames))]
    spec = {"calibration": calibration.to_json(), "snapshot": snapshots[0].id, "pictures": [
        {"name": f"picture {number}", "path": str(store.snapshots.path(one)), "sha256": one.sha256}
        for number, one in enumerate(snapshots, 1)]}
    if job:
        return accepted(await at_work(request, request.app.state.jobs.start, "check", run_check, spec))
    return result_of(await at_length(request, "check", run_check, spec))
