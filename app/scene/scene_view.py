"""All that one scene shows, and how it is looked at. Thread-safe: viser calls from threads of its own."""

import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import viser

from app.core.errors import BadInput
from app.core.field import Field
from app.core.records import Calibration
from app.scene import METRES
from app.scene.cameras import COLOURS, Camera, Pixels, small
from app.scene.clicks import draw_misses, draw_moved, draw_rays, draw_scale
from app.scene.detections import draw_things
from app.scene.error_surfaces import draw_sheets, top_of
from app.scene.geometry.boards import BoardViews
from app.scene.geometry.picking import met, told_at
from app.scene.geometry.scene_camera import Standing
from app.scene.geometry.views import Viewpoint
from app.scene.ground import draw_ground
from app.scene.held_boards import draw_boards
from app.scene.secured_viser import LockedViser
from app.scene.view_state import Look

MARK, MARK_MM = (255, 80, 200), 45.0
Told = Callable[[dict[str, Any]], None]


class Room:
    """One viser with one scene. on_click: told what a click on the carpet means."""

    def __init__(self, server: LockedViser, on_click: Told = lambda _told: None) -> None:
        self.server = server
        self.look = Look()
        self._on_click = on_click
        self._lock = threading.RLock()
        self._field: Field | None = None
        self._cameras: dict[str, Camera] = {}
        self._rays: dict[str, viser.SceneNodeHandle] = {}
        self._arrows: dict[str, list[viser.SceneNodeHandle]] = {}
        self._sheets: dict[str, dict[str, viser.SceneNodeHandle]] = {}
        self._things: dict[str, list[viser.SceneNodeHandle]] = {}
        self._boards: BoardViews | None = None
        self._fair_scale = 1.0
        self._said: viser.SceneNodeHandle | None = None
        server.scene.on_click()(self._clicked)
        server.on_client_connect(lambda client: self._look_from(client))
        self._dress()

    # What is shown

    def show(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Everything anew: {"cameras": [{"key", "title", "calibration", "before"}, …]} or {"lens": a kept lens}.

        What is told beside the scene, as plain JSON. A record that cannot be shown is refused, and the former stays.
        """
        if given.get("lens") is not None:
            return self._show_lens(given["lens"])
        standings = [Standing.of(one["key"], one["title"], Calibration.from_json(one["calibration"]),
                                 Calibration.from_json(one["before"]) if one.get("before") else None)
                     for one in given["cameras"]]
        if not standings:
            raise BadInput("There is no calibration to show.", "Choose a version, or calibrate a camera.",
                           reason="nothing-to-show")
        top = top_of(standings)
        scale = min(one.fair_scale for one in standings)
        told = {"cameras": [one.to_json() for one in standings], "sheet_top_mm": top, "scale": scale, "boards": None}
        for one, colour in zip(told["cameras"], COLOURS * len(standings), strict=False):
            one["colour"] = list(colour)
        with self._lock, self.server.atomic():
            self._empty(standings[0].field)
            self._fair_scale = scale
            draw_ground(self.server.scene, standings[0].field)
            for standing, colour in zip(standings, COLOURS * len(standings), strict=False):
                self._cameras[standing.key] = Camera(self.server.scene, standing, colour)
                if (rays := draw_rays(self.server.scene, f"/rays/{standing.key}", standing, colour)) is not None:
                    self._rays[standing.key] = rays
                if top is not None:
                    self._sheets[standing.key] = draw_sheets(self.server.scene, f"/sheets/{standing.key}", standing,
                                                             top)
            self._draw_arrows()
            self._apply()
            self._look_from_all()
        return told

    def _show_lens(self, lens: Mapping[str, Any]) -> dict[str, Any]:
        boards = BoardViews.of(lens)
        with self._lock, self.server.atomic():
            self._empty(None)
            self._boards = boards
            self.server.scene.set_up_direction("-y")
            draw_boards(self.server.scene, boards)
            self._look_from_all()
        return {"cameras": [], "sheet_top_mm": None, "scale": None, "boards": boards.to_json()}

    def _empty(self, field: Field | None) -> None:
        self.server.scene.reset()
        self.server.scene.set_up_direction("+z")
        self._field, self._boards, self._said = field, None, None
        for table in (self._cameras, self._rays, self._arrows, self._sheets, self._things):
            table.clear()

    def picture(self, key: str, raw: Pixels) -> None:
        """A newer raw picture (h, w, 3) BGR of a camera; one that is not there any more is left."""
        with self._lock:
            if camera := self._cameras.get(key):
                camera.show_picture(small(raw))
                self._apply()

    def things(self, key: str, found: Sequence[Mapping[str, Any]]) -> None:
        """What a camera has detected now, in place of what it had before."""
        with self._lock, self.server.atomic():
            for handle in self._things.pop(key, []):
                handle.remove()
            if key in self._cameras and self._field is not None:
                self._things[key] = draw_things(self.server.scene, f"/things/{key}", self._field, found)
            self._apply()

    # How it is looked at

    def set(self, given: Mapping[str, Any]) -> None:
        """What the page sets; see look.py."""
        with self._lock, self.server.atomic():
            before, self.look = self.look, self.look.changed(given)
            if self.look.scale != before.scale:
                self._draw_arrows()
            if self.look.dark != before.dark:
                self._dress()
            self._apply()
            if "view" in given:  # asked for again, it leads back there
                self._look_from_all()

    def _dress(self) -> None:
        self.server.gui.configure_theme(dark_mode=self.look.dark, show_logo=False, show_share_button=False)

    def _draw_arrows(self) -> None:
        scene, scale = self.server.scene, self.look.scale or self._fair_scale
        for key, camera in self._cameras.items():
            drawn = (draw_misses(scene, f"/arrows/{key}", camera.standing, scale),
                     draw_moved(scene, f"/moved/{key}", camera.standing, scale))
            self._arrows[key] = [handle for handle in drawn if handle is not None]
        if self._field is not None and any(self._arrows.values()):
            self._said = draw_scale(scene, self._field, scale)

    def _apply(self) -> None:
        look = self.look
        for key, camera in self._cameras.items():
            hidden, through = key in look.hidden, look.view == "camera" and look.through == key
            camera.set_visible(lambda layer: layer in look.layers, through, hidden)
            if key in self._rays:
                self._rays[key].visible = "rays" in look.layers and not hidden and not through
            for handle in self._arrows[key]:
                layer = "moved" if handle.name.startswith("/moved/") else "arrows"
                handle.visible = layer in look.layers and not hidden
            for which, handle in self._sheets.get(key, {}).items():
                handle.visible = which == look.sheet and not hidden
        if self._said is not None:
            self._said.visible = bool(look.layers & {"arrows", "moved"})
        for key, handles in self._things.items():
            for handle in handles:
                handle.visible = "things" in look.layers and key not in look.hidden

    def _look_from_all(self) -> None:
        for client in self.server.get_clients().values():
            self._look_from(client)
        if (view := self.viewpoint(16 / 9)) is not None:
            first = self.server.initial_camera
            first.position, first.look_at, first.up = (tuple(float(v) for v in one) for one in (
                view.position_mm * METRES, view.look_at_mm * METRES, view.up))
            first.fov = view.fov_rad

    def _look_from(self, client: viser.ClientHandle) -> None:
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
        """From where a window of that shape looks; None before anything is shown."""
        if self._boards is not None:
            return Viewpoint.beside(self._boards)
        if self._field is None:
            return None
        through = self._cameras.get(self.look.through)
        if self.look.view == "camera" and through is not None and through.standing.hung is not None:
            return Viewpoint.through(through.standing.hung, aspect)
        if self.look.view == "above":
            return Viewpoint.above(self._field, aspect)
        heights = [c.standing.hung.height_mm for c in self._cameras.values() if c.standing.hung is not None]
        return Viewpoint.free(self._field, max(heights, default=0.0), aspect)

    # What is clicked

    def _clicked(self, event: Any) -> None:
        with self._lock:
            if self._field is None:
                return
            place = met(np.array(event.ray_origin) / METRES, event.ray_direction)
            if place is None:
                return
            self.mark(place)
            told = told_at(place, [camera.standing for camera in self._cameras.values()])
        self._on_click(told)

    def mark(self, place_mm: np.ndarray) -> None:
        """A ball of no meaning but "here"."""
        self.server.scene.add_icosphere("/mark", MARK_MM * METRES, MARK, subdivisions=2,
                                        position=(float(place_mm[0]) * METRES, float(place_mm[1]) * METRES, 0.0))
