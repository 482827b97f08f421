"""/lenses: saved lenses, which fits of cameras over a field can hold fixed; and how boards make them."""

from collections.abc import Sequence
from typing import Annotated, Any

from fastapi import APIRouter
from pydantic import Field
from starlette.responses import Response

from touchline.api.dependencies import CallerDep, IfMatch, ServicesDep, in_thread
from touchline.api.request_mapping import image_size, pictures_of_one_size
from touchline.api.responses import Json, accepted, page, versioned
from touchline.api.schemas import responses
from touchline.api.schemas.base import page_of
from touchline.api.schemas.requests import Cursor, Id, Limit
from touchline.core.board import Board, views_from_json
from touchline.core.errors import BadInput
from touchline.services.container import Services
from touchline.services.forms import (
    Name,
    Note,
    Number,
    OptionText,
    OptionValues,
    Pair,
    Size,
    Strict,
    Triple,
)
from touchline.store.repository import content_etag
from touchline.workflows.board_request import BoardCalibrationRequest, run_pictures, run_views

router = APIRouter(tags=["lenses"])

Lenses = page_of("Lenses", responses.LensSummary)

SUMMARY = ("id", "created_at", "camera", "note", "model", "board", "image_size")


class BoardViewForm(Strict):
    """One view of a board: corners in the image, and their positions on the board."""

    image_points: Annotated[list[Pair], Field(max_length=10_000)] = Field(description="[x, y] px in the raw image")
    object_points: Annotated[list[Triple], Field(max_length=10_000)] = Field(description="[x, y, z] mm on the board")
    name: Annotated[str, Field(max_length=200)] = ""


class BoardRequest(Strict):
    """Images of a board, or views of it, for a lens calibration."""

    snapshots: Annotated[list[Name], Field(min_length=1, max_length=500)] | None = None
    views: Annotated[list[BoardViewForm], Field(min_length=1, max_length=1000)] | None = None
    image_size: Size | None = None
    board: Annotated[dict[OptionText, bool | int | Number | OptionText], Field(max_length=10)] | None = Field(
        None, description='{"kind": "chessboard" or "charuco", "columns", "rows" (inner corners), "square_mm"}; a '
                          'charuco board has "marker_mm", "dictionary" and "legacy" too')
    model: Name = "brown-conrady"
    options: OptionValues = Field({})
    camera: Name | None = None
    note: Note = ""


@router.get("/lenses", response_model=Lenses)
def list_lenses(services: ServicesDep, limit: Limit = 50, cursor: Cursor = None) -> Json:
    """List lenses, newest first, each in short."""
    lenses = services.store.lenses.list(limit, cursor)
    return page(map(_summary, lenses.items), lenses.next_cursor)


@router.get("/lenses/{id}", response_model=responses.Lens)
def read_lens(services: ServicesDep, id: Id) -> Json:
    """Return one lens, with its covariance and its complete report; its ETag goes into If-Match of DELETE."""
    lens = services.store.lenses.get(id)
    return versioned(lens, content_etag(lens))


@router.delete("/lenses/{id}", status_code=204, response_class=Response)
def delete_lens(services: ServicesDep, id: Id, if_match: IfMatch = None) -> None:
    """Delete a lens; calibrations that used it keep their copy. With If-Match only that very one."""
    services.store.lenses.delete(id, if_match)


def _summary(lens: dict[str, Any]) -> dict[str, Any]:
    """Return a lens in short; one of an early version may have no report."""
    report = lens.get("report", {"rms_px": None, "verdict": {}, "views": []})
    return {**{key: lens.get(key) for key in SUMMARY}, "rms_px": report["rms_px"], "verdict": report["verdict"],
            "views": sum(view["used"] for view in report["views"])}


@router.post("/calibrations/board", status_code=202, response_model=responses.Job)
@in_thread
def calibrate_lens(services: ServicesDep, caller: CallerDep, body: BoardRequest) -> Json:
    """Start a job that finds a lens and saves it: {"lens": id, "record": what GET /lenses/{id} returns}.

    From `snapshots` of one board, or from `views`: corners in the picture and their places on the board in mm.
    """
    if (body.snapshots is None) == (body.views is None):
        raise BadInput("The request has neither snapshots nor views.", 'Send "snapshots": [id, …], or "views" with '
                       '"image_size".', reason="no-views")
    task = BoardCalibrationRequest(None if body.board is None else Board.from_json(body.board), body.model,
                                   body.options)
    about = {"camera": body.camera, "note": body.note, "snapshots": body.snapshots}
    run, spec = (_from_snapshots(services, body.snapshots, body, task) if body.snapshots is not None else
                 _from_views(body.views or (), body, task))
    return accepted(services.jobs.start("board", run, spec, "lens", about, caller=caller))


def _from_views(given: Sequence[BoardViewForm], body: BoardRequest,
                task: BoardCalibrationRequest) -> tuple[Any, dict[str, Any]]:
    if body.image_size is None:
        raise BadInput("The request has no image size.", 'Send "image_size": [width, height].',
                       reason="no-image-size")
    views = views_from_json([view.model_dump() for view in given])
    return run_views, {"task": task.to_json(), "views": [view.to_json() for view in views],
                       "image_size": body.image_size}


def _from_snapshots(services: Services, ids: Sequence[str], body: BoardRequest,
                    task: BoardCalibrationRequest) -> tuple[Any, dict[str, Any]]:
    if task.board is None:
        raise BadInput("The request has no board.", 'Send "board": {"kind", "columns", "rows", "square_mm"}.',
                       reason="no-board")
    pictures = pictures_of_one_size(services, ids, image_size(body.image_size),
                                    "Use images of one camera at one resolution.")
    return run_pictures, {"task": task.to_json(), "pictures": pictures}
