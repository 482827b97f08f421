"""/cameras/{id}/…: a camera's newest pictures, for pages (WebSocket), for players and scripts (MJPEG, single frames).

Who watches has one slot: the newest picture waits in it, and one that was not taken in time is missed.
"""

import asyncio
import time
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Annotated, Any, Literal, TypeVar

from fastapi import APIRouter, Query, Request, WebSocket
from starlette.responses import Response
from starlette.websockets import WebSocketDisconnect

from app.api.mjpeg import BOUNDARY, NO_STORE, TAKE_S, Mjpeg
from app.api.schemas.requests import Id
from app.api.sockets import refuse, until_either
from app.api.work import at_work
from app.core.errors import BadInput, Conflict, TouchlineError, Unavailable
from app.images import encode
from app.imaging.correction import CorrectedView as CorrectedView
from app.live import LiveCamera, StreamSpec
from app.live.messages import parts
from app.models import model_from_json
from app.workflows.calibration import correct

router = APIRouter(prefix="/cameras", tags=["cameras"])
T = TypeVar("T")

FIRST_S = 5.0  # a camera that was asleep gets so long to show its first picture
MAX_FPS = 240.0
BYTES = {"schema": {"type": "string", "format": "binary"}}

ViewName = Annotated[str, Query(max_length=64, description="raw, corrected, side: both side by side; detections: raw "
                                "with what was found, stage-NAME: what a stage of seeing made of it")]
Width = Annotated[int, Query(ge=0, le=3840, description="of the picture, px; 0 as the camera gives it")]
Quality = Annotated[int, Query(ge=10, le=100, description="of the JPEG")]
Fps = Annotated[float | None, Query(gt=0, le=MAX_FPS, allow_inf_nan=False, description="at most; all when left out")]


@router.get("/{id}/frame.{format}", response_class=Response,
            responses={200: {"content": {"image/jpeg": BYTES, "image/png": BYTES}}})
async def show_frame(request: Request, id: Id, format: Literal["jpg", "png"], view: ViewName = "raw",
                     width: Width = 0, quality: Quality = 90) -> Response:
    """The newest frame. PNG is the frame exact to the bit, at its own size; X-Frame-Seq and X-Frame-Time say which."""
    camera = await live_camera(request, id)
    if format == "png" and view not in ("raw", "corrected"):
        raise BadInput("Only the raw and the corrected view are a PNG.", "Ask for one of them, or for frame.jpg.",
                       reason="unknown-view")
    channel = StreamSpec.requested(view, width, quality)
    camera.require_view(view)
    if format == "png":
        return await _exactly(request, camera, view)
    with camera.watching(channel) as viewer:
        head, jpeg = parts(await first_picture(camera, viewer.next))
    return Response(bytes(jpeg), media_type="image/jpeg", headers=_which(head))


async def _exactly(request: Request, camera: LiveCamera, view: str) -> Response:
    head, png = await first_picture(camera, lambda timeout_s: camera.still(1, timeout_s))
    if view == "corrected":
        calibration = camera.calibration
        if calibration is None:
            raise Conflict("This camera has no active calibration.", "Activate one, or take the raw view.",
                           reason="not-calibrated")

        def corrected() -> bytes:
            frame = request.app.state.decoder.frame_from_bytes(png)
            model = model_from_json(calibration.model_name, calibration.model_parameters)
            return encode(correct(frame.pixels, model, calibration.image_size, CorrectedView()), "png")
        png = await at_work(request, corrected)
    return Response(png, media_type="image/png", headers=_which(head))


def _which(head: dict[str, Any]) -> dict[str, str]:
    return {"X-Frame-Seq": str(head["seq"]), "X-Frame-Time": f"{head['time']:.3f}", **NO_STORE}


@router.get("/{id}/stream.mjpg", response_class=Response,
            responses={200: {"content": {f"multipart/x-mixed-replace; boundary={BOUNDARY}": BYTES}}})
async def stream_mjpeg(request: Request, id: Id, view: ViewName = "raw", width: Width = 0, quality: Quality = 80,
                       fps: Fps = None) -> Response:
    """Multipart MJPEG for <img>, VLC and OpenCV; a browser opens at most six such streams of one server at once."""
    camera = await live_camera(request, id)
    channel = StreamSpec.requested(view, width, quality)
    camera.require_view(view)
    with camera.watching(channel, fps) as viewer:  # whether there is a picture is said before the stream begins
        await first_picture(camera, viewer.next)
    return Mjpeg(camera, channel, fps)


@router.websocket("/{id}/stream")
async def stream_frames(socket: WebSocket, id: str, view: str = "raw", width: int = 0, quality: int = 80,
                        fps: float | None = None, ack: bool = False) -> None:
    """One binary message a frame: uint32 length, so many bytes of JSON, the JPEG.

    With ack=true the next frame is sent when the viewer has answered the last one with any text: nothing is on its way
    that would be old when it arrives. What cannot be watched is said in a text message, a problem; then it is closed.
    """
    await socket.accept()
    try:
        if fps is not None and not 0 < fps <= MAX_FPS:
            raise BadInput(f"A stream cannot have {fps} frames a second.", f"Use more than 0, up to {MAX_FPS:g}.",
                           reason="bad-fps")
        camera = await live_camera(socket, id)
        channel = StreamSpec.requested(view, width, quality)
        camera.require_view(view)
    except TouchlineError as error:
        await refuse(socket, error)
        return
    with camera.watching(channel, fps) as viewer:
        acks = asyncio.Semaphore(1)
        error = await until_either(_heard(socket, acks), _sent(socket, viewer, acks if ack else None))
    if error is not None:
        await refuse(socket, error)


async def _sent(socket: WebSocket, viewer: Any, acks: asyncio.Semaphore | None) -> None:
    async for body in viewer:
        if acks is not None:
            await asyncio.wait_for(acks.acquire(), TAKE_S)
            newer = viewer.take()  # while we waited for it
            body = newer if newer is not None else body
        await asyncio.wait_for(socket.send_bytes(body), TAKE_S)


async def _heard(socket: WebSocket, acks: asyncio.Semaphore) -> None:
    """Until the viewer goes. Any text is an acknowledgement; more than one at a time buys nothing."""
    with suppress(WebSocketDisconnect):
        while True:
            message = await socket.receive()
            if message["type"] == "websocket.disconnect":
                return
            if acks.locked():
                acks.release()


async def live_camera(connection: Request | WebSocket, id: str) -> LiveCamera:
    """The camera, awake; NotFound. Nothing blocks here but the store's first look at an unknown id."""
    return connection.app.state.live.get(id)


async def first_picture(camera: LiveCamera, take: Callable[[float], Awaitable[T]], timeout_s: float = FIRST_S) -> T:
    """A picture, from a camera that may have been asleep until now; Unavailable says what is wrong with it."""
    end = time.monotonic() + timeout_s
    while (status := camera.status())["seq"] in (None, 0) and time.monotonic() < end:
        if status["state"] == "offline":  # it says itself what is wrong
            raise _silent(camera)
        await asyncio.sleep(0.05)
    try:
        return await take(max(1.0, end - time.monotonic()))
    except (TimeoutError, Unavailable):
        raise _silent(camera) from None


def _silent(camera: LiveCamera) -> Unavailable:
    problem = camera.status()["problem"] or {"what": "This camera has shown no picture yet.",
                                             "fix": "Try again in a moment.", "reason": "camera-silent"}
    return Unavailable(problem["what"], problem["fix"], reason=problem["reason"])
