"""/lenses: lenses from boards, to be held by the fits of cameras over a field."""

from typing import Any

from fastapi import APIRouter, Request
from starlette.responses import Response

from app.api.answers import Json
from app.api.schemas import responses
from app.api.schemas.requests import Cursor, Id, Limit

router = APIRouter(prefix="/lenses", tags=["lenses"])

SHORT = ("id", "created_at", "camera", "note", "model", "board", "image_size")


@router.get("", response_model=responses.Lenses)
def list_lenses(request: Request, limit: Limit = 50, cursor: Cursor = None) -> Json:
    """Newest first, each in short."""
    page = request.app.state.store.lenses.list(limit, cursor)
    return Json({"items": [_short(lens) for lens in page.items], "next_cursor": page.next_cursor})


@router.get("/{id}", response_model=responses.Lens)
def read_lens(request: Request, id: Id) -> Json:
    """One lens, with its covariance and its whole report."""
    return Json(request.app.state.store.lenses.get(id))


@router.delete("/{id}", status_code=204)
def delete_lens(request: Request, id: Id) -> Response:
    """Forget a lens; calibrations that held it keep their copy."""
    request.app.state.store.lenses.delete(id)
    return Response(status_code=204)


def _short(lens: dict[str, Any]) -> dict[str, Any]:
    report = lens["report"]
    return {**{key: lens[key] for key in SHORT}, "rms_px": report["rms_px"], "verdict": report["verdict"],
            "views": sum(view["used"] for view in report["views"])}
