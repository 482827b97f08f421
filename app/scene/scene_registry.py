"""Every open scene by its address: started when one is asked for, ended with whoever asked, or with the server."""

import asyncio
import secrets
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from app.core.errors import Busy, NotFound
from app.scene.process import Heard, SceneProcess

MAX_SCENES = 4  # scenes at once: each is a process with viser in it


class SceneRegistry:
    """Only for the event loop's own thread."""

    def __init__(self) -> None:
        self._playing: dict[str, SceneProcess] = {}
        self._begun = 0

    @asynccontextmanager
    async def scene(self, clicked: Heard = lambda _told: None) -> AsyncIterator[tuple[str, SceneProcess]]:
        """A scene of one's own and its name in an address, as long as the context lasts; Busy, Unavailable."""
        if self._begun >= MAX_SCENES:
            raise Busy(f"{MAX_SCENES} scenes are open at once.", "Close one in another tab.", reason="too-many-scenes")
        self._begun += 1
        try:
            process = await SceneProcess.start(clicked)
            name = secrets.token_urlsafe(12)
            self._playing[name] = process
            try:
                yield name, process
            finally:
                self._playing.pop(name, None)
                await asyncio.shield(process.end())
        finally:
            self._begun -= 1

    def get(self, name: str) -> SceneProcess:
        """One that is open; NotFound."""
        try:
            return self._playing[name]
        except KeyError:
            raise NotFound("This scene is not open any more.", "Open it from the page.",
                           reason="unknown-scene") from None

    async def aclose(self) -> None:
        playing, self._playing = self._playing, {}
        await asyncio.gather(*(process.end() for process in playing.values()))
