"""Access control: where a request says it comes from, and the token.

Without a token the server listens on this machine only; then the Host header must name this machine, or a
page elsewhere could reach us by pointing its own name here. A request that changes something and carries an
Origin must come from our own page. With a token everything but OPEN needs it: as a Bearer header from scripts,
as a cookie from browsers, whose pictures and sockets cannot send headers.
"""

import hashlib
import hmac
import time
from collections import deque
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import urlsplit

from fastapi import APIRouter, Request
from starlette.datastructures import Headers
from starlette.responses import HTMLResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send

from app.api.middleware.problems import framework_problem, problem

OPEN = ("/api/v1/health", "/login")
SAFE = ("GET", "HEAD", "OPTIONS")
COOKIE = "touchline"
COOKIE_DAYS = 30
MAX_WRONG = 10  # wrong tokens a minute from one address; a right one is always accepted
MAX_ADDRESSES = 1000

LOGIN_PAGE = """<!doctype html><html lang="en"><meta charset="utf-8"><title>Touchline: sign in</title>
<meta name="viewport" content="width=device-width">
<style>body{{font:16px system-ui;background:#11151a;color:#dfe5ea;display:grid;place-items:center;min-height:90vh}}
form{{display:grid;gap:12px;width:22rem}}
input,button{{font:inherit;padding:.5rem .7rem;border-radius:6px;border:1px solid #445}}
button{{background:#2f81f7;color:#fff;border:0}}p{{margin:0;color:#f0b45b}}</style>
<form method="post" action="/login"><h1>Touchline</h1><label for="token">Access token, as the server printed it</label>
<input id="token" name="token" type="password" autocomplete="current-password" required autofocus>
<p role="alert">{message}</p><button>Sign in</button></form></html>"""


def cookie_of(token: str) -> str:
    """Return what a browser stores instead of the token itself."""
    return hmac.new(token.encode(), b"touchline cookie", hashlib.sha256).hexdigest()


class WrongTokens:
    """Count wrong tokens by address, so that guessing is slow and nobody else is locked out."""

    def __init__(self) -> None:
        self._times: dict[str, deque[float]] = {}

    def too_many(self, address: str) -> bool:
        """Count one more wrong token; return whether it is one too many within a minute."""
        now = time.monotonic()
        if address not in self._times and len(self._times) >= MAX_ADDRESSES:
            self._times.pop(next(iter(self._times)))
        times = self._times.setdefault(address, deque(maxlen=MAX_WRONG + 1))
        times.append(now)
        return len(times) > MAX_WRONG and now - times[0] < 60


class AccessControl:
    """Check every request and every socket once.

    hosts: names under which the page may be opened; empty where the token alone decides.
    """

    def __init__(self, app: ASGIApp, token: str | None, hosts: tuple[str, ...]) -> None:
        self.app = app
        self.token = token
        self.hosts = hosts
        self.wrong = WrongTokens()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            return await self.app(scope, receive, send)
        headers = Headers(scope=scope)
        refusal = self._refuse_origin(scope, headers) or self._refuse_token(scope, headers)
        if refusal is None:
            return await self.app(scope, receive, send)
        if scope["type"] == "websocket":
            return await send({"type": "websocket.close", "code": 1008, "reason": "refused"})
        await refusal(scope, receive, send)

    def _refuse_origin(self, scope: Scope, headers: Headers) -> Response | None:
        host = headers.get("host", "")
        if self.hosts and _name(host) not in self.hosts:
            return framework_problem(403, "This server does not answer to that host name.")
        changes = scope["type"] == "websocket" or scope["method"] not in SAFE
        origin = headers.get("origin")
        elsewhere = origin is not None and urlsplit(origin).netloc != host
        if changes and (elsewhere or headers.get("sec-fetch-site") in ("cross-site", "same-site")):
            return framework_problem(403, "This request comes from another site's page.")
        return None

    def _refuse_token(self, scope: Scope, headers: Headers) -> Response | None:
        if self.token is None or scope["path"] in OPEN:
            return None
        scheme, _, given = headers.get("authorization", "").partition(" ")
        if scheme.lower() == "bearer" and hmac.compare_digest(given.strip().encode(), self.token.encode()):
            return None
        if hmac.compare_digest(_cookie(headers), cookie_of(self.token)):
            return None
        if given and self.wrong.too_many(_address(scope)):
            return too_many_tokens()
        if "text/html" in headers.get("accept", ""):
            return RedirectResponse("/login", 303)
        return framework_problem(401, "This server wants an access token.", {"WWW-Authenticate": "Bearer"})


def _name(host: str) -> str:
    """The host without its port, in lower case: "[::1]:8000" reads "::1"."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


def _cookie(headers: Headers) -> str:
    try:
        morsel = SimpleCookie(headers.get("cookie", "")).get(COOKIE)
    except CookieError:
        return ""
    return morsel.value.encode("ascii", "replace").decode() if morsel else ""


def _address(scope: Scope) -> str:
    return scope["client"][0] if scope.get("client") else "?"


def too_many_tokens() -> Response:
    return problem(429, "too-many-wrong-tokens", "Too many wrong tokens from this address.",
                   "Wait a minute, then send the token that the server printed.", {"Retry-After": "60"})


def _attributes(request: Request) -> dict[str, Any]:
    return {"httponly": True, "samesite": "strict", "secure": request.url.scheme == "https"}


def login_router(token: str | None) -> APIRouter:
    """Return the routes of the page on which a browser exchanges the token for a cookie, and back."""
    router = APIRouter(include_in_schema=False)
    wrong = WrongTokens()

    @router.get("/login")
    def page() -> Response:
        return HTMLResponse(LOGIN_PAGE.format(message="")) if token else RedirectResponse("/", 303)

    @router.post("/login")
    async def login(request: Request) -> Response:
        form = await request.form(max_files=0, max_fields=4, max_part_size=4096)
        given = str(form.get("token", "")).strip()
        if token is None or hmac.compare_digest(given.encode("utf-8", "replace"), token.encode()):
            answer = RedirectResponse("/", 303)
            if token:
                answer.set_cookie(COOKIE, cookie_of(token), max_age=COOKIE_DAYS * 86400, **_attributes(request))
            return answer
        if wrong.too_many(_address(request.scope)):
            return too_many_tokens()
        return HTMLResponse(LOGIN_PAGE.format(message="That is not the token that the server printed."), 401)

    @router.post("/logout")
    def logout(request: Request) -> Response:
        answer = RedirectResponse("/login", 303)
        answer.delete_cookie(COOKIE, **_attributes(request))
        return answer

    return router
