"""Limit the size and the duration of request bodies while they stream; and security headers of every response.

    app.add_middleware(BodyLimits, upload_bytes=…)     before (that is, inside) whatever checks who may come in
    uvicorn.Config(app, http=limited_connections(…))   connections.py: the headers before any app is called

JSON and forms of text are small and fast; pictures and points in bulk (multipart, octet-stream) may be larger and
slower. Nothing is buffered: a body that is too large is refused at the first byte beyond its limit.
"""

import asyncio
import base64
import hashlib
import re
from collections.abc import Iterable
from contextlib import suppress
from http import HTTPStatus
from urllib.parse import urlsplit, urlunsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from touchline.api.middleware.problems import problem

MB = 1_000_000
ENVELOPE_BYTES = 64 * 1024  # what multipart adds to a file
UPLOADS = ("multipart/", "application/octet-stream", "image/")
# a client that is still sending would never read the refusal if the connection were cut at once
LINGER_S = 2.0
INLINE_SCRIPT = re.compile(r"<script(?![^>]*\bsrc=)[^>]*>(.*?)</script>", re.DOTALL | re.IGNORECASE)


class BodyLimits:
    """Refuse bodies that are too large (413) or not complete in time (408), without buffering them.

    text_*: for JSON and everything that is no upload. upload_bytes: the largest file, without its multipart envelope.
    """

    def __init__(
        self,
        app: ASGIApp,
        *,
        text_bytes: int = 1 * MB,
        upload_bytes: int = 32 * MB,
        text_s: float = 10.0,
        upload_s: float = 30.0,
    ) -> None:
        self.app = app
        self._text = (text_bytes, text_s)
        self._upload = (upload_bytes + ENVELOPE_BYTES, upload_s)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            return await self.app(scope, receive, send)
        headers = Headers(scope=scope)
        is_upload = headers.get("content-type", "").lower().startswith(UPLOADS)
        body = _Body(scope, receive, send, *(self._upload if is_upload else self._text), is_upload)
        declared = headers.get("content-length", "")
        if declared.isascii() and declared.isdigit() and int(declared[:18]) > body.limit:
            return await body.refuse_size()
        try:
            await self.app(scope, body.receive, body.send)
        except Exception:
            if not body.refused:
                # otherwise the app only reports that its client has gone, and the client has been
                # answered
                raise


class _Body:
    """One request's body. Once refused, the app receives a disconnect, and what it sends is dropped."""

    def __init__(
        self,
        scope: Scope,
        receive: Receive,
        send: Send,
        limit: int,
        seconds: float,
        is_upload: bool,
    ) -> None:
        self.limit = limit
        self._scope = scope
        self._receive = receive
        self._send = send
        self._seconds = seconds
        self._is_upload = is_upload
        # starts when the app first reads: until then it is the slow one
        self._deadline: float | None = None
        self._size = 0
        self._is_complete = False
        self._answered = False
        self.refused = False

    async def receive(self) -> Message:
        if self.refused:
            return {"type": "http.disconnect"}
        if self._is_complete:
            return await self._receive()  # only the client's disconnect can follow
        if self._deadline is None:
            self._deadline = asyncio.get_running_loop().time() + self._seconds
        try:
            message = await self._next(self._deadline)
        except TimeoutError:
            await self._answer(
                408,
                "too-slow",
                f"The request was incomplete after {self._seconds:g} s.",
                "Send it again over a faster connection, or send less data.",
            )
            return {"type": "http.disconnect"}
        self._size += len(message.get("body", b""))
        self._is_complete = not message.get("more_body", False)
        if self._size > self.limit:
            await self.refuse_size()
            return {"type": "http.disconnect"}
        return message

    async def send(self, message: Message) -> None:
        if not self.refused:
            self._answered = True
            await self._send(message)

    async def refuse_size(self) -> None:
        """Answer 413, then read on for a moment so that the client reads the answer."""
        what = "file" if self._is_upload else "body"
        fix = (
            "Reduce the image size, or save it as JPEG."
            if self._is_upload
            else "Send less data per request. Send large numbers of points as application/octet-stream."
        )
        limit = self.limit - ENVELOPE_BYTES if self._is_upload else self.limit
        await self._answer(413, "too-large", f"The {what} has more than {limit / MB:g} MB.", fix)

    async def _answer(self, status: HTTPStatus | int, reason: str, detail: str, fix: str) -> None:
        self.refused = True
        if self._answered:
            return  # half a response has gone; the app ends when it receives the disconnect
        answer = problem(status, reason, detail, fix, {"Connection": "close"})
        await self._send(
            {"type": "http.response.start", "status": status, "headers": answer.raw_headers}
        )
        await self._send({"type": "http.response.body", "body": answer.body, "more_body": True})
        if status == 413 and not self._is_complete:
            until = asyncio.get_running_loop().time() + LINGER_S
            with suppress(TimeoutError):
                while (await self._next(until)).get("more_body", False):
                    pass
        await self._send({"type": "http.response.body"})

    async def _next(self, deadline: float) -> Message:
        async with asyncio.timeout_at(deadline):
            return await self._receive()


def inline_hashes(html: str) -> list[str]:
    """Return the CSP sources of a page's inline scripts; an import map must be inline."""
    return [
        f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"
        for script in INLINE_SCRIPT.findall(html)
    ]


def _relative(address: str) -> str:
    """Return an address of this server without the server."""
    _, _, path, query, fragment = urlsplit(address)
    return urlunsplit(("", "", f"/{path.lstrip('/')}", query, fragment))


class SecurityHeaders:
    """Add the headers to every response. scripts: CSP sources of the inline scripts of our own pages."""

    def __init__(self, app: ASGIApp, scripts: Iterable[str] = ()) -> None:
        self.app = app
        self.headers = {
            "Content-Security-Policy": "default-src 'self'; script-src 'self' "
            + " ".join(scripts)
            + "; "
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
                # the Host header, of which the framework makes it, is the caller's to choose
                if "location" in headers:
                    headers["location"] = _relative(headers["location"])
            await send(message)

        await self.app(scope, receive, with_headers)
