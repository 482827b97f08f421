"""GET /health: for whoever watches the server; needs no token."""

import time

from fastapi import APIRouter, Request

from app import __version__
from app.api.answers import Json
from app.api.schemas.responses import Health

router = APIRouter(tags=["health"])


@router.get("/health", response_model=Health)
def health(request: Request) -> Json:
    """Whether the server is up, its version and uptime, s; what to know about disk and network; what was damaged."""
    uptime_s = round(time.monotonic() - request.app.state.started, 3)
    store = request.app.state.store
    warnings = (*store.warnings, *request.app.state.publishing.warnings)
    return Json({"status": "ok", "version": __version__, "uptime_s": uptime_s,
                 "warnings": [{"reason": w.reason, "text": w.text, "fix": w.fix} for w in warnings],
                 "damaged": [damage.to_json() for damage in store.damaged]})
