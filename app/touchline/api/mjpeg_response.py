"""A stream of JPEGs as one response that never ends: for <img>, VLC and OpenCV."""

import asyncio
from contextlib import suppress

from starlette.responses import Response
from starlette.types import Receive, Scope, Send

from touchline.api.middleware.connections import ABORT
from touchline.api.responses import NO_STORE
from touchline.api.sockets import SEND_TIMEOUT_S, run_until_first
from touchline.core.errors import Unavailable
from touchline.live.camera import LiveCamera
from touchline.live.messages import StreamSpec
from touchline.processes.framing import decode_body

BOUNDARY = "touchline-frame"


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
                            await send({"type": "http.response.body", "body": _part(body), "more_body": True})
                    except TimeoutError:
                        scope.get("state", {}).get(ABORT, lambda: None)()
                        return
        await send({"type": "http.response.body", "body": f"--{BOUNDARY}--\r\n".encode()})


def _part(body: bytes) -> bytes:
    head, jpeg = decode_body(body)
    return (f"--{BOUNDARY}\r\nContent-Type: image/jpeg\r\nContent-Length: {len(jpeg)}\r\n"
            f"X-Frame-Seq: {head['seq']}\r\nX-Frame-Time: {head['time']:.3f}\r\n\r\n").encode() + bytes(jpeg) + b"\r\n"


async def _until_disconnect(receive: Receive) -> None:
    while (await receive())["type"] != "http.disconnect":
        pass
