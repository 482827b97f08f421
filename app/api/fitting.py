"""Fits of a caller's points: a few at once on a thread, many in a process that ends when the caller leaves."""

from collections.abc import Callable, Mapping
from typing import Any

from fastapi import Request
from starlette.responses import Response

from app.api.request_mapping import fit_task
from app.api.responses import Json, finished_or_queued
from app.api.schemas.requests import FitRequest
from app.core.progress import Progress
from app.services.container import Services
from app.workflows.calibration_request import CalibrationRequest

FEW_POINTS = 600  # half a second; operators click some fifty


async def fit(request: Request, services: Services, body: FitRequest, run: Callable[[CalibrationRequest], Any],
              kind: str, run_job: Callable[[Any, Progress], Any], options: Mapping[str, Any], as_job: bool = False,
              saver: str | None = None, context: Any = None,
              respond: Callable[[Any], Response] = Json) -> Response:
    """Return what `run` makes of the body's task on a thread, or `run_job` of {"task", **options} in a process.

    saver, context, respond: as finished_or_queued takes them.
    """
    def begin() -> tuple[CalibrationRequest, Any]:
        task = fit_task(services, body, (body.model,))
        return task, None if as_job or task.n_points > FEW_POINTS else run(task)
    task, done = await services.run_in_thread(begin)
    if done is not None:
        return await services.run_in_thread(respond, done) if respond is not Json else Json(done)
    spec = {"task": task.to_json(), **options}
    return await finished_or_queued(request, services, kind, run_job, spec, as_job, saver, context, respond)
