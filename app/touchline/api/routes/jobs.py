"""/jobs: progress and results of long work, and how to cancel it."""

import asyncio
from collections.abc import AsyncIterable, AsyncIterator, Callable
from dataclasses import replace
from typing import Annotated, Any, TypeVar

from fastapi import APIRouter, Depends, WebSocket
from fastapi.sse import EventSourceResponse, ServerSentEvent

from touchline.api import schemas
from touchline.api.dependencies import ServicesDep
from touchline.api.requests import Id
from touchline.api.responses import Json, job_json, page
from touchline.api.schemas import page_of
from touchline.api.sockets import send_stream
from touchline.jobs import Job, JobEngine

router = APIRouter(prefix="/jobs", tags=["jobs"])

Jobs = page_of("Jobs", schemas.Job)

T = TypeVar("T")
SAVED_RECORDS = ("calibration", "lens")
POLL_S = 0.1  # how often a watched job is looked at


@router.get("", response_model=Jobs)
def list_jobs(services: ServicesDep) -> Json:
    """List every job, newest first; of those that have ended, the last hundred."""
    return page(map(job_json, services.jobs.all()))


@router.get("/{id}", response_model=schemas.Job)
def read_job(services: ServicesDep, id: Id) -> Json:
    """Return a job as it is now: state, progress from 0 to 1, and in the end its result or its problem."""
    return Json(job_json(services.jobs.get(id)))


@router.delete("/{id}", response_model=schemas.Job)
def cancel_job(services: ServicesDep, id: Id) -> Json:
    """Cancel a job at once; one that has ended stays as it ended. Results are saved completely or not at all."""
    return Json(job_json(services.jobs.cancel(id)))


def known_job(services: ServicesDep, id: Id) -> Job:
    """Refuse an unknown job before the stream begins."""
    return services.jobs.get(id)


@router.get("/{id}/events", response_class=EventSourceResponse)
async def watch_job(
    services: ServicesDep, job: Annotated[Job, Depends(known_job)]
) -> AsyncIterable[ServerSentEvent]:
    """Send events: the job now and after every change, until it has ended; then the stream closes."""
    async for state in _states(services.jobs, job.id):
        yield ServerSentEvent(data=state)


@router.websocket("/{id}/stream")
async def stream_job(socket: WebSocket, services: ServicesDep, id: str) -> None:
    """Send a job as JSON, now and after every change; the socket closes when the job has ended."""
    await send_stream(socket, _states(services.jobs, id))


@router.websocket("/stream")
async def stream_jobs(socket: WebSocket, services: ServicesDep) -> None:
    """Send all jobs: {"items": […]}, newest first, now and after every change; of results only the ids in `made`."""

    async def lists() -> AsyncIterator[dict[str, Any]]:
        async for jobs in _changes(services.jobs, lambda jobs: jobs.all()):
            yield {
                "items": [
                    {**job_json(replace(job, result=None)), "made": _saved_records(job)}
                    for job in jobs
                ]
            }

    await send_stream(socket, lists())


async def _states(jobs: JobEngine, id: str) -> AsyncIterator[dict[str, Any]]:
    async for job in _changes(jobs, lambda jobs: jobs.get(id)):
        yield job_json(job)
        if job.ended:
            return


async def _changes(jobs: JobEngine, look: Callable[[JobEngine], T]) -> AsyncIterator[T]:
    """Yield what there is to see, now and after every change, until the server stops; only the newest is certain."""
    before, now = None, look(jobs)
    while True:
        if now != before:
            yield now
            before = now
        if jobs.closed:
            return
        await asyncio.sleep(POLL_S)
        now = look(jobs)


def _saved_records(job: Job) -> dict[str, str]:
    """Return the ids of what it has made and saved, such as {"calibration": id}."""
    result = job.result if isinstance(job.result, dict) else {}
    return {name: result[name] for name in SAVED_RECORDS if isinstance(result.get(name), str)}
