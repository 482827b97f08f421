"""/lenses: saved lenses, which fits of cameras over a field can hold fixed."""

from fastapi import APIRouter
from starlette.responses import Response

from touchline.api import schemas
from touchline.api.dependencies import IfMatch, ServicesDep
from touchline.api.requests import Cursor, Id, Limit
from touchline.api.responses import Json, page, versioned
from touchline.api.schemas import page_of
from touchline.core.json_values import JsonObject
from touchline.store.repository import content_etag

router = APIRouter(prefix="/lenses", tags=["lenses"])

Lenses = page_of("Lenses", schemas.LensSummary)

SUMMARY = ("id", "created_at", "camera", "note", "model", "board", "image_size")


@router.get("", response_model=Lenses)
def list_lenses(services: ServicesDep, limit: Limit = 50, cursor: Cursor = None) -> Json:
    """List lenses, newest first, each in short."""
    lenses = services.store.lenses.list(limit, cursor)
    return page(map(_summary, lenses.items), lenses.next_cursor)


@router.get("/{id}", response_model=schemas.Lens)
def read_lens(services: ServicesDep, id: Id) -> Json:
    """Return one lens, with its covariance and its complete report; its ETag goes into If-Match of DELETE."""
    lens = services.store.lenses.get(id)
    return versioned(lens, content_etag(lens))


@router.delete("/{id}", status_code=204, response_class=Response)
def delete_lens(services: ServicesDep, id: Id, if_match: IfMatch = None) -> None:
    """Delete a lens; calibrations that used it keep their copy. With If-Match only that very one."""
    services.store.lenses.delete(id, if_match)


def _summary(lens: JsonObject) -> JsonObject:
    """Return a lens in short; one of an early version may have no report."""
    report = lens.get("report", {"rms_px": None, "verdict": {}, "views": []})
    return {
        **{key: lens.get(key) for key in SUMMARY},
        "rms_px": report["rms_px"],
        "verdict": report["verdict"],
        "views": sum(view["used"] for view in report["views"]),
    }
