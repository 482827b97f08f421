"""A scene's process seen from the server's event loop."""

import asyncio
import contextlib
import secrets
from collections.abc import Callable
from typing import Any

from app.processes.async_process import AsyncProcess
from app.processes.framing import decode_body
from app.processes.start import Program
from app.scene import messages

MEMORY_BYTES = 6 << 30  # of addresses: viser's threads reserve much more than they use
NICE = 10  # behind everything else: whoever looks at a scene can wait
ANSWER_S = 60.0
OnClick = Callable[[dict[str, Any]], None]


class SceneProcess(AsyncProcess):
    """A process with viser in it. port and key: where viser listens, and what it must be sent; viewers: how many."""

    PROGRAM = Program("app.scene.worker_main:main", MEMORY_BYTES, NICE)
    START_S = 45.0  # importing viser takes 1 s, on a busy small machine many
    CANNOT_START = NOT_READY = ("The 3-D scene cannot be started.",
                                "Free some memory, then open the scene again.", "scene-process")
    SILENT = "The scene is not responding.", "Open it again.", "scene-silent"
    ENDED = "The 3-D scene has ended.", "Open the scene again.", "scene-gone"
    key: str
    port: int
    viewers: int
    _on_click: OnClick
    _listening: asyncio.Task[None]

    @classmethod
    async def open(cls, on_click: OnClick) -> "SceneProcess":
        """Return a living process with an empty scene. on_click: called with what a click on the carpet means."""
        key = secrets.token_hex(16)
        process = await cls.start({"key": key})
        process.key, process.port, process.viewers = key, process.start_head["port"], 0
        process._on_click = on_click
        process._listening = asyncio.create_task(process._listen(), name="scene")
        return process

    @property
    def is_alive(self) -> bool:
        return not self._listening.done()

    async def show(self, given: dict[str, Any]) -> dict[str, Any]:
        """Draw it all anew; return what is said beside the scene. What cannot be shown is refused."""
        return (await self.request(messages.DRAW, given, ANSWER_S))[0]

    async def export(self, title: str, dark: bool) -> bytes:
        """Return the scene as it is, as one HTML file."""
        return (await self.request(messages.EXPORT, {"title": title, "dark": dark}, ANSWER_S))[1]

    async def close(self) -> None:
        """End the process, and the listening to it."""
        await self.end()
        self._listening.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await self._listening

    async def _listen(self) -> None:
        with contextlib.suppress(OSError, asyncio.IncompleteReadError):
            while True:
                kind, _, body = await self.receive()
                if kind == messages.CLICKED:
                    self._on_click(decode_body(body)[0])
                elif kind == messages.VIEWERS:
                    self.viewers = decode_body(body)[0]["count"]
        self.fail_requests()
