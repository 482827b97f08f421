"""GET /health: for whoever watches the server; needs no token."""

import time

from fastapi import APIRouter, Request

from app import __version__
from app.api.answer_schemas import Health
from app.api.answers import Json

router = APIRouter(tags=["health"])


@router.get("/health", response_model=Health)
async def health(request: Request) -> Json:
    """Whether the server is up, its version and for how long, s."""
    uptime_s = round(time.monotonic() - request.app.state.started, 3)
    return Json({"status": "ok", "version": __version__, "uptime_s": uptime_s})
