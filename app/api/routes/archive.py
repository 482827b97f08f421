"""GET /archive: everything that is saved, as one file."""

from fastapi import APIRouter
from starlette.responses import StreamingResponse

from app.api.dependencies import ServicesDep
from app.api.file_headers import attachment
from app.api.responses import NO_STORE
from app.api.schemas.media import files

router = APIRouter(prefix="/archive", tags=["archive"])


@router.get("", response_class=StreamingResponse, responses=files("application/zip"))
def download_everything(services: ServicesDep) -> StreamingResponse:
    """Download one zip with every row, picture and field of your own; `touchline restore` makes a data folder of it."""
    return StreamingResponse(services.store.archive(services.settings.own_fields), media_type="application/zip",
                             headers={"Content-Disposition": attachment("touchline.zip"), **NO_STORE})
