"""The process of one scene: viser, what it shows, how it is viewed, and the server's messages that say so.

By itself viser admits everybody. It asks for no login and looks at no Origin, so that any page in a browser on this
machine could read the scene; and any viewer could have it call a server elsewhere that passes the scene on. Here a
connection without the key is refused, no file is served, and no tunnel opened. The page reaches the scene through our
own server, which has the key and asks for the login (routes.py).
"""

import hmac
import http
import os
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, Self

import cv2
import numpy as np
import viser
import websockets.asyncio.server
from viser import _messages
from websockets.http11 import Request, Response

from touchline.core.errors import BadInput
from touchline.core.field import Field
from touchline.core.geometry import Pixels
from touchline.core.json_values import JsonObject
from touchline.core.opencv import shrink_to_width
from touchline.core.records import Calibration
from touchline.core.statements import say
from touchline.processes.framing import START, Connection, answer, decode_body, encode_body
from touchline.scene import messages
from touchline.scene.drawing import (
    COLOURS,
    METRES,
    QUAD_PX,
    CameraNode,
    common_scale_mm,
    draw_boards,
    draw_detections,
    draw_error_surfaces,
    draw_ground,
    draw_pose_change,
    draw_rays,
    draw_residuals,
    draw_scale,
)
from touchline.scene.frustum import BoardViews, Viewpoint
from touchline.scene.scene_camera import SceneCamera, carpet_intersection, describe_place

MARK, MARK_MM = (255, 80, 200), 45.0
LAYERS = ("pictures", "rays", "arrows", "footprints", "labels", "moved", "things")
PORT_FROM_OUTSIDE = "_VISER_PORT_OVERRIDE"
UNWANTED = (
    _messages.ShareUrlRequest,
    _messages.ShareUrlDisconnect,
    _messages.FileTransferStartUpload,
    _messages.FileTransferPart,
)
OnMessage = Callable[[JsonObject], None]


def main(connection: Connection, arguments: JsonObject) -> None:
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
        actions: dict[int, Callable[[int, JsonObject, bytes], Any]] = {
            messages.DRAW: lambda number, head, _: answer(
                self._connection, number, lambda: (view.show(head), b"")
            ),
            messages.EXPORT: lambda number, head, _: answer(
                self._connection, number, lambda: ({}, self._exported(head))
            ),
            messages.SET_VIEW: lambda _, head, __: view.set_state(head),
            messages.PICTURE: lambda _, head, jpeg: self._show_picture(head["key"], jpeg),
            messages.DETECTIONS: lambda _, head, __: view.show_detections(
                head["key"], head["things"]
            ),
        }
        while True:
            kind, number, body = self._connection.receive()
            head, payload = decode_body(body)
            actions[kind](number, head, bytes(payload))

    def _show_picture(self, key: str, jpeg: bytes) -> None:
        """Show a JPEG that our own server or a camera's process has encoded."""
        raw = cv2.imdecode(
            np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
        )
        if raw is not None:
            self._view.show_picture(key, np.asarray(raw, np.uint8))

    def _exported(self, head: JsonObject) -> bytes:
        return self._view.server.scene.as_html(dark_mode=head["dark"]).encode("utf-8", "replace")

    def _report_viewers(self) -> None:
        self._send(messages.VIEWERS, {"count": len(self._view.server.get_clients())})

    def _send(self, kind: int, head: JsonObject) -> None:
        self._connection.send(kind, 0, encode_body(head))


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
    """Make a server that viser starts meanwhile answer 403 without the key; the list is then not empty."""
    secured: list[bool] = []
    module = vars(websockets.asyncio.server)
    plain = module["serve"]

    def require_key(connection: Any, request: Request) -> Response | None:
        given = request.headers.get(messages.KEY_HEADER, "")
        if hmac.compare_digest(given.encode("utf-8", "replace"), key.encode()):
            return None
        return connection.respond(
            http.HTTPStatus.FORBIDDEN, "Open it through Touchline's own page.\n"
        )

    def serve(*args: Any, **more: Any) -> Any:
        secured.append(True)
        return plain(*args, **{**more, "process_request": require_key})

    module["serve"] = serve
    try:
        yield secured
    finally:
        module["serve"] = plain


class SceneView:
    """One viser server with one scene. Thread-safe: viser calls from its own threads.

    on_click: receives the description of a clicked place on the carpet.
    """

    def __init__(self, server: SecuredViser, on_click: OnMessage = lambda _: None) -> None:
        self.server = server
        self.state = ViewState()
        self._on_click = on_click
        self._lock = threading.RLock()
        self._field: Field | None = None
        self._nodes: dict[str, CameraNode] = {}
        self._boards: BoardViews | None = None
        self._arrow_scale = 1.0
        self._scale_label: viser.SceneNodeHandle | None = None
        server.scene.on_click()(self._clicked)
        server.on_client_connect(lambda client: self._aim(client))
        self._set_theme()

    # What is shown

    def show(self, given: Mapping[str, Any]) -> JsonObject:
        """Replace the scene: {"cameras": [{"key", "title", "calibration", "before"}, …]} or {"lens": a stored lens}.

        Return what the page shows beside the scene, as JSON. A record that cannot be shown changes nothing.
        """
        if given.get("lens") is not None:
            return self._show_lens(given["lens"])
        cameras = [
            SceneCamera.of(
                one["key"],
                one["title"],
                Calibration.from_json(one["calibration"]),
                Calibration.from_json(one["before"]) if one.get("before") else None,
            )
            for one in given["cameras"]
        ]
        if not cameras:
            raise BadInput(
                say("scene.no-calibration", "There is no calibration to show."),
                say("scene.choose-version", "Choose a version, or calibrate a camera."),
                reason="nothing-to-show",
            )
        top = common_scale_mm(cameras)
        scale = min(one.arrow_scale for one in cameras)
        shown = [
            {**one.to_json(), "colour": list(colour)}
            for one, colour in zip(cameras, COLOURS * len(cameras), strict=False)
        ]
        with self._lock, self.server.atomic():
            self._clear(cameras[0].field)
            self._arrow_scale = scale
            draw_ground(self.server.scene, cameras[0].field)
            for camera, colour in zip(cameras, COLOURS * len(cameras), strict=False):
                node = self._nodes[camera.key] = CameraNode(self.server.scene, camera, colour)
                node.add(
                    "rays", draw_rays(self.server.scene, f"/rays/{camera.key}", camera, colour)
                )
                if top is not None:
                    node.handles |= draw_error_surfaces(
                        self.server.scene, f"/sheets/{camera.key}", camera, top
                    )
            self._draw_arrows()
            self._apply()
            self._aim_all()
        return {"cameras": shown, "sheet_top_mm": top, "scale": scale, "boards": None}

    def _show_lens(self, lens: Mapping[str, Any]) -> JsonObject:
        boards = BoardViews.of(lens)
        with self._lock, self.server.atomic():
            self._clear(None)
            self._boards = boards
            self.server.scene.set_up_direction("-y")
            draw_boards(self.server.scene, boards)
            self._aim_all()
        return {"cameras": [], "sheet_top_mm": None, "scale": None, "boards": boards.to_json()}

    def _clear(self, field: Field | None) -> None:
        self.server.scene.reset()
        self.server.scene.set_up_direction("+z")
        self._field, self._boards, self._scale_label = field, None, None
        self._nodes.clear()

    def show_picture(self, key: str, raw: Pixels) -> None:
        """Show a camera's newer raw picture (h, w, 3) BGR; ignored where the camera is no longer shown."""
        with self._lock:
            if camera := self._nodes.get(key):
                camera.show_picture(shrink_to_width(raw, QUAD_PX))
                self._apply()

    def show_detections(self, key: str, found: Sequence[Mapping[str, Any]]) -> None:
        """Replace what a camera has detected."""
        with self._lock, self.server.atomic():
            if node := self._nodes.get(key):
                for handle in node.handles.pop("things", []):
                    handle.remove()
                node.add(
                    "things",
                    *draw_detections(self.server.scene, f"/things/{key}", node.camera.field, found),
                )
                self._apply()

    # How it is viewed

    def set_state(self, given: Mapping[str, Any]) -> None:
        """Apply what the page sets; see ViewState."""
        with self._lock, self.server.atomic():
            before, self.state = self.state, self.state.changed(given)
            if self.state.scale != before.scale:
                self._draw_arrows()
            if self.state.dark != before.dark:
                self._set_theme()
            self._apply()
            if "view" in given:  # the same view again returns to it
                self._aim_all()

    def _set_theme(self) -> None:
        self.server.gui.configure_theme(
            dark_mode=self.state.dark, show_logo=False, show_share_button=False
        )

    def _draw_arrows(self) -> None:
        scene, scale = self.server.scene, self.state.scale or self._arrow_scale
        for key, node in self._nodes.items():
            for layer, draw in (("arrows", draw_residuals), ("moved", draw_pose_change)):
                node.handles.pop(layer, None)
                node.add(layer, draw(scene, f"/{layer}/{key}", node.camera, scale))
        if self._field is not None and any(
            n.handles["arrows"] or n.handles["moved"] for n in self._nodes.values()
        ):
            self._scale_label = draw_scale(scene, self._field, scale)

    def _apply(self) -> None:
        state = self.state
        shown = state.layers | {state.sheet} | ({"older"} if "moved" in state.layers else set())
        for key, node in self._nodes.items():
            node.set_visible(
                shown, state.view == "camera" and state.through == key, key in state.hidden
            )
        if self._scale_label is not None:
            self._scale_label.visible = bool(state.layers & {"arrows", "moved"})

    def _aim_all(self) -> None:
        for client in self.server.get_clients().values():
            self._aim(client)
        if (view := self.viewpoint(16 / 9)) is not None:
            first = self.server.initial_camera
            first.position, first.look_at, first.up = (
                view.position_mm * METRES,
                view.look_at_mm * METRES,
                view.up,
            )
            first.fov = view.fov_rad

    def _aim(self, client: viser.ClientHandle) -> None:
        with self._lock:
            view = self.viewpoint(client.camera.aspect)
            if view is None:
                return
            with client.atomic():
                client.camera.up_direction = view.up
                client.camera.position = view.position_mm * METRES
                client.camera.look_at = view.look_at_mm * METRES
                client.camera.fov = view.fov_rad

    def viewpoint(self, aspect: float) -> Viewpoint | None:
        """Return the viewpoint for a window of this aspect; None before anything is shown."""
        if self._boards is not None:
            return Viewpoint.beside(self._boards)
        if self._field is None:
            return None
        through = self._nodes.get(self.state.through)
        if (
            self.state.view == "camera"
            and through is not None
            and through.camera.frustum is not None
        ):
            return Viewpoint.through(through.camera.frustum, aspect)
        if self.state.view == "above":
            return Viewpoint.above(self._field, aspect)
        heights = [
            c.camera.frustum.height_mm for c in self._nodes.values() if c.camera.frustum is not None
        ]
        return Viewpoint.free(self._field, max(heights, default=0.0), aspect)

    # What is clicked

    def _clicked(self, event: Any) -> None:
        with self._lock:
            if self._field is None:
                return
            place = carpet_intersection(np.array(event.ray_origin) / METRES, event.ray_direction)
            if place is None:
                return
            x, y = (float(v) * METRES for v in place)
            self.server.scene.add_icosphere(
                "/mark", MARK_MM * METRES, MARK, subdivisions=2, position=(x, y, 0.0)
            )
            description = describe_place(place, [node.camera for node in self._nodes.values()])
        self._on_click(description)


@dataclass(frozen=True)
class ViewState:
    """layers: the visible ones. sheet: which expected error. scale: of arrows, None for a well visible one. hidden:
    cameras left out. view: the viewpoint; through: its camera, for the view "camera"."""

    layers: frozenset[str] = frozenset(LAYERS) - {"rays", "things"}
    sheet: str = "none"
    scale: float | None = None
    dark: bool = True
    hidden: frozenset[str] = frozenset()
    view: str = "free"
    through: str = ""

    def changed(self, given: Mapping[str, Any]) -> Self:
        """Return the state with these changes, which the API schema has validated."""
        changes = {name: value for name, value in given.items() if value is not None}
        layers, hidden = (
            frozenset(changes.pop(name, getattr(self, name))) for name in ("layers", "hidden")
        )
        return replace(self, layers=layers, hidden=hidden, **changes)
