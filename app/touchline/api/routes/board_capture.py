"""WS /cameras/{id}/board: a calibration board before a live camera; pictures of it are taken automatically."""

import asyncio
from typing import Annotated, Any

from fastapi import APIRouter, WebSocket
from pydantic import Field

from touchline.api.dependencies import ServicesDep
from touchline.api.sockets import SessionLimit, receive_json, run_until_first, send_json, websocket_session
from touchline.core.board import Board
from touchline.core.errors import BadInput
from touchline.core.geometry import ImageSize
from touchline.core.statements import say, stated
from touchline.live.board_capture import MAX_VIEWS, BoardCapture
from touchline.live.camera import LiveCamera
from touchline.services.container import Services
from touchline.services.forms import Number, Strict
from touchline.services.live import TakenFrame, when_awake
from touchline.store.snapshots import Snapshot

router = APIRouter(prefix="/cameras", tags=["lenses"])

MIN_INTERVAL_S = 0.2  # between two detections: five a second at most
IDLE_SHARE = 4  # and four times as long as a detection took, so that a fifth of a core is the most
REQUEST_S = 10.0
FIRST_MESSAGE_S = 10.0
MAX_MESSAGE = 100_000  # characters
# 2: a page, and the one before its reload
SESSIONS = SessionLimit(2, "Another user is capturing a board with this camera.",
                        "Wait until the capture ends, or use another camera.", "board-watched")

Corner = Annotated[list[Number], Field(min_length=2, max_length=2)]
Quad = Annotated[list[Corner], Field(min_length=4, max_length=4)]


class BoardMessage(Strict):
    """What a page sends: first which board and which views it has already; later what is to change."""

    board: dict[str, Any] | None = None
    taken: Annotated[list[Quad], Field(default_factory=list, max_length=MAX_VIEWS)]
    automatic: bool | None = None
    take: bool = False


@router.websocket("/{id}/board")
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
            session = BoardSession(socket, services, camera, Board.from_json(first.board), first)
            await run_until_first(session.receive(), session.send())


class BoardSession:
    """One page and the board before its camera."""

    def __init__(self, socket: WebSocket, services: Services, camera: LiveCamera, board: Board,
                 first: BoardMessage) -> None:
        self._socket, self._services, self._camera, self._board = socket, services, camera, board
        self._earlier_views = first.taken
        self._automatic = first.automatic is not False
        self._take = False
        self._watched: BoardCapture | None = None

    async def receive(self) -> None:
        """Follow the page's messages until it has gone."""
        while True:
            message = await _receive(self._socket)
            self._automatic = self._automatic if message.automatic is None else message.automatic
            self._take = self._take or message.take

    async def send(self) -> None:
        """Detect the board again and again, and send each result."""
        loop, seq = asyncio.get_running_loop(), 0

        async def detect(_left_s: float) -> dict[str, Any]:
            return (await self._camera.request("board", REQUEST_S, board=self._board.to_json(), after=seq))[0]

        while True:
            start_s = loop.time()
            found = await when_awake(self._camera, detect)
            seq = found["seq"]
            await send_json(self._socket, await self._result(found, start_s))
            await asyncio.sleep(max(MIN_INTERVAL_S - (loop.time() - start_s), IDLE_SHARE * found["took_s"], 0.01))

    async def _result(self, found: dict[str, Any], now_s: float) -> dict[str, Any]:
        watched = self._at(ImageSize(found["width"], found["height"]))
        state = watched.update(found["quad"], now_s)
        snapshot = None
        if found["quad"] is not None and (self._take or (self._automatic and state["still"] and state["new"])):
            if watched.is_full:
                raise BadInput(say("board.too-many-views", "{most} views are the maximum for one lens.",
                                   most=MAX_VIEWS), say("board.fit-these", "Fit the lens to these views."),
                               reason="too-many-views")
            snapshot = await self._take_snapshot()
            watched.add_view(found["quad"])
        self._take = False
        return stated({**{name: found[name] for name in ("seq", "time", "width", "height", "corners", "quad")}, **state,
                       "automatic": self._automatic, "count": len(watched.poses), **watched.coverage.to_json(),
                       "taken": None if snapshot is None else snapshot.to_json()})

    def _at(self, size: ImageSize) -> BoardCapture:
        """Return the views of pictures of that size; with another size another lens begins."""
        if self._watched is None or self._watched.size != size:
            quads = self._earlier_views if self._watched is None else []
            self._watched = BoardCapture(self._board, size)
            for quad in quads:
                self._watched.add_view(quad)
        return self._watched

    async def _take_snapshot(self) -> Snapshot:
        frame = TakenFrame(self._camera, *await self._camera.still())
        return await self._services.run_in_thread(frame.save, self._services.store, "board")


async def _receive(socket: WebSocket) -> BoardMessage:
    return await receive_json(socket, BoardMessage, MAX_MESSAGE, 'Send {"board": {…}, "taken": [], "automatic": true} '
                              'first, later {"automatic": false} or {"take": true}.')
