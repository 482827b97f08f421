"""Every refusal in one form: application/problem+json (RFC 9457) with `fix`, what the caller can do.

A caller's mistake is a 4xx. An error that we did not foresee is logged with an id, and answered with that id.
"""

import asyncio
import logging
import secrets
from collections.abc import Sequence
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.api.answers import json_bytes
from app.core.errors import TouchlineError

MEDIA_TYPE = "application/problem+json"
MANUAL = "/problems/"  # a problem's type, relative to the server: the manual explains it there
log = logging.getLogger("touchline")

# What the framework itself refuses: reason and fix for each status.
FRAMEWORK = {
    400: ("bad-request", "Correct the request: the form of every body is in /api/v1/openapi.json."),
    401: ("token-needed", "Send Authorization: Bearer TOKEN; the server printed the token when it started."),
    403: ("refused", "Open the page under its own address."),
    404: ("not-found", "Check the path; /docs lists them all."),
    405: ("method-not-allowed", "Use one of the methods named in the Allow header."),
    413: ("too-large", "Send less at once."),
    415: ("wrong-content-type", "Send application/json, or multipart/form-data for a file."),
    416: ("bad-range", "Ask for a range within the file."),
    431: ("headers-too-large", "Send fewer or shorter headers."),
}

# What is wrong with a value, by the kind of pydantic's complaint; its own words serve for the rest.
VALUE_FIXES = {
    "missing": "Add it.",
    "extra_forbidden": "Leave it out, or correct its name.",
    "finite_number": "Send a finite number.",
    "json_invalid": "Send valid JSON: no NaN, no comments, no trailing commas.",
    "less_than_equal": "Stay within the limit that is named.",
    "greater_than_equal": "Stay within the limit that is named.",
    "too_long": "Send fewer.",
    "too_short": "Send more.",
    "string_too_long": "Shorten it.",
    "string_unicode": "Send valid Unicode text.",
    "model_attributes_type": "Send a JSON object, with Content-Type: application/json.",
}


VALUE_REASONS = {
    "finite_number": "non-finite-number",
    "less_than_equal": "out-of-range",
    "greater_than_equal": "out-of-range",
    "too_long": "too-many",
    "string_too_long": "too-long",
    "json_invalid": "bad-json",
}


def problem(status: int, reason: str, title: str, detail: str, fix: str, headers: dict[str, str] | None = None,
            **more: Any) -> Response:
    """A response that says what is wrong and what to do."""
    body = {**more, "type": MANUAL + reason, "title": title, "status": status, "detail": detail, "fix": fix}
    return Response(json_bytes(body), status, headers=headers, media_type=MEDIA_TYPE)


def problem_of(error: TouchlineError) -> Response:
    return problem(error.status, error.reason, error.title, error.what, error.fix, **error.details)


def stale_problem(error: TouchlineError) -> Response:
    """412 for a change that was made from an old state, with the ETag of the one that there is, where there is one."""
    answer = problem_of(error)
    if error.details["etag"] is not None:
        answer.headers["ETag"] = f'"{error.details["etag"]}"'
    return answer


def framework_problem(status: int, detail: str | None = None, headers: Any = None) -> Response:
    """A problem for a bare status code, as the framework gives them."""
    reason, fix = FRAMEWORK.get(status, ("refused", "Check the request against /docs."))
    phrase = HTTPStatus(status).phrase
    return problem(status, reason, reason.replace("-", " ").capitalize(), detail or f"{phrase}.", fix,
                   dict(headers or {}))


def bad_request(errors: Sequence[Any]) -> Response:
    """The first thing that is wrong with a request, by its place; the others beside it."""
    told = [{"at": _place(error["loc"]), "what": str(error["msg"]).replace("Value error, ", ""),
             "kind": str(error["type"])} for error in errors[:20]]
    first = told[0] if told else {"at": "body", "what": "unreadable", "kind": "bad"}
    reason = VALUE_REASONS.get(first["kind"], "bad-request")
    fix = VALUE_FIXES.get(first["kind"], "Correct it: the form of every body is in /api/v1/openapi.json.")
    return problem(422, reason, reason.replace("-", " ").capitalize(),
                   f"{first['at']}: {first['what']}.", fix, errors=told)


def _place(location: Sequence[Any]) -> str:
    """("body", "points", 3, 0) reads "points[3][0]"."""
    parts = [p for p in location[1:] if len(location) != 2 or isinstance(p, str)] or ["body"]
    return "".join(f"[{p}]" if isinstance(p, int) else f".{p}" for p in parts).lstrip(".")[:200] or "body"


class Unexpected:
    """The outermost layer: an error that nobody foresaw becomes a problem with an id that the log knows."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        started = False

        async def watch(message: Message) -> None:
            nonlocal started
            started = started or message["type"] == "http.response.start"
            await send(message)

        try:
            await self.app(scope, receive, watch)
        except asyncio.CancelledError:
            # Only a server that is ending cancels a request; its log has said so.
            if scope["type"] == "http" and not started:
                await problem(503, "shutting-down", "Shutting down", "The server is shutting down.",
                              "Try again when it is back.")(scope, receive, send)
        except Exception:
            if scope["type"] != "http":
                raise
            id = secrets.token_hex(4)
            log.exception("unexpected error %s on %s %s", id, scope["method"], scope["path"])
            if started:
                raise  # half an answer has gone: cutting the connection is the only way left to say so
            answer = problem(500, "unexpected", "Unexpected error",
                             f"Something broke here that should not (error {id}).",
                             f"Try again; if it stays, report it with the log around error {id}.")
            await answer(scope, receive, send)


def install(app: FastAPI) -> None:
    """Answer every exception that leaves a route as a problem."""

    async def known(request: Request, error: Exception) -> Response:
        assert isinstance(error, TouchlineError)
        return problem_of(error)

    async def framework(request: Request, error: Exception) -> Response:
        assert isinstance(error, HTTPException)
        detail = None if error.detail == HTTPStatus(error.status_code).phrase else str(error.detail)
        return framework_problem(error.status_code, detail, error.headers)

    async def invalid(request: Request, error: Exception) -> Response:
        assert isinstance(error, RequestValidationError)
        return bad_request(error.errors())

    app.add_exception_handler(TouchlineError, known)
    app.add_exception_handler(HTTPException, framework)
    app.add_exception_handler(RequestValidationError, invalid)
