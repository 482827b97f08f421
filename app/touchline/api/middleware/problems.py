"""Every error response in one form: application/problem+json (RFC 9457) with `fix`, what the caller can do.

A caller's mistake is a 4xx. An unexpected error is logged with an id, and answered with that id.
"""

import asyncio
import json
import logging
import secrets
from collections.abc import Sequence
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from touchline.core.errors import TouchlineError
from touchline.core.json_values import fault_in_words, finite_json
from touchline.core.sentences import SHUTTING_DOWN
from touchline.core.statements import named, say, stated

MEDIA_TYPE = "application/problem+json"
RETRY_S = 5  # after too many at once: what others asked for has moved on by then
MANUAL = "/problems/"  # a problem's type, relative to the server: the manual explains it there

# Errors of the framework itself: reason and fix for each status.
FRAMEWORK = {
    400: ("bad-request", "Correct the request. See /api/v1/openapi.json for the format."),
    401: (
        "token-needed",
        "Send Authorization: Bearer TOKEN; the server printed the token when it started.",
    ),
    403: ("refused", "Open the page at the address of the server."),
    404: ("not-found", "Check the path. /docs lists all paths."),
    405: ("method-not-allowed", "Use one of the methods named in the Allow header."),
    413: ("too-large", "Send less data per request."),
    415: ("wrong-content-type", "Send application/json, or multipart/form-data for a file."),
    416: ("bad-range", "Request a range within the file."),
    431: ("headers-too-large", "Send fewer or shorter headers."),
}

# What to do about a value, by the type of pydantic's error.
VALUE_FIXES = {
    "missing": "Add this value.",
    "extra_forbidden": "Remove it, or correct its name.",
    "finite_number": "Send a finite number.",
    "json_invalid": "Send valid JSON: no NaN, no comments, no trailing commas.",
    "less_than_equal": "Stay within the limit that is named.",
    "greater_than_equal": "Stay within the limit that is named.",
    "too_long": "Send fewer values.",
    "too_short": "Send more values.",
    "string_too_long": "Shorten it.",
    "string_unicode": "Send valid Unicode text.",
    "model_attributes_type": "Send a JSON object, with Content-Type: application/json.",
    "other": "Correct the value. See /api/v1/openapi.json for the format.",
}

VALUE_REASONS = {
    "finite_number": "non-finite-number",
    "less_than_equal": "out-of-range",
    "greater_than_equal": "out-of-range",
    "too_long": "too-many",
    "string_too_long": "too-long",
    "json_invalid": "bad-json",
}
log = logging.getLogger("touchline")


def json_bytes(value: Any) -> bytes:
    """Return UTF-8 JSON; NaN and infinities are null, and half a surrogate pair is a question mark."""
    try:
        text = json.dumps(value, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    except ValueError:
        text = json.dumps(
            finite_json(value), allow_nan=False, ensure_ascii=False, separators=(",", ":")
        )
    return text.encode("utf-8", "replace")


def problem(
    status: int,
    reason: str,
    detail: str,
    fix: str,
    headers: dict[str, str] | None = None,
    *,
    title: str | None = None,
    **more: Any,
) -> Response:
    """Return a response that says what is wrong and what to do; the title is the reason in words unless it is given."""
    title = title or reason.replace("-", " ").capitalize()
    body = stated(
        {
            **more,
            "type": MANUAL + reason,
            "title": title,
            "status": status,
            "detail": detail,
            "fix": fix,
        }
    )
    return Response(json_bytes(body), status, headers=headers, media_type=MEDIA_TYPE)


def problem_of(error: TouchlineError) -> Response:
    """Return the problem of a refusal; with the ETag of the newest state, where that is what was missed."""
    etag = error.details.get("etag")
    headers = {"ETag": f'"{etag}"'} if etag is not None else {}
    if error.status == 429:
        headers["Retry-After"] = str(RETRY_S)
    return problem(
        error.status,
        error.reason,
        error.what,
        error.fix,
        headers,
        title=error.title,
        **error.details,
    )


def framework_problem(status: int, detail: str | None = None, headers: Any = None) -> Response:
    """Return a problem for a bare status code, as the framework raises them."""
    reason, fix = FRAMEWORK.get(status, ("refused", "Check the request against /docs."))
    return problem(
        status, reason, detail or f"{HTTPStatus(status).phrase}.", fix, dict(headers or {})
    )


def bad_request(errors: Sequence[Any]) -> Response:
    """Return the first thing that is wrong with a request, and the others in `errors`."""
    found = [
        {
            "at": _location(error["loc"]),
            "what": _what(error),
            "kind": str(error["type"]),
        }
        for error in errors[:20]
    ]
    first = found[0] if found else {"at": "body", "what": "unreadable", "kind": "bad"}
    reason = VALUE_REASONS.get(first["kind"], "bad-request")
    detail = say("fault", "{at} {what}.", at=first["at"], what=first["what"])
    kind = first["kind"] if first["kind"] in VALUE_FIXES else "other"
    fix = named(f"fault-fix.{kind}", VALUE_FIXES[kind])
    return problem(422, reason, detail, fix, errors=found)


def _what(error: Any) -> str:
    """Return a fault in words; a check of ours says its own."""
    if error["type"] == "value_error":
        return str(error["msg"]).removeprefix("Value error, ")
    return fault_in_words(error)


def _location(location: Sequence[Any]) -> str:
    """Return a value's path: ("body", "points", 3, 0) reads "points[3][0]"."""
    parts = [
        p
        for p in location[1:]
        if (len(location) != 2 or isinstance(p, str)) and not str(p).startswith("constrained-")
    ] or ["body"]
    return (
        "".join(f"[{p}]" if isinstance(p, int) else f".{p}" for p in parts).lstrip(".")[:200]
        or "body"
    )


class UnexpectedErrors:
    """The outermost middleware: an unexpected error becomes a problem with an id that is in the log."""

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
                await problem(
                    503,
                    "shutting-down",
                    SHUTTING_DOWN,
                    say("server.try-after-restart", "Try again after the server has restarted."),
                )(scope, receive, send)
        except ClientDisconnect:
            log.debug("a caller of %s has gone before its request was complete", scope["path"])
        except Exception:
            if scope["type"] != "http":
                raise
            id = secrets.token_hex(4)
            log.exception("unexpected error %s on %s %s", id, scope["method"], scope["path"])
            if started:
                raise  # half a response has gone: only cutting the connection can say so
            answer = problem(
                500,
                "unexpected",
                say("server.error", "An internal error occurred (error {error}).", error=id),
                say(
                    "server.report-error",
                    "Try again. If the error occurs again, report it with the log "
                    "lines of error {error}.",
                    error=id,
                ),
                title="Unexpected error",
            )
            await answer(scope, receive, send)


def install(app: FastAPI) -> None:
    """Turn every exception that leaves a route into a problem."""

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
