"""/cameras/{id}/…: a camera's newest pictures, for pages (WebSocket), players and scripts (MJPEG, single frames).

Each viewer has one slot: the newest picture waits in it, and one that was not taken in time is missed.
"""

import asyncio
from contextlib import suppress
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Query, WebSocket
from starlette.responses import Response
from starlette.types import Receive, Scope, Send
from starlette.websockets import WebSocketDisconnect

from touchline.api.dependencies import ServicesDep
from touchline.api.middleware.connections import ABORT
from touchline.api.requests import Id
from touchline.api.responses import NO_STORE
from touchline.api.schemas import PICTURE, files
from touchline.api.sockets import SEND_TIMEOUT_S, run_until_first, websocket_session
from touchline.core.errors import BadInput, Conflict, Unavailable
from touchline.core.sentences import ACTIVATE_OR_RAW, NOT_CALIBRATED
from touchline.images import encode
from touchline.imaging.correction import CorrectedView
from touchline.live.camera import LiveCamera
from touchline.live.messages import StreamSpec
from touchline.models import model_of
from touchline.processes.framing import decode_body
from touchline.services.container import Services
from touchline.services.live import FIRST_FRAME_S, take_frame, when_awake
from touchline.workflows.calibration import correct

BOUNDARY = "touchline-frame"
MAX_FPS = 240.0


class MjpegResponse(Response):
    """Send the newest frame as fast as the connection takes it, until the viewer or the camera has gone."""

    media_type = f"multipart/x-mixed-replace; boundary={BOUNDARY}"

    def __init__(self, camera: LiveCamera, channel: StreamSpec, max_fps: float | None) -> None:
        super().__init__(headers=NO_STORE)
        del self.headers["content-length"]
        self._camera, self._channel, self._max_fps = camera, channel, max_fps

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        await run_until_first(self._send(scope, send), _until_disconnect(receive))

    async def _send(self, scope: Scope, send: Send) -> None:
        with self._camera.watching(self._channel, self._max_fps) as viewer:
            await send({"type": "http.response.start", "status": 200, "headers": self.raw_headers})
            with suppress(Unavailable):  # the camera was changed or removed
                async for body in viewer:
                    try:
                        async with asyncio.timeout(SEND_TIMEOUT_S):
                            await send(
                                {
                                    "type": "http.response.body",
                                    "body": _part(body),
                                    "more_body": True,
                                }
                            )
                    except TimeoutError:
                        scope.get("state", {}).get(ABORT, lambda: None)()
                        return
        await send({"type": "http.response.body", "body": f"--{BOUNDARY}--\r\n".encode()})


def _part(body: bytes) -> bytes:
    head, jpeg = decode_body(body)
    return (
        (
            f"--{BOUNDARY}\r\nContent-Type: image/jpeg\r\nContent-Length: {len(jpeg)}\r\n"
            f"X-Frame-Seq: {head['seq']}\r\nX-Frame-Time: {head['time']:.3f}\r\n\r\n"
        ).encode()
        + bytes(jpeg)
        + b"\r\n"
    )


async def _until_disconnect(receive: Receive) -> None:
    while (await receive())["type"] != "http.disconnect":
        pass


router = APIRouter(prefix="/cameras", tags=["cameras"])


ViewName = Annotated[
    str,
    Query(
        max_length=64,
        description="raw, corrected, side: both side by side; detections: raw "
        "with the detections, stage-NAME: result of a stage of the detection",
    ),
]
Width = Annotated[
    int, Query(ge=0, le=3840, description="of the picture, px; 0: as delivered by the camera")
]
Quality = Annotated[int, Query(ge=10, le=100, description="of the JPEG")]
Stale = Annotated[
    bool,
    Query(description="also the last frame of a camera that delivers none any more; only JPEG"),
]
Fps = Annotated[
    float | None,
    Query(gt=0, le=MAX_FPS, allow_inf_nan=False, description="at most; by default all"),
]


@router.get("/{id}/frame.{format}", response_class=Response, responses=PICTURE)
async def read_camera_frame(
    services: ServicesDep,
    id: Id,
    format: Literal["jpg", "png"],
    view: ViewName = "raw",
    width: Width = 0,
    quality: Quality = 90,
    stale: Stale = False,
) -> Response:
    """Return the newest frame. PNG is exact to the bit, at its own size; X-Frame-Seq and X-Frame-Time say which.

    503 while the camera delivers none, unless stale=1 asks for the last one all the same.
    """
    camera = services.live.get(id)
    if format == "png" and view not in ("raw", "corrected"):
        raise BadInput(
            "Only the raw view and the corrected view are available as PNG.",
            "Request one of them, or frame.jpg.",
            reason="unknown-view",
        )
    channel = _channel(camera, view, width, quality)
    if format == "png":
        return await _exact_frame(services, camera, view)
    with camera.watching(channel) as viewer:
        head, jpeg = decode_body(
            await when_awake(camera, viewer.next, FIRST_FRAME_S, must_be_live=not stale)
        )
    return Response(bytes(jpeg), media_type="image/jpeg", headers=_headers(head))


async def _exact_frame(services: Services, camera: LiveCamera, view: str) -> Response:
    frame = await take_frame(camera, FIRST_FRAME_S)
    png, calibration = frame.png, camera.calibration
    if view == "corrected":
        if calibration is None:
            raise Conflict(NOT_CALIBRATED, ACTIVATE_OR_RAW, reason="not-calibrated")

        def corrected() -> bytes:
            pixels = services.decoder.frame_from_bytes(frame.png).pixels
            return encode(
                correct(pixels, model_of(calibration), calibration.image_size, CorrectedView()),
                "png",
            )

        png = await services.run_in_thread(corrected)
    return Response(png, media_type="image/png", headers=_headers(frame.head))


def _headers(head: dict[str, Any]) -> dict[str, str]:
    return {"X-Frame-Seq": str(head["seq"]), "X-Frame-Time": f"{head['time']:.3f}", **NO_STORE}


def _channel(camera: LiveCamera, view: str, width: int, quality: int) -> StreamSpec:
    """Return what to watch; BadInput, or Conflict where the camera cannot show that view."""
    channel = StreamSpec.requested(view, width, quality)
    camera.require_view(view)
    return channel


@router.get(
    "/{id}/stream.mjpg",
    response_class=Response,
    responses=files(f"multipart/x-mixed-replace; boundary={BOUNDARY}"),
)
async def stream_camera_mjpeg(
    services: ServicesDep,
    id: Id,
    view: ViewName = "raw",
    width: Width = 0,
    quality: Quality = 80,
    fps: Fps = None,
) -> Response:
    """Stream multipart MJPEG for <img>, VLC and OpenCV; a browser opens at most six such streams of one server."""
    camera = services.live.get(id)
    channel = _channel(camera, view, width, quality)
    # whether there is a picture is known before the stream begins
    with camera.watching(channel, fps) as viewer:
        await when_awake(camera, viewer.next)
    return MjpegResponse(camera, channel, fps)


@router.websocket("/{id}/stream")
async def stream_frames(
    socket: WebSocket,
    services: ServicesDep,
    id: str,
    view: str = "raw",
    width: int = 0,
    quality: int = 80,
    fps: float | None = None,
    ack: bool = False,
) -> None:
    """Send one binary message a frame: uint32 length, so many bytes of JSON, the JPEG.

    With ack=true the next frame is sent when the viewer has answered the last one with any text: nothing is in transit
    that would be old when it arrives. What cannot be watched is answered with a problem as text; then it is closed.
    """
    async with websocket_session(socket):
        if fps is not None and not 0 < fps <= MAX_FPS:
            raise BadInput(
                f"{fps} frames per second is not a valid frame rate.",
                f"Use a value above 0, up to {MAX_FPS:g}.",
                reason="bad-fps",
            )
        camera = services.live.get(id)
        acks = asyncio.Semaphore(1)
        with camera.watching(_channel(camera, view, width, quality), fps) as viewer:
            await run_until_first(
                _receive_acks(socket, acks), _send_frames(socket, viewer, acks if ack else None)
            )


async def _send_frames(socket: WebSocket, viewer: Any, acks: asyncio.Semaphore | None) -> None:
    async for body in viewer:
        if acks is not None:
            async with asyncio.timeout(SEND_TIMEOUT_S):
                await acks.acquire()
            newer = viewer.take()  # while we waited for it
            body = newer if newer is not None else body
        async with asyncio.timeout(SEND_TIMEOUT_S):
            await socket.send_bytes(body)


async def _receive_acks(socket: WebSocket, acks: asyncio.Semaphore) -> None:
    """Count any text as an acknowledgement until the viewer has gone; more than one at a time gains nothing."""
    with suppress(WebSocketDisconnect):
        while True:
            message = await socket.receive()
            if message["type"] == "websocket.disconnect":
                return
            if acks.locked():
                acks.release()
