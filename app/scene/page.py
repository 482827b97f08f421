"""viser's page as we hand it out: its own, without its panel and its notices. Ours has the controls."""

from functools import cache
from importlib.util import find_spec
from pathlib import Path

# Its panel lets a viewer write another server's address; both cover what is to be seen.
STYLE = ("<style>[data-floating-window],[data-dock-edge],.mantine-Notifications-root{display:none!important}"
         "</style>")


@cache
def client_page() -> bytes:
    """UTF-8 HTML. viser is not imported for it: that would cost the server half a second and 50 MB."""
    html = Path(find_spec("viser").origin).parent / "client" / "build" / "index.html"
    return dressed(html.read_text(encoding="utf-8")).encode()


def dressed(html: str, more: str = "") -> str:
    """With our style, and more that belongs into a page's head."""
    head = html.index("<head>") + len("<head>")
    return f"{html[:head]}{more}{STYLE}{html[head:]}"
