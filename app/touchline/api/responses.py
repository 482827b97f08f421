"""Responses: JSON without NaN, pages, records with an ETag, what never changes, jobs, pictures, and files' headers."""

import re
from collections.abc import Awaitable, Callable, Iterable, Mapping
from functools import partial, wraps
from inspect import Parameter, iscoroutinefunction, signature
from typing import Any, Literal
from unicodedata import combining, normalize
from urllib.parse import quote

import numpy as np
from fastapi import Request
from numpy.typing import NDArray
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import Headers
from starlette.responses import Response

from touchline.api.dependencies import caller_of
from touchline.api.middleware.problems import MANUAL, json_bytes
from touchline.core.errors import Cancelled
from touchline.core.jobs import Progress, error_of
from touchline.evaluate.approximation import ApproximationError
from touchline.images import ENCODED_MEDIA_TYPES, encode
from touchline.jobs import Job
from touchline.services.answer_cache import CachedAnswer
from touchline.services.container import Services

TAGS = re.compile(r'"[^"]*"')  # whether weak or not: of an answer to GET the same

# What ends a header or a path, is no letter anywhere, or turns the reading direction and so hides a name's ending.
UNSAFE = re.compile(
    r'[\x00-\x1f\x7f-\x9f/\\:*?"<>|\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]'
)
# characters: of four bytes each, with %-signs, still no header that a proxy would refuse
MAX_LENGTH = 80
END_LENGTH = 30
API = "/api/v1"
GZIP = re.compile(r"\bgzip\b(?!\s*;\s*q=0(?:\.0*)?\s*(?:,|$))")
NO_STORE = {"Cache-Control": "no-store"}
# a browser keeps it, and asks each time whether it is still so
REVALIDATED = {"Cache-Control": "private, no-cache"}


def revalidated(asked: Headers, answer: CachedAnswer, headers: Mapping[str, str]) -> Response:
    """Return the content with its ETag, by gzip for who takes that; 304 where its If-None-Match names it."""
    known = asked.get("if-none-match", "")
    content, sent = answer.content, {**headers, "ETag": answer.etag}
    if answer.packed is not None:
        sent["Vary"] = "Accept-Encoding"
        if GZIP.search(asked.get("accept-encoding", "")):
            content = answer.packed
            sent |= {"Content-Encoding": "gzip", "ETag": f'{answer.etag[:-1]}-gz"'}
    if known.strip() == "*" or sent["ETag"] in TAGS.findall(known):
        sent.pop("Content-Encoding", None)
        return Response(status_code=304, headers=sent)
    return Response(content, media_type=answer.media_type, headers=sent)


def packed(request: Request, content: Any) -> Response:
    """Return long JSON that changes seldom, such as all fields: by gzip, and not again to who has it already."""
    return revalidated(request.headers, CachedAnswer.of(json_bytes(content)), REVALIDATED)


def attachment(name: str) -> str:
    """Return the Content-Disposition of a file to be saved under that name, as far as systems can."""
    return disposition("attachment", name)


def disposition(kind: Literal["attachment", "inline"], name: str) -> str:
    """Return RFC 6266: a name of ASCII letters for everybody, and the true one in filename* where it differs."""
    name = UNSAFE.sub("_", name).strip("-. ") or "file"
    if len(name) > MAX_LENGTH:  # its end says version and format
        name = f"{name[: MAX_LENGTH - END_LENGTH - 1]}_{name[-END_LENGTH:]}"
    # é is e and an accent
    letters = "".join(letter for letter in normalize("NFKD", name) if not combining(letter))
    plain = re.sub(r"[^A-Za-z0-9._-]", "_", letters)
    more = "" if plain == name else f"; filename*=UTF-8''{quote(name, safe='', errors='replace')}"
    return f'{kind}; filename="{plain}"{more}'


def error_header(loss: ApproximationError | None) -> dict[str, str]:
    """Return the worst error over the region, mm, and other measures: 12.310;rms=3.200;hat=14.050;hat-rms=3.900."""
    if loss is None:
        return {}
    parts = [f"{loss.worst_mm:.3f}", f"rms={loss.rms_mm:.3f}"]
    if loss.hat_worst_mm is not None:
        parts += [f"hat={loss.hat_worst_mm:.3f}", f"hat-rms={loss.hat_rms_mm:.3f}"]
    return {"X-Approximation-Error-Mm": ";".join(parts)}


class JsonText(Response):
    """A JSON response whose text is ready made."""

    media_type = "application/json"


class Json(JsonText):
    """A JSON response that is sent as it is; response models only describe it in the documentation."""

    def render(self, content: Any) -> bytes:
        return json_bytes(content)


def page(items: Iterable[Any], next_cursor: str | None = None) -> Json:
    """Return items and the cursor of those after them, null at the end."""
    return Json({"items": list(items), "next_cursor": next_cursor})


def created(record: Any, path: str) -> Json:
    """Return 201 and the path, within the API, of what was made."""
    return Json(record, 201, headers={"Location": f"{API}/{path}"})


def versioned(record: Any, etag: str, created_at: str | None = None) -> Json:
    """Return a record with the ETag for the next PUT's If-Match. created_at: its path, if it was just made."""
    response = Json(record) if created_at is None else created(record, created_at)
    response.headers.update({"ETag": f'"{etag}"', **NO_STORE})
    return response


def cached_response(work: Callable[..., Any]) -> Callable[..., Awaitable[Response]]:
    """Make a route of work whose answer rests on its parameters alone, such as versions: it is done once for each.

    Its bytes are kept in memory, with an ETag: who has them already receives 304. A parameter that has a `stamp`, as a
    version has, is read each time and may be refused then. Work that is @in_thread waits only where nothing is kept.
    """
    make = work if iscoroutinefunction(work) else partial(run_in_threadpool, work)

    @wraps(work)
    async def route(request: Request, services: Services, **given: Any) -> Response:
        key = (work, *((name, getattr(value, "stamp", value)) for name, value in given.items()))
        if (answer := services.answers.get(key)) is None:
            made = await make(services, **given)
            answer = services.answers.put(key, CachedAnswer.of(bytes(made.body), made.media_type))
        return revalidated(request.headers, answer, REVALIDATED)

    asked = Parameter("request", Parameter.KEYWORD_ONLY, annotation=Request)
    own = signature(work)
    route.__signature__ = own.replace(parameters=[*own.parameters.values(), asked])  # type: ignore[attr-defined]
    return route


def picture(
    pixels: NDArray[np.uint8], format: str, headers: dict[str, str] | None = None
) -> Response:
    """Return a picture as a file of that format."""
    return Response(encode(pixels, format), media_type=ENCODED_MEDIA_TYPES[format], headers=headers)


def job_json(job: Job) -> dict[str, Any]:
    """Return a job as JSON; its problem is what the same refusal would be as a response."""
    shown = None
    if job.problem is not None:
        shown = {key: value for key, value in job.problem.items() if key != "reason"}
        shown["type"] = MANUAL + job.problem["reason"]
    return {**job.to_json(), "problem": shown}


def accepted(job: Job) -> Json:
    """Return 202: the job has been queued, and where it can be watched."""
    return Json(job_json(job), 202, headers={"Location": f"{API}/jobs/{job.id}"})


async def finished_or_queued(
    request: Request,
    services: Services,
    kind: str,
    run: Callable[[Any, Progress], Any],
    spec: Any,
    as_job: bool,
    saver: str | None = None,
    context: Any = None,
    respond: Callable[[Any], Response] = Json,
) -> Response:
    """Return 202 with a job at once, or wait for the result while the caller does.

    saver, context: what keeps the result, as JobEngine.start takes them. respond: returns the answer of a result.
    """
    caller = await caller_of(request)
    if as_job:
        return accepted(
            await services.run_in_thread(
                services.jobs.start, kind, run, spec, saver, context, caller=caller
            )
        )
    job = await services.run_as_job(
        kind, run, spec, request.is_disconnected, saver, context, caller
    )
    if job.problem is not None:
        raise error_of(job.problem)
    if job.state != "done":
        raise Cancelled(f"{job.message}.", "Request it again.")
    return respond(job.result)
