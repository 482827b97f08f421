"""/jobs: long work that was asked for: how far it has come, what came of it, and the way to stop it."""

import asyncio
from collections.abc import AsyncIterable, AsyncIterator, Callable
from dataclasses import asdict, replace
from typing import Annotated, Any, TypeVar

from fastapi import APIRouter, Depends, Request, WebSocket
from fastapi.sse import EventSourceResponse, ServerSentEvent
from starlette.responses import Response

from app.api.answers import Json
from app.api.middleware.problems import MANUAL, problem
from app.api.schemas import responses
from app.api.schemas.requests import Id
from app.api.sockets import tell
from app.jobs import Job, JobEngine

router = APIRouter(prefix="/jobs", tags=["jobs"])

T = TypeVar("T")
MADE = ("calibration", "lens")
LOOK_S = 0.1  # how often a watched job is looked at


@router.get("", response_model=responses.Jobs)
def list_jobs(request: Request) -> Json:
    """Every job, newest first; of those that have ended, the last hundred."""
    return Json({"items": [described(job) for job in request.app.state.jobs.all()], "next_cursor": None})


@router.get("/{id}", response_model=responses.Job)
def read_job(request: Request, id: Id) -> Json:
    """A job as it is now: state, progress from 0 to 1, and in the end its result or its problem."""
    return Json(described(request.app.state.jobs.get(id)))


@router.delete("/{id}", response_model=responses.Job)
def cancel_job(request: Request, id: Id) -> Json:
    """Cancel it, at once and as often as you like; a job that has ended stays as it ended. Nothing is kept by half."""
    return Json(described(request.app.state.jobs.cancel(id)))


def known_job(request: Request, id: Id) -> Job:
    """Refused before the stream begins, where there is no such job."""
    return request.app.state.jobs.get(id)


@router.get("/{id}/events", response_class=EventSourceResponse)
async def watch_job(request: Request, job: Annotated[Job, Depends(known_job)]) -> AsyncIterable[ServerSentEvent]:
    """Server-sent events: the job now and after every change, until it has ended; then the stream closes."""
    async for now in changes(request.app.state.jobs, lambda jobs: jobs.get(job.id)):
        yield ServerSentEvent(data=described(now))
        if now.ended:
            return


@router.websocket("/{id}/stream")
async def stream_job(socket: WebSocket, id: str) -> None:
    """The same for a page: the job as JSON, now and after every change; the socket closes when the job has ended."""
    async def states() -> AsyncIterator[dict[str, Any]]:
        async for job in changes(socket.app.state.jobs, lambda jobs: jobs.get(id)):
            yield described(job)
            if job.ended:
                return
    await tell(socket, states())


@router.websocket("/stream")
async def stream_jobs(socket: WebSocket) -> None:
    """All jobs for a page: {"items": […]}, newest first, now and after every change; without results but for `made`."""
    async def lists() -> AsyncIterator[dict[str, Any]]:
        async for now in changes(socket.app.state.jobs, lambda jobs: jobs.all()):
            yield {"items": [{**described(replace(job, result=None)), "made": made_by(job)} for job in now]}
    await tell(socket, lists())


async def changes(jobs: JobEngine, look: Callable[[JobEngine], T]) -> AsyncIterator[T]:
    """What there is to see, now and after every change, until the server stops. One may be missed, not the newest."""
    before, now = None, look(jobs)
    while True:
        if now != before:
            yield now
            before = now
        if jobs.closed:
            return
        await asyncio.sleep(LOOK_S)
        now = look(jobs)


def described(job: Job) -> dict[str, Any]:
    """A job as JSON; its problem is what the same refusal would be as an answer."""
    told = None
    if job.problem is not None:
        told = {key: value for key, value in job.problem.items() if key != "reason"}
        told["type"] = MANUAL + job.problem["reason"]
    return {**asdict(job), "problem": told}


def made_by(job: Job) -> dict[str, str]:
    """The ids of what it has made and kept, such as {"calibration": id}: where to look at what came of it."""
    result = job.result if isinstance(job.result, dict) else {}
    return {name: result[name] for name in MADE if isinstance(result.get(name), str)}


def accepted(job: Job) -> Json:
    """202: it is being done, and there it can be watched."""
    return Json(described(job), 202, headers={"Location": f"/api/v1/jobs/{job.id}"})


def result_of(job: Job) -> Response:
    """The answer to who has waited for it."""
    if job.state == "done":
        return Json(job.result)
    told = dict(job.problem or {"reason": "cancelled", "title": "Cancelled", "status": 409, "fix": "Ask again.",
                                "detail": f"{job.message}."})
    return problem(told.pop("status"), told.pop("reason"), told.pop("title"), told.pop("detail"), told.pop("fix"),
                   **told)
