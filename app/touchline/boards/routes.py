"""POST /calibrations/board: a lens from images of a board, or from its corners.

WS /cameras/{id}/board: a calibration board before a live camera; pictures of it are taken automatically.
"""

import asyncio
from collections.abc import Sequence
from typing import Annotated

from fastapi import APIRouter, WebSocket
from pydantic import Field

from touchline.api import schemas
from touchline.api.bodies import image_size, pictures_of_one_size
from touchline.api.dependencies import CallerDep, ServicesDep, in_thread
from touchline.api.responses import Json, accepted
from touchline.api.sockets import (
    SessionLimit,
    receive_json,
    run_until_first,
    send_json,
    websocket_session,
)
from touchline.boards.board import Board, views_from_json
from touchline.boards.poses import MAX_VIEWS
from touchline.boards.request import BoardCalibrationRequest, run_pictures, run_views
from touchline.boards.service import CaptureSession
from touchline.core.errors import BadInput
from touchline.core.json_values import JsonObject
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

router = APIRouter(prefix="/calibrations", tags=["lenses"])
live = APIRouter(prefix="/cameras", tags=["lenses"])

FIRST_MESSAGE_S = 10.0
MAX_MESSAGE = 100_000  # characters
# 2: a page, and the one before its reload
SESSIONS = SessionLimit(
    2,
    "Another user is capturing a board with this camera.",
    "Wait until the capture ends, or use another camera.",
    "board-watched",
)

Corner = Annotated[list[Number], Field(min_length=2, max_length=2)]
Quad = Annotated[list[Corner], Field(min_length=4, max_length=4)]


class BoardViewForm(Strict):
    """One view of a board: corners in the image, and their positions on the board."""

    image_points: Annotated[list[Pair], Field(max_length=10_000)] = Field(
        description="[x, y] px in the raw image"
    )
    object_points: Annotated[list[Triple], Field(max_length=10_000)] = Field(
        description="[x, y, z] mm on the board"
    )
    name: Annotated[str, Field(max_length=200)] = ""


class BoardRequest(Strict):
    """Images of a board, or views of it, for a lens calibration."""

    snapshots: Annotated[list[Name], Field(min_length=1, max_length=500)] | None = None
    views: Annotated[list[BoardViewForm], Field(min_length=1, max_length=1000)] | None = None
    image_size: Size | None = None
    board: (
        Annotated[dict[OptionText, bool | int | Number | OptionText], Field(max_length=10)] | None
    ) = Field(
        None,
        description='{"kind": "chessboard" or "charuco", "columns", "rows" (inner corners), "square_mm"}; a '
        'charuco board has "marker_mm", "dictionary" and "legacy" too',
    )
    model: Name = "brown-conrady"
    options: OptionValues = Field({})
    camera: Name | None = None
    note: Note = ""


class BoardMessage(Strict):
    """What a page sends: first which board and which views it has already; later what is to change."""

    board: JsonObject | None = None
    taken: Annotated[list[Quad], Field(default_factory=list, max_length=MAX_VIEWS)]
    automatic: bool | None = None
    take: bool = False


@router.post("/board", status_code=202, response_model=schemas.Job)
@in_thread
def calibrate_lens(services: ServicesDep, caller: CallerDep, body: BoardRequest) -> Json:
    """Start a job that finds a lens and saves it: {"lens": id, "record": what GET /lenses/{id} returns}.

    From `snapshots` of one board, or from `views`: corners in the picture and their places on the board in mm.
    """
    if (body.snapshots is None) == (body.views is None):
        raise BadInput(
            "The request has neither snapshots nor views.",
            'Send "snapshots": [id, …], or "views" with "image_size".',
            reason="no-views",
        )
    request = BoardCalibrationRequest(
        None if body.board is None else Board.from_json(body.board), body.model, body.options
    )
    about = {"camera": body.camera, "note": body.note, "snapshots": body.snapshots}
    if body.snapshots is not None:
        run, spec = run_pictures, _pictures_spec(services, body.snapshots, body, request)
    else:
        run, spec = run_views, _views_spec(body.views or (), body, request)
    return accepted(services.jobs.start("board", run, spec, "lens", about, caller=caller))


def _views_spec(
    views: Sequence[BoardViewForm], body: BoardRequest, request: BoardCalibrationRequest
) -> JsonObject:
    if body.image_size is None:
        raise BadInput(
            "The request has no image size.",
            'Send "image_size": [width, height].',
            reason="no-image-size",
        )
    checked = views_from_json([view.model_dump() for view in views])
    return {
        "task": request.to_json(),
        "views": [view.to_json() for view in checked],
        "image_size": body.image_size,
    }


def _pictures_spec(
    services: Services, ids: Sequence[str], body: BoardRequest, request: BoardCalibrationRequest
) -> JsonObject:
    if request.board is None:
        raise BadInput(
            "The request has no board.",
            'Send "board": {"kind", "columns", "rows", "square_mm"}.',
            reason="no-board",
        )
    pictures = pictures_of_one_size(
        services, ids, image_size(body.image_size), "Use images of one camera at one resolution."
    )
    return {"task": request.to_json(), "pictures": pictures}


@live.websocket("/{id}/board")
async def watch_board(socket: WebSocket, services: ServicesDep, id: str) -> None:
    """Receive {"board": {…}, "taken": [quad, …], "automatic": true}; send what is seen, covered and needed, as JSON.

    A frame in which the board stands still in a new way is saved as a snapshot with the purpose "board", while
    automatic or on {"take": true}, and sent as `taken`. Refusals come as a problem; then the socket is closed.
    """
    async with websocket_session(socket):
        with SESSIONS.session(id):
            camera = services.live.get(id)
            async with asyncio.timeout(FIRST_MESSAGE_S):
                first = await _receive(socket)
            session = CaptureSession(
                services,
                camera,
                Board.from_json(first.board),
                first.taken,
                first.automatic is not False,
            )
            await run_until_first(_follow(socket, session), _send(socket, session))


async def _follow(socket: WebSocket, session: CaptureSession) -> None:
    """Pass the page's messages on until it has gone."""
    while True:
        message = await _receive(socket)
        if message.automatic is not None:
            session.automatic = message.automatic
        session.take = session.take or message.take


async def _send(socket: WebSocket, session: CaptureSession) -> None:
    async for result in session.results():
        await send_json(socket, result)


async def _receive(socket: WebSocket) -> BoardMessage:
    return await receive_json(
        socket,
        BoardMessage,
        MAX_MESSAGE,
        'Send {"board": {…}, "taken": [], "automatic": true} '
        'first, later {"automatic": false} or {"take": true}.',
    )
