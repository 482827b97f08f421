"""Every open scene by name: started on request, ended with the request or the server."""

import asyncio
import secrets
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from app.core.errors import Busy, NotFound
from app.scene.process import Heard, SceneProcess

MAX_SCENES = 4  # open at once: each is a process with viser in it


class SceneRegistry:
    """Open scenes by name. Only for the event loop's own thread."""

    def __init__(self) -> None:
        self._open: dict[str, SceneProcess] = {}
        self._count = 0

    @asynccontextmanager
    async def scene(self, clicked: Heard = lambda _told: None) -> AsyncIterator[tuple[str, SceneProcess]]:
        """Open a scene for as long as the context lasts; yield its name and process. Busy, Unavailable."""
        if self._count >= MAX_SCENES:
            raise Busy(f"{MAX_SCENES} scenes are open at once.", "Close one in another tab.", reason="too-many-scenes")
        self._count += 1
        try:
            process = await SceneProcess.start(clicked)
            name = secrets.token_urlsafe(12)
            self._open[name] = process
            try:
                yield name, process
            finally:
                self._open.pop(name, None)
                await asyncio.shield(process.end())
        finally:
            self._count -= 1

    def get(self, name: str) -> SceneProcess:
        """Return an open scene; NotFound."""
        try:
            return self._open[name]
        except KeyError:
            raise NotFound("This scene is not open any more.", "Open it from the page.",
                           reason="unknown-scene") from None

    async def aclose(self) -> None:
        scenes, self._open = self._open, {}
        await asyncio.gather(*(process.end() for process in scenes.values()))
