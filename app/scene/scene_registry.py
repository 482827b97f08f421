"""Every open scene by name: started on request, ended with the request or the server."""

import asyncio
import secrets
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from app.core.errors import Busy, NotFound
from app.core.statements import say
from app.scene.process import OnClick, SceneProcess

MAX_SCENES = 4  # at once: each is a process with viser in it


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
