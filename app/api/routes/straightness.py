"""POST /straightness: how straight pictures show straight edges, and the lens that makes them straight."""

from typing import Any

from fastapi import APIRouter, Request
from starlette.responses import Response

from app.api.answers import picture
from app.api.routes.calibrations import ACCEPTED
from app.api.routes.jobs import accepted, result_of
from app.api.routes.pictures import ANSWER, Format
from app.api.schemas import responses
from app.api.schemas.requests import AsJob, StraightenedRequest, StraightnessRequest, WidthPx
from app.api.work import at_length, at_work
from app.core.errors import Conflict
from app.core.geometry import ImageSize
from app.models.plumb_line import PlumbLens
from app.workflows.straight_lines import undistort
from app.workflows.straight_lines_request import StraightLinesRequest, run_straightness

router = APIRouter(prefix="/straightness", tags=["lenses"])


@router.post("", response_model=responses.Straightness, responses=ACCEPTED)
async def judge_straightness(request: Request, body: StraightnessRequest, job: AsJob = False) -> Response:
    """Edges of pictures, or lines clicked in one: how far the lens bows them, and what is left once that is undone.

    Needs no field and no board, and tells no focal length. With ?job=true a job, whose result is the same.
    """
    spec = await at_work(request, _spec, request, body)
    if job:
        return accepted(await at_work(request, request.app.state.jobs.start, "straightness", run_straightness,
                                      spec))
    return result_of(await at_length(request, "straightness", run_straightness, spec))


@router.post("/picture.{format}", response_class=Response, responses=ANSWER)
async def straighten_picture(request: Request, format: Format, body: StraightenedRequest,
                             width: WidthPx = None) -> Response:
    """A snapshot without its bend, by the `lens` of an answer; `straight` of its lines is drawn in this picture."""
    return await at_work(request, _straightened, request, body, width, format)


def _spec(request: Request, body: StraightnessRequest) -> dict[str, Any]:
    """All that can be refused at once is refused here."""
    given = ImageSize.of(body.image_size) if body.image_size is not None else None
    task = StraightLinesRequest(body.lens, body.centre_sigma_px, tuple(body.lines), given)
    task.check_given(len(body.snapshots))
    store = request.app.state.store
    snapshots = [store.snapshots.get(id) for id in body.snapshots]
    sizes = {snapshot.size for snapshot in snapshots} | ({given} if given is not None else set())
    if len(sizes) > 1:
        raise Conflict("The pictures are not all of one size: " + " and ".join(
            sorted(f"{size.width} × {size.height} px" for size in sizes)) + ".",
            "Send pictures of one camera in one mode.", reason="size-mismatch")
    pictures = [{"name": f"picture {number}", "path": str(store.snapshots.path(snapshot)), "sha256": snapshot.sha256}
                for number, snapshot in enumerate(snapshots, 1)]
    return {"task": task.to_json(), "pictures": pictures}


def _straightened(request: Request, body: StraightenedRequest, width: int | None, format: str) -> Response:
    lens = PlumbLens.from_json(body.lens.model_dump())
    return picture(undistort(request.app.state.frames[body.snapshot].pixels, lens, width), format)
