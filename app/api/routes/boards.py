"""POST /calibrations/board: a lens from pictures of a board, or from corners found elsewhere."""

from typing import Any

from fastapi import APIRouter, Request

from app.api.answers import Json
from app.api.routes.jobs import accepted
from app.api.schemas import responses
from app.api.schemas.requests import BoardRequest
from app.api.work import at_work
from app.core.board import Board, views_from_json
from app.core.errors import BadInput, Conflict
from app.core.geometry import ImageSize
from app.jobs import Job
from app.workflows.board_request import BoardCalibrationRequest, run_pictures, run_views

router = APIRouter(prefix="/calibrations", tags=["lenses"])


@router.post("/board", status_code=202, response_model=responses.Job)
async def calibrate_lens(request: Request, body: BoardRequest) -> Json:
    """A job that finds a lens and keeps it: {"lens": id, "record": what GET /lenses/{id} answers}.

    From `snapshots` of one board, or from `views`: corners in the picture and their places on the board in mm.
    """
    return accepted(await at_work(request, _started, request, body))


def _started(request: Request, body: BoardRequest) -> Job:
    """All that can be refused at once is refused here."""
    if (body.snapshots is None) == (body.views is None):
        raise BadInput("Either snapshots or views are needed.", 'Send "snapshots": [id, …], or "views" with '
                       '"image_size".', reason="no-views")
    task = BoardCalibrationRequest(None if body.board is None else Board.from_json(body.board), body.model,
                                   body.options)
    about = {"camera": body.camera, "note": body.note, "snapshots": body.snapshots}
    run, spec = (_from_views(body, task) if body.views is not None else _from_snapshots(request, body, task))
    return request.app.state.jobs.start("board", run, spec, "lens", about)


def _from_views(body: BoardRequest, task: BoardCalibrationRequest) -> tuple[Any, dict[str, Any]]:
    if body.image_size is None:
        raise BadInput("The size of the pictures is not given.", 'Send "image_size": [width, height].',
                       reason="no-image-size")
    views = views_from_json([view.model_dump() for view in body.views])
    return run_views, {"task": task.to_json(), "views": [view.to_json() for view in views],
                       "image_size": body.image_size}


def _from_snapshots(request: Request, body: BoardRequest, task: BoardCalibrationRequest) -> tuple[Any, dict[str, Any]]:
    store = request.app.state.store
    if task.board is None:
        raise BadInput("No board is given.", 'Send "board": {"kind", "columns", "rows", "square_mm"}.',
                       reason="no-board")
    snapshots = [store.snapshots.get(id) for id in body.snapshots]
    sizes = {snapshot.size for snapshot in snapshots}
    sizes |= {ImageSize.of(body.image_size)} if body.image_size is not None else set()
    if len(sizes) > 1:
        raise Conflict("The pictures are not all of one size: " + " and ".join(
            sorted(f"{size.width} × {size.height} px" for size in sizes)) + ".",
            "Take all pictures with one camera at one size.", reason="size-mismatch")
    pictures = [{"name": f"picture {number}", "path": str(store.snapshots.path(snapshot)), "sha256": snapshot.sha256}
                for number, snapshot in enumerate(snapshots, 1)]
    return run_pictures, {"task": task.to_json(), "pictures": pictures}
