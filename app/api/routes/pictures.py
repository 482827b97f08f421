"""/calibrations/{id}/correct and corrected.png|.jpg: corrected pictures, of an upload or of a snapshot."""

from typing import Annotated, Any, Literal

from fastapi import APIRouter, Query, Request
from starlette.responses import Response

from app.api.answers import picture
from app.api.bodies import uploaded_file
from app.api.schemas.requests import Id, IdQuery, MarginPx, WidthPx
from app.api.work import at_work
from app.core.errors import BadInput
from app.core.records import Calibration, Frame
from app.imaging.correction import CorrectedView
from app.models import model_from_json
from app.workflows import calibration as workflow

router = APIRouter(prefix="/calibrations/{id}", tags=["using a calibration"])

Format = Literal["png", "jpg"]
IMAGE = {"schema": {"type": "string", "format": "binary"}}
ANSWER: dict[int | str, dict[str, Any]] = {200: {"content": {"image/png": IMAGE, "image/jpeg": IMAGE}}}
BODY = {"requestBody": {"required": False, "content": {"multipart/form-data": {"schema": {
    "type": "object", "properties": {"file": {"type": "string", "format": "binary"}}, "required": ["file"]}}}}}


@router.post("/correct", response_class=Response, responses=ANSWER, openapi_extra=BODY)
async def correct_picture(request: Request, id: Id, snapshot: Annotated[IdQuery | None, Query()] = None,
                  margin_px: MarginPx = 0, width: WidthPx = None, format: Format = "png") -> Response:
    """The corrected picture of an uploaded one (multipart, `file`), or of a snapshot named in the query."""
    state = request.app.state
    calibration = state.store.calibrations.get(id)
    if snapshot is not None:
        return await at_work(request, _corrected, request, calibration, snapshot, CorrectedView(margin_px, width),
                             format)
    data, _ = await uploaded_file(request, state.decoder.limits.max_bytes)
    frame = await at_work(request, state.decoder.frame_from_bytes, data)
    return await at_work(request, _drawn, calibration, frame, CorrectedView(margin_px, width), format)


@router.get("/corrected.{format}", response_class=Response, responses=ANSWER)
async def show_corrected(request: Request, id: Id, format: Format, snapshot: Annotated[IdQuery | None, Query()] = None,
                    margin_px: MarginPx = 0, width: WidthPx = None) -> Response:
    """The corrected picture of its own snapshot, or of another one of the same size."""
    calibration = request.app.state.store.calibrations.get(id)
    if snapshot is None and calibration.snapshot is None:
        raise BadInput("The calibration was made without a snapshot.", "Name one: ?snapshot=ID.", reason="no-snapshot")
    return await at_work(request, _corrected, request, calibration, snapshot or calibration.snapshot,
                         CorrectedView(margin_px, width), format)


def _corrected(request: Request, calibration: Calibration, snapshot: str, view: CorrectedView, format: str) -> Response:
    return _drawn(calibration, request.app.state.frames[snapshot], view, format)


def _drawn(calibration: Calibration, frame: Frame, view: CorrectedView, format: str) -> Response:
    model = model_from_json(calibration.model_name, calibration.model_parameters)
    return picture(workflow.correct(frame.pixels, model, calibration.image_size, view), format)
