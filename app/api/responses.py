"""Responses: plain JSON in which nothing is NaN, pages of items, records with an ETag, jobs and pictures."""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from fastapi import Request
from numpy.typing import NDArray
from starlette.responses import Response

from app.api.dependencies import operator_of
from app.api.json_text import json_bytes
from app.api.middleware.problems import MANUAL, problem
from app.core.progress import Progress
from app.images import ENCODED_MEDIA_TYPES, encode
from app.jobs import Job
from app.services.container import Services

API = "/api/v1"
NO_STORE = {"Cache-Control": "no-store"}


class Json(Response):
    """A JSON response that is sent as it is; response models only describe it in the documentation."""

    media_type = "application/json"

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


def picture(pixels: NDArray[np.uint8], format: str, headers: dict[str, str] | None = None) -> Response:
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


async def finished_or_queued(request: Request, services: Services, kind: str, run: Callable[[Any, Progress], Any],
                             spec: Any, as_job: bool, saver: str | None = None, context: Any = None,
                             respond: Callable[[Any], Response] = Json) -> Response:
    """Return 202 with a job at once, or wait for the result while the caller does.

    saver, context: what keeps the result, as JobEngine.start takes them. respond: returns the answer of a result.
    """
    caller = await operator_of(request)
    if as_job:
        return accepted(await services.run_in_thread(services.jobs.start, kind, run, spec, saver, context,
                                                     caller=caller))
    job = await services.run_as_job(kind, run, spec, request.is_disconnected, saver, context, caller)
    if job.state == "done":
        return respond(job.result)
    return problem(**(job.problem or {"reason": "cancelled", "title": "Cancelled", "status": 409,
                                      "fix": "Request it again.",
                                      "detail": f"{job.message}."}))
