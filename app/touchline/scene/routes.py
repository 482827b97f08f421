"""WS /scene: a 3-D scene for one page, while the socket is open; GET …/scene.html: the same as a file.

/viser/NAME/: an open scene under our own port and login; viser itself accepts only this proxy.
"""

import asyncio
from contextlib import suppress
from typing import Annotated, Literal

from fastapi import APIRouter, Query, WebSocket
from pydantic import Field, StringConstraints
from starlette.responses import HTMLResponse
from starlette.websockets import WebSocketDisconnect
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import WebSocketException
from websockets.typing import Subprotocol

from touchline.api.dependencies import ServicesDep
from touchline.api.requests import Id
from touchline.api.responses import disposition
from touchline.api.schemas import HTML
from touchline.api.sockets import receive_json, run_until_first, send_json, websocket_session
from touchline.core.errors import NotFound, TouchlineError, Unavailable
from touchline.core.json_values import JsonObject
from touchline.core.records import Calibration
from touchline.core.statements import say, stated
from touchline.live.messages import StreamSpec
from touchline.processes.framing import decode_body, split_body
from touchline.scene import messages
from touchline.scene.service import (
    EXPORT_POLICY,
    PAGE_POLICY,
    SceneProcess,
    SceneState,
    calibration_jpeg,
    client_page,
    scene_content,
    title_of,
)
from touchline.services.container import Services
from touchline.services.forms import Strict

router = APIRouter(tags=["scene"])
viser_proxy = APIRouter(prefix="/viser", include_in_schema=False)

LIVE_PX, LIVE_QUALITY, DETECTIONS_FPS = 480, 70, 5.0
SAVED_PICTURE_S = 2.0
IDLE_S = 300.0  # without a viewer: a tab that sleeps, or a script that has forgotten
POLL_S = 1.0
SILENT_S = 5.0  # without detections
MAX_WAITING = 50  # messages for a page that takes none
MAX_MESSAGE = 20_000  # characters
MAX_CAMERAS = 16
VISER_PROTOCOL = "viser-v"
MAX_VIEWER_BYTES = 1 << 20  # of a viewer's message: cameras and clicks have some hundred bytes
OPEN_S = 10.0
Dark = Annotated[bool, Query(description="on a dark ground")]
SceneName = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")]
Layer = Literal["pictures", "rays", "arrows", "footprints", "labels", "moved", "things"]


class SceneShow(Strict):
    """calibrations, or a rig by its name, or a lens from a board; before: an older version to show the changes."""

    calibrations: Annotated[list[SceneName], Field(min_length=1, max_length=MAX_CAMERAS)] | None = (
        None
    )
    rig: SceneName | None = None
    lens: SceneName | None = None
    before: SceneName | None = None
    live: bool = True
    # of live pictures; a slow viewer that gets too many shows none
    fps: Annotated[float, Field(ge=0.1, le=5)] = 5.0


class SceneSet(Strict):
    """How the scene is viewed: see ViewState."""

    layers: Annotated[list[Layer], Field(max_length=16)] | None = None
    hidden: Annotated[list[SceneName], Field(max_length=MAX_CAMERAS)] | None = None
    sheet: Literal["none", "carpet", "hat"] | None = None
    scale: Annotated[float, Field(ge=0.1, le=1000)] | None = None
    dark: bool | None = None
    view: Literal["free", "above", "camera"] | None = None
    through: Annotated[str, Field(max_length=64)] | None = None


class SceneMessage(Strict):
    """One message: either, or both."""

    show: SceneShow | None = None
    set: SceneSet | None = None


@router.websocket("/scene")
async def open_scene(socket: WebSocket, services: ServicesDep) -> None:
    """Send {"address"}; receive {"show": {…}} and {"set": {…}}; send {"shown"}, {"clicked"}, {"problem"}.

    The scene's process starts with the connection and ends with it, or when nobody looks any more.
    """
    session, scenes = SceneSession(socket, services), services.part(SceneState)
    async with (
        websocket_session(socket),
        scenes.open.scene(lambda click: session.queue({"clicked": click})) as (name, process),
    ):
        session.queue({"address": f"/viser/{name}/"})
        try:
            await run_until_first(session.receive(process), session.send(), _until_over(process))
        finally:
            await session.stop_feeds()


async def _until_over(process: SceneProcess) -> None:
    """Raise when the scene's process has died, or nobody has looked for long."""
    idle_s = 0.0
    while process.is_alive:
        await asyncio.sleep(POLL_S)
        idle_s = 0.0 if process.viewers else idle_s + POLL_S
        if idle_s > IDLE_S:
            raise Unavailable(
                say("scene.unused", "The scene was closed because it was not used."),
                say("scene.reload", "Reload the page."),
                reason="scene-idle",
            )
    raise Unavailable(
        say("scene.process-ended", "The scene process has stopped."),
        say("scene.open-again", "Open the scene again."),
        reason="scene-gone",
    )


class SceneSession:
    """One page and its scene."""

    def __init__(self, socket: WebSocket, services: Services) -> None:
        self._socket, self._services = socket, services
        self._waiting: asyncio.Queue[JsonObject] = asyncio.Queue(MAX_WAITING)
        self._shows_detections = False
        self._feeds: list[asyncio.Task[None]] = []

    def queue(self, message: JsonObject) -> None:
        """Send a message to the page, in order; one that takes nothing gets no more."""
        with suppress(asyncio.QueueFull):
            self._waiting.put_nowait(message)

    async def send(self) -> None:
        while True:
            await send_json(self._socket, await self._waiting.get())

    async def receive(self, process: SceneProcess) -> None:
        """Follow the page's messages until it has gone; what cannot be shown leaves the scene as it was."""
        while True:
            message = await receive_json(
                self._socket,
                SceneMessage,
                MAX_MESSAGE,
                'Send {"show": {"calibrations": [id]}} or {"set": {"view": "above"}}.',
            )
            if message.set is not None:
                if message.set.layers is not None:
                    self._shows_detections = "things" in message.set.layers
                process.send(messages.SET_VIEW, message.set.model_dump(exclude_none=True))
            if message.show is not None:
                try:
                    await self._show(process, message.show)
                except TouchlineError as error:
                    self.queue(
                        {
                            "problem": stated(
                                {"reason": error.reason, "detail": error.what, "fix": error.fix}
                            )
                        }
                    )

    async def stop_feeds(self) -> None:
        """Send no more pictures to the scene."""
        feeds, self._feeds = self._feeds, []
        for feed in feeds:
            feed.cancel()
        await asyncio.gather(*feeds, return_exceptions=True)

    async def _show(self, process: SceneProcess, show: SceneShow) -> None:
        content = await self._services.run_in_thread(
            scene_content, self._services, show.calibrations, show.rig, show.lens, show.before
        )
        result = await process.show(content.records)
        self.queue({"shown": {**result, "missing": content.missing}})
        await self.stop_feeds()
        for key, calibration in content.calibrations.items():
            self._feeds.append(
                asyncio.create_task(self._feed_pictures(process, key, calibration, show))
            )
            if show.live and calibration.camera is not None:
                self._feeds.append(
                    asyncio.create_task(
                        self._feed_detections(process, key, calibration.camera, calibration.id)
                    )
                )

    async def _feed_pictures(
        self, process: SceneProcess, key: str, calibration: Calibration, show: SceneShow
    ) -> None:
        """Send the picture that was calibrated; then, where there is such a camera, what it sees now."""
        jpeg = await self._services.run_in_thread(calibration_jpeg, self._services, calibration)
        if jpeg is not None:
            process.send(messages.PICTURE, {"key": key}, jpeg)
        if not show.live or calibration.camera is None:
            return
        # viser loses a picture that it still unpacks when the next one comes
        await asyncio.sleep(SAVED_PICTURE_S)
        with suppress(TouchlineError):  # the camera was removed, or changed meanwhile
            camera = self._services.live.get(calibration.camera)
            channel = StreamSpec.requested("raw", LIVE_PX, LIVE_QUALITY)
            with camera.watching(channel, show.fps) as viewer:
                async for body in viewer:
                    status = camera.status()
                    same = (status["width"], status["height"]) == tuple(calibration.image_size)
                    if same and process.viewers and not process.is_congested:
                        process.send(messages.PICTURE, {"key": key}, bytes(split_body(body)[1]))

    async def _feed_detections(
        self, process: SceneProcess, key: str, camera: str, calibration: str
    ) -> None:
        """Send what the camera detects by this very calibration, while that layer is shown.

        Else it does not listen: the camera's process works for listeners.
        """
        while True:
            await asyncio.sleep(POLL_S)
            if not self._shows_detections:
                continue
            with (
                suppress(TouchlineError, TimeoutError),  # switched off, silent, or gone
                self._services.live.get(camera)
                .feeds["detections"]
                .listening(DETECTIONS_FPS) as viewer,
            ):
                while self._shows_detections:
                    result = decode_body(await viewer.next(SILENT_S))[0]
                    detections = result["items"] if result["calibration"] == calibration else []
                    if process.viewers and not process.is_congested:
                        process.send(messages.DETECTIONS, {"key": key, "things": detections})
            process.send(messages.DETECTIONS, {"key": key, "things": []})


@router.get("/calibrations/{id}/scene.html", response_class=HTMLResponse, responses=HTML)
async def read_scene_page(
    services: ServicesDep, id: Id, dark: Dark = False, before: Id | None = None
) -> HTMLResponse:
    """Return the scene as one HTML file of about 1 MB that loads nothing else: to save next to the report.

    before: an older version of the same camera, to show the changes.
    """
    content = await services.run_in_thread(scene_content, services, [id], before=before)
    calibration = content.calibrations[id]
    title = f"{title_of(services, calibration)}, version {calibration.version}"
    jpeg = await services.run_in_thread(calibration_jpeg, services, calibration)
    key = (id, before, dark, title, jpeg)
    scenes = services.part(SceneState)
    html = scenes.files.get(key)
    if html is None:
        async with scenes.open.scene() as (_, process):
            process.send(messages.SET_VIEW, {"dark": dark})
            await process.show(content.records)
            if jpeg is not None:
                process.send(messages.PICTURE, {"key": id}, jpeg)
            html = await process.export(f"Scene of {title}", dark)
        scenes.files.put(key, html)
    name = f"{calibration.camera or calibration.field['name']}-v{calibration.version}-scene.html"
    return HTMLResponse(
        html,
        headers={
            # an origin of its own: whatever runs in it has no part in ours
            "Content-Security-Policy": f"sandbox allow-scripts; {EXPORT_POLICY}; frame-ancestors 'self'",
            "Cache-Control": "no-cache",
            "Content-Disposition": disposition("inline", name),
        },
    )


@viser_proxy.get("/{name}/")
async def show_viser(services: ServicesDep, name: str) -> HTMLResponse:
    services.part(SceneState).open.get(name)
    return HTMLResponse(
        client_page(), headers={"Content-Security-Policy": PAGE_POLICY, "Cache-Control": "no-cache"}
    )


@viser_proxy.websocket("/{name}")
async def forward_viser(socket: WebSocket, services: ServicesDep, name: str) -> None:
    """Forward bytes both ways and the subprotocol's name; nothing is read or stored."""
    offered = [
        Subprotocol(one)
        for one in socket.scope.get("subprotocols") or ()
        if one.startswith(VISER_PROTOCOL)
    ]
    try:
        scene = services.part(SceneState).open.get(name)
        inner = await connect(
            f"ws://127.0.0.1:{scene.port}/",
            subprotocols=offered or None,
            proxy=None,
            additional_headers={messages.KEY_HEADER: scene.key},
            max_size=None,
            compression=None,
            open_timeout=OPEN_S,
        )
    except (NotFound, OSError, TimeoutError, WebSocketException):
        await socket.close(1008)  # before it was accepted: 403
        return
    async with inner:
        await socket.accept(subprotocol=inner.subprotocol)
        await run_until_first(_to_client(inner, socket), _to_viser(socket, inner))


async def _to_client(inner: ClientConnection, socket: WebSocket) -> None:
    async for message in inner:
        if isinstance(message, bytes):
            await socket.send_bytes(message)


async def _to_viser(socket: WebSocket, inner: ClientConnection) -> None:
    while True:
        message = await socket.receive()
        if message["type"] == "websocket.disconnect":
            raise WebSocketDisconnect
        data = message.get("bytes")
        if data is None or len(data) > MAX_VIEWER_BYTES:
            return
        await inner.send(data)
