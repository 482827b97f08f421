"""GET /health: for whoever watches the server; needs no token."""

import time

from fastapi import APIRouter

from app import __version__
from app.api.dependencies import ServicesDep
from app.api.responses import Json
from app.api.schemas import responses

router = APIRouter(tags=["health"])


@router.get("/health", response_model=responses.Health)
def health(services: ServicesDep) -> Json:
    """Return version, uptime in s, warnings about disk and network, and damaged records."""
    warnings = (*services.store.warnings, *services.publishing.warnings)
    return Json({"status": "ok", "version": __version__, "uptime_s": round(time.monotonic() - services.started_s, 3),
                 "warnings": [{"reason": w.reason, "text": w.text, "fix": w.fix} for w in warnings],
                 "damaged": [damage.to_json() for damage in services.store.damaged]})
