"""/calibrations/{id}/correct and corrected.png|.jpg: corrected pictures, of an upload or of a snapshot."""

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request
from starlette.responses import Response

from app.api.bodies import uploaded_file
from app.api.dependencies import ServicesDep
from app.api.responses import picture
from app.api.schemas.media import PICTURE, upload
from app.api.schemas.requests import Id, IdQuery, MarginPx, WidthPx
from app.core.errors import BadInput
from app.core.records import Calibration, Frame
from app.imaging.correction import CorrectedView
from app.services.calibrations import model_of
from app.workflows.calibration import correct

router = APIRouter(prefix="/calibrations/{id}", tags=["using a calibration"])

Format = Literal["png", "jpg"]


@router.post("/correct", response_class=Response, responses=PICTURE,
             openapi_extra={"requestBody": upload(required=False)})
async def correct_picture(request: Request, services: ServicesDep, id: Id,
                          snapshot: Annotated[IdQuery | None, Query()] = None, margin_px: MarginPx = 0,
                          width: WidthPx = None, format: Format = "png") -> Response:
    """Correct an uploaded picture (multipart, `file`), or a snapshot named in the query."""
    calibration = services.store.calibrations.get(id)
    if snapshot is not None:
        frame = await services.run_in_thread(services.frame, snapshot)
    else:
        data, _ = await uploaded_file(request, services.decoder.limits.max_bytes)
        frame = await services.run_in_thread(services.decoder.frame_from_bytes, data)
    return await services.run_in_thread(_corrected, calibration, frame, CorrectedView(margin_px, width), format)


@router.get("/corrected.{format}", response_class=Response, responses=PICTURE)
async def show_corrected(services: ServicesDep, id: Id, format: Format,
                         snapshot: Annotated[IdQuery | None, Query()] = None, margin_px: MarginPx = 0,
                         width: WidthPx = None) -> Response:
    """Return the corrected picture of the calibration's own snapshot, or of another one of the same size."""
    calibration = services.store.calibrations.get(id)
    if snapshot is None and calibration.snapshot is None:
        raise BadInput("The calibration was made without a snapshot.", "Name one: ?snapshot=ID.", reason="no-snapshot")
    frame = await services.run_in_thread(services.frame, snapshot or calibration.snapshot)
    return await services.run_in_thread(_corrected, calibration, frame, CorrectedView(margin_px, width), format)


def _corrected(calibration: Calibration, frame: Frame, view: CorrectedView, format: str) -> Response:
    return picture(correct(frame.pixels, model_of(calibration), calibration.image_size, view), format)
