"""viser's page without its panel and notices: our own page has the controls."""

from functools import cache
from importlib.util import find_spec
from pathlib import Path

# Its panel lets a viewer enter another server's address; both cover the scene.
STYLE = ("<style>[data-floating-window],[data-dock-edge],.mantine-Notifications-root{display:none!important}"
         "</style>")


@cache
def client_page() -> bytes:
    """Return the page as UTF-8 HTML. Importing viser would cost the server half a second and 50 MB."""
    html = Path(find_spec("viser").origin).parent / "client" / "build" / "index.html"
    return with_style(html.read_text(encoding="utf-8")).encode()


def with_style(html: str, more: str = "") -> str:
    """Insert our style and more into the page's head."""
    head = html.index("<head>") + len("<head>")
    return f"{html[:head]}{more}{STYLE}{html[head:]}"
