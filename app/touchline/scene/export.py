"""The scene as one HTML file: viser's own page with the scene in it, which asks for no server."""

from html import escape

from touchline.scene.page import EXPORT_POLICY, with_style


def whole_page(html: str, title: str) -> str:
    """Add the security policy and a title."""
    return with_style(html, f'<meta http-equiv="Content-Security-Policy" content="{EXPORT_POLICY}">'
                            f"<title>{escape(title)}</title>")
