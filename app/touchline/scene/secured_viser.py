"""viser on this machine only, and for clients with the key; by itself it admits everybody.

It asks for no login and looks at no Origin, so that any page in a browser on this machine could read the scene; and any
viewer could have it call a server elsewhere that passes the scene on. Here a connection without the key is refused,
no file is served, and no tunnel opened. The page reaches the scene through our own server, which has the key and asks
for the login (api/scene_proxy.py).
"""

import hmac
import http
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import viser
import websockets.asyncio.server
from viser import _messages
from websockets.http11 import Request, Response

from touchline.scene.messages import KEY_HEADER

PORT_FROM_OUTSIDE = "_VISER_PORT_OVERRIDE"
UNWANTED = (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect, _messages.FileTransferStartUpload,
            _messages.FileTransferPart)


class SecuredViser(viser.ViserServer):
    """A ViserServer at 127.0.0.1 on any free port; get_port() says which."""

    def __init__(self, key: str) -> None:
        os.environ.pop(PORT_FROM_OUTSIDE, None)
        with _requiring_key(key) as secured:
            super().__init__(host="127.0.0.1", port=0, verbose=False)
        if not secured:
            self.stop()
            raise RuntimeError("this viser starts its server in a way that we cannot secure")
        for unwanted in UNWANTED:
            self._websock_server._incoming_handlers.pop(unwanted, None)
        self.gui.configure_theme(show_logo=False, show_share_button=False)

    def request_share_url(self, verbose: bool = True) -> None:
        """Refuse: the scene is for those who may open the page."""
        return None


@contextmanager
def _requiring_key(key: str) -> Iterator[list[bool]]:
    """Make a server that viser starts answer 403 without the key; the list is then not empty."""
    secured: list[bool] = []
    module = vars(websockets.asyncio.server)
    plain = module["serve"]

    def require_key(connection: Any, request: Request) -> Response | None:
        given = request.headers.get(KEY_HEADER, "")
        if hmac.compare_digest(given.encode("utf-8", "replace"), key.encode()):
            return None
        return connection.respond(http.HTTPStatus.FORBIDDEN, "Open it through Touchline's own page.\n")

    def serve(*args: Any, **more: Any) -> Any:
        secured.append(True)
        return plain(*args, **{**more, "process_request": require_key})

    module["serve"] = serve
    try:
        yield secured
    finally:
        module["serve"] = plain
