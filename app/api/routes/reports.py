"""/calibrations/{id}/report.html and .json: everything that is known of one version, to print or to keep."""

from contextlib import suppress
from typing import Any

from fastapi import APIRouter, Request
from starlette.responses import HTMLResponse

from app import report
from app.api.answers import Json
from app.api.file_headers import disposition
from app.api.schemas import responses
from app.api.schemas.requests import Id
from app.api.work import at_work
from app.core.errors import NotFound
from app.core.records import Calibration
from app.report.page import POLICY

router = APIRouter(prefix="/calibrations/{id}", tags=["judging"])

HTML: dict[int | str, dict[str, Any]] = {200: {"content": {"text/html": {"schema": {"type": "string"}}}}}


@router.get("/report.html", response_class=HTMLResponse, responses=HTML)
async def report_page(request: Request, id: Id) -> HTMLResponse:
    """One self-contained page: verdict, numbers, pictures before and after, error maps, versions and hashes."""
    calibration = request.app.state.store.calibrations.get(id)
    return await at_work(request, _page, request, calibration)


@router.get("/report.json", response_model=responses.CalibrationReport)
async def report_as_json(request: Request, id: Id) -> Json:
    """The same numbers and words as JSON, null for what is not known."""
    calibration = request.app.state.store.calibrations.get(id)
    return Json(await at_work(request, lambda: report.contents(calibration, _shown(request, calibration))))


def _page(request: Request, calibration: Calibration) -> HTMLResponse:
    shown = _shown(request, calibration)
    said = report.contents(calibration, shown)
    html = report.page(said, report.draw(calibration, shown, said))
    name = f"{calibration.camera or calibration.field['name']}-v{calibration.version}-report.html"
    return HTMLResponse(html.encode("utf-8", "replace"), headers={
        "Content-Security-Policy": f"{POLICY}; frame-ancestors 'self'", "Cache-Control": "no-cache",
        "Content-Disposition": disposition("inline", name)})


def _shown(request: Request, calibration: Calibration) -> report.ReportPicture:
    """The picture that was clicked, and what its camera is called."""
    state = request.app.state
    name = None
    if calibration.camera is not None:
        with suppress(NotFound):  # its camera is gone, or was another house's
            name = state.camera_shelf.get(calibration.camera).name
    return report.report_picture(calibration, lambda snapshot: state.frames[snapshot], name)
