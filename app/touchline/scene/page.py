"""viser's page without its panel and notices, since our own page has the controls; and what it may load.

It unpacks itself, which takes inline scripts and WebAssembly; its decoders take eval. Our own pages' policy stays as
tight as it is (api/middleware).
"""

from functools import cache
from importlib.metadata import distribution
from pathlib import Path

# Its panel lets a viewer enter another server's address; both cover the scene.
STYLE = ("<style>[data-floating-window],[data-dock-edge],.mantine-Notifications-root{display:none!important}"
         "</style>")
_PAGE = ("default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval' blob:; style-src 'unsafe-inline'; "
         "img-src blob: data:; font-src data:; worker-src blob: data:; base-uri 'none'; form-action 'none'; "
         "connect-src blob: data:")
EXPORT_POLICY = _PAGE  # a saved file talks to nobody
PAGE_POLICY = f"{_PAGE} 'self'; frame-ancestors 'self'"  # behind our own port, to that port alone


@cache
def client_page() -> bytes:
    """Return the page as UTF-8 HTML. Importing viser would cost the server half a second and 50 MB."""
    html = Path(str(distribution("viser").locate_file("viser/client/build/index.html")))
    return with_style(html.read_text(encoding="utf-8")).encode()


def with_style(html: str, more: str = "") -> str:
    """Insert our style and more into the page's head."""
    head = html.index("<head>") + len("<head>")
    return f"{html[:head]}{more}{STYLE}{html[head:]}"
