"""POST /calibrations/board: a lens from pictures of a board, or from corners found elsewhere."""

from typing import Any

from fastapi import APIRouter

from app.api.dependencies import ServicesDep
from app.api.request_mapping import image_size
from app.api.responses import Json, accepted
from app.api.schemas import responses
from app.api.schemas.lenses import BoardRequest
from app.core.board import Board, views_from_json
from app.core.errors import BadInput
from app.jobs import Job
from app.services.container import Services
from app.services.snapshots import check_one_size, job_pictures
from app.workflows.board_request import BoardCalibrationRequest, run_pictures, run_views

router = APIRouter(prefix="/calibrations", tags=["lenses"])


@router.post("/board", status_code=202, response_model=responses.Job)
async def calibrate_lens(services: ServicesDep, body: BoardRequest) -> Json:
    """Start a job that finds a lens and saves it: {"lens": id, "record": what GET /lenses/{id} returns}.

    From `snapshots` of one board, or from `views`: corners in the picture and their places on the board in mm.
    """
    return accepted(await services.run_in_thread(_start, services, body))


def _start(services: Services, body: BoardRequest) -> Job:
    """Refuse at once what can be, and start the job."""
    if (body.snapshots is None) == (body.views is None):
        raise BadInput("Either snapshots or views are needed.", 'Send "snapshots": [id, …], or "views" with '
                       '"image_size".', reason="no-views")
    task = BoardCalibrationRequest(None if body.board is None else Board.from_json(body.board), body.model,
                                   body.options)
    about = {"camera": body.camera, "note": body.note, "snapshots": body.snapshots}
    run, spec = (_from_views(body, task) if body.views is not None else _from_snapshots(services, body, task))
    return services.jobs.start("board", run, spec, "lens", about)


def _from_views(body: BoardRequest, task: BoardCalibrationRequest) -> tuple[Any, dict[str, Any]]:
    if body.image_size is None:
        raise BadInput("The size of the pictures is not given.", 'Send "image_size": [width, height].',
                       reason="no-image-size")
    views = views_from_json([view.model_dump() for view in body.views])
    return run_views, {"task": task.to_json(), "views": [view.to_json() for view in views],
                       "image_size": body.image_size}


def _from_snapshots(services: Services, body: BoardRequest,
                    task: BoardCalibrationRequest) -> tuple[Any, dict[str, Any]]:
    if task.board is None:
        raise BadInput("No board is given.", 'Send "board": {"kind", "columns", "rows", "square_mm"}.',
                       reason="no-board")
    check_one_size([services.store.snapshots.get(id) for id in body.snapshots], image_size(body.image_size),
                   "Take all pictures with one camera at one size.")
    return run_pictures, {"task": task.to_json(), "pictures": job_pictures(services.store, body.snapshots)}
