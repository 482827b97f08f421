"""/lenses: lenses from boards and edges, which fits of cameras over a field can hold fixed."""

from typing import Any

from fastapi import APIRouter
from starlette.responses import Response

from app.api.dependencies import ServicesDep
from app.api.responses import Json, page
from app.api.schemas import responses
from app.api.schemas.requests import Cursor, Id, Limit

router = APIRouter(prefix="/lenses", tags=["lenses"])

SUMMARY = ("id", "created_at", "camera", "note", "model", "board", "image_size")


@router.get("", response_model=responses.Lenses)
def list_lenses(services: ServicesDep, limit: Limit = 50, cursor: Cursor = None) -> Json:
    """List lenses, newest first, each in short."""
    lenses = services.store.lenses.list(limit, cursor)
    return page(map(_summary, lenses.items), lenses.next_cursor)


@router.get("/{id}", response_model=responses.Lens)
def read_lens(services: ServicesDep, id: Id) -> Json:
    """Return one lens, with its covariance and its complete report."""
    return Json(services.store.lenses.get(id))


@router.delete("/{id}", status_code=204)
def delete_lens(services: ServicesDep, id: Id) -> Response:
    """Delete a lens; calibrations that used it keep their copy."""
    services.store.lenses.delete(id)
    return Response(status_code=204)


def _summary(lens: dict[str, Any]) -> dict[str, Any]:
    report = lens["report"]
    return {**{key: lens[key] for key in SUMMARY}, "rms_px": report["rms_px"], "verdict": report["verdict"],
            "views": sum(view["used"] for view in report["views"])}
