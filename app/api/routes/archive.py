"""GET /archive: everything that is kept, as one file."""

from fastapi import APIRouter, Request
from starlette.responses import StreamingResponse

router = APIRouter(prefix="/archive", tags=["archive"])

ZIP = {200: {"content": {"application/zip": {"schema": {"type": "string", "format": "binary"}}}}}


@router.get("", response_class=StreamingResponse, responses=ZIP)  # type: ignore[arg-type]
def download_everything(request: Request) -> StreamingResponse:
    """One zip with every row, picture and field of your own; `touchline restore` makes a data folder of it."""
    state = request.app.state
    return StreamingResponse(state.store.archive(state.settings.own_fields), media_type="application/zip",
                             headers={"Content-Disposition": 'attachment; filename="touchline.zip"',
                                      "Cache-Control": "no-store"})
