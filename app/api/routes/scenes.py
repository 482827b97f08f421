"""WS /scene: a scene in 3-D for one page, as long as the line is open; GET …/scene.html: the same as a file."""

import asyncio
from contextlib import suppress
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, WebSocket
from starlette.responses import HTMLResponse
from starlette.websockets import WebSocketDisconnect

from app.api.answers import json_bytes
from app.api.file_headers import disposition
from app.api.mjpeg import TAKE_S
from app.api.routes.reports import HTML
from app.api.schemas.requests import Id
from app.api.schemas.scenes import SceneShow, read_word
from app.api.sockets import refuse, until_either
from app.api.work import at_work
from app.core.errors import TouchlineError, Unavailable
from app.core.records import Calibration
from app.live import StreamSpec
from app.live.messages import parts, payload
from app.scene import messages
from app.scene.policy import EXPORT_POLICY
from app.scene.process import SceneProcess
from app.services.scenes import records_of, still_of, title_of

router = APIRouter(tags=["scene"])

PICTURE_PX, PICTURE_QUALITY, SEEN_FPS = 480, 70, 5.0
STILL_S = 2.0
IDLE_S = 300.0  # without anybody who looks: a tab that sleeps, or a script that has forgotten
LOOK_S = 1.0
SILENT_S = 5.0  # without a word of what is seen
MOST_WAITING = 50  # messages for a page that takes none
Dark = Annotated[bool, Query(description="on a dark ground")]


@router.websocket("/scene")
async def open_scene(socket: WebSocket) -> None:
    """Hear {"address"}; say {"show": {…}} and {"set": {…}}; hear {"shown"}, {"clicked"}, {"problem"}.

    The scene's process begins with the line and ends with it, or when nobody looks any more.
    """
    await socket.accept()
    session = Session(socket)
    try:
        async with socket.app.state.scenes.scene(lambda told: session.say({"clicked": told})) as (name, process):
            session.say({"address": f"/viser/{name}/"})
            try:
                error = await until_either(session.hear(process), session.tell(), _until_over(process))
            finally:
                await session.end()
        if error is not None:
            await refuse(socket, error)
    except TouchlineError as error:
        await refuse(socket, error)
    with suppress(RuntimeError, WebSocketDisconnect):
        await socket.close()


async def _until_over(process: SceneProcess) -> None:
    """Until its process has died, or nobody has looked for long."""
    seen_s = 0.0
    while process.is_alive:
        await asyncio.sleep(LOOK_S)
        seen_s = 0.0 if process.viewers else seen_s + LOOK_S
        if seen_s > IDLE_S:
            raise Unavailable("Nobody has looked at this scene for long, so it was closed.", "Open the page anew.",
                              reason="scene-idle")
    raise Unavailable("The scene's process has ended.", "Open the scene again.", reason="scene-gone")


class Session:
    """One page and its scene."""

    def __init__(self, socket: WebSocket) -> None:
        self._socket = socket
        self._waiting: asyncio.Queue[dict[str, Any]] = asyncio.Queue(MOST_WAITING)
        self._wants_things = False
        self._feeding: list[asyncio.Task[None]] = []

    def say(self, told: dict[str, Any]) -> None:
        """To the page, in order; one that takes nothing hears no more."""
        with suppress(asyncio.QueueFull):
            self._waiting.put_nowait(told)

    async def tell(self) -> None:
        while True:
            told = await self._waiting.get()
            await asyncio.wait_for(self._socket.send_text(json_bytes(told).decode()), TAKE_S)

    async def hear(self, process: SceneProcess) -> None:
        """Until the page goes. What cannot be shown is told, and the scene stays as it was."""
        while True:
            word = read_word(await self._socket.receive_text())
            if word.set is not None:
                if word.set.layers is not None:
                    self._wants_things = "things" in word.set.layers
                process.send(messages.SET_VIEW, word.set.model_dump(exclude_none=True))
            if word.show is not None:
                try:
                    await self._show(process, word.show)
                except TouchlineError as error:
                    self.say({"problem": {"reason": error.reason, "detail": error.what, "fix": error.fix}})

    async def end(self) -> None:
        """No more pictures."""
        tasks, self._feeding = self._feeding, []
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _show(self, process: SceneProcess, asked: SceneShow) -> None:
        records = await at_work(self._socket, records_of, self._socket, asked)
        told = await process.show(records.given)
        self.say({"shown": {**told, "missing": records.missing}})
        await self.end()
        for key, calibration in records.calibrations.items():
            self._feeding.append(asyncio.create_task(self._feed(process, key, calibration, asked)))
            if asked.live and calibration.camera is not None:
                self._feeding.append(asyncio.create_task(self._feed_things(process, key, calibration)))

    async def _feed(self, process: SceneProcess, key: str, calibration: Calibration, asked: SceneShow) -> None:
        """The picture that was clicked; then, where there is such a camera, what it sees now."""
        still = await at_work(self._socket, still_of, self._socket, calibration)
        if still is not None:
            process.send(messages.PICTURE, {"key": key}, still)
        if not asked.live or calibration.camera is None:
            return
        await asyncio.sleep(STILL_S)  # viser forgets a picture that it is still unpacking when the next one comes
        with suppress(TouchlineError):  # there is no such camera any more, or it was changed meanwhile
            camera = self._socket.app.state.live.get(calibration.camera)
            channel = StreamSpec.requested("raw", PICTURE_PX, PICTURE_QUALITY)
            with camera.watching(channel, asked.fps) as viewer:
                async for body in viewer:
                    status = camera.status()
                    same = (status["width"], status["height"]) == tuple(calibration.image_size)
                    if same and process.viewers and not process.is_congested:
                        process.send(messages.PICTURE, {"key": key}, bytes(payload(body)))

    async def _feed_things(self, process: SceneProcess, key: str, calibration: Calibration) -> None:
        """What the camera sees on the field, by this very calibration; only while that layer is wanted, as the camera's
        process works for it."""
        while True:
            await asyncio.sleep(LOOK_S)
            if not self._wants_things:
                continue
            cameras = self._socket.app.state.live
            with (suppress(TouchlineError, TimeoutError),  # switched off, silent, or gone
                  cameras.get(calibration.camera).detections.listening(SEEN_FPS) as viewer):
                while self._wants_things:
                    told = parts(await viewer.next(SILENT_S))[0]
                    things = told["items"] if told["calibration"] == calibration.id else []
                    if process.viewers and not process.is_congested:
                        process.send(messages.DETECTIONS, {"key": key, "things": things})
            process.send(messages.DETECTIONS, {"key": key, "things": []})


@router.get("/calibrations/{id}/scene.html", response_class=HTMLResponse, responses=HTML)
async def scene_page(request: Request, id: Id, dark: Dark = False) -> HTMLResponse:
    """The scene as one HTML file of about 1 MB that asks for nothing else: to keep beside the report."""
    asked = SceneShow(calibrations=[id], live=False)
    records = await at_work(request, records_of, request, asked)
    calibration = records.calibrations[id]
    title = f"{title_of(request, calibration.camera)}, version {calibration.version}"
    still = await at_work(request, still_of, request, calibration)
    of = (id, dark, title, still)
    html = request.app.state.scene_pages.get(of)
    if html is None:
        async with request.app.state.scenes.scene() as (_, process):
            process.send(messages.SET_VIEW, {"dark": dark})
            await process.show(records.given)
            if still is not None:
                process.send(messages.PICTURE, {"key": id}, still)
            html = await process.export(f"Scene of {title}", dark)
        request.app.state.scene_pages.keep(of, html)
    name = f"{calibration.camera or calibration.field['name']}-v{calibration.version}-scene.html"
    return HTMLResponse(html, headers={
        # an origin of its own: whatever runs in it has no part in ours
        "Content-Security-Policy": f"sandbox allow-scripts; {EXPORT_POLICY}; frame-ancestors 'self'",
        "Cache-Control": "no-cache", "Content-Disposition": disposition("inline", name)})
