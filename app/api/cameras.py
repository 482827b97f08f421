"""/cameras: the cameras that the settings name."""

from typing import Any

from fastapi import APIRouter, Request

from app.api import answer_schemas
from app.api.answers import Json
from app.api.schemas import Id
from app.settings import CameraSettings

router = APIRouter(prefix="/cameras", tags=["cameras"])


@router.get("", response_model=answer_schemas.Cameras)
def list_cameras(request: Request) -> Json:
    """Every camera: what it is called, and the field and region that it looks at."""
    items = [_described(request, camera) for camera in request.app.state.settings.cameras]
    return Json({"items": items, "next_cursor": None})


@router.get("/{id}", response_model=answer_schemas.Camera)
def read_camera(request: Request, id: Id) -> Json:
    """One camera."""
    return Json(_described(request, request.app.state.settings.camera(id)))


def _described(request: Request, camera: CameraSettings) -> dict[str, Any]:
    """The source's address stays here: it may hold a password."""
    active = request.app.state.store.active(camera.id)
    return {"id": camera.id, "name": camera.title, "field": camera.field, "region": camera.region,
            "active_calibration": active.id if active else None}
