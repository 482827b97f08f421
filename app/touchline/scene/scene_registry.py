"""Open scenes: the process of each as the server's event loop sees it, and all of them by name."""

import asyncio
import contextlib
import secrets
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

from touchline.core.errors import Busy, NotFound
from touchline.core.statements import say
from touchline.processes.async_process import AsyncProcess
from touchline.processes.framing import decode_body
from touchline.processes.start import Program
from touchline.scene import messages

MEMORY_BYTES = 6 << 30  # of addresses: viser's threads reserve much more than they use
NICE = 10  # behind everything else: whoever looks at a scene can wait
ANSWER_S = 60.0
OnClick = Callable[[dict[str, Any]], None]
MAX_SCENES = 4  # at once: each is a process with viser in it


class SceneProcess(AsyncProcess):
    """A process with viser in it. port and key: where viser listens, and what it must be sent; viewers: how many."""

    PROGRAM = Program("touchline.scene.worker_main:main", MEMORY_BYTES, NICE)
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


class SceneRegistry:
    """Open scenes by name. Only for the event loop's own thread."""

    def __init__(self) -> None:
        self._open: dict[str, SceneProcess] = {}
        self._count = 0  # also those that are starting or ending

    @asynccontextmanager
    async def scene(self, on_click: OnClick = lambda _click: None) -> AsyncIterator[tuple[str, SceneProcess]]:
        """Yield a scene of one's own and its name in an address; Busy, Unavailable."""
        if self._count >= MAX_SCENES:
            raise Busy(say("scene.too-many", "{scenes} scenes are open, which is the maximum.", scenes=MAX_SCENES),
                       say("scene.close-one", "Close one in another tab."), reason="too-many-scenes")
        self._count += 1
        try:
            process = await SceneProcess.open(on_click)
            name = secrets.token_urlsafe(12)
            self._open[name] = process
            try:
                yield name, process
            finally:
                self._open.pop(name, None)
                await asyncio.shield(process.close())
        finally:
            self._count -= 1

    def get(self, name: str) -> SceneProcess:
        """Return one that is open; NotFound."""
        try:
            return self._open[name]
        except KeyError:
            raise NotFound(say("scene.not-open", "This scene is no longer open."),
                           say("scene.open-from-page", "Open it from the page."), reason="unknown-scene") from None

    async def aclose(self) -> None:
        processes, self._open = self._open, {}
        await asyncio.gather(*(process.close() for process in processes.values()))
