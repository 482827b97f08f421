"""WS /cameras/{id}/board: a board held before a live camera; pictures of it are taken by themselves."""

import asyncio
import json
from collections import Counter
from contextlib import contextmanager
from dataclasses import asdict
from typing import Annotated, Any

from fastapi import APIRouter, WebSocket
from pydantic import Field, ValidationError

from app.api.answers import json_bytes
from app.api.mjpeg import TAKE_S
from app.api.routes.streams import first_picture, live_camera
from app.api.schemas.requests import Number, Strict
from app.api.sockets import both, spoken_with
from app.api.work import at_work
from app.core.board import Board
from app.core.errors import BadInput, Busy
from app.core.geometry import ImageSize
from app.live import LiveCamera
from app.live.board_capture import MAX_VIEWS, BoardCapture
from app.store import Snapshot

router = APIRouter(prefix="/cameras", tags=["lenses"])

EVERY_S = 0.2  # between two looks: five a second at most
SHARE = 4  # and four times as long as a look took, so that a fifth of a core is the most
FIRST_WORD_S = 10.0
LONGEST_WORD = 100_000  # characters
MOST_AT_ONCE = 2  # boards looked for with one camera: an operator's page, and the one before its reload

Corner = Annotated[list[Number], Field(min_length=2, max_length=2)]
Quad = Annotated[list[Corner], Field(min_length=4, max_length=4)]
_watched: Counter[str] = Counter()


class Wish(Strict):
    """What a page may say: first which board and which views it has already; later what is to change."""

    board: dict[str, Any] | None = None
    taken: Annotated[list[Quad], Field(default_factory=list, max_length=MAX_VIEWS)]
    automatic: bool | None = None
    take: bool = False


@router.websocket("/{id}/board")
async def watch_board(socket: WebSocket, id: str) -> None:
    """Say {"board": {…}, "taken": [quad, …], "automatic": true}; hear what is seen, covered and wanted, as JSON texts.

    A frame in which the board stands still in a new way is kept as a snapshot with the purpose "board", while automatic
    or on {"take": true}, and told as `taken`. Refusals come as a problem; then the socket is closed.
    """
    async with spoken_with(socket):
        with _one_more(id):
            camera = await live_camera(socket, id)
            first = _read(await asyncio.wait_for(socket.receive_text(), FIRST_WORD_S))
            session = Session(socket, camera, Board.from_json(first.board), first)
            await both(session.hear(), session.tell())


class Session:
    """One page that holds a board before one camera."""

    def __init__(self, socket: WebSocket, camera: LiveCamera, board: Board, first: Wish) -> None:
        self._socket, self._camera, self._board = socket, camera, board
        self._first = first.taken
        self._automatic = first.automatic is not False
        self._take = False
        self._watched: BoardCapture | None = None

    async def hear(self) -> None:
        """Until the page goes."""
        while True:
            wish = _read(await self._socket.receive_text())
            self._automatic = self._automatic if wish.automatic is None else wish.automatic
            self._take = self._take or wish.take

    async def tell(self) -> None:
        """Each look as it comes, again and again."""
        loop, seq = asyncio.get_running_loop(), 0
        while True:
            begun = loop.time()
            seen = await first_picture(self._camera, lambda _timeout_s, after=seq: self._camera.board(
                self._board.to_json(), after))
            seq = seen["seq"]
            told = await self._looked(seen, begun)
            await asyncio.wait_for(self._socket.send_text(json_bytes(told).decode()), TAKE_S)
            await asyncio.sleep(max(EVERY_S - (loop.time() - begun), SHARE * seen["took_s"], 0.01))

    async def _looked(self, seen: dict[str, Any], now_s: float) -> dict[str, Any]:
        watched = self._at(ImageSize(seen["width"], seen["height"]))
        state = watched.update(seen["quad"], now_s)
        snapshot = None
        if seen["quad"] is not None and (self._take or (self._automatic and state["still"] and state["new"])):
            if watched.is_full:
                raise BadInput(f"{MAX_VIEWS} views are as many as a lens needs.", "Find the lens from them.",
                               reason="too-many-views")
            snapshot = await self._taken()
            watched.add_view(seen["quad"])
        self._take = False
        return {**{name: seen[name] for name in ("seq", "time", "width", "height", "corners", "quad")}, **state,
                "automatic": self._automatic, "count": len(watched.poses), **watched.coverage.to_json(),
                "taken": None if snapshot is None else snapshot.to_json()}

    def _at(self, size: ImageSize) -> BoardCapture:
        """What was seen in pictures of that size; another size is another lens's beginning."""
        if self._watched is None or self._watched.size != size:
            taken = self._first if self._watched is None else []
            self._watched = BoardCapture(self._board, size)
            for quad in taken:
                self._watched.add_view(quad)
        return self._watched

    async def _taken(self) -> Snapshot:
        head, png = await self._camera.still()
        store, identity = self._socket.app.state.store, self._camera.identity

        def keep() -> Snapshot:
            kept = store.snapshots.add(png, ImageSize(head["width"], head["height"]), "png", self._camera.id, "board")
            if identity is not None:
                store.identities.confirm(kept.id, asdict(identity))
            return kept
        return await at_work(self._socket, keep)


@contextmanager
def _one_more(id: str) -> Any:
    if _watched[id] >= MOST_AT_ONCE:
        raise Busy("Others hold a board before this camera.", "Wait until they are done, or use another camera.",
                   reason="board-watched")
    _watched[id] += 1
    try:
        yield
    finally:
        _watched[id] -= 1
        if not _watched[id]:
            del _watched[id]


def _read(text: str) -> Wish:
    try:
        return Wish.model_validate(json.loads(text[:LONGEST_WORD]))
    except (ValidationError, ValueError):
        raise BadInput("This is not what can be said here.", 'Say {"board": {…}, "taken": [], "automatic": true} '
                       'first, later {"automatic": false} or {"take": true}.', reason="bad-request") from None
