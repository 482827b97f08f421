"""/calibrations/{id}/report.html and .json: everything that is known of one version, to print or to keep."""

from contextlib import suppress

from fastapi import APIRouter
from starlette.responses import HTMLResponse

from app import report
from app.api.dependencies import ServicesDep
from app.api.file_headers import disposition
from app.api.responses import Json
from app.api.schemas import responses
from app.api.schemas.media import HTML
from app.api.schemas.requests import Id
from app.core.errors import NotFound
from app.core.records import Calibration
from app.report.page import POLICY
from app.services.container import Services

router = APIRouter(prefix="/calibrations/{id}", tags=["judging"])


@router.get("/report.html", response_class=HTMLResponse, responses=HTML)
async def report_page(services: ServicesDep, id: Id) -> HTMLResponse:
    """Return one self-contained page: verdict, numbers, pictures before and after, error maps, versions and hashes."""
    return await services.run_in_thread(_page, services, services.store.calibrations.get(id))


@router.get("/report.json", response_model=responses.CalibrationReport)
async def report_as_json(services: ServicesDep, id: Id) -> Json:
    """Return the same numbers and words as JSON, null for what is not known."""
    calibration = services.store.calibrations.get(id)
    return Json(await services.run_in_thread(lambda: report.contents(calibration, _shown(services, calibration))))


def _page(services: Services, calibration: Calibration) -> HTMLResponse:
    shown = _shown(services, calibration)
    contents = report.contents(calibration, shown)
    html = report.page(contents, report.draw(calibration, shown, contents))
    name = f"{calibration.camera or calibration.field['name']}-v{calibration.version}-report.html"
    return HTMLResponse(html.encode("utf-8", "replace"), headers={
        "Content-Security-Policy": f"{POLICY}; frame-ancestors 'self'", "Cache-Control": "no-cache",
        "Content-Disposition": disposition("inline", name)})


def _shown(services: Services, calibration: Calibration) -> report.ReportPicture:
    """Return the picture that was calibrated, and what its camera is called."""
    name = None
    if calibration.camera is not None:
        with suppress(NotFound):  # its camera was removed, or belongs to another server
            name = services.cameras.get(calibration.camera).name
    return report.report_picture(calibration, services.frame, name)
