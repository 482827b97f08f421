"""The process of one scene: viser and all that it draws."""

from collections.abc import Callable
from typing import Any

import cv2
import numpy as np

from touchline.processes.framing import START, Connection, answer, decode_body, encode_body
from touchline.scene import messages
from touchline.scene.export import whole_page
from touchline.scene.scene_view import SceneView
from touchline.scene.secured_viser import SecuredViser


def main(connection: Connection, arguments: dict[str, Any]) -> None:
    """Serve until the server goes. arguments: {"key"} that viser's port wants."""
    SceneWorker(connection, arguments["key"]).run()


class SceneWorker:
    """One connection, one scene."""

    def __init__(self, connection: Connection, key: str) -> None:
        self._connection = connection
        server = SecuredViser(key)
        self._view = SceneView(server, lambda click: self._send(messages.CLICKED, click))
        server.on_client_connect(lambda _: self._report_viewers())
        server.on_client_disconnect(lambda _: self._report_viewers())
        self._send(START, {"port": server.get_port()})

    def run(self) -> None:
        view = self._view
        actions: dict[int, Callable[[int, dict[str, Any], bytes], Any]] = {
            messages.DRAW: lambda number, head, _: answer(self._connection, number, lambda: (view.show(head), b"")),
            messages.EXPORT: lambda number, head, _: answer(self._connection, number,
                                                            lambda: ({}, self._exported(head))),
            messages.SET_VIEW: lambda _, head, __: view.set_state(head),
            messages.PICTURE: lambda _, head, jpeg: self._show_picture(head["key"], jpeg),
            messages.DETECTIONS: lambda _, head, __: view.show_detections(head["key"], head["things"]),
        }
        while True:
            kind, number, body = self._connection.receive()
            head, payload = decode_body(body)
            actions[kind](number, head, bytes(payload))

    def _show_picture(self, key: str, jpeg: bytes) -> None:
        """Show a JPEG that our own server or a camera's process has encoded."""
        raw = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
        if raw is not None:
            self._view.show_picture(key, np.asarray(raw, np.uint8))

    def _exported(self, head: dict[str, Any]) -> bytes:
        html = self._view.server.scene.as_html(dark_mode=head["dark"])
        return whole_page(html, head["title"]).encode("utf-8", "replace")

    def _report_viewers(self) -> None:
        self._send(messages.VIEWERS, {"count": len(self._view.server.get_clients())})

    def _send(self, kind: int, head: dict[str, Any]) -> None:
        self._connection.send(kind, 0, encode_body(head))
