"""Security headers of every response: what our page may load, and that browsers do not guess types."""

import base64
import hashlib
import re
from collections.abc import Iterable
from urllib.parse import urlsplit, urlunsplit

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

INLINE_SCRIPT = re.compile(r"<script(?![^>]*\bsrc=)[^>]*>(.*?)</script>", re.DOTALL | re.IGNORECASE)


def inline_hashes(html: str) -> list[str]:
    """Return the CSP sources of a page's inline scripts; an import map must be inline."""
    return [f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"
            for script in INLINE_SCRIPT.findall(html)]


def _relative(address: str) -> str:
    """Return an address of this server without the server."""
    _, _, path, query, fragment = urlsplit(address)
    return urlunsplit(("", "", f"/{path.lstrip('/')}", query, fragment))


class SecurityHeaders:
    """Add the headers to every response. scripts: CSP sources of the inline scripts of our own pages."""

    def __init__(self, app: ASGIApp, scripts: Iterable[str] = ()) -> None:
        self.app = app
        self.headers = {
            "Content-Security-Policy": "default-src 'self'; script-src 'self' " + " ".join(scripts) + "; "
            "style-src 'self' 'unsafe-inline'; img-src 'self' blob: data:; connect-src 'self'; "
            "worker-src 'self' blob:; object-src 'none'; base-uri 'none'; form-action 'self'; frame-ancestors 'self'",
            "X-Content-Type-Options": "nosniff",
            "Cross-Origin-Resource-Policy": "same-origin",
            "Cross-Origin-Opener-Policy": "same-origin",
            "Permissions-Policy": "camera=(), display-capture=(), geolocation=(), microphone=(), usb=()",
            "Referrer-Policy": "same-origin",
            "X-Frame-Options": "SAMEORIGIN",
        }

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in self.headers.items():
                    headers.setdefault(name, value)
                if "location" in headers:  # the Host header, of which the framework makes it, is the caller's to choose
                    headers["location"] = _relative(headers["location"])
            await send(message)

        await self.app(scope, receive, with_headers)
