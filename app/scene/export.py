"""The scene as one HTML file: viser's own page with the scene in it, which asks for no server."""

import secrets
from collections.abc import Mapping
from html import escape
from typing import Any

from app.scene.cameras import Pixels
from app.scene.page import dressed
from app.scene.policy import KEPT
from app.scene.scene_view import Room
from app.scene.secured_viser import LockedViser


def scene_html(given: Mapping[str, Any], pictures: Mapping[str, Pixels], *, dark: bool = False,
               title: str = "Touchline") -> str:
    """given: as Room.show takes it. pictures: raw ones (h, w, 3) BGR by camera key. Needs a process of its own."""
    server = LockedViser(secrets.token_hex(16))
    try:
        room = Room(server)
        room.set({"dark": dark})
        room.show(given)
        for key, raw in pictures.items():
            room.picture(key, raw)
        return whole_page(server.scene.as_html(dark_mode=dark), title)
    finally:
        server.stop()


def whole_page(html: str, title: str) -> str:
    """With a policy and a title of its own."""
    return dressed(html, f'<meta http-equiv="Content-Security-Policy" content="{KEPT}"><title>{escape(title)}</title>')
