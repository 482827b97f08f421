"""Boards with what the server keeps: saved lenses, and pictures of a board before a live camera."""

import asyncio
from collections.abc import AsyncIterator, Sequence
from typing import Any

from touchline.boards.board import Board
from touchline.boards.poses import MAX_VIEWS, BoardCapture
from touchline.core.errors import BadInput
from touchline.core.geometry import ImageSize
from touchline.core.json_values import JsonObject
from touchline.core.statements import say, stated
from touchline.live.camera import LiveCamera
from touchline.services.container import Services
from touchline.services.live import TakenFrame, when_awake
from touchline.store.snapshots import Snapshot

MIN_INTERVAL_S = 0.2  # between two detections: five a second at most
IDLE_SHARE = 4  # and four times as long as a detection took, so that a fifth of a core is the most
REQUEST_S = 10.0
SHOWN = ("seq", "time", "width", "height", "corners", "quad")  # of what the camera's process found


def save_lens(services: Services, result: JsonObject, about: JsonObject) -> JsonObject:
    """Save a lens; return its id and its record."""
    record = services.store.lenses.add({**result, **about})
    return {"lens": record["id"], "record": record}


class CaptureSession:
    """One viewer and the board before a live camera: the views that are worth a picture are saved.

        seen → still for STILL_S → like none that was taken → take

    captured: quads of the views that were taken before. automatic, take: as the viewer last asked.
    """

    def __init__(
        self,
        services: Services,
        camera: LiveCamera,
        board: Board,
        captured: Sequence[Any],
        automatic: bool,
    ) -> None:
        self.automatic, self.take = automatic, False
        self._services, self._camera, self._board = services, camera, board
        self._captured_before = captured
        self._capture: BoardCapture | None = None

    async def results(self) -> AsyncIterator[JsonObject]:
        """Detect the board again and again; yield what is seen, covered and needed."""
        loop, seq = asyncio.get_running_loop(), 0

        async def detect(_left_s: float) -> JsonObject:
            return (
                await self._camera.request(
                    "board", REQUEST_S, board=self._board.to_json(), after=seq
                )
            )[0]

        while True:
            start_s = loop.time()
            found = await when_awake(self._camera, detect)
            seq = found["seq"]
            yield await self._result(found, start_s)
            await asyncio.sleep(
                max(MIN_INTERVAL_S - (loop.time() - start_s), IDLE_SHARE * found["took_s"], 0.01)
            )

    async def _result(self, found: JsonObject, now_s: float) -> JsonObject:
        capture = self._capture_at(ImageSize(found["width"], found["height"]))
        state = capture.update(found["quad"], now_s)
        snapshot = None
        if found["quad"] is not None and (
            self.take or (self.automatic and state["still"] and state["new"])
        ):
            if capture.is_full:
                raise BadInput(
                    say(
                        "board.too-many-views",
                        "{most} views are the maximum for one lens.",
                        most=MAX_VIEWS,
                    ),
                    say("board.fit-these", "Fit the lens to these views."),
                    reason="too-many-views",
                )
            snapshot = await self._save_snapshot()
            capture.add_view(found["quad"])
        self.take = False
        return stated(
            {
                **{name: found[name] for name in SHOWN},
                **state,
                "automatic": self.automatic,
                "count": len(capture.poses),
                **capture.coverage.to_json(),
                "taken": None if snapshot is None else snapshot.to_json(),
            }
        )

    def _capture_at(self, size: ImageSize) -> BoardCapture:
        """Return the views of images of that size; with another size another lens begins."""
        if self._capture is None or self._capture.size != size:
            quads = self._captured_before if self._capture is None else ()
            self._capture = BoardCapture(self._board, size)
            for quad in quads:
                self._capture.add_view(quad)
        return self._capture

    async def _save_snapshot(self) -> Snapshot:
        frame = TakenFrame(self._camera, *await self._camera.still())
        return await self._services.run_in_thread(frame.save, self._services.store, "board")
