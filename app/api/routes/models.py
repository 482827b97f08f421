"""GET /models: every camera model, described well enough to build its form."""

from typing import Any

from fastapi import APIRouter

from app.api.responses import Json, page
from app.api.schemas import responses
from app.fitting import FITTERS
from app.models import MODELS

router = APIRouter(tags=["models"])


@router.get("/models", response_model=responses.Models)
def list_models() -> Json:
    """List every model with its options (name, type, default, range, unit, help) and how few points it needs."""
    return page(map(_model_json, MODELS))


def _model_json(name: str) -> dict[str, Any]:
    model, fitter = MODELS[name], FITTERS[name]
    return {"name": name, "title": model.TITLE, "help": model.HELP, "points_needed": fitter.points_needed(),
            "options": [option.to_json() for option in fitter.OPTIONS]}
