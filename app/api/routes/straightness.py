"""POST /straightness: how straight pictures show straight edges, and the lens that makes them straight."""

from typing import Any

from fastapi import APIRouter, Request
from starlette.responses import Response

from app.api.dependencies import ServicesDep
from app.api.request_mapping import image_size
from app.api.responses import finished_or_queued, picture
from app.api.routes.calibrations import ACCEPTED
from app.api.routes.pictures import Format
from app.api.schemas import responses
from app.api.schemas.lenses import StraightenedRequest, StraightnessRequest
from app.api.schemas.media import PICTURE
from app.api.schemas.requests import AsJob, WidthPx
from app.models.distortion import Distortion
from app.services.container import Services
from app.services.snapshots import check_one_size, job_pictures
from app.workflows.straight_lines import undistort
from app.workflows.straight_lines_request import StraightLinesRequest, run_straightness

router = APIRouter(prefix="/straightness", tags=["lenses"])


@router.post("", response_model=responses.Straightness, responses=ACCEPTED)
async def judge_straightness(request: Request, services: ServicesDep, body: StraightnessRequest,
                             job: AsJob = False) -> Response:
    """Measure edges of pictures, or lines clicked in one: how far the lens bends them, and what correction leaves.

    Needs no field and no board, and gives no focal length. With ?job=true a job, whose result is the same.
    """
    spec = await services.run_in_thread(_spec, services, body)
    return await finished_or_queued(request, services, "straightness", run_straightness, spec, job)


@router.post("/picture.{format}", response_class=Response, responses=PICTURE)
async def straighten_picture(services: ServicesDep, format: Format, body: StraightenedRequest,
                             width: WidthPx = None) -> Response:
    """Return a snapshot without distortion, by the `lens` of a response; `straight` of its lines is in its px."""
    def draw() -> Response:
        lens = Distortion.from_json(body.lens.model_dump())
        return picture(undistort(services.frame(body.snapshot).pixels, lens, width), format)
    return await services.run_in_thread(draw)


def _spec(services: Services, body: StraightnessRequest) -> dict[str, Any]:
    """Refuse at once what can be, and return what the job takes."""
    size = image_size(body.image_size)
    task = StraightLinesRequest(body.lens, body.centre_sigma_px, tuple(body.lines), size)
    task.check_given(len(body.snapshots))
    check_one_size([services.store.snapshots.get(id) for id in body.snapshots], size,
                   "Send pictures of one camera in one mode.")
    return {"task": task.to_json(), "pictures": job_pictures(services.store, body.snapshots)}
