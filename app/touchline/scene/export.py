"""The scene as one HTML file: viser's own page with the scene in it, which asks for no server."""

import secrets
from collections.abc import Mapping
from html import escape
from typing import Any

from touchline.scene.cameras import Pixels
from touchline.scene.page import EXPORT_POLICY, with_style
from touchline.scene.scene_view import SceneView
from touchline.scene.secured_viser import SecuredViser


def scene_html(given: Mapping[str, Any], pictures: Mapping[str, Pixels], *, dark: bool = False,
               title: str = "Touchline") -> str:
    """given: as SceneView.show takes it. pictures: raw ones (h, w, 3) BGR by camera key. Needs a process of its own."""
    server = SecuredViser(secrets.token_hex(16))
    try:
        view = SceneView(server)
        view.set_state({"dark": dark})
        view.show(given)
        for key, raw in pictures.items():
            view.show_picture(key, raw)
        return whole_page(server.scene.as_html(dark_mode=dark), title)
    finally:
        server.stop()


def whole_page(html: str, title: str) -> str:
    """Add the security policy and a title."""
    return with_style(html, f'<meta http-equiv="Content-Security-Policy" content="{EXPORT_POLICY}">'
                            f"<title>{escape(title)}</title>")
