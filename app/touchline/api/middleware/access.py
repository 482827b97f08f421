"""Access control: where a request says it comes from, and the token.

Without a token the server listens on this machine only; then the Host header must name this machine, or a
page elsewhere could reach us by pointing its own name here. A request that changes something and carries an
Origin must come from our own page. With a token everything but OPEN needs it: as a Bearer header from scripts,
as a cookie from browsers, whose pictures and sockets cannot send headers; /health tells the others only that the
server answers. Nothing is read from another site's page, either, but what it links to: a browser says where a request
comes from (Sec-Fetch-Site; https://web.dev/fetch-metadata).
"""

import hashlib
import hmac
import logging
import time
from collections import deque
from http.cookies import CookieError, SimpleCookie
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from fastapi import APIRouter, Request
from starlette.datastructures import Headers
from starlette.responses import RedirectResponse, Response
from starlette.templating import Jinja2Templates
from starlette.types import ASGIApp, Receive, Scope, Send

from touchline.api.middleware.problems import framework_problem, problem

LOGIN = "/login"
OPEN = ("/api/v1/health", LOGIN)
SAFE = ("GET", "HEAD", "OPTIONS")
COOKIE = "touchline"
COOKIE_DAYS = 30
MAX_WRONG = 10  # wrong tokens a minute from one address; a right one is always accepted
MAX_ADDRESSES = 1000
EMBEDDED = ("object", "embed")  # a navigation within another site's page
log = logging.getLogger("touchline")

TEMPLATES = Jinja2Templates(Path(__file__).parents[1] / "templates")


def cookie_of(token: str) -> str:
    """Return what a browser stores instead of the token itself."""
    return hmac.new(token.encode(), b"touchline cookie", hashlib.sha256).hexdigest()


def has_token(headers: Headers, token: str | None) -> bool:
    """Tell whether a request has the token, as a script or as a browser sends it."""
    if token is None:
        return False
    scheme, _, given = headers.get("authorization", "").partition(" ")
    return (
        scheme.lower() == "bearer" and hmac.compare_digest(given.strip().encode(), token.encode())
    ) or hmac.compare_digest(_cookie(headers), cookie_of(token))


class WrongTokens:
    """Count and log wrong tokens by address, so that guessing is slow and nobody else is locked out."""

    def __init__(self) -> None:
        self._times: dict[str, deque[float]] = {}

    def too_many(self, address: str) -> bool:
        """Count one more wrong token or cookie; return whether it is one too many within a minute."""
        now = time.monotonic()
        if address not in self._times and len(self._times) >= MAX_ADDRESSES:
            self._times.pop(next(iter(self._times)))
        times = self._times.setdefault(address, deque(maxlen=MAX_WRONG + 1))
        was_too_many = len(times) > MAX_WRONG and now - times[0] < 60
        times.append(now)
        is_too_many = len(times) > MAX_WRONG and now - times[0] < 60
        if not was_too_many:  # a guesser does not fill the log
            log.warning(
                "wrong token from %s%s",
                address,
                ", and more than are answered" if is_too_many else "",
            )
        return is_too_many


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
        name = _name(host)
        if name is None:
            return framework_problem(400, "The Host header is not a host name.")
        if self.hosts and name not in self.hosts:
            return framework_problem(403, "This server does not accept that host name.")
        changes = scope["type"] == "websocket" or scope["method"] not in SAFE
        if (changes and _is_elsewhere(headers.get("origin"), host)) or (
            headers.get("sec-fetch-site") in ("cross-site", "same-site")
            and (changes or not _is_link(headers))
        ):
            return framework_problem(403, "This request comes from a page of another site.")
        return None

    def _refuse_token(self, scope: Scope, headers: Headers) -> Response | None:
        if self.token is None or scope["path"] == LOGIN or has_token(headers, self.token):
            return None
        cookie = _cookie(headers)
        is_wrong = bool(headers.get("authorization", "").partition(" ")[2] or cookie)
        # an open path, too, answers a right one otherwise
        too_many = is_wrong and self.wrong.too_many(_address(scope))
        if scope["path"] in OPEN and not too_many:
            return None
        answer = framework_problem(
            401, "This server requires an access token.", {"WWW-Authenticate": "Bearer"}
        )
        if too_many:
            answer = too_many_tokens()
        elif "text/html" in headers.get("accept", ""):
            answer = RedirectResponse("/login", 303)
        if cookie:
            # a page would send it again and again
            answer.delete_cookie(COOKIE, httponly=True, samesite="strict")
        return answer


def _name(host: str) -> str | None:
    """The host without its port, in lower case: "[::1]:8000" reads "::1"; None where it is no host."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return None


def _is_elsewhere(origin: str | None, host: str) -> bool:
    """Whether it is given and is not the host's own."""
    try:
        return origin is not None and urlsplit(origin).netloc != host
    except ValueError:
        return True


def _is_link(headers: Headers) -> bool:
    """Whether the browser goes there: then the other site's page reads nothing of it."""
    return (
        headers.get("sec-fetch-mode") == "navigate"
        and headers.get("sec-fetch-dest") not in EMBEDDED
    )


def _cookie(headers: Headers) -> str:
    try:
        morsel = SimpleCookie(headers.get("cookie", "")).get(COOKIE)
    except CookieError:
        return ""
    return morsel.value.encode("ascii", "replace").decode() if morsel else ""


def _address(scope: Scope) -> str:
    return scope["client"][0] if scope.get("client") else "?"


def too_many_tokens() -> Response:
    return problem(
        429,
        "too-many-wrong-tokens",
        "Too many wrong access tokens from this address.",
        "Wait one minute, then send the token that the server printed.",
        {"Retry-After": "60"},
    )


def _attributes(request: Request) -> dict[str, Any]:
    return {"httponly": True, "samesite": "strict", "secure": request.url.scheme == "https"}


def login_router(token: str | None) -> APIRouter:
    """Return the routes of the page on which a browser exchanges the token for a cookie, and back."""
    router = APIRouter(include_in_schema=False)
    wrong = WrongTokens()

    @router.get("/login")
    def page(request: Request) -> Response:
        if token is None:
            return RedirectResponse("/", 303)
        return TEMPLATES.TemplateResponse(request, "login.html", {"message": ""})

    @router.post("/login")
    async def login(request: Request) -> Response:
        form = await request.form(max_files=0, max_fields=4, max_part_size=4096)
        given = str(form.get("token", "")).strip()
        if token is None or hmac.compare_digest(given.encode("utf-8", "replace"), token.encode()):
            answer = RedirectResponse("/", 303)
            if token:
                answer.set_cookie(
                    COOKIE, cookie_of(token), max_age=COOKIE_DAYS * 86400, **_attributes(request)
                )
            return answer
        if wrong.too_many(_address(request.scope)):
            return too_many_tokens()
        return TEMPLATES.TemplateResponse(
            request, "login.html", {"message": "The access token is wrong."}, 401
        )

    @router.post("/logout")
    def logout(request: Request) -> Response:
        answer = RedirectResponse("/login", 303)
        answer.delete_cookie(COOKIE, **_attributes(request))
        return answer

    return router
