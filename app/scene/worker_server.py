"""In a scene's process: what the server asks for, done."""

from collections.abc import Callable
from typing import Any

import cv2
import numpy as np

from app.core.errors import TouchlineError
from app.live import messages as form
from app.live.worker_main import Line
from app.live.worker_server import problem_of
from app.scene import messages
from app.scene.export import whole_page
from app.scene.scene_view import SceneView
from app.scene.secured_viser import SecuredViser


class Serving:
    """One line, one scene."""

    def __init__(self, line: Line) -> None:
        self._line = line
        kind, _, body = line.receive()
        if kind != messages.KEY:
            raise RuntimeError("the server began with something else")
        server = SecuredViser(form.parts(body)[0]["key"])
        self._view = SceneView(server, lambda told: self._send(messages.CLICKED, told))
        server.on_client_connect(lambda _: self._viewers())
        server.on_client_disconnect(lambda _: self._viewers())
        self._send(messages.READY, {"port": server.get_port()})

    def run(self) -> None:
        deeds: dict[int, Callable[[dict[str, Any], bytes], Any]] = {
            messages.DRAW: lambda head, _: self._answer(head, lambda: (self._view.show(head), b"")),
            messages.EXPORT: lambda head, _: self._answer(head, lambda: ({}, self._exported(head))),
            messages.SET_VIEW: lambda head, _: self._view.set_state(head),
            messages.PICTURE: lambda head, jpeg: self._picture(head["key"], jpeg),
            messages.DETECTIONS: lambda head, _: self._view.show_detections(head["key"], head["things"]),
        }
        while True:
            kind, _, body = self._line.receive()
            head, payload = form.parts(body)
            deeds[kind](head, bytes(payload))

    def _picture(self, key: str, jpeg: bytes) -> None:
        """A JPEG that our own server or a camera's process has encoded."""
        raw = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
        if raw is not None:
            self._view.show_picture(key, raw)

    def _exported(self, head: dict[str, Any]) -> bytes:
        html = self._view.server.scene.as_html(dark_mode=head["dark"])
        return whole_page(html, head["title"]).encode("utf-8", "replace")

    def _answer(self, head: dict[str, Any], deed: Callable[[], tuple[dict[str, Any], bytes]]) -> None:
        try:
            told, payload = deed()
        except TouchlineError as error:
            self._send(messages.ANSWER, {"number": head["number"], "problem": problem_of(error)})
        else:
            self._send(messages.ANSWER, {"number": head["number"], "told": told}, payload)

    def _viewers(self) -> None:
        self._send(messages.VIEWERS, {"count": len(self._view.server.get_clients())})

    def _send(self, kind: int, head: dict[str, Any], payload: bytes = b"") -> None:
        self._line.send(kind, 0, form.message(head, payload))
